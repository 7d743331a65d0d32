"""What changes while an ensemble grows, in two places written by turns: one is always whole.

Each writing has a number, its length and a checksum; the newest that is sound counts. A kill in
the middle of a writing spoils the older of the two.
"""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from wearsim.results.content import Arrays, as_plain

NAMES = ("finished", "warnings", "notes", "wall_seconds", "statistics")
"""The fields of `EnsembleData` that change."""
PLACES = ("state_0", "state_1")
"""Where they stand, by turns."""
PLACE_BYTES = 1 << 17

_HEAD = struct.Struct("<QI")  # number of the writing, length of its text
_CHECK = struct.Struct("<I")
_BEFORE = _HEAD.size + _CHECK.size


def first_places(state: Mapping[str, Any]) -> Arrays:
    """Return both places of a new file, the first state in one of them.

    Parameters
    ----------
    state : mapping
        The fields of NAMES.

    Returns
    -------
    dict of str to ndarray
        Bytes by place.
    """
    places = {name: np.zeros(PLACE_BYTES, np.uint8) for name in PLACES}
    content = np.frombuffer(written(0, state), np.uint8)
    places[place_of(0)][: len(content)] = content
    return places


def place_of(number: int) -> str:
    """Return where a writing goes.

    Parameters
    ----------
    number : int
        Number of the writing.
    """
    return PLACES[number % len(PLACES)]


def written(number: int, state: Mapping[str, Any]) -> bytes:
    """Return a state as it stands in the file.

    Parameters
    ----------
    number : int
        Number of the writing.
    state : mapping
        The fields of NAMES.

    Returns
    -------
    bytes

    Raises
    ------
    ValueError
        If it holds other fields, or is too long.
    """
    if state.keys() != set(NAMES):
        raise ValueError(f"a state has the fields {sorted(NAMES)}, got {sorted(state)}")
    text = json.dumps(dict(state), default=as_plain).encode()
    if len(text) > PLACE_BYTES - _BEFORE:
        raise ValueError(f"a state of {len(text)} bytes does not fit {PLACE_BYTES - _BEFORE}")
    head = _HEAD.pack(number, len(text))
    return head + _CHECK.pack(zlib.crc32(head + text)) + text


def newest(places: Sequence[bytes]) -> tuple[int, dict[str, Any]]:
    """Return the newest sound state and the number of its writing.

    Parameters
    ----------
    places : sequence of bytes
        What stands in each of PLACES.

    Returns
    -------
    number : int
    state : dict

    Raises
    ------
    ValueError
        If none is sound.
    """
    found = [state for state in map(_sound, places) if state]
    if not found:
        raise ValueError("its state is not sound in either place")
    return max(found, key=lambda state: state[0])


def _sound(place: bytes) -> tuple[int, dict[str, Any]] | None:
    number, length = _HEAD.unpack_from(place)
    (check,) = _CHECK.unpack_from(place, _HEAD.size)
    text = place[_BEFORE : _BEFORE + length]
    if len(text) != length or zlib.crc32(place[: _HEAD.size] + text) != check:
        return None
    return number, json.loads(text)
