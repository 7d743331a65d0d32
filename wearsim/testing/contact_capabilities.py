"""Each capability of a contact model: what is claimed works, what is not claimed is refused."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from wearsim.errors import CapabilityError, ContactError
from wearsim.plugins import SharedWear
from wearsim.testing.checks import Checks, PromiseBroken, agree, require
from wearsim.testing.contact_bench import ContactBench
from wearsim.types import ContactSolution, Creepage, FloatArray, OperatingPoint

CAPABILITIES: Checks[ContactBench] = Checks()
_CAPABILITIES = "wearsim.plugins.Capabilities"


def refuses(bench: ContactBench, capability: str, ask: Callable[[], Any]) -> bool:
    """Tell whether a capability is not claimed, after seeing to it that it is refused then.

    Parameters
    ----------
    bench : ContactBench
        The model.
    capability : str
        Its name.
    ask : callable
        Asks for it.
    """
    if getattr(bench.capabilities, capability):
        return False
    told = f"{capability} is not claimed, and asking for it "
    try:
        ask()
    except CapabilityError:
        return True
    except Exception as error:
        told += f"raises {type(error).__name__} ({error}), where a CapabilityError is due"
        raise PromiseBroken(told) from error
    raise PromiseBroken(f"{told}is silently ignored, where a CapabilityError is due")


@CAPABILITIES.promised_in("wearsim.plugins.ContactModelSpec")
def spec_claims_what_its_models_claim(bench: ContactBench) -> None:
    """The spec claims no less than the models it builds, and no more than with no option given."""
    claimed = set(bench.chosen.spec.capabilities.names())
    more = set(bench.capabilities.names()) - claimed
    require(not more, f"the model claims {', '.join(sorted(more))}, and its spec does not")
    if not bench.chosen.raw:
        less = claimed - set(bench.capabilities.names())
        require(not less, f"the spec claims {', '.join(sorted(less))}, and its model does not")


def softening(bench: ContactBench) -> FloatArray:
    """Return a wear compliance, uneven, that opens the gap by a part of the approach [m/(N/m)]."""
    pressed = bench.solution.approach - float(bench.gap.min())
    share = 1.0 + 0.5 * np.tanh(bench.grid.y / (0.2 * bench.case.width))
    compliance: FloatArray = 0.2 * pressed / float(bench.solution.line_load.max()) * share
    return compliance


@CAPABILITIES.promised_in(_CAPABILITIES)
def wear_compliance(bench: ContactBench) -> None:
    """With a wear compliance c the answer is that of the gap plus c q."""
    compliance = softening(bench)
    if refuses(bench, "wear_compliance", lambda: bench.solve(wear_compliance=compliance)):
        return
    for what, gap in bench.gaps.items():
        found = bench.solve(gap=gap, wear_compliance=compliance)
        agree(
            f"{what}: the load of strips that wear",
            float(found.line_load.sum()) * bench.grid.spacing,
            bench.case.normal_force,
            bench.case.tolerance,
        )
        worn = bench.solve(gap=gap + compliance * found.line_load)
        told = f"{what}: the line load on gap + c q, against that with the wear compliance c,"
        agree(told, worn.line_load, found.line_load, 1e-4)
    nothing = bench.solve(wear_compliance=np.zeros_like(compliance))
    agree("the line load with no compliance", nothing.line_load, bench.solution.line_load, 1e-6)


@CAPABILITIES.promised_in(_CAPABILITIES)
def coupled(bench: ContactBench) -> None:
    """Contacts that wear one body together each solve the gap that all of them open."""
    gap = np.array([bench.gaps["fresh"], bench.gaps["off centre"]])
    load = bench.case.normal_force
    points = [bench.point(), bench.point(Creepage(5e-4, 2e-4), normal_force=0.8 * load)]
    each = 0.25 * softening(bench)
    wear = SharedWear(np.array([[0, 0], [0, 1]]), np.array([[each, each], [each, 0.0 * each]]))

    def ask() -> Sequence[ContactSolution]:
        return bench.model.solve_coupled(gap, bench.case.curvature, points, wear)

    if refuses(bench, "coupled", ask):
        return
    found = ask()
    opened = gap + wear.opening(np.array([item.line_load for item in found]))
    for k, (point, item) in enumerate(zip(points, found, strict=True)):
        alone = bench.solve(point, opened[k])
        told = f"of contact {k} on what both wear, solved alone, against both together,"
        agree(f"the line load {told}", alone.line_load, item.line_load, 1e-4)
        agree(f"the power {told}", alone.power, item.power, 1e-3)


@CAPABILITIES.promised_in("wearsim.types.Creepage")
def creepage_variation(bench: ContactBench) -> None:
    """Strips that slide dissipate by their own creepage xi + g - <g>."""
    variation = 5e-3 * np.tanh(bench.grid.y / (0.2 * bench.case.width)) + 1e-2
    point = bench.point(Creepage(2e-2, variation=variation))
    if refuses(bench, "creepage_variation", lambda: bench.solve(point)):
        return
    for what, gap in bench.gaps.items():
        found = bench.solve(point, gap)
        local = 2e-2 + variation - np.average(variation, weights=found.line_load)
        even = bench.solve(bench.point(Creepage(2e-2)), gap).dissipation
        told = f"{what}: dissipation of strips that slide, as xi + g - <g>,"
        agree(told, found.dissipation, even * local / 2e-2, 0.03)
        shifted = replace(point, creepage=Creepage(2e-2, variation=variation + 0.01))
        told = f"{what}: dissipation after a constant was added to the variation"
        agree(told, bench.solve(shifted, gap).dissipation, found.dissipation, 1e-6)


@CAPABILITIES.promised_in("wearsim.types.OperatingPoint")
def bearing_torque(bench: ContactBench) -> None:
    """The bearing torque is carried, by the creepage that is returned, or the roller skids."""
    case = bench.case
    radius = np.full(bench.grid.strips, case.roller_radius)
    most = case.friction * case.normal_force * case.roller_radius

    def driven(part: float) -> OperatingPoint:
        return bench.point(Creepage(0.0), bearing_torque=part * most, rolling_radius=radius)

    if refuses(bench, "bearing_torque", lambda: bench.solve(driven(0.4))):
        return
    for part in (0.4, -0.2, 0.0):
        found = bench.solve(driven(part))
        carried = -case.roller_radius * found.force_x
        told = f"the torque carried with {part:g} mu N R at the bearing"
        agree(told, carried, part * most, case.tolerance, most)
        again = bench.solve(bench.point(Creepage(found.longitudinal_creepage)))
        told = "force_x at the longitudinal_creepage that the balance of torque found"
        agree(told, again.force_x, found.force_x, case.tolerance, most / case.roller_radius)
    try:
        bench.solve(driven(1.2))
    except ContactError:
        return
    raise PromiseBroken("a torque of 1.2 mu N R, at which the roller skids, has an answer")


@CAPABILITIES.promised_in("wearsim.types.OperatingPoint")
def local_friction(bench: ContactBench) -> None:
    """Strips that slide dissipate by their own friction."""
    case, creepage = bench.case, Creepage(2e-2)
    friction = case.friction * np.where(bench.grid.y > 0.0, 1.5, 0.5)
    asked = bench.point(creepage, friction=friction)
    if refuses(bench, "local_friction", lambda: bench.solve(asked)):
        return
    even = bench.point(friction=np.full(bench.grid.strips, case.friction))
    told = "dissipation where every strip has the same friction, against one value,"
    agree(told, bench.solve(even).dissipation, bench.solution.dissipation, 1e-9)
    sliding = bench.solve(bench.point(creepage)).dissipation * friction / case.friction
    told = "dissipation of strips that slide, in proportion to their own friction,"
    agree(told, bench.solve(asked).dissipation, sliding, 0.03)


@CAPABILITIES.promised_in("wearsim.plugins.ContactModel.friction_points")
def friction_field(bench: ContactBench) -> None:
    """Friction is asked for within the contact, and points that slide dissipate by their own."""
    case, model = bench.case, bench.model
    whole = np.full((7, bench.grid.strips), case.friction)
    if refuses(bench, "friction_field", lambda: bench.solve(bench.point(friction=whole))):
        refuses(
            bench,
            "friction_field",
            lambda: model.friction_points(bench.gap, case.curvature, bench.point()),
        )
        return
    x, y = model.friction_points(bench.gap, case.curvature, bench.point())
    agree("y of the friction points", y, bench.grid.y, 0.0)
    require(
        x.ndim == 2 and x.shape[1] == len(y), f"x has the shape {x.shape}, not (points, strips)"
    )
    require(bool((np.diff(x, axis=0) <= 0.0).all()), "x does not fall from the leading edge on")
    outside = bench.solution.half_length == 0.0
    require(not x[:, outside].any(), "x is not 0 outside the contact")
    even = np.full(x.shape, case.friction)
    for carried in (False, True):
        found = bench.solve(bench.point(friction=even, friction_carried=carried))
        told = f"power of one friction at all points, {'carried' if carried else 'staying'},"
        agree(told, found.power, bench.solution.power, 0.01)
    strips = case.friction * np.where(y > 0.0, 1.5, 0.5) * np.ones_like(x)
    found = bench.solve(bench.point(Creepage(2e-2), friction=strips))
    sliding = bench.solve(bench.point(Creepage(2e-2))).dissipation * strips[0] / case.friction
    told = "dissipation of points that slide, in proportion to their own friction,"
    agree(told, found.dissipation, sliding, 0.03)
    many, _ = model.friction_points_batch(bench.gap[None], case.curvature, [bench.point()])
    agree("friction_points_batch of one contact", many, x[None], 1e-12)


@CAPABILITIES.promised_in("wearsim.plugins.ContactModel.fields")
def fields(bench: ContactBench) -> None:
    """Pressure rises to its peak; pressure, traction and power add up to load, force and power."""
    case, points = bench.case, 801

    def ask(point: OperatingPoint, solution: ContactSolution) -> Any:
        return bench.model.fields(solution, bench.gap, case.curvature, point, points)

    if refuses(bench, "fields", lambda: ask(bench.point(), bench.solution)):
        return
    for creepage in (Creepage(1e-3), Creepage(4e-4), Creepage(2e-4, -3e-4)):
        point = bench.point(creepage)
        solution = bench.solve(point)
        found = ask(point, solution)
        require(found.x.shape == (points, bench.grid.strips), f"x has the shape {found.x.shape}")
        agree("y of the fields", found.y, bench.grid.y, 0.0)
        agree("the leading edge x[-1]", found.x[-1], solution.half_length, 0.02)
        agree("the greatest pressure", found.pressure.max(), solution.peak_pressure, 0.02)
        force = float(np.hypot(solution.force_x, solution.force_y))
        for name, total, tolerance, size in (
            ("pressure", case.normal_force, 0.02, 0.0),
            ("traction_x", solution.force_x, 0.02, force),
            ("traction_y", solution.force_y, 0.02, force),
            ("power_density", solution.power, 0.05, 0.0),
        ):
            values = getattr(found, name)
            summed = float(np.trapezoid(values, found.x, axis=0).sum()) * bench.grid.spacing
            agree(f"the sum of {name} over the points", summed, total, tolerance, size)
        sliding = np.hypot(found.slip_x, found.slip_y)[found.adhesion]
        require(not sliding.any(), "points that adhere slip")
