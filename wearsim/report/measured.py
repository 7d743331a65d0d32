"""Residuals of measured profiles as text."""

from __future__ import annotations

import numpy as np

from wearsim.levelling import ComputedProfile, Measured, residuals, rms
from wearsim.report.text import count, shown


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
