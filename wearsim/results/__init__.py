"""The results: one HDF5 file per run or study, written whole or not at all, and read back."""

from wearsim.results.data import RunData
from wearsim.results.dissipation_data import DissipationData
from wearsim.results.dissipation_result import DissipationResult, open_dissipation
from wearsim.results.export import export_csv
from wearsim.results.inputs import refuse_inputs, same_file
from wearsim.results.reader import is_dissipation, read_dissipation, read_results
from wearsim.results.result import Result, open_results
from wearsim.results.writer import check_output, write_results

__all__ = [
    "DissipationData",
    "DissipationResult",
    "Result",
    "RunData",
    "check_output",
    "export_csv",
    "is_dissipation",
    "open_dissipation",
    "open_results",
    "read_dissipation",
    "read_results",
    "refuse_inputs",
    "same_file",
    "write_results",
]
