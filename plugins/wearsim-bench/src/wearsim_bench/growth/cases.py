"""Sizes of studies: strips, passes, records, realisations and workers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from wearsim.operating_system import processors
from wearsim.scenario.examples import shipped_scenario
from wearsim.scenario.tables.plain import DEFAULT_RECORDS
from wearsim.studies.run.draws import draw
from wearsim.studies.run.grid import strips_of_run
from wearsim_bench.contact.methods import DEFAULT_MODEL
from wearsim_bench.growth.point import Workload
from wearsim_bench.measure.measurement import Effort
from wearsim_bench.sampling.jobs import CHEAP, RIG as SCATTERED

RIG = "rig-450min"
STRIPS, PASSES, RECORDS = "strips", "passes", "recorded profiles"
REALISATIONS, WORKERS = "realisations", "workers"


@dataclass(frozen=True)
class Sizes:
    """Sizes of a scaling benchmark.

    Parameters
    ----------
    strips, passes, single_passes, records, realisations : tuple of int
        Increasing; `single_passes` are solved individually.
    tests : int
        Realisations of the ensemble run with different numbers of workers.
    workers : int
        Largest number of workers, limited by the number of processors.
    true_strips, true_passes : int
        Strips and passes of the reference test, whose passes are solved individually.
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
    """One study of a scaling benchmark.

    Parameters
    ----------
    group, method, setting : str
        See `Measurement`.
    size : float
        Number of strips, passes, records, realisations or workers.
    model : str
        Name of the contact model.
    work : Workload
        The study to run.
    default : bool
        Whether this is the default of a scenario.
    """

    group: str
    method: str
    setting: str
    size: float
    model: str
    work: Workload
    default: bool = False


def points(sizes: Sizes, effort: Effort) -> list[Point]:
    """Return all studies, group by group, with increasing size for each method."""
    models = list(dict.fromkeys((DEFAULT_MODEL, effort.plugin or DEFAULT_MODEL)))
    groups = (_strips, _passes, _records, _realisations, _workers)
    return [
        point
        for of_group in groups
        for model in models
        for point in of_group(sizes, model, effort.repetitions)
    ]


def reference_workload(sizes: Sizes, model: str) -> Workload:
    """Return the reference test: the same groove, with individually solved passes."""
    single = {"evolution.stepper": "per-pass", "contact.strips": sizes.true_strips}
    return _test(model, {**single, **same_groove(sizes.true_passes)}, 1)


def same_groove(passes: int) -> dict[str, object]:
    """Return changes of the rig so that this number of passes wears the same groove."""
    scenario = shipped_scenario(RIG)
    law = scenario.wear.built if scenario.wear is not None else None
    factor = law.depth_per_dissipation("cylinder", scenario.rolling_speed) if law else None
    if factor is None:
        raise ValueError(f"the wear law of {RIG} is not linear")
    k_over_h = factor * scenario.rolling_speed * scenario.total_passes / passes
    return {"operation.passes": passes, "wear.cylinder.k_over_h": f"{k_over_h!r} 1/Pa"}


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
    most = min(processors(), sizes.workers)
    doubling: Sequence[int] = [2**k for k in range(most.bit_length())]
    for count in sorted({*doubling, most}):
        work = _ensemble(model, sizes.tests, count, repetitions)
        chosen = count == most and model == DEFAULT_MODEL
        setting = f"{count} worker" if count == 1 else f"{count} workers"
        yield Point(WORKERS, model, setting, count, model, work, chosen)


def _test(model: str, changes: Mapping[str, object], repetitions: int) -> Workload:
    return Workload(RIG, {"contact.model": model, **changes}, repetitions=repetitions)


def _ensemble(model: str, count: int, workers: int, repetitions: int) -> Workload:
    return Workload(SCATTERED, {**CHEAP, "contact.model": model}, count, workers, repetitions)
