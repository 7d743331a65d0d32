"""Sweep over the values of a key: an ensemble for each, with common random numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from wearsim.errors import Interrupted, ResultsFileError
from wearsim.results import EnsembleResult, check_output, read_ensemble
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.api import (
    EnsembleRequest,
    checked_request,
    ensemble,
    resume_ensemble,
)


def sweep(
    scenario_of: Callable[[str], Scenario],
    values: Sequence[str],
    realisations: int,
    output: str | Path,
    *,
    on_value: Callable[[str, Path], None] | None = None,
    **options: Any,
) -> list[EnsembleResult]:
    """Run an ensemble for each of several values, each with a separate file.

    Random numbers are addressed by the names of the inputs, so that a realisation differs between
    the ensembles in the value only: differences are not affected by sampling. Unfinished ensembles
    of an earlier call are continued.

    Parameters
    ----------
    scenario_of : callable
        Returns the scenario with one of the values.
    values : sequence of str
        As written in the names of the files.
    realisations : int
        Number of realisations of each ensemble.
    output : path
        ``FILE.h5``, for files ``FILE-VALUE.h5``.
    on_value : callable, optional
        Called with value and file before each ensemble.
    **options
        Options of `ensemble`.

    Returns
    -------
    list of EnsembleResult

    Raises
    ------
    ResultsFileError
        If a file exists, or is that of two values.
    ScenarioError, CapabilityError, TypeError, ValueError
        As in `ensemble`; those known from the arguments before the first one runs.
    Interrupted
        If it was stopped, with the values that are left.
    """
    scenarios = [scenario_of(value) for value in values]
    paths = [path_of(output, value) for value in values]
    same = [path for path in paths if paths.count(path) > 1]
    if same:
        raise ResultsFileError(
            f"{same[0]}: would be the file of two values; write them differently"
        )
    force, resumed = options.get("force", False), []
    for scenario, path in zip(scenarios, paths, strict=True):
        request = checked_request(scenario, realisations, options.get("plan"), options.get("until"))
        resumed.append(not force and path.exists() and _matches(path, scenario, request))
        if not resumed[-1]:
            check_output(path, force, scenario.paths)
    run_options = {key: options[key] for key in options.keys() - {"plan", "until", "force"}}
    results: list[EnsembleResult] = []
    for value, scenario, path, is_resumed in zip(values, scenarios, paths, resumed, strict=True):
        if on_value is not None:
            on_value(value, path)
        try:
            if is_resumed:
                results.append(resume_ensemble(path, **run_options))
            else:
                results.append(ensemble(scenario, realisations, path, **options))
        except Interrupted as stop:
            left = values[len(results) + 1 :]
            rest = f"; not started: {', '.join(left)}" if left else ""
            raise Interrupted(f"{stop}{rest}; repeat the command to continue the sweep") from stop
    return results


def _matches(path: Path, scenario: Scenario, request: EnsembleRequest) -> bool:
    """Return whether a file is that of the same ensemble."""
    try:
        data = read_ensemble(path)
    except ResultsFileError:  # another kind of file, which is not overwritten
        return False
    until = "" if request.target is None else str(request.target)
    requested = (scenario.sha256, request.plan, request.realisations, until)
    return requested == (data.sha256, data.plan, data.requested, data.until)


def path_of(output: str | Path, value: str) -> Path:
    """Return the file of one value: 'out/test.h5' and '250 N' give 'out/test-250N.h5'."""
    path = Path(output)
    joined = re.sub(r"\s+(?=[A-Za-z])", "", value.strip())  # a number and its unit
    plain = re.sub(r"\s+", "_", joined.replace("/", "_per_").replace("%", "percent"))
    plain = re.sub(r"[^\w.+-]+", "", plain)
    return path.with_name(f"{path.stem}-{plain}{path.suffix}")
