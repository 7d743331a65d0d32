"""Savings within one contact: closed forms, full slip, strips outside it, fields, friction."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from wearsim.contact_batch import OperatingPoints, rows_of
from wearsim.models.contact.strip_model import grid_about_hertz
from wearsim.plugins import ContactModelSpec, registry
from wearsim.scenario.examples import shipped_scenario
from wearsim.studies.contact.single import study_contact
from wearsim.types import Creepage, FloatArray, Grid, OperatingPoint
from wearsim_bench.contact.methods import HOST, Method, methods
from wearsim_bench.savings.pairs import Pair, Ways

FINE = 1000  # steps of the march that the others are held against
TIMES = 3  # as many strips
CONTACTS = 20  # solved at once
_SLIGHT = 1e-9  # 1/m: no spin to speak of, but a spin
_SPIN = 0.05  # 1/m, that of a tilt of 1 mrad
_SLIDING = 0.1  # creepage at which no part of the contact adheres


class Rig:
    """The rig's mean contact on strips that span 1.2 times its patch, more of them, or finer ones.

    Parameters
    ----------
    method : Method
    wide, fine : int
        How many times as wide, and as fine, the strips' grid is.
    """

    def __init__(self, method: Method, wide: int = 1, fine: int = 1) -> None:
        scenario = shipped_scenario("mean-contact")
        materials = scenario.cylinder.material, scenario.roller.material
        self.curvature = 1.0 / scenario.cylinder.radius + 1.0 / scenario.roller.radius
        across, self.point = 1.0 / scenario.roller.crown_radius, study_contact(scenario).point
        usual = grid_about_hertz(across, self.curvature, self.point.normal_force, materials)
        half = 0.5 * wide * usual.strips * usual.spacing
        self.grid = Grid.spanning(-half, half, wide * fine * usual.strips)
        self.gap: FloatArray = 0.5 * across * self.grid.y**2
        self.model = method.build()
        self.model.prepare(self.grid, materials)

    def many(self, name: str, point: OperatingPoint) -> Callable[[], FloatArray]:
        """Return what solves many such contacts at once, and returns a field of the solutions."""
        points = OperatingPoints.of([point] * CONTACTS) or [point] * CONTACTS
        gaps = np.repeat(self.gap[None], CONTACTS, axis=0)
        return lambda: rows_of(self.model.solve_batch(gaps, self.curvature, points), name)

    def dissipation(self, point: OperatingPoint) -> FloatArray:
        """Return P_l(y) at an operating point, shape (strips,) [W/m]."""
        return self.model.solve(self.gap, self.curvature, point).dissipation

    def with_fields(self, point: OperatingPoint) -> FloatArray:
        """Return P_l(y) as `dissipation` does, tractions and slip being found too."""
        solution = self.model.solve(self.gap, self.curvature, point)
        self.model.fields(solution, self.gap, self.curvature, point)
        return solution.dissipation


def _theories() -> list[Method]:
    """Return the tangential theories on the model that compares them, and as the paper has it."""
    return [method for method in methods() if method.model == HOST] + [Method("hertz-fastsim")]


def _models() -> list[Method]:
    return [Method(name) for name in registry().names(ContactModelSpec)]


def _slipping(point: OperatingPoint, longitudinal: float, spin: float) -> OperatingPoint:
    return replace(point, creepage=Creepage(longitudinal, 0.0, spin))


def _marched(method: Method) -> Method | None:
    """Return the method with a march of many steps, or None where it does not march."""
    fields = method.spec.options.model_fields
    fine = {**method.options, "mx": FINE}
    if "mx" not in fields:
        return None
    try:
        method.spec.options(**fine)
    except ValueError:
        return None
    return Method(method.model, fine)


def closed_forms() -> Iterator[Pair]:
    """Yield every theory without spin, and with next to none, where no closed form holds."""
    for method in _theories():
        yield Pair("no spin", method.name, partial(_closed_form, method))


def _closed_form(method: Method) -> Ways:
    rig = Rig(method)
    none, some = (
        _slipping(rig.point, rig.point.creepage.longitudinal, spin) for spin in (0.0, _SLIGHT)
    )
    ways = {
        "no spin": rig.many("dissipation", none),
        "next to none": rig.many("dissipation", some),
    }
    return Ways(ways, _limit(method, some))


def _limit(method: Method, point: OperatingPoint) -> Callable[[], FloatArray] | None:
    """Return what finds P_l(y) by a march of many steps, or None where the method has none."""
    fine = _marched(method)
    if fine is None:
        return None
    # without any spin it would be the closed form
    marched = _slipping(point, point.creepage.longitudinal, _SLIGHT)
    return Rig(fine).many("dissipation", marched)


def full_slip() -> Iterator[Pair]:
    """Yield every theory that marches where all slides, and where part of the contact adheres."""
    for method in _theories():
        fine = _marched(method)
        if fine is not None:
            yield Pair("full slip", method.name, partial(_slides, method, fine))


def _slides(method: Method, fine: Method) -> Ways:
    rig = Rig(method)
    slips = {"all slides": _SLIDING, "part adheres": rig.point.creepage.longitudinal}
    ways = {
        name: _relative(rig, Rig(fine), _slipping(rig.point, slip, _SPIN))
        for name, slip in slips.items()
    }
    return Ways(ways, lambda: np.ones(CONTACTS))


def _relative(rig: Rig, fine: Rig, point: OperatingPoint) -> Callable[[], FloatArray]:
    """Return what finds the power over that which is found on a fine march."""
    power, exact = rig.many("power", point), fine.many("power", point)()
    return lambda: power() / exact


def uniform_friction() -> Iterator[Pair]:
    """Yield every model under one coefficient of friction, and under one at every point."""
    for method in _models():
        if method.spec.capabilities.local_friction:
            yield Pair("uniform friction", method.name, partial(_one_friction, method))


def _one_friction(method: Method) -> Ways:
    rig = Rig(method)
    mu = np.full(_friction_shape(method, rig), rig.point.friction)
    place = "strip" if mu.ndim == 1 else "point"
    ways = {
        "one": rig.many("dissipation", rig.point),
        f"one per {place}": rig.many("dissipation", replace(rig.point, friction=mu)),
    }
    return Ways(ways, _limit(method, rig.point))


def _friction_shape(method: Method, rig: Rig) -> tuple[int, ...]:
    if not method.spec.capabilities.friction_field:
        return (rig.grid.strips,)
    return rig.model.friction_points(rig.gap, rig.curvature, rig.point)[0].shape


def strips_outside() -> Iterator[Pair]:
    """Yield every model with strips outside the contact, without them, and with all in contact."""
    for method in _models():
        yield Pair("strips outside", method.name, partial(_outside, method))


def _outside(method: Method) -> Ways:
    wide, alone, fine = Rig(method, wide=TIMES), Rig(method), Rig(method, fine=TIMES)
    ways = {
        f"{TIMES} x as many, outside": wide.many("power", wide.point),
        "strips about the patch": alone.many("power", alone.point),
        f"{TIMES} x as many, finer": fine.many("power", fine.point),
    }
    return Ways(ways)


def fields() -> Iterator[Pair]:
    """Yield every model that knows the inside of a contact, asked for it and not."""
    for method in _models():
        if method.spec.capabilities.fields:
            yield Pair("fields", method.name, partial(_inside, method))


def _inside(method: Method) -> Ways:
    rig = Rig(method)
    ways = {
        "strips": partial(rig.dissipation, rig.point),
        "fields too": partial(rig.with_fields, rig.point),
    }
    return Ways(ways)
