"""Time and memory against strips, passes, records, realisations and workers."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from wearsim.operating_system import processors
from wearsim.studies.execution.processes import ONE_THREAD
from wearsim_bench.growth.cases import (
    QUICK,
    REALISATIONS,
    WORKERS,
    Point,
    Sizes,
    points,
    reference_workload,
)
from wearsim_bench.growth.point import Cost, Workload
from wearsim_bench.measure.measurement import Effort, Measurement, OnProgress, Topic

LIMIT = 120.0  # s, time limit of a study
POINT = "wearsim_bench.growth.point"  # module run by the process of a study
ABOUT = (
    "Complete studies from a scenario to a file, each in a new process after an untimed short one."
    " Single tests are those of the rig. The wear factor is scaled with the number of passes so"
    " that the groove is the same; depths are compared with a test of individually solved passes."
    " Ensembles consist of short tests with all random inputs; their error is half the 95 %"
    " confidence interval of the mean. The order of time is its slope against size on logarithmic"
    " scales. Memory is the sum of the peaks of all processes; shared pages are counted for each."
)
ERRORS = {"depth": "depth", "stated": "depth, estimated"}
COUNTS = {
    "order": "order of time",
    "peak_bytes": "memory",
    "added_bytes": "above imports",
    "file_bytes": "file",
}


def growth(effort: Effort, on_progress: OnProgress) -> Topic:
    """Measure time and memory of studies of increasing size.

    Parameters
    ----------
    effort : Effort
        Number of cases and repetitions.
    on_progress : callable
        Called with a description and the completed fraction.
    """
    sizes = QUICK if effort.quick else Sizes()
    studies = points(sizes, effort)
    models = list(dict.fromkeys(point.model for point in studies))
    works = [
        *(reference_workload(sizes, model) for model in models),
        *(point.work for point in studies),
    ]
    names = [*("reference" for _ in models), *(f"{p.group}: {p.setting}" for p in studies)]
    costs: list[Cost | str] = []
    # timings of a quick benchmark may disturb each other
    with ThreadPoolExecutor(processors() if effort.quick else 1) as pool:
        for name, cost in zip(names, pool.map(measured, works), strict=True):
            costs.append(cost)
            on_progress(name, len(costs) / len(works))
    depths = {
        model: cost.depth
        for model, cost in zip(models, costs, strict=False)
        if isinstance(cost, Cost)
    }
    return Topic(
        name="growth",
        title="Growth: time and memory against the size of a study",
        about=ABOUT,
        seconds="one study",
        error="depth",
        errors=ERRORS,
        counts=COUNTS,
        measurements=tuple(measurements(studies, costs[len(models) :], depths)),
    )


def measured(work: Workload) -> Cost | str:
    """Return the cost of a workload in a separate process, or the reason of its failure."""
    path = os.pathsep.join(part for part in sys.path if part)
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": path}
    with TemporaryDirectory() as folder:
        output = Path(folder) / "cost.json"
        command = [sys.executable, "-m", POINT, json.dumps(asdict(work)), str(output)]
        try:
            done = subprocess.run(
                command, env=environment, capture_output=True, text=True, timeout=LIMIT, check=False
            )
        except subprocess.TimeoutExpired:
            return f"took longer than {LIMIT:g} s"
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        if done.returncode:
            return f"ended with exit code {done.returncode}: {last}"
        try:
            cost = json.loads(output.read_text(encoding="utf-8"))
            return str(cost["failed"]) if "failed" in cost else Cost(**cost)
        except (OSError, ValueError, TypeError) as error:
            return f"ended without a result ({type(error).__name__}): {last}"


def measurements(
    studies: Sequence[Point], costs: Sequence[Cost | str], depths: Mapping[str, float]
) -> list[Measurement]:
    """Return the measurements, with the order of time between neighbouring sizes.

    Parameters
    ----------
    studies : sequence of Point
        Studies with increasing size for each method.
    costs : sequence of Cost or str
        Their costs, or reasons of failure.
    depths : mapping of str to float
        Depth of the reference test by contact model, where it is known [m].
    """
    rows: list[Measurement] = []
    before: dict[tuple[str, str], tuple[float, float]] = {}
    for point, cost in zip(studies, costs, strict=True):
        row = Measurement(point.group, point.method, point.setting, default=point.default)
        if isinstance(cost, str):
            rows.append(replace(row, failed=cost))
            continue
        sizes = {name: getattr(cost, name) for name in ("peak_bytes", "added_bytes", "file_bytes")}
        counts = {name: float(value) for name, value in sizes.items() if value is not None}
        line = point.group, point.method
        if line in before:
            size, seconds = before[line]
            counts["order"] = math.log(cost.seconds / seconds) / math.log(point.size / size)
        before[line] = point.size, cost.seconds
        errors = errors_of(point, cost, depths.get(point.model))
        rows.append(row.with_results(cost.seconds, errors, counts))
    return rows


def errors_of(point: Point, cost: Cost, reference: float | None) -> dict[str, float]:
    """Return the known errors of the depth of one study.

    Parameters
    ----------
    point : Point
        The study.
    cost : Cost
        Its cost and results.
    reference : float, optional
        Depth of the reference test [m], for single tests.
    """
    errors = {"stated": cost.stated}
    if point.group in {REALISATIONS, WORKERS}:
        if cost.half_width is not None:
            errors["depth"] = cost.half_width
    elif reference is not None:
        errors["depth"] = abs(cost.depth / reference - 1.0)
    return errors
