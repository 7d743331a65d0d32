"""Random numbers by address: a counter-based generator that needs no state to be stored.

Every number belongs to (seed, input name, purpose, realisation, block, position) and to nothing
else, so that another order, batch or number of workers, or one more input, changes no draw.
"""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.types import FloatArray

Purpose: TypeAlias = Literal["test", "pass", "field", "process", "plan"]

_LANES = 4  # 64-bit words that the generator yields per count
_STEP = 2.0**-52  # one bit short of a float's 53, so that half a step more is exact, and below 1


@dataclass(frozen=True)
class Stream:
    """The uniform numbers of one input.

    Parameters
    ----------
    seed : int
        Seed of the scenario.
    name : str
        Name of the input, "load.normal_force".
    purpose : {"test", "pass", "field", "process", "plan"}
        What they are for: values of whole tests, of single passes, cells of a field, steps of a
        process, or the inner workings of a sampling plan.
    """

    seed: int
    name: str
    purpose: Purpose = "test"

    @property
    def _key(self) -> npt.NDArray[np.uint64]:
        text = f"{self.seed}\n{self.purpose}\n{self.name}"
        return np.frombuffer(sha256(text.encode()).digest()[:16], dtype="<u8").astype(np.uint64)

    def words(
        self, first: int, count: int, realisation: int = 0, block: int = 0
    ) -> npt.NDArray[np.uint64]:
        """Return random words, shape (count,), from position `first` on.

        Parameters
        ----------
        first, count : int
            Position of the first, and how many.
        realisation, block : int
            The rest of the address.
        """
        counter = np.array([first // _LANES, realisation, block, 0], dtype=np.uint64)
        generator = np.random.Philox(key=self._key, counter=counter)
        skipped = first % _LANES
        return np.asarray(generator.random_raw(count + skipped)[skipped:], dtype=np.uint64)

    def uniforms(self, first: int, count: int, realisation: int = 0, block: int = 0) -> FloatArray:
        """Return uniform numbers between 0 and 1, both excluded; parameters as of `words`."""
        words = self.words(first, count, realisation, block)
        return np.asarray(((words >> np.uint64(12)) + 0.5) * _STEP)

    def rows(self, first: int, count: int, dimension: int, realisation: int = 0) -> FloatArray:
        """Return uniform numbers for draws that take several each, (count, dimension).

        Component k of every draw has the block k; other parameters as of `words`.
        """
        columns = [self.uniforms(first, count, realisation, k) for k in range(dimension)]
        return np.stack(columns, axis=1)
