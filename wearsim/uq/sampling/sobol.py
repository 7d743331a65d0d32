"""Random number streams by Philox, and Sobol sequences."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from wearsim.types import FloatArray

_LANES = 4  # 64-bit words per count of the generator
_STEP = 2.0**-52  # one bit fewer than a float has, so that (k + 1/2) _STEP is exact and below 1
Words: TypeAlias = npt.NDArray[np.uint32]
SLOTS = 16
#: First slot of each common input, and its number of slots.
SLOT_OF = {
    "load.normal_force": (0, 1),
    "friction.coefficient": (1, 1),
    "creepage.longitudinal": (2, 1),
    "creepage.misalignment": (3, 2),
    "creepage.yaw": (3, 1),
    "creepage.tilt": (4, 1),
    "wear.cylinder.k_over_h": (5, 1),
    "wear.roller.k_over_h": (6, 1),
    "load.stiffness": (7, 1),
    "creepage.bearing_torque": (8, 1),
    "load.thermal.gain": (9, 1),
    "load.thermal.time_constant": (10, 1),
    "roller.offset": (11, 1),
}
_ROLLER = re.compile("0|[1-9][0-9]{0,2}")  # fewer than scipy's 21201 dimensions
_BITS = 32
_ROUNDS = 4
_VALUES, _ORDER = 0, 1  # uses of a key


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
    purpose: Literal["test", "pass", "field", "process", "plan"] = "test"

    @property
    def _key(self) -> npt.NDArray[np.uint64]:
        return np.frombuffer(
            sha256(f"{self.seed}\n{self.purpose}\n{self.name}".encode()).digest()[:16], dtype="<u8"
        ).astype(np.uint64)

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


def slots(name: str, dimension: int) -> range | None:
    """Return the fixed Sobol dimensions of an input, counted from 0, or None.

    Parameters
    ----------
    name : str
        Name of the input, with the number of a roller: "creepage.yaw@2".
    dimension : int
        Number of uniform numbers per realisation.
    """
    base, at, roller = name.partition("@")
    slot, width = SLOT_OF.get(base, (0, 0))
    if dimension > width or (at and not _ROLLER.fullmatch(roller)):
        return None
    start = slot + (SLOTS * (1 + int(roller)) if at else 0)
    return range(start, start + dimension)


def scrambled(
    seed: int, name: str, dimension: int, first: int, count: int, replicate: int = 0
) -> FloatArray:
    """Return the scrambled Sobol points of one input, strictly between 0 and 1.

    Each component is scrambled separately (Owen 1995, DOI 10.1007/978-1-4612-2552-2_19), so that
    each point is uniform over the seeds and the points remain a digital net.

    Parameters
    ----------
    seed : int
        Seed of the scenario.
    name : str
        Name of the input.
    dimension : int
        Number of uniform numbers per realisation.
    first, count : int
        First realisation, and number of realisations.
    replicate : int
        Number of the independent scramble of the sequence.

    Returns
    -------
    ndarray, shape (count, dimension)
    """
    stop = first + count
    if stop > 2**_BITS:
        raise ValueError(f"a Sobol plan has {2**_BITS} realisations, got {stop}; use monte-carlo")
    fixed = slots(name, dimension)
    words = (
        _padded(seed, name, dimension, first, count, replicate)
        if fixed is None
        else _sequence(fixed.stop, first, count)[:, fixed.start :]
    )
    for k in range(dimension):
        words[:, k] = nested_scramble(words[:, k], _key(seed, name, _VALUES, k, replicate))
    return np.asarray((words + 0.5) * 2.0**-_BITS, dtype=np.float64)


def _sequence(dimensions: int, first: int, count: int) -> Words:
    """Return the unscrambled Sobol sequence, shape (count, dimensions)."""
    from scipy.stats.qmc import Sobol  # noqa: PLC0415  (a second to import)

    engine = Sobol(dimensions, scramble=False, bits=_BITS)
    if first > 0:
        engine.fast_forward(first)
    # the first point separately: scipy warns if the first batch is not a power of two
    points = np.concatenate([engine.random(1), engine.random(max(count - 1, 0))])[:count]
    return np.asarray(points * 2.0**_BITS).astype(np.uint32)


def _padded(seed: int, name: str, dimension: int, first: int, count: int, replicate: int) -> Words:
    """Return the first two dimensions of the sequence, in a random order per pair of components.

    The order is a nested scramble of the index: 2^m consecutive realisations from a multiple of 2^m
    are 2^m consecutive points of the sequence, and thus a net (Burley 2020, JCGT 9(4)).
    """
    index = np.arange(first, first + count, dtype=np.uint64).astype(np.uint32)
    words = np.zeros((count, dimension), dtype=np.uint32)
    for k in range(0, dimension, 2):
        order = nested_scramble(index, _key(seed, name, _ORDER, k, replicate))
        words[:, k] = reverse_bits(order)
        if k + 1 < dimension:  # Pascal's triangle modulo 2 times the index
            direction = 2 ** (_BITS - 1)
            for bit in range(_BITS):
                words[:, k + 1] ^= (order >> np.uint32(bit) & np.uint32(1)) * np.uint32(direction)
                direction ^= direction >> 1
    return words


def reverse_bits(words: Words) -> Words:
    """Return 32-bit words with their bits reversed."""
    for width, low in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF)):
        mask, shift = np.uint32(low), np.uint32(width)
        words = (words >> shift & mask) | (words & mask) << shift
    return (words >> np.uint32(16)) | (words << np.uint32(16))


def nested_scramble(words: Words, key: Words) -> Words:
    """Return a nested uniform scramble: each bit is flipped by a hash of the bits above it.

    In sums and products no bit affects those below it, so that on reversed bits the intervals stay
    nested (Laine and Karras 2011; Burley 2020, JCGT 9(4)). The first sum makes each word uniform
    over the keys; the rounds make the flips of different branches independent.

    Parameters
    ----------
    words : ndarray of uint32
        Numbers in units of 2^-32, or indices.
    key : ndarray of uint32, shape (rounds, 3)
        Summand, even factor and odd factor of each round.

    Returns
    -------
    ndarray of uint32, shape as `words`
    """
    mixed = reverse_bits(words)
    for added, even, odd in key:
        mixed = (mixed + added) * odd
        mixed = mixed ^ mixed * even
    return reverse_bits(mixed)


@lru_cache(maxsize=2048)
def _key(seed: int, name: str, use: int, component: int, replicate: int = 0) -> Words:
    """Return the random constants of one scramble."""
    needed = 3 * _ROUNDS
    words = Stream(seed, name, "plan").words(replicate * needed, needed, use, component)
    key = (words >> np.uint64(32)).astype(np.uint32).reshape(_ROUNDS, 3)
    key[:, 1] &= ~np.uint32(1)
    key[:, 2] |= np.uint32(1)
    key.flags.writeable = False
    return key
