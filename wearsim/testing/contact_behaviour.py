"""Balances, reproducibility, errors and batches of contact models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import ContactError
from wearsim.testing.checks import Checks, ConformanceError, agree, require, require_values
from wearsim.testing.contact_fixtures import NUMBERS, STRIPS, ContactFixture
from wearsim.types import ContactSolution, Creepage, FloatArray, Grid

BEHAVIOUR: Checks[ContactFixture] = Checks()
_SOLUTION = "wearsim.types.ContactSolution"
_MODEL = "wearsim.plugins.ContactModel"
_SATURATION_ERROR = 0.02  # relative deviation from mu N allowed in gross sliding
_SOLVE = "wearsim.plugins.ContactModel.solve"


def _gross_sliding(fixture: ContactFixture) -> ContactSolution:
    return fixture.solve(fixture.point(Creepage(0.1)))


@BEHAVIOUR.specified_in(_SOLUTION)
def solution_is_complete_and_finite(fixture: ContactFixture) -> None:
    """Every field of a solution has the right shape and is finite, on the given strips."""
    for case, (_, solution) in fixture.solutions.items():
        for name in STRIPS:
            require_values(f"{case}: {name}", getattr(solution, name), fixture.grid.y.shape)
        for name in NUMBERS:
            require_values(f"{case}: {name}", getattr(solution, name), ())
        agree(f"{case}: y", solution.y, fixture.grid.y, 0.0)


@BEHAVIOUR.specified_in(_SOLUTION)
def strips_carry_the_load(fixture: ContactFixture) -> None:
    """The line loads add up to the normal force."""
    for case, (point, solution) in fixture.solutions.items():
        carried = float(solution.line_load.sum()) * fixture.grid.spacing
        agree(f"{case}: load of the strips", carried, point.normal_force, fixture.case.tolerance)


@BEHAVIOUR.specified_in(_SOLUTION)
def zero_outside_the_contact(fixture: ContactFixture) -> None:
    """Half-length, line load and dissipation are never negative, zero where nothing overlaps."""
    for case, (_, solution) in fixture.solutions.items():
        outside = solution.half_length <= 0.0
        require(outside[[0, -1]].all(), f"{case}: the first or last strip is in contact")
        for name in STRIPS:
            values = getattr(solution, name)
            require(float(values.min()) >= 0.0, f"{case}: {name} falls to {values.min():.3g}")
            largest = float(np.abs(values[outside]).max())
            require(largest == 0.0, f"{case}: {name} is {largest:.3g} where half_length is 0")
        require(
            (solution.line_load[~outside] > 0.0).all(),
            f"{case}: a strip with a positive half_length carries no load",
        )
        fixture.require_overlap(case, solution)


@BEHAVIOUR.specified_in(_SOLUTION)
def power_equals_strip_sum(fixture: ContactFixture) -> None:
    """The power is the sum of the dissipation over the strips."""
    for case, (_, solution) in fixture.solutions.items():
        total = float(solution.dissipation.sum()) * fixture.grid.spacing
        agree(f"{case}: power", solution.power, total, fixture.case.tolerance)


@BEHAVIOUR.specified_in(_MODEL)
def power_equals_rigid_slip_work(fixture: ContactFixture) -> None:
    """P = -V (xi F_x + eta F_y + phi M_z) for all creepages."""
    for case, (point, solution) in fixture.solutions.items():
        parts = point.rolling_speed * np.array(
            [
                solution.longitudinal_creepage * solution.force_x,
                point.creepage.lateral * solution.force_y,
                point.creepage.spin * solution.spin_moment,
            ]
        )
        agree(
            f"{case}: power, compared with -V (xi F_x + eta F_y + phi M_z),",
            solution.power,
            -float(parts.sum()),
            fixture.case.tolerance,
            float(np.abs(parts).sum()),
        )


@BEHAVIOUR.specified_in("wearsim.types.Creepage")
def mean_creepage_is_preserved(fixture: ContactFixture) -> None:
    """Without a bearing torque the mean longitudinal creepage equals the prescribed one."""
    for case, (point, solution) in fixture.solutions.items():
        agree(
            f"{case}: longitudinal_creepage",
            solution.longitudinal_creepage,
            point.creepage.longitudinal,
            1e-12,
        )


@BEHAVIOUR.specified_in("wearsim.types.OperatingPoint")
def force_within_coulomb_bound(fixture: ContactFixture) -> None:
    """The tangential force never exceeds mu N, and reaches it in gross sliding."""
    bound = fixture.case.friction * fixture.case.normal_force
    for case, (_, solution) in fixture.solutions.items():
        force = float(np.hypot(solution.force_x, solution.force_y))
        # models that integrate over points bound the traction at each point, not the sum
        require(
            force <= bound * (1.0 + 1e-3),
            f"{case}: the tangential force is {force:.6g} N, above mu N = {bound:.6g} N",
        )
    force_x = _gross_sliding(fixture).force_x
    agree("the force at a creepage of 0.1", force_x, -bound, _SATURATION_ERROR)


@BEHAVIOUR.specified_in(_SOLUTION)
def no_adhesion_in_gross_sliding(fixture: ContactFixture) -> None:
    """The adhesion fraction is between 0 and 1, and zero in gross sliding."""
    for case, (_, solution) in fixture.solutions.items():
        fraction = solution.adhesion_fraction
        require(0.0 <= fraction <= 1.0, f"{case}: adhesion_fraction is {fraction:.3g}")
    # Carter: a strip at (1 - s) of its full friction adheres over sqrt(s) of its length
    fraction, limit = _gross_sliding(fixture).adhesion_fraction, _SATURATION_ERROR**0.5
    require(
        fraction <= limit,
        f"adhesion_fraction at a creepage of 0.1 is {fraction:.3g}, and {limit:.2g} is allowed",
    )


@BEHAVIOUR.specified_in(_SOLUTION)
def peak_pressure_exceeds_strip_means(fixture: ContactFixture) -> None:
    """The peak pressure is at least the mean pressure q/(2 a) of every strip."""
    for case, (_, solution) in fixture.solutions.items():
        inside = solution.half_length > 0.0
        mean = float((solution.line_load[inside] / (2.0 * solution.half_length[inside])).max())
        require(
            solution.peak_pressure >= mean * (1.0 - fixture.case.tolerance),
            f"{case}: peak_pressure is {solution.peak_pressure:.6g} Pa, the mean of a strip"
            f" {mean:.6g} Pa",
        )


@BEHAVIOUR.specified_in(_MODEL)
def no_power_without_creepage(fixture: ContactFixture) -> None:
    """Bodies that roll without creepage exchange no tangential force and dissipate no power."""
    solution = fixture.solve(fixture.point(Creepage(0.0)))
    force = fixture.case.friction * fixture.case.normal_force
    # the power of the whole load sliding at the base creepage
    scale = force * fixture.case.rolling_speed * 1e-3
    for name, size in (("power", scale), ("force_x", force), ("force_y", force)):
        agree(f"{name} without creepage", getattr(solution, name), 0.0, 1e-9, size)


@BEHAVIOUR.specified_in(_MODEL)
def mirror_symmetry(fixture: ContactFixture) -> None:
    """With gap, lateral creepage and spin mirrored in y, the solution is mirrored."""
    tolerance = fixture.case.tolerance
    point = fixture.point(Creepage(3e-4, 4e-4, 0.3))
    mirrored_point = replace(point, creepage=Creepage(3e-4, -4e-4, -0.3))
    for case, gap in fixture.gaps.items():
        solution = fixture.solve(point, gap)
        image = fixture.solve(mirrored_point, gap[::-1].copy())
        for name in STRIPS:
            mirrored = getattr(image, name)[::-1]
            agree(f"{case}: mirrored {name}", mirrored, getattr(solution, name), tolerance)
        for name, sign in (("force_x", 1.0), ("force_y", -1.0), ("spin_moment", -1.0)):
            arm = fixture.case.width if name == "spin_moment" else 1.0
            agree(
                f"{case}: mirrored {name}",
                getattr(image, name),
                sign * getattr(solution, name),
                tolerance,
                fixture.case.friction * fixture.case.normal_force * arm,
            )


@BEHAVIOUR.specified_in("wearsim.plugins.ContactModel.solve")
def gap_offset_shifts_approach(fixture: ContactFixture) -> None:
    """A constant added to the gap is added to the approach and changes nothing else."""
    base = fixture.solution
    for fraction in (0.25, -2.0):
        shift = fraction * float(np.ptp(fixture.gap))
        solution = fixture.solve(gap=fixture.gap + shift)
        when = f"after {shift:.3g} m was added to the gap"
        agree(f"the approach {when}", solution.approach, base.approach + shift, 1e-6)
        agree(f"the line load {when}", solution.line_load, base.line_load, 1e-5)
    require(
        base.approach > float(fixture.gap.min()),
        "the approach does not exceed the smallest gap: the bodies do not overlap",
    )


@BEHAVIOUR.specified_in(_SOLUTION)
def approach_rises_with_load(fixture: ContactFixture) -> None:
    """The approach rises with the load, and the peak pressure does not fall."""
    loads = fixture.case.normal_force * np.array([0.5, 0.75, 1.0, 1.25])
    solutions = [fixture.solve(fixture.point(normal_force=float(load))) for load in loads]
    for name, smallest in (("approach", 1e-12), ("peak_pressure", -1e-9)):
        values = np.array([getattr(solution, name) for solution in solutions])
        require(
            (np.diff(values) > smallest * np.abs(values[1:])).all(),
            f"{name} at loads of {loads} N is {values}",
        )


@BEHAVIOUR.specified_in("wearsim.types.Grid")
def convergence_with_strips(fixture: ContactFixture) -> None:
    """Doubling the number of strips twice changes the result less the second time."""
    case, point = fixture.case, fixture.point(Creepage(3e-4, 4e-4, 0.3))
    solutions = [
        fixture.fresh(grid).solve_one(case.gap(grid), case.curvature, point)
        for grid in map(case.grid, (1, 2, 4))
    ]
    for name in ("approach", "peak_pressure", "power", "force_x", "force_y"):
        coarse, middle, fine = (getattr(solution, name) for solution in solutions)
        first, second, noise = abs(middle - coarse), abs(fine - middle), 2e-3 * abs(fine)
        require(
            second <= 0.75 * first + noise and abs(fine - coarse) <= 0.1 * abs(fine),
            f"{name} is {coarse:.6g}, {middle:.6g} and {fine:.6g} with {case.strips},"
            f" {2 * case.strips} and {4 * case.strips} strips: it does not converge",
        )


def _require_identical(first: ContactSolution, other: ContactSolution, message: str) -> None:
    """Raise ConformanceError with the names of the fields that are not equal bit for bit."""
    pairs = zip(asdict(first).items(), asdict(other).values(), strict=True)
    changed = [name for (name, a), b in pairs if not np.array_equal(a, b)]
    require(not changed, f"{message} {', '.join(changed)}")


@BEHAVIOUR.specified_in(_SOLVE)
def repeated_solves_identical(fixture: ContactFixture) -> None:
    """The same contact has the same solution bit for bit, by the same model or a new one."""
    point, curvature = fixture.point(Creepage(3e-4, 4e-4, 0.3)), fixture.case.curvature
    model = fixture.fresh()
    first = model.solve_one(fixture.gap, curvature, point)
    copy = ContactSolution(**asdict(first))
    for gap in fixture.gaps.values():  # other solves in between
        model.solve_one(gap, curvature, fixture.point())
    _require_identical(first, copy, "later calls change these fields of an earlier solution:")
    for solver, message in (
        (model, "a second solve by the same model differs in"),
        (fixture.fresh(), "the solution of a new model differs in"),
    ):
        _require_identical(first, solver.solve_one(fixture.gap, curvature, point), message)


@BEHAVIOUR.specified_in(_SOLVE)
def inputs_unchanged(fixture: ContactFixture) -> None:
    """`solve` changes none of its input arrays."""
    strips, capabilities = fixture.grid.strips, fixture.model.capabilities
    # no value of the gap is special: a model may subtract its minimum in place
    inputs: dict[str, FloatArray] = {"gap": fixture.gap + 0.25 * np.ptp(fixture.gap)}
    point = fixture.point()
    if capabilities.creepage_variation:
        inputs["creepage.variation"] = 1e-4 * np.sign(fixture.grid.y)
        point = replace(point, creepage=Creepage(1e-3, variation=inputs["creepage.variation"]))
    if capabilities.local_friction:
        inputs["friction"] = np.full(strips, fixture.case.friction)
        point = replace(point, friction=inputs["friction"])
    if capabilities.wear_compliance:
        inputs["wear_compliance"] = np.full(strips, 1e-13)
    warm = fixture.solve(fixture.point(normal_force=0.9 * fixture.case.normal_force))
    inputs |= {f"warm.{name}": getattr(warm, name) for name in STRIPS}
    before = {name: values.copy() for name, values in inputs.items()}
    fixture.solve(point, inputs["gap"], inputs.get("wear_compliance"), warm)
    changed = [name for name, values in inputs.items() if not np.array_equal(values, before[name])]
    require(not changed, f"solve changes its inputs {', '.join(changed)}")


@BEHAVIOUR.specified_in(_SOLVE)
def result_independent_of_warm_start(fixture: ContactFixture) -> None:
    """Near and distant starting points lead to the same solution."""
    load, expected = fixture.case.normal_force, fixture.solution
    starts = {
        "nearby": fixture.solve(fixture.point(normal_force=1.1 * load)),
        "far away": fixture.solve(
            fixture.point(normal_force=0.2 * load), fixture.gaps["off centre"]
        ),
        "at the solution": expected,
    }
    for where, start in starts.items():
        solution = fixture.solve(warm=start)
        for name, tolerance in (("line_load", 1e-5), ("approach", 1e-6), ("power", 1e-5)):
            got = getattr(solution, name)
            agree(f"{name} with a warm start {where}", got, getattr(expected, name), tolerance)


def _require_contact_error(case: str, solve: Callable[[], ContactSolution]) -> ContactError:
    """Return the ContactError that `solve` raises."""
    try:
        solution = solve()
    except ContactError as error:
        require(str(error).strip(), f"{case}: the message of the ContactError is empty")
        return error
    except Exception as error:
        raise ConformanceError(
            f"{case}: {type(error).__name__} ({error}) where a ContactError is required"
        ) from error
    raise ConformanceError(
        f"{case}: a solution with a power of {solution.power:.4g} W where a ContactError is"
        " required"
    )


@BEHAVIOUR.specified_in(_SOLVE)
def invalid_input_raises_contact_error(fixture: ContactFixture) -> None:
    """A load, gap, creepage or friction without a solution raises a ContactError, never NaN."""
    strips = np.arange(fixture.grid.strips)
    cases = [
        *(
            (f"a load of {load:g} N", fixture.point(normal_force=load), fixture.gap)
            for load in (0.0, -fixture.case.normal_force, np.nan, np.inf)
        ),
        *(
            (f"creepage {at.creepage.longitudinal:g} and friction {at.friction:g}", at, fixture.gap)
            for at in (fixture.point(Creepage(np.nan)), fixture.point(friction=np.nan))
        ),
        *(
            (
                f"a gap of {value:g} m in strip {strip}",
                fixture.point(),
                np.where(strips == strip, value, fixture.gap),
            )
            for value in (np.nan, np.inf, -np.inf)
            for strip in (len(strips) // 2, 0)
        ),
    ]
    for case, point, gap in cases:
        _require_contact_error(case, partial(fixture.solve, point, gap))


@BEHAVIOUR.specified_in(_SOLVE)
def contact_wider_than_strips_raises(fixture: ContactFixture) -> None:
    """A contact wider than its strips raises a ContactError; it is not truncated."""
    half = float(np.abs(fixture.grid.y[fixture.solution.line_load > 0.0]).max())
    grid = Grid.spanning(-0.5 * half, 0.5 * half, fixture.grid.strips)
    model, case = fixture.fresh(grid), fixture.case
    _require_contact_error(
        f"strips over {1e3 * half:.3g} mm of a contact twice as wide",
        lambda: model.solve_one(case.gap(grid), case.curvature, fixture.point()),
    )


def _contacts(fixture: ContactFixture, loads: FloatArray) -> ContactBatch:
    """Return contacts of these loads that differ in gap, curvature, velocity and creepage."""
    points = [
        fixture.point(Creepage(5e-4, 1e-4 * k, 0.05), normal_force=float(load))
        for k, load in enumerate(loads)
    ]
    gaps = fixture.gaps["fresh"], fixture.gaps["worn"]
    factor: FloatArray = np.linspace(1.0, 1.3, len(loads))
    return replace(
        fixture.batch(points, [gaps[k % 2] for k in range(len(loads))]),
        longitudinal_curvature=fixture.case.curvature * factor,
        rolling_speed=fixture.case.rolling_speed / factor,
    )


@BEHAVIOUR.specified_in(_SOLVE)
def batch_equals_single_solves(fixture: ContactFixture) -> None:
    """A batch of contacts of different curvature and velocity equals single solves."""
    case = fixture.case
    batch = _contacts(fixture, case.normal_force * np.array([0.8, 0.9, 1.0, 1.1]))
    solutions = fixture.model.solve(batch)
    require(
        isinstance(solutions, ContactBatchSolution), f"solve returns {type(solutions).__name__}"
    )
    require(len(solutions) == len(batch), f"solve returns {len(solutions)} of 4 solutions")
    size = case.friction * case.normal_force * case.width
    for k, solution in enumerate(solutions):
        single = fixture.model.solve_one(
            batch.gap[k], float(batch.longitudinal_curvature[k]), batch.point(k)
        )
        for name in (*STRIPS, *NUMBERS):
            agree(
                f"{name} of contact {k} in a batch",
                getattr(solution, name),
                getattr(single, name),
                1e-9,
                1e-6 * size if name in {"spin_moment", "force_y"} else 0.0,
            )


@BEHAVIOUR.specified_in(_SOLVE)
def batch_error_names_contact(fixture: ContactFixture) -> None:
    """The error of a batch names the failed contact, in its message and in its state."""
    batch = _contacts(fixture, fixture.case.normal_force * np.array([1.0, 1.0, -1.0]))
    error = _require_contact_error(
        "a batch whose third load is negative", lambda: fixture.model.solve(batch)[0]
    )
    require(
        error.state.get("contact") == [2] and "contact 2" in str(error),
        f"the error of a batch names no contact: {error}",
    )
