"""Lives for several values of a design variable, with common draws."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from wearsim.results import check_output
from wearsim.results.ensemble.life import LifeResult
from wearsim.scenario import Scenario, as_scenario
from wearsim.studies.ensemble.sweep import path_of
from wearsim.studies.life.api import life


def sweep_life(
    scenario: Scenario | str | Path,
    key: str,
    values: Sequence[object],
    output: str | Path,
    realisations: int = 400,
    *,
    on_value: Callable[[str, Path], None] | None = None,
    **options: Any,
) -> list[LifeResult]:
    """Return the lives of a design for each of several values of one key.

    The draws are common to all values, so that lives differ by the value only. Each result has the
    value as `variable`.

    Parameters
    ----------
    scenario : Scenario or path
        The scenario, or its file.
    key : str
        Dotted key, "cam.base_radius".
    values : sequence
        Values of the key, as in a scenario: "25 mm", 0.1.
    output : path
        ``FILE.h5``, for files ``FILE-VALUE.h5``.
    realisations : int
        Maximum number of realisations for each value.
    on_value : callable, optional
        Called with value and file before each study.
    **options
        Options of `life`, such as ``limits=["depth 50 um"]``.

    Returns
    -------
    list of LifeResult
        In the order of the values.

    Raises
    ------
    ScenarioError, CapabilityError, ResultsFileError, TypeError, ValueError
        As `life`; mistakes in values and files are raised before the first study.

    Examples
    --------
    >>> factor = {"distribution": "lognormal", "median": "1.1e-11 1/Pa", "factor": 1.5}
    >>> rig = wearsim.load_scenario("rig.toml", {"wear.cylinder.k_over_h": factor})
    >>> options = {"limits": ["depth 50 um"], "scheduler": "serial"}
    >>> radii = ["400 mm", "500 mm"]
    >>> found = wearsim.sweep_life(rig, "roller.crown_radius", radii, "crown.h5", **options)
    >>> [f"{one.variable.text}: B10 {one.b(10).value:.3g}" for one in found]
    ['400 mm: B10 7.61e+05', '500 mm: B10 8.51e+05']
    """
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise TypeError(f"values must be a list, got {values!r}")
    base, names = as_scenario(scenario), [str(value) for value in values]
    scenarios = [base.changed({key: value}) for value in values]
    paths = [path_of(output, name) for name in names]
    if len(set(paths)) < len(paths):
        raise ValueError("two values have the same file; write them differently")
    for one, path in zip(scenarios, paths, strict=True):
        check_output(path, options.get("force", False), one.paths)
    results = []
    for one, name, path in zip(scenarios, names, paths, strict=True):
        if on_value is not None:
            on_value(name, path)
        results.append(life(one, realisations, path, variable=key, **options))
    return results
