"""The results: one HDF5 file per run, written whole or not at all, read back as a `Result`."""

from wearsim.results.data import RunData
from wearsim.results.export import export_csv
from wearsim.results.reader import read_results
from wearsim.results.result import Result, open_results
from wearsim.results.writer import check_output, write_results

__all__ = [
    "Result",
    "RunData",
    "check_output",
    "export_csv",
    "open_results",
    "read_results",
    "write_results",
]
