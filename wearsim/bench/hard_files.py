"""Files that hard cases name: worn, rough and broken profiles, and logs of loads."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wearsim.types import FloatArray

_REACH, _POINTS = 16.0, 801  # mm to either side of the middle, and how many heights
_ROUGHNESS_WAVES = 24
_EDGE = 1e-3  # of a test: how long a load takes from one level to the next


def profile(height: Callable[[FloatArray], FloatArray], finer: int = 1) -> str:
    """Return the CSV of a profile.

    Parameters
    ----------
    height : callable
        Height [um] over the axial position [mm].
    finer : int
        How many times closer its points are, over as many times less width.
    """
    y = np.linspace(-_REACH / finer, _REACH / finer, _POINTS)
    return _csv("y [mm], height [um]", y, height(y))


def log_of_load(duration: float, parts: tuple[float, ...], levels: tuple[float, ...]) -> str:
    """Return the CSV of a load that holds one level after another.

    Parameters
    ----------
    duration : float
        Length of the test [s].
    parts : tuple of float
        Where each level but the first begins, as part of the test.
    levels : tuple of float
        Loads [N].
    """
    time, load = [0.0], [levels[0]]
    for part, before, after in zip(parts, levels[:-1], levels[1:], strict=True):
        time += [part * duration, (part + _EDGE) * duration]
        load += [before, after]
    return _csv("time [s], load [N]", np.array([*time, duration]), np.array([*load, levels[-1]]))


def step(y: FloatArray) -> FloatArray:
    """Return a groove 5 um deep with upright sides, 0.5 mm to either side of the middle."""
    return np.where(np.abs(y) < 0.5, -5.0, 0.0)


def groove(y: FloatArray) -> FloatArray:
    """Return a smooth groove 8 um deep, which leaves two patches."""
    return -8.0 * np.exp(-np.square(y / 0.5))


def edge(y: FloatArray) -> FloatArray:
    """Return a track that ends 0.8 mm beside the middle."""
    return np.where(y > 0.8, -60.0, 0.0)


def ridges(y: FloatArray) -> FloatArray:
    """Return two ridges: the roller first touches the higher, then both, then all between."""
    first, second = (np.exp(-np.square((y - at) / 0.2)) for at in (-0.8, 0.8))
    found: FloatArray = 30.0 * first + 8.0 * second
    return found


def waviness(y: FloatArray) -> FloatArray:
    """Return waves of 0.4 mm, 0.5 um high, that come and go."""
    return 0.5 * np.sin(2.0 * np.pi * y / 0.4) * np.cos(1.7 * y)


def roughness(y: FloatArray) -> FloatArray:
    """Return roughness as it is measured: 0.5 um rms, correlated over 0.1 mm, of fixed phases.

    Waves of a Gaussian spectrum, equally spaced in wave number, with phases of the golden ratio.
    """
    length, number = 0.1, np.arange(1, _ROUGHNESS_WAVES + 1)
    wave = 4.0 / length * (number - 0.5) / _ROUGHNESS_WAVES
    amplitude = np.exp(-np.square(0.5 * wave * length) / 2.0)
    phase = 2.0 * np.pi * ((0.5 * (np.sqrt(5.0) - 1.0) * np.square(number)) % 1.0)
    found: FloatArray = amplitude @ np.cos(wave[:, None] * y + phase[:, None])
    found *= 0.5 / np.sqrt(0.5 * np.square(amplitude).sum())
    return found


def _csv(head: str, *columns: FloatArray) -> str:
    rows = (", ".join(map(repr, row)) for row in np.stack(columns, axis=1).tolist())
    return "\n".join([head, *rows])
