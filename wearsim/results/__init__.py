"""The results: one HDF5 file per run or study, which opens after a kill at any moment."""

from wearsim.results.data import RunData
from wearsim.results.dissipation_data import DissipationData
from wearsim.results.dissipation_result import DissipationResult, open_dissipation
from wearsim.results.ensemble_data import EnsembleData, Outcome
from wearsim.results.ensemble_file import EnsembleFile
from wearsim.results.ensemble_reader import read_ensemble
from wearsim.results.ensemble_result import EnsembleResult, open_ensemble
from wearsim.results.export import export_csv
from wearsim.results.inputs import refuse_inputs, same_file
from wearsim.results.reader import is_dissipation, kind_of, read_dissipation, read_results
from wearsim.results.result import Result, open_results
from wearsim.results.writer import check_output, write_results

__all__ = [
    "DissipationData",
    "DissipationResult",
    "EnsembleData",
    "EnsembleFile",
    "EnsembleResult",
    "Outcome",
    "Result",
    "RunData",
    "check_output",
    "export_csv",
    "is_dissipation",
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
