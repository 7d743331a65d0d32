"""What hard cases are measured by: balances, smoothness, symmetry, and convergence."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby, pairwise

import numpy as np

from wearsim.evolution.observables import centroid, oscillation
from wearsim.results import Result
from wearsim.scenario import Scenario
from wearsim.studies.run.assemble import merged_rollers
from wearsim.studies.run.draws import draw
from wearsim.types import FloatArray

PROFILES = ("cylinder_depth_profile", "roller_depth_profile")
_ENOUGH = 20  # strips in contact, whose parabola has second differences of 2 %
_NOTHING = 1e-12  # relative: round-off


def is_finite(result: Result) -> bool:
    """Return whether every number that a run has kept is finite, and no depth below zero."""
    raw = result.raw
    arrays = [*raw.history.values(), *raw.records.values()]
    worn = all((raw.records[name] >= 0.0).all() for name in PROFILES)
    return worn and all(np.isfinite(array).all() for array in arrays)


def volume_balance(result: Result, scenario: Scenario) -> float | None:
    """Return the greatest |V - (K/H) E| of the cylinder or the rollers, over V at the end.

    Parameters
    ----------
    result : Result
    scenario : Scenario

    Returns
    -------
    float, optional
        None where wear is no multiple of dissipation, 0 where nothing wears.
    """
    history, law = result.raw.history, scenario.wear.build() if scenario.wear else None
    on_rollers = np.einsum("r,srn->sn", result.raw.static["multiplicity"], _roller_volume(result))
    worst = 0.0
    for body, volume in (("cylinder", history["worn_volume"]), ("roller", on_rollers)):
        factor = law.depth_per_dissipation(body, 1.0) if law is not None else None  # type: ignore[arg-type]
        if factor is None:
            return None
        apart = np.abs(volume - factor * history["dissipated_energy"]).max()
        worst = max(worst, _over(float(apart), float(volume[-1].max())))
    return worst


def load_balance(result: Result) -> float:
    """Return the greatest |sum q dy - N|/N where a record falls on the end of a step."""
    raw = result.raw
    at = {passes: row for row, passes in enumerate(raw.history["passes"].tolist())}
    carried = raw.records["line_load"].sum(axis=-1).mean(axis=1) * _spacing(result)
    worst = 0.0
    for passes, loads in zip(raw.records["record_passes"].tolist(), carried, strict=True):
        if passes in at:
            wanted = raw.history["normal_force"][at[passes]]
            worst = max(worst, float((np.abs(loads - wanted) / wanted).max()))
    return worst


def energy_balance(result: Result) -> float:
    """Return |sum of P_l dy times the time since the last record - E|/E of a run.

    It is round-off where the records of a run fall on the ends of its half steps, at a load that
    does not change.
    """
    raw = result.raw
    power = np.einsum("r,ksrny->k", raw.static["multiplicity"], raw.records["dissipation"])
    stations = raw.records["dissipation"].shape[1]
    time = np.diff(raw.records["record_time"])
    energy = float(raw.history["dissipated_energy"][-1, 0])
    found = float(power[1:] @ time) * _spacing(result) / stations
    return _over(abs(found - energy), energy)


def work_balance(result: Result, scenario: Scenario) -> float:
    """Return the greatest |P + V (xi F_x + eta F_y + phi M_z)|/P of the contacts at the end.

    Parameters
    ----------
    result : Result
    scenario : Scenario
        With a creepage that varies over the strips by spin alone.
    """
    held = result.raw.checkpoint
    creepage, speed = scenario.creepage, scenario.rolling_speed
    yaw, tilt = (scenario.per_roller(v) for v in (creepage.yaw, creepage.tilt))
    worst = 0.0
    for number, roller in enumerate(merged_rollers(draw(scenario))[0]):
        spin = tilt[roller] / scenario.roller.radius
        along = float(held["contact_longitudinal_creepage"][number])
        forces = [float(held[f"contact_{n}"][number]) for n in ("force_x", "force_y")]
        moment, power = (float(held[f"contact_{n}"][number]) for n in ("spin_moment", "power"))
        work = -speed * (along * forces[0] + yaw[roller] * forces[1] + spin * moment)
        worst = max(worst, _over(abs(power - work), power))
    return worst


def records_half_steps(result: Result) -> bool:
    """Return whether the records of a run with forced steps fall on the ends of its half steps."""
    raw = result.raw
    apart, steps = np.diff(raw.records["record_passes"]), np.diff(raw.history["passes"])
    return len(apart) == 2 * len(steps) and bool(np.array_equal(apart, np.repeat(0.5 * steps, 2)))


def roughest(result: Result) -> float:
    """Return the greatest `oscillation` of a line load over all records and contacts.

    Contacts of few strips are left out: there the honest curvature of q is large.
    """
    line_load = result.raw.records["line_load"]
    rows = line_load.reshape(-1, line_load.shape[-1])
    return max((oscillation(row) for row in rows if (row > 0.0).sum() >= _ENOUGH), default=0.0)


def drift(result: Result) -> float:
    """Return how far a groove's centre is from y = 0 at most, over the groove's width."""
    y, worn = result.y, result.raw.records["cylinder_depth_profile"][:, 0, 0]
    worst = 0.0
    for row in worn:
        wide = float(np.ptp(y[row > 0.0])) if (row > 0.0).any() else 0.0
        worst = max(worst, _over(abs(centroid(y, row)), wide + _spacing(result)))
    return worst


def patches(result: Result) -> tuple[int, ...]:
    """Return how many patches the first roller's contact has had, one number after another."""
    loaded = result.raw.records["line_load"][:, 0, 0, 0] > 0.0
    edges = np.diff(loaded.astype(int), axis=1, prepend=0)
    counts = (edges == 1).sum(axis=1).tolist()
    return tuple(number for number, _ in groupby(counts))


def asymmetry(result: Result, mirrored: Result) -> float:
    """Return how far a run's last profiles are from those of its mirror image, relative."""
    worst = 0.0
    for name in PROFILES:
        one, other = (item.raw.records[name][-1] for item in (result, mirrored))
        # rollers keep their numbers, only y is turned about
        worst = max(worst, _over(float(np.abs(one - other[..., ::-1]).max()), float(one.max())))
    return worst


def change(coarse: Result, fine: Result) -> float:
    """Return the part of the worn area that lies elsewhere in a finer run's last profile.

    Where one has a multiple of the other's strips, the means over the wider strips are compared;
    of the two bodies, the one that wears more counts.
    """
    name = max(PROFILES, key=lambda name: float(fine.raw.records[name][-1].max()))
    one, other = (item.raw.records[name][-1] for item in (coarse, fine))
    return _apart(one, other.reshape(*one.shape, -1).mean(axis=-1))


def changes(runs: Sequence[Result]) -> list[float]:
    """Return the `change` from each run to the next."""
    return [change(coarse, fine) for coarse, fine in pairwise(runs)]


def changes_of(values: Sequence[FloatArray]) -> list[float]:
    """Return the L1 difference from each array to the next one, over the norm of the latter."""
    return [_apart(coarse, fine) for coarse, fine in pairwise(values)]


def moved(first: Result, second: Result) -> float:
    """Return by how much depth or volume of either body differ between two runs, relative."""
    worst = 0.0
    for names in (("depth", "roller_depth"), ("worn_volume", "roller_worn_volume")):
        one, other = (
            max(float(item.raw.history[name][-1].max()) for name in names)
            for item in (first, second)
        )
        worst = max(worst, _over(abs(one - other), other))
    return worst


def promised(result: Result) -> float:
    """Return the relative error that a run says it may have: its tolerance, or what it warns of."""
    final = result.final
    told = [greatest(final[f"relative_{name}_error"]) for name in ("depth", "volume")]
    return max(result.raw.tolerance, *told)


def greatest(value: float | list[float]) -> float:
    """Return a number, or the greatest of several."""
    return max(value) if isinstance(value, list) else value


def order(changes: list[float]) -> float | None:
    """Return the order with which changes fall from one halving to the next.

    Parameters
    ----------
    changes : list of float
        From each run to the next one, twice as fine.

    Returns
    -------
    float, optional
        The mean over all halvings; None where there are no two changes above round-off.
    """
    if len(changes) < 2 or min(changes) < _NOTHING:
        return None
    return float(np.log2(changes[0] / changes[-1])) / (len(changes) - 1)


def _roller_volume(result: Result) -> FloatArray:
    return result.raw.history["roller_worn_volume"]


def _spacing(result: Result) -> float:
    return float(result.raw.checkpoint["spacing"])


def _apart(one: FloatArray, other: FloatArray) -> float:
    """Return the L1 difference of two arrays over the norm of the other."""
    return _over(float(np.abs(one - other).sum()), float(np.abs(other).sum()))


def _over(apart: float, size: float) -> float:
    """Return a relative difference; 0 of 0 is none."""
    return apart / size if size > 0.0 else (0.0 if apart == 0.0 else float("inf"))
