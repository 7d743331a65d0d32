"""Conformance tests of wear laws, on a contact known in closed form."""

from __future__ import annotations

import numpy as np

from wearsim.plugins import BODIES, Body, WearLaw, WearLawSpec
from wearsim.testing.checks import Checks, Fixture, agree, require, require_values, spec_checks
from wearsim.types import ContactSolution, FloatArray, Grid

_SPEED = 2.618
_LOAD, _CREEPAGE, _FRICTION = 300.0, 1e-3, 0.1
_HALF_WIDTH, _HALF_LENGTH = 1.5e-3, 1.3e-4


def sliding_contact(strips: int, speed: float = _SPEED, slides: float = 1.0) -> ContactSolution:
    """Return a sliding Hertzian ellipse, divided into strips.

    Parameters
    ----------
    strips : int
        Number of strips over twice the patch's width; half of them are outside the patch.
    speed : float
        Rolling speed [m/s].
    slides : float
        Slip as a fraction of the creepage; 0 is a loaded contact without slip.
    """
    grid = Grid.spanning(-2.0 * _HALF_WIDTH, 2.0 * _HALF_WIDTH, strips)
    inside = np.maximum(1.0 - (grid.y / _HALF_WIDTH) ** 2, 0.0)
    load = 0.75 * _LOAD / _HALF_WIDTH * inside
    dissipation = _FRICTION * load * slides * _CREEPAGE * speed
    return ContactSolution(
        y=grid.y,
        half_length=_HALF_LENGTH * np.sqrt(inside),
        line_load=load,
        dissipation=dissipation,
        force_x=-_FRICTION * _LOAD,
        force_y=0.0,
        spin_moment=0.0,
        approach=3e-6,
        peak_pressure=1.5 * _LOAD / (np.pi * _HALF_LENGTH * _HALF_WIDTH),
        adhesion_fraction=0.0,
        power=float(dissipation.sum()) * grid.spacing,
        longitudinal_creepage=slides * _CREEPAGE,
        iterations=1,
    )


class WearLawFixture(Fixture[WearLawSpec]):
    """A wear law under test."""

    def depth(self, body: Body, contact: ContactSolution, speed: float = _SPEED) -> FloatArray:
        """Return the depth of one pass [m]."""
        return np.asarray(self.instance.depth_per_pass(body, contact, speed))


WEAR_LAW: Checks[WearLawFixture] = spec_checks()
_DEPTH = "wearsim.plugins.WearLaw.depth_per_pass"


@WEAR_LAW.specified_in("wearsim.plugins.WearLawSpec")
def factory_builds_a_wear_law(fixture: WearLawFixture) -> None:
    """The factory builds a WearLaw."""
    law = fixture.instance
    require(isinstance(law, WearLaw), f"{type(law).__name__} is not a WearLaw")


@WEAR_LAW.specified_in(_DEPTH)
def depth_is_never_negative(fixture: WearLawFixture) -> None:
    """The depth has the shape of the strips, is finite and never negative."""
    contact = sliding_contact(200)
    for body in BODIES:
        depth = fixture.depth(body, contact)
        require_values(f"{body}: the depth", depth, contact.y.shape)
        require(float(depth.min()) >= 0.0, f"{body}: the depth falls to {depth.min():.3g} m")


@WEAR_LAW.specified_in(_DEPTH)
def no_wear_outside_contact(fixture: WearLawFixture) -> None:
    """The depth is zero where the line load is zero."""
    contact = sliding_contact(200)
    for body in BODIES:
        largest = float(fixture.depth(body, contact)[contact.line_load == 0.0].max())
        require(largest == 0.0, f"{body}: the depth outside the contact is up to {largest:.3g} m")


@WEAR_LAW.specified_in("wearsim.plugins.WearLaw")
def no_wear_without_dissipation(fixture: WearLawFixture) -> None:
    """The depth is zero where the dissipation is zero."""
    contact = sliding_contact(200, slides=0.0)
    for body in BODIES:
        largest = float(fixture.depth(body, contact).max())
        require(largest == 0.0, f"{body}: the depth without dissipation is up to {largest:.3g} m")


@WEAR_LAW.specified_in("wearsim.plugins.WearLaw.depth_per_dissipation")
def linear_factor_matches_depth(fixture: WearLawFixture) -> None:
    """The depth per dissipation, if given, is the depth over the dissipation of any contact."""
    for body in BODIES:
        for speed in (_SPEED, 3.0 * _SPEED):
            factor = fixture.instance.depth_per_dissipation(body, speed)
            if factor is None:
                continue
            require(np.isfinite(factor) and factor >= 0.0, f"{body}: the factor is {factor}")
            for slides in (1.0, 0.3):
                contact = sliding_contact(200, speed, slides)
                agree(
                    f"{body}, V = {speed:g} m/s: the depth, compared with depth_per_dissipation,",
                    fixture.depth(body, contact, speed),
                    factor * contact.dissipation,
                    1e-12,
                )


@WEAR_LAW.specified_in(_DEPTH)
def depth_independent_of_strips(fixture: WearLawFixture) -> None:
    """The depth at a position does not depend on the width of the strips."""
    coarse, fine = sliding_contact(400), sliding_contact(1600)
    for body in BODIES:
        depth = fixture.depth(body, coarse)
        refined = np.interp(coarse.y, fine.y, fixture.depth(body, fine))
        # a law can have a threshold, next to which one strip differs
        difference = float(np.abs(depth - refined).sum())
        require(
            difference <= 0.02 * float(depth.sum()),
            f"{body}: the depths of 400 and 1600 strips differ by {difference:.3g} m in total",
        )


@WEAR_LAW.specified_in(_DEPTH)
def depth_is_reproducible(fixture: WearLawFixture) -> None:
    """The same contact has the same depth bit for bit, and is not changed."""
    contact, original = sliding_contact(200), sliding_contact(200)
    for body in BODIES:
        first = fixture.depth(body, contact).copy()
        fixture.depth(body, sliding_contact(200, slides=0.5))
        repeated = fixture.depth(body, contact)
        require(np.array_equal(first, repeated), f"{body}: a second call differs")
        repeated = fixture.fresh().depth_per_pass(body, contact, _SPEED)
        require(np.array_equal(first, repeated), f"{body}: a new law differs")
    for name in ("half_length", "line_load", "dissipation"):
        unchanged = np.array_equal(getattr(contact, name), getattr(original, name))
        require(unchanged, f"depth_per_pass changes the {name} of its input")
