"""How any contact model behaves: the same bits twice, clean errors, batches as single contacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np

from wearsim.contact_batch import BatchSolution, OperatingPoints
from wearsim.errors import ContactError
from wearsim.testing.checks import Checks, PromiseBroken, agree, require
from wearsim.testing.contact_bench import NUMBERS, STRIPS, ContactBench
from wearsim.types import ContactSolution, Creepage, FloatArray, Grid

MANNERS: Checks[ContactBench] = Checks()
_SOLVE = "wearsim.plugins.ContactModel.solve"
_BATCH = "wearsim.plugins.ContactModel.solve_batch"


def differing(one: ContactSolution, other: ContactSolution) -> list[str]:
    """Return the names of what differs between two solutions, to the bit."""
    pairs = zip(asdict(one).items(), asdict(other).values(), strict=True)
    return [name for (name, a), b in pairs if not np.array_equal(a, b)]


@MANNERS.promised_in(_SOLVE)
def same_bits_twice(bench: ContactBench) -> None:
    """The same question has the same bits for an answer, from this model or a new one."""
    point = bench.point(Creepage(3e-4, 4e-4, 0.3))
    model = bench.fresh()
    first = model.solve(bench.gap, bench.case.curvature, point)
    kept = ContactSolution(**asdict(first))
    for gap in bench.gaps.values():  # whatever it is asked in between
        model.solve(gap, bench.case.curvature, bench.point())
    changed = differing(first, kept)
    require(not changed, f"later calls changed an earlier answer's {', '.join(changed)}")
    again = model.solve(bench.gap, bench.case.curvature, point)
    changed = differing(first, again)
    require(not changed, f"asked again, the same model answers with another {', '.join(changed)}")
    anew = bench.fresh().solve(bench.gap, bench.case.curvature, point)
    changed = differing(first, anew)
    require(not changed, f"a new model answers with another {', '.join(changed)}")


@MANNERS.promised_in(_SOLVE)
def inputs_are_left_as_they_were(bench: ContactBench) -> None:
    """No array that is given to `solve` is changed."""
    strips, able = bench.grid.strips, bench.capabilities
    given: dict[str, FloatArray] = {"gap": bench.gap.copy()}
    point = bench.point()
    if able.creepage_variation:
        given["creepage.variation"] = 1e-4 * np.sign(bench.grid.y)
        point = replace(point, creepage=Creepage(1e-3, variation=given["creepage.variation"]))
    if able.local_friction:
        given["friction"] = np.full(strips, bench.case.friction)
        point = replace(point, friction=given["friction"])
    compliance = None
    if able.wear_compliance:
        compliance = given["wear_compliance"] = np.full(strips, 1e-13)
    warm = bench.solve(bench.point(normal_force=0.9 * bench.case.normal_force))
    given |= {f"warm.{name}": getattr(warm, name) for name in STRIPS}
    before = {name: values.copy() for name, values in given.items()}
    bench.solve(point, given["gap"], compliance, warm)
    changed = [name for name, values in given.items() if not np.array_equal(values, before[name])]
    require(not changed, f"solve changed what it was given: {', '.join(changed)}")


@MANNERS.promised_in(_SOLVE)
def warm_start_changes_nothing(bench: ContactBench) -> None:
    """A start near or far leads to the same answer."""
    load = bench.case.normal_force
    starts = {
        "nearby": bench.solve(bench.point(normal_force=1.1 * load)),
        "far away": bench.solve(bench.point(normal_force=0.2 * load), bench.gaps["off centre"]),
        "where it ends": bench.solution,
    }
    for what, start in starts.items():
        found = bench.solve(warm=start)
        agree(f"the line load from a start {what}", found.line_load, bench.solution.line_load, 1e-5)
        agree(f"the approach from a start {what}", found.approach, bench.solution.approach, 1e-6)
        agree(f"the power from a start {what}", found.power, bench.solution.power, 1e-5)


def _refused(what: str, solve: Callable[[], ContactSolution]) -> ContactError:
    """Return the ContactError that `solve` raises; raises PromiseBroken where it answers."""
    try:
        found = solve()
    except ContactError as error:
        require(bool(str(error).strip()), f"{what}: the ContactError says nothing")
        return error
    except Exception as error:
        told = f"{what}: {type(error).__name__} ({error}) where a ContactError is due"
        raise PromiseBroken(told) from error
    raise PromiseBroken(
        f"{what}: an answer with a power of {found.power:.4g} W where a ContactError is due"
    )


@MANNERS.promised_in(_SOLVE)
def impossible_input_is_a_clean_error(bench: ContactBench) -> None:
    """A load, gap, creepage or friction that has no answer is a ContactError, never NaN."""
    for load in (0.0, -bench.case.normal_force, np.nan, np.inf):
        _refused(
            f"a load of {load:g} N",
            lambda load=load: bench.solve(bench.point(normal_force=load)),  # type: ignore[misc]
        )
    for point in (bench.point(Creepage(np.nan)), bench.point(friction=np.nan)):
        told = f"creepage {point.creepage.longitudinal:g} and friction {point.friction:g}"
        _refused(told, lambda point=point: bench.solve(point))  # type: ignore[misc]
    for value in (np.nan, np.inf, -np.inf):
        for where in (bench.grid.strips // 2, 0):
            gap = bench.gap.copy()
            gap[where] = value
            _refused(f"a gap of {value:g} m in strip {where}", lambda gap=gap: bench.solve(gap=gap))  # type: ignore[misc]


@MANNERS.promised_in(_SOLVE)
def contact_beyond_the_strips_is_a_clean_error(bench: ContactBench) -> None:
    """A contact wider than its strips is a ContactError, not a contact cut short."""
    reach = float(np.abs(bench.grid.y[bench.solution.line_load > 0.0]).max())
    grid = Grid.spanning(-0.5 * reach, 0.5 * reach, bench.grid.strips)
    model, case = bench.fresh(grid), bench.case
    _refused(
        f"strips that span {1e3 * reach:.3g} mm of a contact twice as wide",
        lambda: model.solve(case.gap(grid), case.curvature, bench.point()),
    )


def _columns(bench: ContactBench) -> OperatingPoints:
    loads = bench.case.normal_force * np.array([0.8, 0.9, 1.0, 1.1])
    same = np.ones_like(loads)
    return OperatingPoints(
        normal_force=loads,
        longitudinal=5e-4 * same,
        lateral=np.array([0.0, 1e-4, 2e-4, 3e-4]),
        spin=0.05 * same,
        friction=bench.case.friction * same,
        rolling_speed=bench.case.rolling_speed,
    )


@MANNERS.promised_in(_BATCH)
def many_contacts_are_solved_as_each_alone(bench: ContactBench) -> None:
    """A batch holds what single solves give, for points in columns or in a list."""
    points, curvature, strips = _columns(bench), bench.case.curvature, bench.grid.strips
    gaps = np.array([bench.gaps["fresh"], bench.gaps["worn"]]).reshape(1, 2, 1, strips)
    gaps = np.broadcast_to(gaps, (1, 2, 2, strips))  # the second axis from last has stride 0
    alone = [bench.solve(points[k], gaps[0, k // 2, k % 2].copy()) for k in range(4)]
    for how, asked in (("columns", points), ("a list", list(points))):
        batch = bench.model.solve_batch(gaps, curvature, asked)
        require(isinstance(batch, BatchSolution), f"solve_batch returns {type(batch).__name__}")
        require(batch.shape == (1, 2, 2), f"the batch has the shape {batch.shape}, not (1, 2, 2)")
        for k, (found, single) in enumerate(zip(batch.solutions, alone, strict=True)):
            for name in (*STRIPS, *NUMBERS):
                told = f"{name} of contact {k} in a batch given as {how}"
                size = bench.case.friction * bench.case.normal_force * bench.case.width
                least = 1e-6 * size if name in {"spin_moment", "force_y"} else 0.0
                agree(told, getattr(found, name), getattr(single, name), 1e-9, least)


@MANNERS.promised_in(_BATCH)
def batch_names_the_contact_that_fails(bench: ContactBench) -> None:
    """The error of a batch says which contact it befell, in its text and in its state."""
    points = _columns(bench)
    loads = points.normal_force.copy()
    loads[2] = -1.0
    points = replace(points, normal_force=loads)
    gaps = np.broadcast_to(bench.gap, (1, 1, 4, bench.grid.strips))
    error = _refused(
        "a batch whose third load is -1 N",
        lambda: bench.model.solve_batch(gaps, bench.case.curvature, points).solutions[0],
    )
    told = f"the error of a batch names no contact: {error}"
    require(error.state.get("contact") == [0, 0, 2], told)
    require("realisation 2" in str(error), told)


@MANNERS.promised_in("wearsim.plugins.ContactModel.suggest_grid")
def suggested_strips_hold_the_contact(bench: ContactBench) -> None:
    """The strips that a model suggests are even and hold the contact."""
    case = bench.case
    grid = bench.model.suggest_grid(
        1.0 / case.crown_radius, case.curvature, case.normal_force, case.materials
    )
    if grid is None:
        return
    even = np.full(grid.strips - 1, grid.spacing)
    agree("the spacing of the suggested strips", np.diff(grid.y), even, 1e-9)
    found = bench.fresh(grid).solve(case.gap(grid), case.curvature, bench.point())
    carried = float(found.line_load.sum()) * grid.spacing
    agree("load of the suggested strips", carried, case.normal_force, case.tolerance)
