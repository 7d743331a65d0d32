"""How time and memory grow: with strips, passes, records, realisations and workers."""

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

from wearsim.studies.execution.processes import ONE_THREAD
from wearsim_bench.growth.cases import QUICK, REALISATIONS, WORKERS, Point, Sizes, points, truth
from wearsim_bench.growth.point import Cost, Work
from wearsim_bench.measure.machine import cores
from wearsim_bench.measure.measurement import Effort, Measurement, Tell, Topic

LIMIT = 120.0  # s, that a point may take
POINT = "wearsim_bench.growth.point"  # what the process of a point runs
ABOUT = (
    "Whole studies from a scenario to a file, each in a fresh process, after a short one that does"
    " not count. Single tests are those of the rig: passes come with a wear factor that leaves the"
    " same groove, and depths are held against that of every pass solved by itself. Ensembles are"
    " of cheap tests of all that scatters; their error is half the 95 % interval of the mean."
    " The order of time is its slope against what grows, on logarithmic scales. Memory is the most"
    " that all processes of a study hold, pages that they share counted for each of them."
)
ERRORS = {"depth": "depth", "stated": "depth, as stated"}
COUNTS = {
    "order": "order of time",
    "peak_bytes": "memory",
    "added_bytes": "above imports",
    "file_bytes": "file",
}


def growth(effort: Effort, tell: Tell) -> Topic:
    """Measure what studies take as they grow.

    Parameters
    ----------
    effort : Effort
    tell : callable
        Gets what is being measured, and which part is done.
    """
    sizes = QUICK if effort.quick else Sizes()
    asked = points(sizes, effort)
    models = list(dict.fromkeys(point.model for point in asked))
    works = [*(truth(sizes, model) for model in models), *(point.work for point in asked)]
    told = [*("every pass by itself" for _ in models), *(f"{p.group}: {p.setting}" for p in asked)]
    found: list[Cost | str] = []
    # what is only to show what there is need not have the machine for itself
    with ThreadPoolExecutor(cores() if effort.quick else 1) as pool:
        for words, cost in zip(told, pool.map(measured, works), strict=True):
            found.append(cost)
            tell(words, len(found) / len(works))
    true = {
        model: cost.depth
        for model, cost in zip(models, found, strict=False)
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
        measurements=tuple(measurements(asked, found[len(models) :], true)),
    )


def measured(work: Work) -> Cost | str:
    """Return what work takes in a process of its own, or why it cannot be done.

    Parameters
    ----------
    work : Work
    """
    path = os.pathsep.join(part for part in sys.path if part)
    environment = {**os.environ, **ONE_THREAD, "PYTHONPATH": path}
    with TemporaryDirectory() as folder:
        answer = Path(folder) / "cost.json"
        command = [sys.executable, "-m", POINT, json.dumps(asdict(work)), str(answer)]
        try:
            done = subprocess.run(
                command, env=environment, capture_output=True, text=True, timeout=LIMIT, check=False
            )
        except subprocess.TimeoutExpired:
            return f"took longer than {LIMIT:g} s"
        last = (done.stderr.strip().splitlines() or ["nothing was said"])[-1]
        if done.returncode:
            return f"ended with exit code {done.returncode}: {last}"
        try:
            told = json.loads(answer.read_text(encoding="utf-8"))
            return str(told["failed"]) if "failed" in told else Cost(**told)
        except (OSError, ValueError, TypeError) as error:
            return f"ended without an answer ({type(error).__name__}): {last}"


def measurements(
    asked: Sequence[Point], found: Sequence[Cost | str], true: Mapping[str, float]
) -> list[Measurement]:
    """Return what was measured, with the order of growth between neighbours.

    Parameters
    ----------
    asked : sequence of Point
        The sizes of each method rising.
    found : sequence of Cost or str
        What each takes, or why it cannot be done.
    true : mapping of str to float
        Depth that every pass solved by itself leaves, by contact model, where it is known [m].
    """
    rows: list[Measurement] = []
    before: dict[tuple[str, str], tuple[float, float]] = {}
    for point, cost in zip(asked, found, strict=True):
        row = Measurement(point.group, point.method, point.setting, default=point.default)
        if isinstance(cost, str):
            rows.append(replace(row, failed=cost))
            continue
        sizes = ("peak_bytes", "added_bytes", "file_bytes")
        told = {name: getattr(cost, name) for name in sizes}
        counts = {name: float(value) for name, value in told.items() if value is not None}
        line = point.group, point.method
        if line in before:
            size, seconds = before[line]
            counts["order"] = math.log(cost.seconds / seconds) / math.log(point.size / size)
        before[line] = point.size, cost.seconds
        errors = errors_of(point, cost, true.get(point.model))
        rows.append(row.found(cost.seconds, errors, counts))
    return rows


def errors_of(point: Point, cost: Cost, true: float | None) -> dict[str, float]:
    """Return the errors of one point's depth, as far as they are known.

    Parameters
    ----------
    point : Point
    cost : Cost
    true : float, optional
        Depth of a single test [m].
    """
    errors = {"stated": cost.stated}
    if point.group in {REALISATIONS, WORKERS}:
        if cost.half_width is not None:
            errors["depth"] = cost.half_width
    elif true is not None:
        errors["depth"] = abs(cost.depth / true - 1.0)
    return errors
