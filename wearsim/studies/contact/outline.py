"""Outline of the contact on strips: the edges of the patch, and strips and outline of each."""

from __future__ import annotations

import numpy as np

from wearsim.types import FloatArray


def patch_edges(y: FloatArray, half_length: FloatArray) -> tuple[float, float] | None:
    """Return the axial positions of the two edges of the contact [m], or None without contact.

    Near an edge the square of the half-length decreases linearly; the edge is its zero,
    extrapolated from the two outermost strips by at most one strip width.

    Parameters
    ----------
    y : ndarray, shape (strips,)
        Axial position of the strips [m].
    half_length : ndarray, shape (strips,)
        Half-length a(y) of the contact [m].
    """
    touching = np.flatnonzero(half_length > 0.0)
    if len(touching) == 0:
        return None
    first, last = int(touching[0]), int(touching[-1])
    spacing = float(y[1] - y[0])
    return (
        float(y[first]) - spacing * _beyond(half_length, first, 1),
        float(y[last]) + spacing * _beyond(half_length, last, -1),
    )


def patch_strips(half_length: FloatArray) -> list[slice]:
    """Return the range of strips of each patch of a contact.

    Parameters
    ----------
    half_length : ndarray, shape (strips,)
        Half-length a(y) of the contact [m].
    """
    touching = np.concatenate([[False], half_length > 0.0, [False]])
    ends = np.flatnonzero(np.diff(touching.astype(np.int8)))
    return [slice(int(i), int(j)) for i, j in zip(ends[::2], ends[1::2], strict=True)]


def patch_outlines(y: FloatArray, half_length: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return the outline of each patch, across and along, up to its edges beyond the strips [m].

    Parameters
    ----------
    y, half_length : ndarray, shape (strips,)
        As of `patch_edges`.
    """
    outlines = []
    for strips in patch_strips(half_length):
        inside, a, patch = y[strips], half_length[strips], np.zeros_like(half_length)
        patch[strips] = a
        edges = patch_edges(y, patch)
        assert edges is not None
        part = np.linspace(0.0, 1.0, 12)
        left = edges[0] + (inside[0] - edges[0]) * part
        right = inside[-1] + (edges[1] - inside[-1]) * part
        across, ends = np.concatenate([left, inside, right]), np.sqrt(part)
        # the square of the half-length is linear there
        height = np.concatenate([a[0] * ends, a, a[-1] * ends[::-1]])
        outlines.append(
            (np.concatenate([across, across[::-1]]), np.concatenate([height, -height[::-1]]))
        )
    return outlines


def _beyond(half_length: FloatArray, strip: int, inwards: int) -> float:
    """Return the distance of the edge from the centre of the outermost strip, in strips."""
    inner = strip + inwards
    if not 0 <= inner < len(half_length):
        return 0.5
    outer_square, inner_square = half_length[strip] ** 2, half_length[inner] ** 2
    if inner_square <= outer_square:
        return 0.5
    return float(np.clip(outer_square / (inner_square - outer_square), 0.0, 1.0))
