"""Script that prints the ids of its worker processes, which then work for minutes."""

from __future__ import annotations

import sys

from batch_works import Squares

from wearsim.studies.execution.factory import executor


def main(scheduler: str) -> None:
    """Run quick batches, and then slow ones for all workers."""
    batches = [*([number] for number in range(1, 9)), *([-number] for number in range(4))]
    with executor(scheduler, 2) as workers:
        for _, results in workers.results(Squares(0.05, 600.0), iter(batches)):
            sys.stdout.write(f"{results[0][1]}\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1])
