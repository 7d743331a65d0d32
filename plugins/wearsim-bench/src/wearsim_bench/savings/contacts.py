"""Savings in one contact: closed forms, full slip, strips outside it, fields, friction."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from wearsim.contact_batch import ContactBatch
from wearsim.models.contact.strip_model import grid_about_hertz
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.contact.single import study_contact
from wearsim.types import Creepage, FloatArray, Grid, OperatingPoint
from wearsim_bench.contact.methods import COMPARISON_MODEL, Method, compared_models, methods
from wearsim_bench.savings.saving import Alternatives, Saving

FINE = 1000  # steps along rolling of the reference
TIMES = 3  # factor on the number of strips
CONTACTS = 20  # batch size
_SLIGHT = 1e-9  # 1/m, a negligible spin that is not zero
_SPIN = 0.05  # 1/m, for a tilt of 1 mrad
_SLIDING = 0.1  # creepage at which no part of the contact adheres


class MeanContact:
    """Mean contact of the rig, by default on strips over 1.2 times its patch.

    Parameters
    ----------
    method : Method
        The contact model.
    wide, fine : int
        Factors on width and resolution of the strips.
    """

    def __init__(self, method: Method, wide: int = 1, fine: int = 1) -> None:
        scenario = shipped_scenario("mean-contact")
        materials = scenario.materials
        self.curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
        across, self.point = 1.0 / scenario.roller.crown_radius, study_contact(scenario).point
        usual = grid_about_hertz(None, across, self.curvature, self.point.normal_force, materials)
        half = 0.5 * wide * usual.strips * usual.spacing
        self.grid = Grid.spanning(-half, half, wide * fine * usual.strips)
        self.gap: FloatArray = 0.5 * across * self.grid.y**2
        self.model = method.choice().build(self.grid, materials)

    def batch(self, name: str, point: OperatingPoint) -> Callable[[], FloatArray]:
        """Return a function that solves a batch of contacts and returns one solution field."""
        gaps = np.repeat(self.gap[None], CONTACTS, axis=0)
        contacts = ContactBatch.of(gaps, self.curvature, [point] * CONTACTS)
        return lambda: np.asarray(getattr(self.model.solve(contacts), name))

    def dissipation(self, point: OperatingPoint) -> FloatArray:
        """Return P_l(y) at an operating point, shape (strips,) [W/m]."""
        return self.model.solve_one(self.gap, self.curvature, point).dissipation

    def with_fields(self, point: OperatingPoint) -> FloatArray:
        """Return P_l(y) like `dissipation`, after computing tractions and slip too."""
        solution = self.model.solve_one(self.gap, self.curvature, point)
        self.model.fields(solution, self.gap, self.curvature, point)
        return solution.dissipation


def _theories() -> list[Method]:
    """Return the tangential theories on the comparison model, and `hertz-fastsim`."""
    return [method for method in methods() if method.model == COMPARISON_MODEL] + [
        Method("hertz-fastsim")
    ]


def _models() -> list[Method]:
    return [Method(name) for name in compared_models()]


def _slipping(point: OperatingPoint, longitudinal: float, spin: float) -> OperatingPoint:
    return replace(point, creepage=Creepage(longitudinal, 0.0, spin))


def _many_steps(method: Method) -> Method | None:
    """Return the method with many steps along rolling, or None if it has no such steps."""
    fields = method.spec.options.model_fields
    fine = {**method.options, "mx": FINE}
    if "mx" not in fields:
        return None
    try:
        method.spec.options(**fine)
    except ValueError:
        return None
    return Method(method.model, fine)


def closed_forms() -> Iterator[Saving]:
    """Yield all theories without spin, and with negligible spin and no closed form."""
    for method in _theories():
        yield Saving("no spin", method.name, partial(_closed_form, method))


def _closed_form(method: Method) -> Alternatives:
    rig = MeanContact(method)
    without_spin, slight_spin = (
        _slipping(rig.point, rig.point.creepage.longitudinal, spin) for spin in (0.0, _SLIGHT)
    )
    ways = {
        "no spin": rig.batch("dissipation", without_spin),
        "negligible spin": rig.batch("dissipation", slight_spin),
    }
    return Alternatives(ways, _limit(method, slight_spin))


def _limit(method: Method, point: OperatingPoint) -> Callable[[], FloatArray] | None:
    """Return a function for P_l(y) with many steps along rolling, or None if not available."""
    fine = _many_steps(method)
    if fine is None:
        return None
    # a nonzero spin, to avoid the closed form
    reference = _slipping(point, point.creepage.longitudinal, _SLIGHT)
    return MeanContact(fine).batch("dissipation", reference)


def full_slip() -> Iterator[Saving]:
    """Yield all theories with steps along rolling, in full slip and with partial adhesion."""
    for method in _theories():
        fine = _many_steps(method)
        if fine is not None:
            yield Saving("full slip", method.name, partial(_full_slip, method, fine))


def _full_slip(method: Method, fine: Method) -> Alternatives:
    rig = MeanContact(method)
    slips = {"full slip": _SLIDING, "partial adhesion": rig.point.creepage.longitudinal}
    ways = {
        name: _relative(rig, MeanContact(fine), _slipping(rig.point, slip, _SPIN))
        for name, slip in slips.items()
    }
    return Alternatives(ways, lambda: np.ones(CONTACTS))


def _relative(
    rig: MeanContact, fine: MeanContact, point: OperatingPoint
) -> Callable[[], FloatArray]:
    """Return a function for the power relative to that with many steps."""
    power, exact = rig.batch("power", point), fine.batch("power", point)()
    return lambda: power() / exact


def uniform_friction() -> Iterator[Saving]:
    """Yield all models with one friction coefficient, and with one at every point."""
    for method in _models():
        if method.spec.capabilities.local_friction:
            yield Saving("uniform friction", method.name, partial(_one_friction, method))


def _one_friction(method: Method) -> Alternatives:
    rig = MeanContact(method)
    mu = np.full(_friction_shape(method, rig), rig.point.friction)
    place = "strip" if mu.ndim == 1 else "point"
    ways = {
        "one": rig.batch("dissipation", rig.point),
        f"one per {place}": rig.batch("dissipation", replace(rig.point, friction=mu)),
    }
    return Alternatives(ways, _limit(method, rig.point))


def _friction_shape(method: Method, rig: MeanContact) -> tuple[int, ...]:
    if not method.spec.capabilities.friction_field:
        return (rig.grid.strips,)
    contact = ContactBatch.of(rig.gap[None], rig.curvature, [rig.point])
    return rig.model.friction_points(contact)[0].shape[1:]


def strips_outside() -> Iterator[Saving]:
    """Yield all models with strips outside the contact, without them, and with all in contact."""
    for method in _models():
        yield Saving("strips outside", method.name, partial(_outside, method))


def _outside(method: Method) -> Alternatives:
    wide, usual, fine = (
        MeanContact(method, wide=TIMES),
        MeanContact(method),
        MeanContact(method, fine=TIMES),
    )
    ways = {
        f"{TIMES} x as many, outside": wide.batch("power", wide.point),
        "strips at the patch": usual.batch("power", usual.point),
        f"{TIMES} x as many, finer": fine.batch("power", fine.point),
    }
    return Alternatives(ways)


def fields() -> Iterator[Saving]:
    """Yield all models with fields inside the contact, without and with their computation."""
    for method in _models():
        if method.spec.capabilities.fields:
            yield Saving("fields", method.name, partial(_fields, method))


def _fields(method: Method) -> Alternatives:
    rig = MeanContact(method)
    ways = {
        "strips": partial(rig.dissipation, rig.point),
        "with fields": partial(rig.with_fields, rig.point),
    }
    return Alternatives(ways)
