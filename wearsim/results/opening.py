"""Opening of results files of every kind."""

from __future__ import annotations

from pathlib import Path

from wearsim.results.dissipation import DissipationResult
from wearsim.results.ensemble.life import ensemble_result
from wearsim.results.ensemble.parts import read_ensemble
from wearsim.results.ensemble.result import EnsembleResult
from wearsim.results.identification import IdentificationResult
from wearsim.results.io.files import (
    kind_of,
    read_dissipation,
    read_identification,
    read_results,
)
from wearsim.results.run import Result


def open_results(
    path: str | Path,
) -> Result | DissipationResult | EnsembleResult | IdentificationResult:
    """Open a results file of any kind.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Result, DissipationResult, EnsembleResult or IdentificationResult
        Of a wear test, of a dissipation study, of an ensemble, or of an identification.

    Raises
    ------
    ResultsFileError
        If it is missing, foreign, truncated, damaged, or of another layout.

    Examples
    --------
    >>> wearsim.open_results("rig-ensemble.h5")
    <EnsembleResult 'a wear test': 16 realisations, depth 47.63 um>
    """
    kind = kind_of(path)
    if kind == "run":
        return Result(read_results(path), Path(path))
    if kind == "identification":
        return IdentificationResult(read_identification(path), Path(path))
    return open_ensemble(path) if kind == "ensemble" else open_dissipation(path)


def open_dissipation(path: str | Path) -> DissipationResult:
    """Open the file of a dissipation study; see `open_results`.

    Examples
    --------
    >>> friction = {"distribution": "uniform", "low": 0.08, "high": 0.12}
    >>> scenario = wearsim.load_scenario("rig.toml", {"friction.coefficient": friction})
    >>> study = wearsim.dissipation(scenario, 10, "powers.h5")
    >>> wearsim.open_dissipation("powers.h5").count
    10
    """
    return DissipationResult(read_dissipation(path), Path(path))


def open_ensemble(path: str | Path) -> EnsembleResult:
    """Open the file of an ensemble; see `open_results`.

    Examples
    --------
    >>> wearsim.open_ensemble("rig-ensemble.h5").plan
    'monte-carlo'
    """
    return ensemble_result(read_ensemble(path), Path(path))
