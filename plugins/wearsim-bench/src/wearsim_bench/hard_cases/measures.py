"""Measures for hard cases: balances, smoothness, symmetry and convergence."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby, pairwise

import numpy as np

from wearsim.evolution.observables import centroid
from wearsim.evolution.quantities import oscillation
from wearsim.evolution.strips import averaged
from wearsim.scenario import Scenario
from wearsim.studies.run.assemble import merged_rollers
from wearsim.studies.run.draws import draw
from wearsim.studies.run.result import Result
from wearsim.types import FloatArray, Grid

PROFILES = ("cylinder_depth_profile", "roller_depth_profile")
_MIN_STRIPS = 20  # strips in contact, for which a parabola has second differences of 2 %
_ROUND_OFF = 1e-12  # relative


def is_finite(result: Result) -> bool:
    """Return whether all results of a run are finite and no depth is negative."""
    raw = result.raw
    arrays = [*raw.history.values(), *raw.records.values()]
    non_negative = all((raw.records[name] >= 0.0).all() for name in PROFILES)
    return non_negative and all(np.isfinite(array).all() for array in arrays)


def volume_balance(result: Result, scenario: Scenario) -> float | None:
    """Return the largest |V - (K/H) E| of cylinder or rollers, relative to the final V.

    Returns
    -------
    float, optional
        None if wear is not proportional to dissipation, 0 without wear.
    """
    history, law = result.raw.history, scenario.wear.built if scenario.wear else None
    on_rollers = np.einsum("r,srn->sn", result.raw.static["multiplicity"], _roller_volume(result))
    worst = 0.0
    for body, volume in (("cylinder", history["worn_volume"]), ("roller", on_rollers)):
        factor = law.depth_per_dissipation(body, 1.0) if law is not None else None  # type: ignore[arg-type]
        if factor is None:
            return None
        difference = np.abs(volume - factor * history["dissipated_energy"]).max()
        worst = max(worst, _relative(float(difference), float(volume[-1].max())))
    return worst


def load_balance(result: Result) -> float:
    """Return the largest |sum q dy - N|/N over the records at ends of steps."""
    raw = result.raw
    at = {passes: row for row, passes in enumerate(raw.history["passes"].tolist())}
    carried = raw.records["line_load"].sum(axis=-1).mean(axis=1) * _spacing(result)
    worst = 0.0
    for passes, loads in zip(raw.records["record_passes"].tolist(), carried, strict=True):
        if passes in at:
            expected = raw.history["normal_force"][at[passes]]
            worst = max(worst, float((np.abs(loads - expected) / expected).max()))
    return worst


def energy_balance(result: Result) -> float:
    """Return |integral of P_l dy dt - E|/E of a run, by the trapezoidal rule over the records."""
    raw = result.raw
    power = np.einsum("r,ksrny->k", raw.static["multiplicity"], raw.records["dissipation"])
    stations = raw.records["dissipation"].shape[1]
    time = np.diff(raw.records["record_time"])
    energy = float(raw.history["dissipated_energy"][-1, 0])
    integral = float(0.5 * (power[1:] + power[:-1]) @ time) * _spacing(result) / stations
    return _relative(abs(integral - energy), energy)


def work_balance(result: Result, scenario: Scenario) -> float:
    """Return the largest |P + V (xi F_x + eta F_y + phi M_z)|/P of the final contacts.

    Parameters
    ----------
    result : Result
        Results of a run.
    scenario : Scenario
        Its scenario; the creepage must vary over the strips by spin only.
    """
    checkpoint = result.raw.checkpoint
    creepage, speed = scenario.creepage, scenario.rolling_speed
    yaw, tilt = (scenario.per_roller(v) for v in (creepage.yaw, creepage.tilt))
    worst = 0.0
    for number, roller in enumerate(merged_rollers(draw(scenario))[0]):
        spin = tilt[roller] / scenario.roller.radius
        along = float(checkpoint["contact_longitudinal_creepage"][number])
        forces = [float(checkpoint[f"contact_{n}"][number]) for n in ("force_x", "force_y")]
        moment, power = (
            float(checkpoint[f"contact_{n}"][number]) for n in ("spin_moment", "power")
        )
        work = -speed * (along * forces[0] + yaw[roller] * forces[1] + spin * moment)
        worst = max(worst, _relative(abs(power - work), power))
    return worst


def records_half_steps(result: Result) -> bool:
    """Return whether the records of a run with fixed steps are at the ends of half steps."""
    raw = result.raw
    intervals, steps = np.diff(raw.records["record_passes"]), np.diff(raw.history["passes"])
    return len(intervals) == 2 * len(steps) and bool(
        np.array_equal(intervals, np.repeat(0.5 * steps, 2))
    )


def max_oscillation(result: Result) -> float:
    """Return the largest `oscillation` of the line load over all records and contacts.

    Contacts of few strips are omitted: their second differences are large without oscillation.
    """
    line_load = result.raw.records["line_load"]
    rows = line_load.reshape(-1, line_load.shape[-1])
    return max((oscillation(row) for row in rows if (row > 0.0).sum() >= _MIN_STRIPS), default=0.0)


def drift(result: Result) -> float:
    """Return the largest distance of the groove's centre from y = 0, relative to its width."""
    y, worn = result.y, result.raw.records["cylinder_depth_profile"][:, 0, 0]
    worst = 0.0
    for row in worn:
        width = float(np.ptp(y[row > 0.0])) if (row > 0.0).any() else 0.0
        worst = max(worst, _relative(abs(centroid(y, row)), width + _spacing(result)))
    return worst


def patches(result: Result) -> tuple[int, ...]:
    """Return the sequence of the number of contact patches of the first roller."""
    loaded = result.raw.records["line_load"][:, 0, 0, 0] > 0.0
    edges = np.diff(loaded.astype(int), axis=1, prepend=0)
    counts = (edges == 1).sum(axis=1).tolist()
    return tuple(number for number, _ in groupby(counts))


def asymmetry(result: Result, mirrored: Result) -> float:
    """Return the largest relative difference of the final profiles of two mirrored runs."""
    worst = 0.0
    for name in PROFILES:
        profile, mirror_profile = (item.raw.records[name][-1] for item in (result, mirrored))
        # only y is reversed, not the order of the rollers
        worst = max(
            worst,
            _relative(
                float(np.abs(profile - mirror_profile[..., ::-1]).max()), float(profile.max())
            ),
        )
    return worst


def change(coarse: Result, fine: Result) -> float:
    """Return the relative L1 difference of the final profile from that of a finer run.

    Means over the strips of the coarse run are compared. The body with more wear is used.
    """
    name = max(PROFILES, key=lambda name: float(fine.raw.records[name][-1].max()))
    coarse_profile, fine_profile = (item.raw.records[name][-1] for item in (coarse, fine))
    return _relative_difference(coarse_profile, averaged(fine_profile, *map(_grid, (fine, coarse))))


def _grid(result: Result) -> Grid:
    return Grid(result.y, float(result.raw.checkpoint["spacing"]))


def changes(runs: Sequence[Result]) -> list[float]:
    """Return the `change` from each run to the next."""
    return [change(coarse, fine) for coarse, fine in pairwise(runs)]


def changes_of(values: Sequence[FloatArray]) -> list[float]:
    """Return the relative L1 difference of each array from the next one."""
    return [_relative_difference(coarse, fine) for coarse, fine in pairwise(values)]


def observable_change(first: Result, second: Result) -> float:
    """Return the largest relative difference in depth and volume between two runs."""
    worst = 0.0
    for names in (("depth", "roller_depth"), ("worn_volume", "roller_worn_volume")):
        first_value, second_value = (
            max(float(item.raw.history[name][-1].max()) for name in names)
            for item in (first, second)
        )
        worst = max(worst, _relative(abs(first_value - second_value), second_value))
    return worst


def stated_error(result: Result) -> float:
    """Return the tolerance of a run, or its error estimate if that is larger."""
    final = result.final
    estimates = [greatest(final[f"relative_{name}_error"]) for name in ("depth", "volume")]
    return max(result.raw.tolerance, *estimates)


def greatest(value: float | list[float]) -> float:
    """Return a number, or the largest of several."""
    return max(value) if isinstance(value, list) else value


def order(changes: list[float]) -> float | None:
    """Return the observed order of convergence.

    Parameters
    ----------
    changes : list of float
        Changes from each run to the next one, which is refined by 2.

    Returns
    -------
    float, optional
        Mean over all refinements; None without two changes above round-off.
    """
    if len(changes) < 2 or min(changes) < _ROUND_OFF:
        return None
    return float(np.log2(changes[0] / changes[-1])) / (len(changes) - 1)


def _roller_volume(result: Result) -> FloatArray:
    return result.raw.history["roller_worn_volume"]


def _spacing(result: Result) -> float:
    return float(result.raw.checkpoint["spacing"])


def _relative_difference(values: FloatArray, reference: FloatArray) -> float:
    """Return the L1 norm of the difference of two arrays, relative to that of `reference`."""
    return _relative(float(np.abs(values - reference).sum()), float(np.abs(reference).sum()))


def _relative(difference: float, size: float) -> float:
    """Return a relative difference; 0/0 is 0."""
    return difference / size if size > 0.0 else (0.0 if difference == 0.0 else float("inf"))
