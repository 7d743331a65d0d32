"""What grows in a study, step by step: strips, passes, records, realisations and workers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from wearsim.scenario.examples import shipped_scenario
from wearsim.scenario.tables.plain import DEFAULT_RECORDS
from wearsim.studies.run.assemble import strips_of_run
from wearsim.studies.run.draws import draw
from wearsim_bench.contact.methods import DEFAULT_MODEL
from wearsim_bench.growth.point import Work
from wearsim_bench.measure.machine import cores
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.sampling.jobs import CHEAP
from wearsim_bench.sampling.jobs import RIG as SCATTERED

RIG = "rig-450min"
STRIPS, PASSES, RECORDS = "strips", "passes", "recorded profiles"
REALISATIONS, WORKERS = "realisations", "workers"


@dataclass(frozen=True)
class Sizes:
    """How far everything grows.

    Parameters
    ----------
    strips, passes, single_passes, records, realisations : tuple of int
        Rising; `single_passes` where each pass is solved by itself.
    tests : int
        Of an ensemble whose workers grow.
    workers : int
        Of it, at most; no more than there are processors.
    true_strips, true_passes : int
        Of the test whose passes are solved one by one, against which depths are held.
    """

    strips: tuple[int, ...] = (21, 41, 81, 161, 321, 641)
    passes: tuple[int, ...] = (10**4, 10**5, 10**6, 10**7, 10**8, 10**9)
    single_passes: tuple[int, ...] = (10**4, 3 * 10**4, 10**5, 3 * 10**5)
    records: tuple[int, ...] = (1, 10, 100, 1000)
    realisations: tuple[int, ...] = (10, 100, 1000)
    tests: int = 1000
    workers: int = 256
    true_strips: int = 161
    true_passes: int = 3000


QUICK = Sizes(
    strips=(21,),
    passes=(10**6,),
    single_passes=(),
    records=(),
    realisations=(4,),
    tests=8,
    workers=2,
    true_strips=81,
    true_passes=1000,
)


@dataclass(frozen=True)
class Point:
    """One size of what grows.

    Parameters
    ----------
    group, method, setting : str
        As of a `Measurement`.
    size : float
    model : str
        Name of the contact model.
    work : Work
    default : bool
        Whether it is what a scenario gets that asks for nothing.
    """

    group: str
    method: str
    setting: str
    size: float
    model: str
    work: Work
    default: bool = False


def points(sizes: Sizes, effort: Effort) -> list[Point]:
    """Return all points, group by group and rising in each method.

    Parameters
    ----------
    sizes : Sizes
    effort : Effort
    """
    models = list(dict.fromkeys((DEFAULT_MODEL, effort.plugin or DEFAULT_MODEL)))
    groups = (_strips, _passes, _records, _realisations, _workers)
    return [
        point
        for of_group in groups
        for model in models
        for point in of_group(sizes, model, effort.repetitions)
    ]


def truth(sizes: Sizes, model: str) -> Work:
    """Return the test of the rig whose passes are solved one by one, and leave the same groove."""
    single = {"evolution.stepper": "per-pass", "contact.strips": sizes.true_strips}
    return _test(model, {**single, **same_groove(sizes.true_passes)}, 1)


def same_groove(passes: int) -> dict[str, object]:
    """Return the changes by which so many passes wear the rig like its own."""
    scenario = shipped_scenario(RIG)
    law = scenario.wear.build() if scenario.wear is not None else None
    factor = law.depth_per_dissipation("cylinder", scenario.rolling_speed) if law else None
    if factor is None:
        raise ValueError(f"the wear law of {RIG} is not linear")
    hastened = factor * scenario.rolling_speed * scenario.total_passes / passes
    return {"operation.passes": passes, "wear.cylinder.k_over_h": f"{hastened!r} 1/Pa"}


def _strips(sizes: Sizes, model: str, repetitions: int) -> Iterator[Point]:
    usual = strips_of_run(draw(shipped_scenario(RIG))).strips
    for count in sorted({*sizes.strips, usual}):
        work = _test(model, {"contact.strips": count}, repetitions)
        chosen = count == usual and model == DEFAULT_MODEL
        yield Point(STRIPS, model, f"{count} strips", count, model, work, chosen)


def _passes(sizes: Sizes, model: str, repetitions: int) -> Iterator[Point]:
    for count in sizes.passes:
        work = _test(model, same_groove(count), repetitions)
        yield Point(PASSES, model, f"{count:.0e} passes", count, model, work)
    for count in sizes.single_passes if model == DEFAULT_MODEL else ():
        changes = {**same_groove(count), "evolution.stepper": "per-pass"}
        work = _test(model, changes, repetitions)
        yield Point(PASSES, f"{model}, per-pass", f"{count:.0e} passes", count, model, work)


def _records(sizes: Sizes, model: str, repetitions: int) -> Iterator[Point]:
    for count in sorted({*sizes.records, DEFAULT_RECORDS}):
        work = _test(model, {"outputs.records": count}, repetitions)
        chosen = count == DEFAULT_RECORDS and model == DEFAULT_MODEL
        yield Point(RECORDS, model, f"{count} records", count, model, work, chosen)


def _realisations(sizes: Sizes, model: str, repetitions: int) -> Iterator[Point]:
    for count in sizes.realisations:
        work = _ensemble(model, count, 1, repetitions)
        yield Point(REALISATIONS, model, f"n = {count}", count, model, work)


def _workers(sizes: Sizes, model: str, repetitions: int) -> Iterator[Point]:
    there = min(cores(), sizes.workers)
    doubling: Sequence[int] = [2**k for k in range(there.bit_length())]
    for count in sorted({*doubling, there}):
        work = _ensemble(model, sizes.tests, count, repetitions)
        chosen = count == there and model == DEFAULT_MODEL
        told = f"{count} worker" if count == 1 else f"{count} workers"
        yield Point(WORKERS, model, told, count, model, work, chosen)


def _test(model: str, changes: Mapping[str, object], repetitions: int) -> Work:
    return Work(RIG, {"contact.model": model, **changes}, repetitions=repetitions)


def _ensemble(model: str, count: int, workers: int, repetitions: int) -> Work:
    return Work(SCATTERED, {**CHEAP, "contact.model": model}, count, workers, repetitions)
