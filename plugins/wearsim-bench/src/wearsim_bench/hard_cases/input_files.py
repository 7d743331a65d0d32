"""Input files of the hard cases: profiles and load logs as CSV."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from wearsim.types import FloatArray

_REACH, _POINTS = 16.0, 801  # mm to either side of y = 0, and number of points
_ROUGHNESS_WAVES = 24
_RAMP = 1e-3  # duration of a load step, relative to the test


def profile(height: Callable[[FloatArray], FloatArray], finer: int = 1) -> str:
    """Return the CSV of a profile.

    Parameters
    ----------
    height : callable
        Height [um] over the axial position [mm].
    finer : int
        Factor by which point spacing and width are reduced.
    """
    y = np.linspace(-_REACH / finer, _REACH / finer, _POINTS)
    return _csv("y [mm], height [um]", y, height(y))


def log_of_load(
    duration: float, parts: tuple[float, ...], levels: tuple[float, ...], last: float = _RAMP
) -> str:
    """Return the CSV of a stepwise constant load.

    Parameters
    ----------
    duration : float
        Duration of the test [s].
    parts : tuple of float
        Start of each level except the first, as a fraction of the test.
    levels : tuple of float
        Loads [N].
    last : float
        Duration of the last change of the load, relative to the test.
    """
    time, load = [0.0], [levels[0]]
    ramps = [*(_RAMP for _ in parts[1:]), last]
    for part, ramp, before, after in zip(parts, ramps, levels[:-1], levels[1:], strict=True):
        time += [part * duration, (part + ramp) * duration]
        load += [before, after]
    return _csv("time [s], load [N]", np.array([*time, duration]), np.array([*load, levels[-1]]))


def step(y: FloatArray) -> FloatArray:
    """Return a groove 5 um deep with vertical sides at +-0.5 mm."""
    return np.where(np.abs(y) < 0.5, -5.0, 0.0)


def groove(y: FloatArray) -> FloatArray:
    """Return a smooth groove 8 um deep, with two contact patches."""
    return -8.0 * np.exp(-np.square(y / 0.5))


def edge(y: FloatArray) -> FloatArray:
    """Return a track that ends at y = 0.8 mm."""
    return np.where(y > 0.8, -60.0, 0.0)


def ridges(y: FloatArray) -> FloatArray:
    """Return two ridges: contact on the higher one, then on both, then over the whole width."""
    first, second = (np.exp(-np.square((y - at) / 0.2)) for at in (-0.8, 0.8))
    height: FloatArray = 30.0 * first + 8.0 * second
    return height


def waviness(y: FloatArray) -> FloatArray:
    """Return modulated waves of length 0.4 mm and amplitude 0.5 um."""
    return 0.5 * np.sin(2.0 * np.pi * y / 0.4) * np.cos(1.7 * y)


def roughness(y: FloatArray) -> FloatArray:
    """Return a deterministic roughness of 0.5 um rms with a correlation length of 0.1 mm.

    Sum of waves of a Gaussian spectrum, equally spaced in wave number, with phases from multiples
    of the golden ratio.
    """
    length, number = 0.1, np.arange(1, _ROUGHNESS_WAVES + 1)
    wave = 4.0 / length * (number - 0.5) / _ROUGHNESS_WAVES
    amplitude = np.exp(-np.square(0.5 * wave * length) / 2.0)
    phase = 2.0 * np.pi * ((0.5 * (np.sqrt(5.0) - 1.0) * np.square(number)) % 1.0)
    height: FloatArray = amplitude @ np.cos(wave[:, None] * y + phase[:, None])
    height *= 0.5 / np.sqrt(0.5 * np.square(amplitude).sum())
    return height


def _csv(head: str, *columns: FloatArray) -> str:
    rows = (", ".join(map(repr, row)) for row in np.stack(columns, axis=1).tolist())
    return "\n".join([head, *rows])
