"""Residuals of measured profiles as text."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from wearsim.errors import ScenarioError
from wearsim.levelling import ComputedProfile, Measured, levelled, residuals, rms
from wearsim.report.text import count, shown

_MISALIGNED = 0.5  # ratio of residuals below which levelling is suggested


def level_hint(measured: Measured, computed: ComputedProfile) -> str:
    """Return the residual that levelling would leave if it were far smaller, or an empty text."""
    with suppress(ScenarioError):  # cannot be levelled
        left = rms(levelled(measured, computed), computed)
        if left < _MISALIGNED * rms(measured, computed):
            return f"; rms {shown(left, 'um', 3)} with --level"
    return ""


def residual_text(measured: Measured, computed: ComputedProfile) -> str:
    """Return the root mean square of measured minus computed heights, and their mean.

    Points beyond the strips are not compared. With a band, the part of the points within it is
    added.

    Parameters
    ----------
    measured : Measured
    computed : ComputedProfile
    """
    y, height, residual = residuals(measured, computed)
    if len(y) == 0:
        return "no point on the strips, no residual"
    text = (
        f"residual rms {shown(rms(measured, computed), 'um', 3)},"
        f" mean {shown(float(residual.mean()), 'um', 3)}, {count(len(y))} points"
    )
    if computed.label:
        low, high = (np.interp(y, computed.y, end) for end in (computed.low, computed.high))
        text += f", {shown(float(((height >= low) & (height <= high)).mean()), '%', 3)} in the band"
    return text
