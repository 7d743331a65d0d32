"""Strips that grow with the groove during a test.

A test begins on strips that resolve the contact of the unworn bodies. Before a step that starts
close to the outer strips, strips of the same width are added on both sides. Where that would be
more than a greatest number, every three strips are joined to one first: their wear is averaged, so
that the worn volume is kept, and the groove is then resolved as well as the fresh contact was.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from wearsim.evolution.contacts import computed_once
from wearsim.evolution.error_estimates import half_quadrature
from wearsim.evolution.problem import WearProblem
from wearsim.evolution.state import WearState
from wearsim.evolution.steppers.single_step import carried_loads, solve_present
from wearsim.plugins import ContactModel
from wearsim.types import FloatArray, Grid

FREE = 0.075  # part of all strips that is without load on each side, at least
WIDER = 1.5  # width after growing over that before
JOINED = 3  # strips joined to one; an odd number keeps symmetric strips symmetric
LEAST_LOADED = 24  # least number of strips of each contact after joining, as of a fresh contact
MOST_OF_ALL = 1601  # number of strips above which they are joined even if a contact has fewer
LEAST_FILLED = 0.25  # part of all strips that contacts take up where a step may need wider strips
_ALIGNED = 1e-9  # part of a strip by which edges that coincide may differ


class Surfaces(NamedTuple):
    """Surfaces of the unworn bodies of one realisation on strips.

    Parameters
    ----------
    gap : ndarray, shape (stations or 1, rollers, 1, strips)
        Gap of rollers without tilt before wear [m].
    from_apex : ndarray, shape (rollers, 1, strips)
        Distance from their apexes [m].
    roller_drop, slip_profile : ndarray, optional
        As in `WearProblem`.
    """

    gap: FloatArray
    from_apex: FloatArray
    roller_drop: FloatArray | None
    slip_profile: FloatArray | None


@dataclass(frozen=True, eq=False)
class Growth:
    """Construction of the problem of one realisation on other strips, and how its strips grow.

    Parameters
    ----------
    model : callable
        Returns the contact model for strips.
    surfaces : callable
        Returns the surfaces on strips, at the angles of the stations of a cam.
    coarse : callable
        Returns strips of about twice the width over the same range.
    most : int
        Number of strips above which strips are joined; 0 where the strips do not grow.
    margin : float
        Least distance of a contact from the outer edges at the start of a step, where its load and
        position vary in time [m].
    last : Grid, optional
        Strips over the whole width of rollers that have ends, which grow no further.
    least_loaded : int
        Strips of each contact after joining, at least.
    by_angle : bool
        Whether the surfaces differ along the angle of a cam before wear.
    """

    model: Callable[[Grid], ContactModel]
    surfaces: Callable[[Grid, FloatArray | None], Surfaces]
    coarse: Callable[[Grid], Grid]
    most: int
    margin: float = 0.0
    last: Grid | None = None
    least_loaded: int = LEAST_LOADED
    by_angle: bool = False


def free_strips(problem: WearProblem) -> list[int]:
    """Return the strips without load on each side below which strips grow; 0 where they do not."""
    strips, spacing = problem.grid.strips, problem.grid.spacing
    least = max(3, math.ceil(FREE * strips))
    return [
        min(max(least, math.ceil(growth.margin / spacing)), strips) if growth.most else 0
        for growth in problem.growth
    ] or [0] * problem.shape[2]


def next_grids(
    problem: WearProblem, state: WearState, outgrown: Collection[int]
) -> dict[int, Grid]:
    """Return the wider strips of the realisations that need them, by place.

    Strips grow if a contact is loaded close to the outer strips. They also grow for the
    realisations at the places `outgrown`, whose contacts reach these in a step from the state.
    """
    free, load = computed_once(free_strips, problem), state.contacts.line_load
    widest = max(free)
    if not widest:
        return {}
    outer = load[:, :widest] + load[:, -widest:]
    if not (outgrown or outer.nonzero()[0].size):  # any() takes ten times as long on short arrays
        return {}
    loaded = (load > 0.0).reshape(-1, state.passes.size, problem.grid.strips)
    counts = loaded.sum(axis=2).min(axis=0).tolist()
    wider = {
        v: _next(problem.grid, growth, count)
        for v, (growth, width, count) in enumerate(zip(problem.growth, free, counts, strict=True))
        if width and (v in outgrown or loaded[:, v, :width].any() or loaded[:, v, -width:].any())
    }
    return {v: grid for v, grid in wider.items() if grid is not None}


def fill_strips(state: WearState, place: int) -> bool:
    """Return whether the contacts of a realisation take up more than a small part of the strips."""
    loaded = (state.contacts.line_load > 0.0).reshape(-1, state.passes.size, state.contacts.y.size)
    places = np.flatnonzero(loaded[:, place].any(axis=0))
    return bool(places.size and np.ptp(places) >= LEAST_FILLED * state.contacts.y.size)


def _next(grid: Grid, growth: Growth, loaded: int) -> Grid | None:
    """Return the next wider strips, or None after the last; `loaded` strips carry each contact."""
    last = growth.last
    if last is not None and same_strips(grid, last):
        return None
    strips, spacing = grid.strips, grid.spacing
    wide = math.ceil(WIDER * strips)
    resolved = loaded >= JOINED * growth.least_loaded
    if wide > growth.most and (resolved or wide > MOST_OF_ALL):
        wide, spacing = math.ceil(wide / JOINED), JOINED * spacing
    wide += (wide - strips) % 2  # a strip or an edge stays in the middle
    middle = 0.5 * (grid.edges[0] + grid.edges[1])
    wider = Grid.spanning(middle - 0.5 * wide * spacing, middle + 0.5 * wide * spacing, wide)
    ends = last is not None and (wider.edges[0] < last.edges[0] or wider.edges[1] > last.edges[1])
    return last if ends else wider


def same_strips(one: Grid, other: Grid) -> bool:
    """Return whether two grids have the same strips, apart from round-off."""
    near = _ALIGNED * one.spacing
    return one.strips == other.strips and bool(np.abs(one.y - other.y).max() <= near)


def identical_strips(one: Grid, other: Grid) -> bool:
    """Return whether two grids have the same strips to the last bit."""
    return one.spacing == other.spacing and np.array_equal(one.y, other.y)


def on_grid(problem: WearProblem, grid: Grid) -> WearProblem:
    """Return a problem on other strips."""
    return with_surfaces(replace(problem, grid=grid, model=problem.growth[0].model(grid)))


def with_surfaces(problem: WearProblem) -> WearProblem:
    """Return a problem with the surfaces of the unworn bodies on its strips, at its stations."""
    grid, angles = problem.grid, problem.kinematics.track.angles
    parts = [growth.surfaces(grid, angles) for growth in problem.growth]
    gap = np.concatenate([part.gap for part in parts], axis=2)
    stations, shared = 1 if angles is None else len(angles), problem.from_apex.shape[1] == 1

    def joined(name: str, axis: int) -> FloatArray | None:
        arrays = [getattr(part, name) for part in parts]
        return arrays[0] if shared or arrays[0] is None else np.concatenate(arrays, axis=axis)

    return replace(
        problem,
        flat_gap=np.broadcast_to(gap, (stations, *gap.shape[1:])),
        from_apex=np.asarray(joined("from_apex", 1)),
        roller_drop=joined("roller_drop", 1),
        slip_profile=joined("slip_profile", 2),
    )


def coarse_problem(problem: WearProblem) -> WearProblem:
    """Return a problem on strips of twice the width."""
    growth = tuple(
        replace(
            fine,
            most=math.ceil(0.5 * fine.most),
            last=fine.last and fine.coarse(fine.last),
            least_loaded=math.ceil(0.5 * fine.least_loaded),
        )
        for fine in problem.growth
    )
    return replace(on_grid(problem, problem.growth[0].coarse(problem.grid)), growth=growth)


def grown(problem: WearProblem, state: WearState, grid: Grid) -> tuple[WearProblem, WearState]:
    """Return problem and state of some realisations on wider strips."""
    wider = on_grid(problem, grid)
    return wider, state_on_grid(wider, state, problem.grid)


def shares(old: Grid, new: Grid) -> FloatArray:
    """Return the part of each old strip that lies in each new one, shape (new, old strips)."""
    edges = [np.append(grid.y - 0.5 * grid.spacing, grid.edges[1]) for grid in (old, new)]
    low = np.maximum(edges[1][:-1, None], edges[0][None, :-1])
    high = np.minimum(edges[1][1:, None], edges[0][None, 1:])
    part = np.clip((high - low) / old.spacing, 0.0, 1.0)
    nearest = np.round(part)
    return np.asarray(np.where(np.abs(part - nearest) < _ALIGNED, nearest, part))


def averaged(values: FloatArray, old: Grid, new: Grid) -> FloatArray:
    """Return the averages over new strips of values on old ones, last axis; zero outside.

    The integral over the strips is kept where the new ones cover the old ones.
    """
    weights = shares(old, new) * (old.spacing / new.spacing)
    # row by row, so that the round-off does not depend on the number of rows
    return np.array(
        [(weights * row).sum(axis=-1) for row in values.reshape(-1, old.strips)]
    ).reshape(*values.shape[:-1], new.strips)


def state_on_grid(problem: WearProblem, state: WearState, old: Grid) -> WearState:
    """Return a state on the strips of a problem, with the same worn volume of each body.

    Parameters
    ----------
    problem : WearProblem
        On the new strips.
    state : WearState
    old : Grid
        Strips of the state.
    """
    new, contacts = problem.grid, state.contacts
    arrays = {
        name: averaged(values, old, new)
        for name in (
            *("past_wear", "stepping_error", "wear_exponents", "cylinder_depth", "roller_depth"),
            "damage",
        )
        if (values := getattr(state, name)) is not None
    }
    if "wear_exponents" in arrays:  # zero on strips without wear so far
        arrays["wear_exponents"][arrays["wear_exponents"] == 0.0] = 1.0
    if state.loop_strips is not None:  # line loads; without a factorisation the loop begins again
        arrays["loop_strips"] = averaged(state.loop_strips, old, new)
        arrays["loop_strips"][1:] = 0.0
    if state.part is not None:
        arrays |= _edges_on_grid(problem, state, old)
    columns: dict[str, Any] = {
        name: averaged(getattr(contacts, name), old, new)
        for name in ("line_load", "half_length", "dissipation")
    }
    if contacts.separation is not None:  # not known until the contacts are solved
        columns["separation"] = np.full_like(columns["line_load"], np.nan)
    contacts = replace(contacts, y=new.y, **columns)
    halves = "half_quadrature_solution"
    auxiliary = {
        name: state_on_grid(
            half_quadrature(problem, state)[0] if name == halves else problem, solution, old
        )
        for name, solution in state.auxiliary.items()
    }
    state = state.replaced(**arrays, contacts=contacts, **auxiliary)
    if abs(new.spacing / old.spacing - 1.0) < _ALIGNED:
        return state  # the added strips are without load
    solved = solve_present(problem, state, carried_loads(problem, state.contacts))
    return state.replaced(contacts=solved, solves=state.solves + problem.contacts_each)


def _edges_on_grid(problem: WearProblem, state: WearState, old: Grid) -> dict[str, FloatArray]:
    """Return the fields of a state about the edges of contacts on the strips of a problem.

    On added strips the separation of the surfaces is that of the old outer strip plus the increase
    of the gap beyond it, and it decreases at the same rate.
    """
    new, gap, sums = problem.grid, problem.nominal_gap, np.asarray(state.past_sums)
    arrays = {
        name: averaged(values, old, new)
        for name in ("separation", "part", "whole_steps")
        if (values := getattr(state, name)) is not None
    }
    # strips partly in contact are not joined with others whole
    arrays["whole_steps"] = np.where(arrays["part"] < 1.0, 0.0, np.floor(arrays["whole_steps"]))
    sums = np.concatenate([old.spacing / new.spacing * sums[:, :-1], sums[:, -1:]], axis=1)
    if state.separation is None:
        return arrays | {"part": np.ceil(arrays["part"]), "past_sums": sums}
    past = averaged(np.asarray(state.past_wear), old, new)
    cut = ~np.isnan(np.asarray(state.part)[0, 0, :, :1])  # tests that resolve edges
    inside = np.flatnonzero(shares(old, new).sum(axis=1) > 0.0)
    for added, edge in (
        (slice(0, inside[0]), inside[0]),
        (slice(inside[-1] + 1, None), inside[-1]),
    ):
        beyond = gap[..., added] - gap[..., edge : edge + 1]
        arrays["separation"][..., added] = arrays["separation"][..., edge : edge + 1] + beyond
        past[1:, ..., added] = np.where(cut, past[1:, ..., edge : edge + 1], past[1:, ..., added])
    return arrays | {"past_wear": past, "past_sums": sums}
