"""Reproducibility, errors and batches of contact models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np

from wearsim.contact_batch import ContactBatch, ContactBatchSolution
from wearsim.errors import ContactError
from wearsim.testing.checks import Checks, ConformanceError, agree, require
from wearsim.testing.contact_fixtures import NUMBERS, STRIPS, ContactFixture
from wearsim.types import ContactSolution, Creepage, FloatArray, Grid

BEHAVIOUR: Checks[ContactFixture] = Checks()
_SOLVE = "wearsim.plugins.ContactModel.solve"


def _require_identical(one: ContactSolution, other: ContactSolution, message: str) -> None:
    """Raise ConformanceError with the names of the fields that are not equal bit for bit."""
    pairs = zip(asdict(one).items(), asdict(other).values(), strict=True)
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
    repeated = model.solve_one(fixture.gap, curvature, point)
    _require_identical(first, repeated, "a second solve by the same model differs in")
    repeated = fixture.fresh().solve_one(fixture.gap, curvature, point)
    _require_identical(first, repeated, "the solution of a new model differs in")


@BEHAVIOUR.specified_in(_SOLVE)
def inputs_unchanged(fixture: ContactFixture) -> None:
    """`solve` changes none of its input arrays."""
    strips, capabilities = fixture.grid.strips, fixture.capabilities
    inputs: dict[str, FloatArray] = {"gap": fixture.gap.copy()}
    point = fixture.point()
    if capabilities.creepage_variation:
        inputs["creepage.variation"] = 1e-4 * np.sign(fixture.grid.y)
        point = replace(point, creepage=Creepage(1e-3, variation=inputs["creepage.variation"]))
    if capabilities.local_friction:
        inputs["friction"] = np.full(strips, fixture.case.friction)
        point = replace(point, friction=inputs["friction"])
    compliance = None
    if capabilities.wear_compliance:
        compliance = inputs["wear_compliance"] = np.full(strips, 1e-13)
    warm = fixture.solve(fixture.point(normal_force=0.9 * fixture.case.normal_force))
    inputs |= {f"warm.{name}": getattr(warm, name) for name in STRIPS}
    before = {name: values.copy() for name, values in inputs.items()}
    fixture.solve(point, inputs["gap"], compliance, warm)
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
    for load in (0.0, -fixture.case.normal_force, np.nan, np.inf):
        _require_contact_error(
            f"a load of {load:g} N",
            lambda load=load: fixture.solve(fixture.point(normal_force=load)),  # type: ignore[misc]
        )
    for point in (fixture.point(Creepage(np.nan)), fixture.point(friction=np.nan)):
        _require_contact_error(
            f"creepage {point.creepage.longitudinal:g} and friction {point.friction:g}",
            lambda point=point: fixture.solve(point),  # type: ignore[misc]
        )
    for value in (np.nan, np.inf, -np.inf):
        for strip in (fixture.grid.strips // 2, 0):
            gap = fixture.gap.copy()
            gap[strip] = value
            _require_contact_error(
                f"a gap of {value:g} m in strip {strip}",
                lambda gap=gap: fixture.solve(gap=gap),  # type: ignore[misc]
            )


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


@BEHAVIOUR.specified_in("wearsim.plugins.ContactModelSpec")
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
