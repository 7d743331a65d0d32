"""Capabilities of contact models: claimed ones work, others raise a CapabilityError."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from wearsim.errors import CapabilityError, ContactError
from wearsim.plugins import PassLoop, SharedWear
from wearsim.testing.checks import Checks, ConformanceError, agree, require
from wearsim.testing.contact_fixtures import ContactFixture
from wearsim.types import ContactSolution, Creepage, FloatArray, OperatingPoint

CAPABILITIES: Checks[ContactFixture] = Checks()
_CAPABILITIES = "wearsim.plugins.Capabilities"
_PASSES = 12
_LOAD_ITERATIONS = 10  # each divides the change of a spring force by ten or more
_SLIPS = {
    "almost no slip": Creepage(1e-7, 2e-7),
    "partial slip": Creepage(4e-4, 1e-4),
    "all creepages": Creepage(3e-4, 4e-4, 0.3),
    "gross sliding": Creepage(2e-2, -1e-2),
}


def _is_refused(fixture: ContactFixture, capability: str, call: Callable[[], Any]) -> bool:
    """Return False if a capability is claimed, else True.

    Raises
    ------
    ConformanceError
        If the capability is not claimed and `call`, which requires it, raises no CapabilityError.
    """
    if getattr(fixture.model.capabilities, capability):
        return False
    message = f"{capability} is not claimed, and a call that requires it"
    try:
        call()
    except CapabilityError:
        return True
    except Exception as error:
        raise ConformanceError(
            f"{message} raises {type(error).__name__} ({error}) instead of CapabilityError"
        ) from error
    raise ConformanceError(f"{message} is silently ignored instead of raising CapabilityError")


@CAPABILITIES.specified_in("wearsim.plugins.ContactModelSpec")
def suggested_grid_holds_contact(fixture: ContactFixture) -> None:
    """The suggested strips are equally wide and contain the contact."""
    case, suggest = fixture.case, fixture.configured.spec.suggest_grid
    if suggest is None:
        return
    problem = 1.0 / case.crown_radius, case.curvature, case.normal_force, case.materials
    grid = suggest(fixture.configured.options, *problem)
    if grid is None:
        return
    equal = np.full(grid.strips - 1, grid.spacing)
    agree("the spacing of the suggested strips", np.diff(grid.y), equal, 1e-9)
    solution = fixture.fresh(grid).solve_one(case.gap(grid), case.curvature, fixture.point())
    carried = float(solution.line_load.sum()) * grid.spacing
    agree("load of the suggested strips", carried, case.normal_force, case.tolerance)


@CAPABILITIES.specified_in("wearsim.plugins.ContactModelSpec")
def spec_and_model_capabilities_agree(fixture: ContactFixture) -> None:
    """The spec claims all capabilities of its models, and with default options no others."""
    of_spec = set(fixture.configured.spec.capabilities.names())
    of_model = set(fixture.model.capabilities.names())
    extra = ", ".join(sorted(of_model - of_spec))
    require(not extra, f"the model claims {extra}, and its spec does not")
    missing = "" if fixture.configured.raw else ", ".join(sorted(of_spec - of_model))
    require(not missing, f"the spec claims {missing}, and its model does not")


def _uneven_compliance(fixture: ContactFixture) -> FloatArray:
    """Return an uneven wear compliance that opens the gap by a part of the approach [m/(N/m)]."""
    overlap = fixture.solution.approach - float(fixture.gap.min())
    shape = 1.0 + 0.5 * np.tanh(fixture.grid.y / (0.2 * fixture.case.width))
    return np.asarray(0.2 * overlap / float(fixture.solution.line_load.max()) * shape)


@CAPABILITIES.specified_in(_CAPABILITIES)
def wear_compliance(fixture: ContactFixture) -> None:
    """With a wear compliance c the solution equals a solution for the gap plus c q."""
    compliance = _uneven_compliance(fixture)
    if _is_refused(fixture, "wear_compliance", lambda: fixture.solve(wear_compliance=compliance)):
        return
    for case, gap in fixture.gaps.items():
        solution = fixture.solve(gap=gap, wear_compliance=compliance)
        agree(
            f"{case}: load of the strips with wear compliance",
            float(solution.line_load.sum()) * fixture.grid.spacing,
            fixture.case.normal_force,
            fixture.case.tolerance,
        )
        agree(
            f"{case}: the line load on gap + c q, compared with that with the wear compliance c,",
            fixture.solve(gap=gap + compliance * solution.line_load).line_load,
            solution.line_load,
            1e-4,
        )
    line_load = fixture.solve(wear_compliance=np.zeros_like(compliance)).line_load
    agree("the line load at zero compliance", line_load, fixture.solution.line_load, 1e-6)


@CAPABILITIES.specified_in(_CAPABILITIES)
def coupled(fixture: ContactFixture) -> None:
    """Contacts coupled by the wear of a shared body each solve the gap that all of them open."""
    load = fixture.case.normal_force
    points = [fixture.point(), fixture.point(Creepage(5e-4, 2e-4), normal_force=0.8 * load)]
    compliance = 0.25 * _uneven_compliance(fixture)
    wear = SharedWear(
        np.array([[0, 0], [0, 1]]),
        np.array([[compliance, compliance], [compliance, 0.0 * compliance]]),
    )
    batch = fixture.batch(points, [fixture.gaps["fresh"], fixture.gaps["off centre"]])
    if _is_refused(fixture, "coupled", lambda: fixture.model.solve(batch, coupling=wear)):
        return
    solutions = fixture.model.solve(batch, coupling=wear)
    opened = batch.gap + wear.opening(solutions.line_load)
    for k, (point, solution) in enumerate(zip(points, solutions, strict=True)):
        single = fixture.solve(point, opened[k])
        how = f"of contact {k}, solved separately on the worn gap, compared with the coupled one,"
        agree(f"the line load {how}", single.line_load, solution.line_load, 1e-4)
        agree(f"the power {how}", single.power, solution.power, 1e-3)


@CAPABILITIES.specified_in("wearsim.types.Creepage")
def creepage_variation(fixture: ContactFixture) -> None:
    """Sliding strips dissipate according to their local creepage xi + g - <g>."""
    variation = 5e-3 * np.tanh(fixture.grid.y / (0.2 * fixture.case.width)) + 1e-2
    point = fixture.point(Creepage(2e-2, variation=variation))
    if _is_refused(fixture, "creepage_variation", lambda: fixture.solve(point)):
        return
    for case, gap in fixture.gaps.items():
        solution = fixture.solve(point, gap)
        local = 2e-2 + variation - np.average(variation, weights=solution.line_load)
        agree(
            f"{case}: dissipation of sliding strips, compared with xi + g - <g>,",
            solution.dissipation,
            fixture.solve(fixture.point(Creepage(2e-2)), gap).dissipation * local / 2e-2,
            0.03,
        )
        shifted = replace(point, creepage=Creepage(2e-2, variation=variation + 0.01))
        agree(
            f"{case}: dissipation after a constant was added to the variation",
            fixture.solve(shifted, gap).dissipation,
            solution.dissipation,
            1e-6,
        )


@CAPABILITIES.specified_in("wearsim.types.OperatingPoint")
def bearing_torque(fixture: ContactFixture) -> None:
    """The returned creepage balances the bearing torque; a torque that cannot be carried raises."""
    case = fixture.case
    radius = np.full(fixture.grid.strips, case.roller_radius)
    bound = case.friction * case.normal_force * case.roller_radius

    def driven(fraction: float) -> ContactSolution:
        return fixture.solve(
            fixture.point(Creepage(0.0), bearing_torque=fraction * bound, rolling_radius=radius)
        )

    if _is_refused(fixture, "bearing_torque", lambda: driven(0.4)):
        return
    for fraction in (0.4, -0.2, 0.0):
        solution = driven(fraction)
        agree(
            f"the torque carried with {fraction:g} mu N R at the bearing",
            -case.roller_radius * solution.force_x,
            fraction * bound,
            case.tolerance,
            bound,
        )
        agree(
            "force_x at the longitudinal_creepage of the torque balance",
            fixture.solve(fixture.point(Creepage(solution.longitudinal_creepage))).force_x,
            solution.force_x,
            case.tolerance,
            bound / case.roller_radius,
        )
    try:
        driven(1.2)
    except ContactError:
        return
    raise ConformanceError("a torque of 1.2 mu N R, at which the roller skids, has a solution")


@CAPABILITIES.specified_in("wearsim.types.OperatingPoint")
def local_friction(fixture: ContactFixture) -> None:
    """Sliding strips dissipate in proportion to their local friction."""
    mu, creepage = fixture.case.friction, Creepage(2e-2)
    friction = mu * np.where(fixture.grid.y > 0.0, 1.5, 0.5)
    varied = fixture.point(creepage, friction=friction)
    if _is_refused(fixture, "local_friction", lambda: fixture.solve(varied)):
        return
    agree(
        "dissipation with the same friction on every strip, compared with one value,",
        fixture.solve(fixture.point(friction=np.full(fixture.grid.strips, mu))).dissipation,
        fixture.solution.dissipation,
        1e-9,
    )
    agree(
        "dissipation of sliding strips, in proportion to their friction,",
        fixture.solve(varied).dissipation,
        fixture.solve(fixture.point(creepage)).dissipation * friction / mu,
        0.03,
    )


@CAPABILITIES.specified_in("wearsim.plugins.ContactModel.friction_points")
def friction_field(fixture: ContactFixture) -> None:
    """Friction points are inside the contact; sliding points dissipate by their local friction."""
    mu = fixture.case.friction
    uniform = np.full((7, fixture.grid.strips), mu)

    def points() -> tuple[FloatArray, FloatArray]:
        gaps = [fixture.gap, fixture.gaps["worn"]]
        return fixture.model.friction_points(fixture.batch([fixture.point()] * 2, gaps))

    if _is_refused(
        fixture, "friction_field", lambda: fixture.solve(fixture.point(friction=uniform))
    ):
        _is_refused(fixture, "friction_field", points)
        return
    positions, y = points()
    require(
        positions.ndim == 3 and positions.shape[::2] == (2, len(y)),
        f"x has the shape {positions.shape}, not (contacts, points, strips)",
    )
    x = positions[0]
    agree("y of the friction points", y, fixture.grid.y, 0.0)
    require((np.diff(x, axis=0) <= 0.0).all(), "x does not decrease from the leading edge")
    require(not x[:, fixture.solution.half_length == 0.0].any(), "x is not 0 outside the contact")
    even = np.full(x.shape, mu)
    for carried in (False, True):
        agree(
            f"power of uniform friction at all points, {'carried' if carried else 'stationary'},",
            fixture.solve(fixture.point(friction=even, friction_carried=carried)).power,
            fixture.solution.power,
            0.01,
        )
    friction = mu * np.where(y > 0.0, 1.5, 0.5) * np.ones_like(x)
    agree(
        "dissipation of sliding points, in proportion to their friction,",
        fixture.solve(fixture.point(Creepage(2e-2), friction=friction)).dissipation,
        fixture.solve(fixture.point(Creepage(2e-2))).dissipation * friction[0] / mu,
        0.03,
    )


@CAPABILITIES.specified_in("wearsim.plugins.ContactModel.fields")
def fields(fixture: ContactFixture) -> None:
    """Pressure, traction and power density integrate to load, force and power of the solution."""
    from scipy.integrate import trapezoid  # noqa: PLC0415  (0.3 s to import)

    case, points = fixture.case, 801

    def solve(point: OperatingPoint, solution: ContactSolution) -> Any:
        return fixture.model.fields(solution, fixture.gap, case.curvature, point, points)

    if _is_refused(fixture, "fields", lambda: solve(fixture.point(), fixture.solution)):
        return
    for creepage in (Creepage(1e-3), Creepage(4e-4), Creepage(2e-4, -3e-4)):
        point = fixture.point(creepage)
        solution = fixture.solve(point)
        inside = solve(point, solution)
        require(
            inside.x.shape == (points, fixture.grid.strips), f"x has the shape {inside.x.shape}"
        )
        agree("y of the fields", inside.y, fixture.grid.y, 0.0)
        agree("the leading edge x[-1]", inside.x[-1], solution.half_length, 0.02)
        agree("the largest pressure", inside.pressure.max(), solution.peak_pressure, 0.02)
        force = float(np.hypot(solution.force_x, solution.force_y))
        for name, total, tolerance, size in (
            ("pressure", case.normal_force, 0.02, 0.0),
            ("traction_x", solution.force_x, 0.02, force),
            ("traction_y", solution.force_y, 0.02, force),
            ("power_density", solution.power, 0.05, 0.0),
        ):
            lines = trapezoid(getattr(inside, name), inside.x, axis=0)
            integral = float(lines.sum()) * fixture.grid.spacing
            agree(f"the integral of {name}", integral, total, tolerance, size)
        slip = np.hypot(inside.slip_x, inside.slip_y)[inside.adhesion]
        require(not slip.any(), "points in adhesion have slip")


@CAPABILITIES.specified_in("wearsim.types.ContactSolution")
def peak_pressure_follows_strips(fixture: ContactFixture) -> None:
    """The peak pressure is that of `fields`, or in a constant ratio to the strip means q/(2 a)."""
    ratios, curvature = {}, fixture.case.curvature
    for part in (0.25, 0.5, 1.0, 1.25):
        for shape, gap in fixture.gaps.items():
            point = fixture.point(normal_force=part * fixture.case.normal_force)
            solution, case = fixture.solve(point, gap), f"{shape}, {point.normal_force:.4g} N"
            inside = solution.half_length > 0.0
            means = solution.line_load[inside] / (2.0 * solution.half_length[inside])
            ratios[case] = solution.peak_pressure / float(means.max())
            if fixture.model.capabilities.fields:
                pressure = fixture.model.fields(solution, gap, curvature, point, 801).pressure
                agree(f"{case}: peak_pressure", solution.peak_pressure, float(pressure.max()), 0.02)
    least, most = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
    require(
        fixture.model.capabilities.fields or ratios[most] <= 1.01 * ratios[least],
        f"peak_pressure is {ratios[least]:.4g} times the greatest q/(2 a) of a strip ({least}) and"
        f" {ratios[most]:.4g} times ({most}): either it lacks a part of the pressure that carries"
        " the load, or the shape of the pressure along a strip changes with the load, which"
        " `fields` must then return; if neither can be, skip this check: without={...}",
    )


def _pass_loop(fixture: ContactFixture) -> PassLoop:
    """Return two alternating rollers with a spring, a lagging term, tilt and spin."""
    case, y, shape = fixture.case, fixture.grid.y, (2, fixture.grid.strips)
    overlap = fixture.solution.approach - float(fixture.gap.min())
    gaps = np.array([fixture.gaps["fresh"], fixture.gaps["off centre"]])
    # the largest wear of a pass is 1e-4 of the approach
    factor = 1e-4 * overlap * case.rolling_speed / float(fixture.solution.dissipation.max())
    ramp = np.linspace(-1.0, 1.0, _PASSES)
    return PassLoop(
        order=np.array([0, 1]),
        first_pass=4,
        base_load=case.normal_force * (1.0 + 0.05 * ramp),
        creepage=np.stack([1e-3 * (1.0 + 0.1 * ramp), 2e-4 * ramp], axis=1),
        friction=case.friction * (1.0 - 0.1 * ramp),
        tilt=1e-5 * ramp,
        spin=0.05 * ramp,
        stiffness=0.1 * case.normal_force / overlap,
        fresh_approach=overlap * (1.0 - 0.05 * ramp),
        nominal_gap=gaps,
        from_apex=np.array([y, y - 0.05 * case.width]),
        longitudinal_curvature=case.curvature * np.array([1.0, 1.1]),
        rolling_speed=case.rolling_speed * np.array([1.0, 0.9]),
        slip_base=np.zeros(shape),
        spin_arm=np.array([y, y]),
        slip_rates=np.zeros(2),
        wear=factor * np.array([1.0, 0.5, 0.0]),
        term_rates=np.array([[20.0, 0.1, 0.2]]),
        similar=False,
        terms=np.array([[0.5, 1.0]]),
        cylinder_depth=np.zeros(fixture.grid.strips),
        roller_depth=np.zeros(shape),
        line_load=np.zeros(shape),
        anchor=np.zeros(shape),
        anchor_gap=np.zeros(shape),
        approach=gaps.min(axis=1) + overlap,
        anchor_approach=np.zeros(2),
        energy=np.zeros(2),
    )


def _run_single_solves(fixture: ContactFixture, loop: PassLoop) -> None:
    """Run the passes of `loop` by single solves, as specified in `PassLoop`."""
    for p in range(_PASSES):
        g = int(loop.order[(loop.first_pass + p) % len(loop.order)])
        unworn = loop.nominal_gap[g] + loop.tilt[p] * loop.from_apex[g]
        gap = unworn + loop.cylinder_depth + loop.roller_depth[g]
        longitudinal, lateral = loop.creepage[p].tolist()
        point = fixture.point(
            Creepage(longitudinal, lateral, float(loop.spin[p])),
            friction=float(loop.friction[p]),
            rolling_speed=float(loop.rolling_speed[g]),
        )
        approach = float(gap.min() + loop.fresh_approach[p])
        for _ in range(_LOAD_ITERATIONS):
            displacement = approach - float(unworn.min() + loop.fresh_approach[p])
            load = loop.base_load[p] + loop.terms[:, g].sum() - loop.stiffness * displacement
            solution = fixture.model.solve_one(
                gap, float(loop.longitudinal_curvature[g]), replace(point, normal_force=float(load))
            )
            approach = solution.approach
        energy_per_area = solution.dissipation / point.rolling_speed
        loop.cylinder_depth += loop.wear[0] * energy_per_area
        loop.roller_depth[g] += loop.wear[1 + g] * energy_per_area
        gain, rate = loop.term_rates[:, 0], loop.term_rates[:, 1 + g]
        loop.terms[:, g] += rate * (gain * solution.power - loop.terms[:, g])
        loop.energy[g] += solution.power
        loop.line_load[g], loop.approach[g] = solution.line_load, solution.approach


@CAPABILITIES.specified_in(_CAPABILITIES)
def creep_factor(fixture: ContactFixture) -> None:
    """With a creep factor k tractions are those of k times the creepages, at 1/k their power."""
    if _is_refused(fixture, "creep_factor", lambda: fixture.model.with_creep_factor(0.5)):
        return
    factor, curvature = 0.4, fixture.case.curvature
    before = fixture.solve()
    model = fixture.model.with_creep_factor(factor)
    for case, creepage in _SLIPS.items():
        slower = Creepage(
            factor * creepage.longitudinal, factor * creepage.lateral, factor * creepage.spin
        )
        ideal = fixture.solve(fixture.point(slower))
        solution = model.solve_one(fixture.gap, curvature, fixture.point(creepage))
        force = float(np.hypot(ideal.force_x, ideal.force_y))
        scales = {"force_x": force, "force_y": force, "spin_moment": force * fixture.case.width}
        how = f"{case}: with a creep factor of {factor}, the"
        for name in ("line_load", "approach", *scales):
            scale = scales.get(name, 0.0)
            agree(f"{how} {name}", getattr(solution, name), getattr(ideal, name), 1e-6, scale)
        for name in ("power", "dissipation"):
            agree(f"{how} {name}", factor * getattr(solution, name), getattr(ideal, name), 1e-6)
    after = fixture.solve()
    require(before.power == after.power, "with_creep_factor changes the model that it is called on")


@CAPABILITIES.specified_in("wearsim.plugins.PassLoop")
def pass_loop(fixture: ContactFixture) -> None:
    """The compiled loop over passes gives the same state as single solves."""
    fast, slow = _pass_loop(fixture), _pass_loop(fixture)
    if _is_refused(fixture, "pass_loop", lambda: fixture.model.pass_loop(fast)):
        return
    solves = fixture.model.pass_loop(fast)
    _run_single_solves(fixture, slow)
    require(0 < solves <= _PASSES, f"pass_loop returns {solves} full solves in {_PASSES} passes")
    for name in ("cylinder_depth", "roller_depth", "line_load", "approach", "energy", "terms"):
        agree(
            f"{name} after {_PASSES} passes of the loop, compared with single solves,",
            getattr(fast, name),
            getattr(slow, name),
            1e-5,
        )
