"""The notebook of the Python interface runs as it is, and is stored without outputs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).parents[1] / "docs" / "python.ipynb"


def test_notebook_is_stored_without_outputs() -> None:
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert len(code) >= 10
    assert not [cell for cell in code if cell["outputs"] or cell["execution_count"]]


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_notebook_runs(tmp_path: Path) -> None:
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    outputs = {cell.source: cell.outputs for cell in notebook.cells if cell.cell_type == "code"}

    def shown(start: str) -> str:
        """Return the text output of a cell, and its other output as text."""
        (found,) = [outputs[source] for source in outputs if source.startswith(start)]
        parts = [item.get("text", "") for item in found]
        return " ".join(parts + [str(item.get("data", "")) for item in found])

    progress = shown("result = wearsim.run")
    assert "done in" in progress
    assert "90,000 (100 %)" not in progress  # the line is updated
    assert "<Result 'a short test': 90000 roller passes" in progress
    assert "image/png" in shown("result.plot()")
    assert "text/html" in shown("result.to_dataframe()")
    assert "cylinder_depth_profile" in shown("result.to_xarray()")
    ensemble = shown("ensemble = ")
    assert "40 of 40 realisations" in ensemble
    assert "95 % interval" in ensemble
    assert "image/png" in shown("from matplotlib")
    assert "did you mean 'coefficient'?" in shown("try:")
