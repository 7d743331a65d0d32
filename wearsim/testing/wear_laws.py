"""What any wear law keeps, on a contact whose strips are known in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wearsim.plugins import BODIES, Body, WearLaw, WearLawSpec
from wearsim.testing.checks import Checks, agree, require
from wearsim.testing.specs import Chosen, spec_checks
from wearsim.types import ContactSolution, FloatArray, Grid

_SPEED = 2.618
_LOAD, _CREEPAGE, _FRICTION = 300.0, 1e-3, 0.1
_HALF_WIDTH, _HALF_LENGTH = 1.5e-3, 1.3e-4


def sliding_contact(strips: int, speed: float = _SPEED, slides: float = 1.0) -> ContactSolution:
    """Return a Hertzian ellipse that slides, cut into strips.

    Parameters
    ----------
    strips : int
        Over twice the patch's width, so that half of them lie outside it.
    speed : float
        Rolling speed [m/s].
    slides : float
        Part of the creepage that it slides with; at 0 it is loaded and nothing slides.
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


@dataclass(frozen=True)
class WearLawBench:
    """A wear law with options."""

    chosen: Chosen[WearLawSpec]

    def __str__(self) -> str:
        return str(self.chosen)

    def fresh(self) -> WearLaw:
        """Return a new wear law."""
        return self.chosen.spec.factory(self.chosen.options)

    @cached_property
    def law(self) -> WearLaw:
        """One law for all checks."""
        return self.fresh()

    def depth(self, body: Body, contact: ContactSolution, speed: float = _SPEED) -> FloatArray:
        """Return the depth of one pass [m]."""
        return self.law.depth_per_pass(body, contact, speed)


WEAR_LAW: Checks[WearLawBench] = Checks(spec_checks())
_DEPTH = "wearsim.plugins.WearLaw.depth_per_pass"


@WEAR_LAW.promised_in("wearsim.plugins.WearLawSpec")
def factory_builds_a_wear_law(bench: WearLawBench) -> None:
    """The factory builds a WearLaw."""
    require(isinstance(bench.law, WearLaw), f"{type(bench.law).__name__} is no WearLaw")


@WEAR_LAW.promised_in(_DEPTH)
def depth_is_never_negative(bench: WearLawBench) -> None:
    """The depth has the strips' shape, is finite and never negative."""
    contact = sliding_contact(200)
    for body in BODIES:
        depth = np.asarray(bench.depth(body, contact))
        require(depth.shape == contact.y.shape, f"{body}: the depth has the shape {depth.shape}")
        require(bool(np.isfinite(depth).all()), f"{body}: the depth is not finite")
        require(float(depth.min()) >= 0.0, f"{body}: the depth falls to {depth.min():.3g} m")


@WEAR_LAW.promised_in(_DEPTH)
def nothing_wears_outside_the_contact(bench: WearLawBench) -> None:
    """Nothing wears where nothing touches."""
    contact = sliding_contact(200)
    outside = contact.line_load == 0.0
    for body in BODIES:
        most = float(bench.depth(body, contact)[outside].max())
        require(most == 0.0, f"{body}: {most:.3g} m wear off where nothing touches")


@WEAR_LAW.promised_in("wearsim.plugins.WearLaw")
def nothing_wears_where_nothing_slides(bench: WearLawBench) -> None:
    """Nothing wears where nothing is dissipated."""
    contact = sliding_contact(200, slides=0.0)
    for body in BODIES:
        most = float(bench.depth(body, contact).max())
        require(most == 0.0, f"{body}: {most:.3g} m wear off a contact that dissipates nothing")


@WEAR_LAW.promised_in("wearsim.plugins.WearLaw.depth_per_dissipation")
def linear_law_is_linear(bench: WearLawBench) -> None:
    """A depth per dissipation, where given, is the depth over the dissipation of any contact."""
    for body in BODIES:
        for speed in (_SPEED, 3.0 * _SPEED):
            factor = bench.law.depth_per_dissipation(body, speed)
            if factor is None:
                continue
            require(np.isfinite(factor) and factor >= 0.0, f"{body}: the factor is {factor}")
            for slides in (1.0, 0.3):
                contact = sliding_contact(200, speed, slides)
                depth = bench.depth(body, contact, speed)
                told = f"{body}, V = {speed:g} m/s: the depth, by depth_per_dissipation,"
                agree(told, depth, factor * contact.dissipation, 1e-12)


@WEAR_LAW.promised_in(_DEPTH)
def depth_does_not_depend_on_the_strips(bench: WearLawBench) -> None:
    """The depth at a place is the same however fine the strips are."""
    coarse, fine = sliding_contact(400), sliding_contact(1600)
    for body in BODIES:
        own = bench.depth(body, coarse)
        found = np.interp(coarse.y, fine.y, bench.depth(body, fine))
        # a law may have a threshold, beside which one strip falls on the other side
        apart = float(np.abs(own - found).sum())
        told = f"{body}: the depth of 400 strips is not that of 1600, by {apart:.3g} m in all"
        require(apart <= 0.02 * float(own.sum()), told)


@WEAR_LAW.promised_in(_DEPTH)
def depth_has_the_same_bits_twice(bench: WearLawBench) -> None:
    """The same contact wears the same bits, and is left as it was."""
    contact = sliding_contact(200)
    for body in BODIES:
        first = np.array(bench.depth(body, contact))
        bench.depth(body, sliding_contact(200, slides=0.5))
        require(np.array_equal(first, bench.depth(body, contact)), f"{body}: a second call differs")
        anew = bench.fresh().depth_per_pass(body, contact, _SPEED)
        require(np.array_equal(first, anew), f"{body}: a new law differs")
    same = sliding_contact(200)
    for name in ("half_length", "line_load", "dissipation"):
        unchanged = np.array_equal(getattr(contact, name), getattr(same, name))
        require(unchanged, f"depth_per_pass changes the {name} that it is given")
