"""Estimated error of contact models from indicators, calibrated with half-space solutions."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from wearsim.types import ContactSolution, FloatArray, OperatingPoint

CALIBRATION = Path(__file__).with_name("calibration.json")
#: Names of the indicators, in the order of `indicators_of`.
INDICATORS = (
    "ln of half-width over half-length",
    "adhesion fraction",
    "ln of creepage over that of full slip",
    "share of spin in the creepage",
    "share of lateral creepage, positive where spin adds to it ahead of the centre",
    "ln of the line load's deviation from a parabola, plus 0.01",
    "ln of the line load's curvature over a half-length, plus 0.001",
)
_BEYOND = 0.1  # allowed beyond the range of an indicator, over that range
#: Times of one contact up to this multiple of the cheapest model's do not count: well below a
#: millisecond.
CHEAP = 10.0
#: indicators whose errors do not increase beyond their greatest and their least value: contacts
#: that are longer across rolling, in full slip, and smoother
_UNLIMITED_ABOVE, _UNLIMITED_BELOW = [0, 2], [5, 6]


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """Estimated error of P_l(y) of one contact model with options.

    Parameters
    ----------
    model : str
        Registered name.
    options : dict of str to Any
        Options with other than default values.
    cost : float
        Measured time of one contact, over the cheapest model.
    coefficients : ndarray, shape (36,)
        Of the quadratic polynomial of the scaled indicators that gives ln(error).
    factor : float
        Safety factor: 95 % of the calibrated contacts have less than `factor` times the
        polynomial's error, by cross-validation.
    """

    model: str
    options: dict[str, Any]
    cost: float
    coefficients: FloatArray
    factor: float

    def error(self, scaled: FloatArray) -> float:
        """Return the estimated error, L2 over the strips; indicators as of `Calibration.scaled`."""
        return float(np.exp(terms_of(scaled[None])[0] @ self.coefficients) * self.factor)

    @property
    def label(self) -> str:
        """Name and options: "slender, tangential fastrip"."""
        return ", ".join([self.model, *(f"{key} {value}" for key, value in self.options.items())])


@dataclass(frozen=True, eq=False)
class Calibration:
    """The calibrated error models, in the order of their cost, and the range of the indicators."""

    models: tuple[ErrorModel, ...]
    mean: FloatArray
    scale: FloatArray
    least: FloatArray
    greatest: FloatArray
    provenance: dict[str, Any]

    def scaled(self, indicators: FloatArray) -> FloatArray:
        """Return indicators, less their mean over the calibration, over their deviation."""
        return np.asarray((self._limited(indicators) - self.mean) / self.scale)

    def outside(self, indicators: FloatArray) -> str:
        """Return the first indicator outside the calibrated contacts with its value, or nothing."""
        margin = _BEYOND * (self.greatest - self.least)
        low, high = self.least - margin, self.greatest + margin
        for name, value, least, most in zip(
            INDICATORS, self._limited(indicators), low, high, strict=True
        ):
            if not least <= value <= most:
                return f"{name} {value:.2g}, calibrated from {least:.2g} to {most:.2g}"
        return ""

    def _limited(self, indicators: FloatArray) -> FloatArray:
        """Return indicators cut to their range on the sides beyond which errors do not increase."""
        limited = indicators.copy()
        limited[_UNLIMITED_ABOVE] = np.minimum(limited, self.greatest)[_UNLIMITED_ABOVE]
        limited[_UNLIMITED_BELOW] = np.maximum(limited, self.least)[_UNLIMITED_BELOW]
        return limited


def preference(error: float, model: ErrorModel) -> tuple[float, float]:
    """Return the key by which models within the tolerance are ordered, the best one first.

    The cheapest is the best; of models that cost at most `CHEAP`, that with the least estimated
    error.
    """
    return max(model.cost, CHEAP), error


@cache
def calibration() -> Calibration:
    """Return the calibration of the package."""
    data = json.loads(CALIBRATION.read_text(encoding="utf-8"))
    models = [
        ErrorModel(**{**item, "coefficients": np.array(item["coefficients"])})
        for item in data["models"]
    ]
    return Calibration(
        tuple(sorted(models, key=lambda item: item.cost)),
        **{name: np.array(data[name]) for name in ("mean", "scale", "least", "greatest")},
        provenance=data["provenance"],
    )


def terms_of(scaled: FloatArray) -> FloatArray:
    """Return the terms of a quadratic polynomial, shape (contacts, 36), of scaled indicators."""
    first, second = np.triu_indices(scaled.shape[1])
    return np.concatenate(
        [np.ones((len(scaled), 1)), scaled, scaled[:, first] * scaled[:, second]], axis=1
    )


def indicators_of(
    solution: ContactSolution,
    longitudinal_curvature: float,
    point: OperatingPoint,
    creep_factor: float = 1.0,
) -> FloatArray:
    """Return the indicators of a contact.

    Parameters
    ----------
    solution : ContactSolution
        The contact by a cheap model, `slender` or else `hertz`.
    longitudinal_curvature : float
        Relative curvature along rolling [1/m].
    point : OperatingPoint
        Its operating point, with uniform friction and creepage.
    creep_factor : float
        That of the model; tractions are those of ideal bodies at as many times the creepages.

    Returns
    -------
    ndarray, shape (7,)
        In the order of `INDICATORS`.
    """
    y, load, length = solution.y, solution.line_load, float(solution.half_length.max())
    touching, spacing = np.flatnonzero(load > 0.0), float(y[1] - y[0])
    first, last = int(touching[0]), int(touching[-1])
    half_width, middle = 0.5 * (last - first + 1) * spacing, 0.5 * float(y[first] + y[last])
    creepage, friction = point.creepage, float(np.mean(point.friction))
    spin = creepage.spin * np.sqrt(length * half_width)
    size = float(np.sqrt(creepage.longitudinal**2 + creepage.lateral**2 + spin**2)) or 1e-300
    full = max(friction, 1e-300) * length * longitudinal_curvature / creep_factor
    lateral = creepage.lateral * (np.sign(spin) or np.sign(creepage.lateral))
    parabola = np.maximum(1.0 - ((y - middle) / half_width) ** 2, 0.0)
    parabola *= load.sum() / parabola.sum()
    there = y[touching]
    before, after = (np.interp(there + way, y, load, 0.0, 0.0) for way in (-length, length))
    bend = np.sqrt(np.mean((before - 2.0 * load[touching] + after) ** 2)) / load.max()
    return np.array(
        [
            np.log(half_width / length),
            solution.adhesion_fraction,
            np.log(size / full),
            abs(spin) / size,
            lateral / size,
            np.log(np.linalg.norm(load - parabola) / np.linalg.norm(load) + 1e-2),
            np.log(bend + 1e-3),
        ]
    )
