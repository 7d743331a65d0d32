"""Settings of the tests by rule machines: few short ones, more by WEARSIM_STATES=200."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

_COUNT = os.environ.get("WEARSIM_STATES", "")

#: Without the variable the same few sequences of rules every time.
STATES = settings(
    max_examples=int(_COUNT or 5),
    stateful_step_count=40 if _COUNT else 15,
    derandomize=not _COUNT,
    database=None,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)
