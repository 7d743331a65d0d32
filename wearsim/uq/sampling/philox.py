"""Counter-based random numbers, addressed without a stored state.

Each number depends only on (seed, input name, purpose, realisation, block, position): draws do not
depend on the order, the batch size, the number of workers or the other inputs.
"""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.types import FloatArray

Purpose: TypeAlias = Literal["test", "pass", "field", "process", "plan"]

_LANES = 4  # 64-bit words per count of the generator
_STEP = 2.0**-52  # one bit fewer than a float has, so that (k + 1/2) _STEP is exact and below 1


@dataclass(frozen=True)
class Stream:
    """Stream of uniform numbers of one input.

    Parameters
    ----------
    seed : int
        Seed of the scenario.
    name : str
        Name of the input, "load.normal_force".
    purpose : {"test", "pass", "field", "process", "plan"}
        Use of the numbers: values of whole tests, of single passes, cells of a field, steps of a
        process, or permutations and scrambles of a sampling design.
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
        """Return random words, shape (count,), starting at position `first`.

        Parameters
        ----------
        first, count : int
            Position of the first word, and number of words.
        realisation, block : int
            Realisation and block of the words.
        """
        counter = np.array([first // _LANES, realisation, block, 0], dtype=np.uint64)
        generator = np.random.Philox(key=self._key, counter=counter)
        skipped = first % _LANES
        return np.asarray(generator.random_raw(count + skipped)[skipped:], dtype=np.uint64)

    def uniforms(self, first: int, count: int, realisation: int = 0, block: int = 0) -> FloatArray:
        """Return uniform numbers between 0 and 1, both excluded; parameters as for `words`."""
        words = self.words(first, count, realisation, block)
        return np.asarray(((words >> np.uint64(12)) + 0.5) * _STEP)

    def rows(self, first: int, count: int, dimension: int, realisation: int = 0) -> FloatArray:
        """Return uniform numbers of draws with several components, (count, dimension).

        Component k of each draw is taken from block k; other parameters as for `words`.
        """
        return np.stack(
            [self.uniforms(first, count, realisation, k) for k in range(dimension)], axis=1
        )
