"""Small result files of the present layouts; `python tests/results/layout_files.py` writes them.

Run it once when a layout number rises, and commit the new files beside those of earlier layouts.
"""

from __future__ import annotations

from pathlib import Path

from ensemble_examples import finish, some_header, some_outcome, some_static
from run_examples import some_run
from test_dissipation_files import some_study

from wearsim.results.io.files import write_results
from wearsim.studies.dissipation.result import DISSIPATION, DissipationData
from wearsim.studies.ensemble.file.schema import ENSEMBLE
from wearsim.studies.ensemble.file.writer import EnsembleFile
from wearsim.studies.run.result import RunData
from wearsim.studies.run.schema import RUN

FOLDER = Path(__file__).parent / "data"
LAYOUTS = {
    "run": RUN.version,
    "dissipation": DISSIPATION.version,
    "ensemble": ENSEMBLE.version,
    "unfinished": ENSEMBLE.version,
}
"""Number of the layout of each kind of file; an unfinished ensemble has a part."""


def run_of_file() -> RunData:
    """Return the content of the file of a run."""
    return some_run(seed=3, steps=2, records=2, strips=3)


def study_of_file() -> DissipationData:
    """Return the content of the file of a dissipation study."""
    return some_study(count=4, kept=3)


def write_all(folder: Path) -> None:
    """Write all files."""
    write_results(folder / f"run-{LAYOUTS['run']}.h5", run_of_file())
    write_results(folder / f"dissipation-{LAYOUTS['dissipation']}.h5", study_of_file())
    for name in ("ensemble", "unfinished"):
        path = folder / f"{name}-{LAYOUTS[name]}.h5"
        with EnsembleFile.create(path, some_header(4), some_static(3)) as file:
            file.put([some_outcome(number, 3, "lost" * (number == 2)) for number in (2, 0, 1)])
            if name == "ensemble":
                finish(file)


if __name__ == "__main__":
    write_all(FOLDER)
