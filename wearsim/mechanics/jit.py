"""The one place for numba's options."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numba

P = ParamSpec("P")
R = TypeVar("R")


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` with numba, cached on disk wherever a cache can be kept.

    No fastmath and no parallel reduction: a resumed run must equal an unbroken one bit for bit.
    Every kernel is called with one signature only (C-contiguous float64 arrays, floats, ints), so
    that processes starting together write the same cache entries.
    """
    try:
        compiled = numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:
        # neither the source tree nor the user's cache folder can be written: compile afresh
        compiled = numba.njit(error_model="numpy")(function)
    return compiled  # type: ignore[no-any-return]
