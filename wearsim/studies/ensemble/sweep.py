"""One ensemble for each of several values of a key, all with the same random numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from wearsim.errors import Interrupted, ResultsFileError
from wearsim.results import EnsembleResult, check_output, read_ensemble
from wearsim.scenario import Scenario
from wearsim.studies.ensemble.api import Asked, checked, ensemble, resume_ensemble


def sweep(
    scenario_of: Callable[[str], Scenario],
    values: Sequence[str],
    realisations: int,
    output: str | Path,
    *,
    on_value: Callable[[str, Path], None] | None = None,
    **options: Any,
) -> list[EnsembleResult]:
    """Run an ensemble for each of several values, each to a file of its own.

    Draws have the names of their inputs as addresses, so that realisation k is the same test in all
    of them but for the value: what differs between the ensembles is not left to chance. An ensemble
    that an earlier go has begun is gone on with.

    Parameters
    ----------
    scenario_of : callable
        Returns the scenario with one of the values.
    values : sequence of str
        As they stand in the names of the files.
    realisations : int
        Of each ensemble.
    output : path
        ``FILE.h5`` stands for ``FILE-VALUE.h5``.
    on_value : callable, optional
        Told value and file before each ensemble.
    **options
        Of `ensemble`.

    Returns
    -------
    list of EnsembleResult

    Raises
    ------
    ResultsFileError
        If a file exists, or would be that of two values.
    ScenarioError, CapabilityError, TypeError, ValueError
        As `ensemble`; what can be known beforehand, before the first one runs.
    Interrupted
        If it was stopped, telling the values that are left.
    """
    scenarios = [scenario_of(value) for value in values]
    paths = [path_of(output, value) for value in values]
    force = options.get("force", False)
    same = [path for path in paths if paths.count(path) > 1]
    if same:
        raise ResultsFileError(f"{same[0]}: would be the file of two values; write them apart")
    begun = []
    for scenario, path in zip(scenarios, paths, strict=True):
        asked = checked(scenario, realisations, options.get("plan"), options.get("until"))
        begun.append(_is_part(path, scenario, asked, force))
        if not begun[-1]:
            check_output(path, force, scenario.paths)
    found: list[EnsembleResult] = []
    for value, scenario, path, is_part in zip(values, scenarios, paths, begun, strict=True):
        if on_value is not None:
            on_value(value, path)
        try:
            if is_part:
                found.append(resume_ensemble(path, **_of_work(options)))
            else:
                found.append(ensemble(scenario, realisations, path, **options))
        except Interrupted as stop:
            left = values[len(found) + 1 :]
            rest = f"; not begun: {', '.join(left)}" if left else ""
            again = "; the same command once more goes on with the sweep"
            raise Interrupted(f"{stop}{rest}{again}") from stop
    return found


def _is_part(path: Path, scenario: Scenario, asked: Asked, force: bool) -> bool:
    """Tell whether a file is that of a value from an earlier go at the same sweep."""
    if force or not path.exists():
        return False
    try:
        data = read_ensemble(path)
    except ResultsFileError:  # whatever it is, it stays
        return False
    until = "" if asked.target is None else str(asked.target)
    mine = (scenario.sha256, asked.plan, asked.realisations, until)
    return mine == (data.sha256, data.plan, data.asked, data.until)


def _of_work(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of an ensemble that say how it is run, not what it is."""
    what = {"plan", "until", "force"}
    return {name: value for name, value in options.items() if name not in what}


def path_of(output: str | Path, value: str) -> Path:
    """Return the file of one value: 'out/test.h5' and '250 N' make 'out/test-250N.h5'."""
    path = Path(output)
    joined = re.sub(r"\s+(?=[A-Za-z])", "", value.strip())  # a number and its unit
    plain = re.sub(r"\s+", "_", joined.replace("/", "_per_").replace("%", "percent"))
    plain = re.sub(r"[^\w.+-]+", "", plain)
    return path.with_name(f"{path.stem}-{plain}{path.suffix}")
