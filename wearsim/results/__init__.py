"""The results: one HDF5 file per run or study, which opens after a kill at any moment."""

from importlib import import_module
from typing import TYPE_CHECKING

from wearsim.results.dissipation import DissipationData, DissipationResult
from wearsim.results.identification import IdentificationData, IdentificationResult
from wearsim.results.io.atomic_write import DISK, Storage, check_output, refuse_inputs, same_file
from wearsim.results.io.files import kind_of, read_dissipation, read_results, write_results
from wearsim.results.run import Result, RunData

if TYPE_CHECKING:
    from wearsim.results.csv_export import export_csv
    from wearsim.results.ensemble.data import EnsembleData, Outcome
    from wearsim.results.ensemble.parts import read_ensemble
    from wearsim.results.ensemble.result import EnsembleResult
    from wearsim.results.ensemble.writer import EnsembleFile
    from wearsim.results.opening import open_dissipation, open_ensemble, open_results

# those that a run does not use are imported at their first use
_MODULES = {
    "EnsembleData": "ensemble.data",
    "EnsembleFile": "ensemble.writer",
    "EnsembleResult": "ensemble.result",
    "Outcome": "ensemble.data",
    "export_csv": "csv_export",
    "open_dissipation": "opening",
    "open_ensemble": "opening",
    "open_results": "opening",
    "read_ensemble": "ensemble.parts",
}

__all__ = [
    "DISK",
    "DissipationData",
    "DissipationResult",
    "EnsembleData",
    "EnsembleFile",
    "EnsembleResult",
    "IdentificationData",
    "IdentificationResult",
    "Outcome",
    "Result",
    "RunData",
    "Storage",
    "check_output",
    "export_csv",
    "kind_of",
    "open_dissipation",
    "open_ensemble",
    "open_results",
    "read_dissipation",
    "read_ensemble",
    "read_results",
    "refuse_inputs",
    "same_file",
    "write_results",
]


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module 'wearsim.results' has no attribute '{name}'")
    return getattr(import_module(f"wearsim.results.{_MODULES[name]}"), name)
