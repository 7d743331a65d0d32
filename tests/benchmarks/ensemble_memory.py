"""Memory, time and disk space of an ensemble of closed-form tests, which cost no solves.

``python -m tests.benchmarks.ensemble_memory COUNT`` prints JSON. Every test is the closed form of
full slip, so that only writing the file and computing statistics are measured.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tests.benchmarks.ensemble_cases import Size, drawn
from wearsim.studies.ensemble import api as study
from wearsim.studies.ensemble.file.data import Outcome
from wearsim.studies.ensemble.file.schema import OBSERVABLES
from wearsim.studies.ensemble.realisation import RealisationRunner, closed_form_depths


class ClosedForm(RealisationRunner):
    """Realisations with the closed-form depth of full slip of rigid bodies."""

    def __call__(self, numbers: Sequence[int]) -> list[Outcome]:
        """Return the outcomes of consecutive realisations in closed form."""
        first, count = numbers[0], len(numbers)
        columns = self.drawer.columns(first, count)
        depths = closed_form_depths(self.scenario, columns, count)
        return [
            Outcome(
                number=first + k,
                values={
                    **{key: column[k] for key, column in columns.items()},
                    **{name: depths[k] * np.array([0.0, 1.0]) for name in OBSERVABLES},
                    **dict.fromkeys(("depth_error", "volume_error", "steps", "solves"), 0.0),
                    "depth_profile": np.zeros(self.grid.strips),
                },
            )
            for k in range(count)
        ]


def main(count: int) -> None:
    """Run an ensemble of `count` and print its peak memory, time and size."""
    study.RealisationRunner = ClosedForm  # type: ignore[misc]
    start = time.perf_counter()
    with TemporaryDirectory() as folder:
        path = Path(folder) / "many.h5"
        result = study.ensemble(drawn("per-test", Size()), count, path, scheduler="serial")
        if result.count != count:
            raise RuntimeError(f"{result.count} of {count} realisations succeeded")
        size = path.stat().st_blocks * 512
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024  # kB on Linux
    measured = {
        "seconds": time.perf_counter() - start,
        "megabytes": peak / 1e6,
        "file_megabytes": size / 1e6,
    }
    sys.stdout.write(json.dumps(measured))


if __name__ == "__main__":
    main(int(sys.argv[1]))
