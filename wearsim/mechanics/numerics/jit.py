"""The one place for numba's options, and for the arrays that they make kernels take."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np

from wearsim.types import FloatArray

P = ParamSpec("P")
R = TypeVar("R")

# a kernel is never handed to C, which is what the second wrapper would be for
_OPTIONS = {"nopython": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` with numba, cached on disk wherever a cache can be kept.

    No fastmath and no parallel reduction: a resumed run must equal an unbroken one bit for bit.
    Every kernel is called with one signature only (C-contiguous float64 arrays, floats, ints), so
    that processes starting together write the same cache entries.
    """
    compiled: Callable[P, R] = _cached(_dispatcher(function))
    return compiled


def inlined_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` as `kernel` does, and put its code in the place of every call.

    For the little that an inner loop calls: a loop with a call left in it is not vectorised.
    """
    compiled: Callable[P, R] = _cached(_dispatcher(function, forceinline=True))
    return compiled


def _cached(compiled: Any) -> Any:
    """Return what compiles a function, cached on disk wherever a cache can be kept."""
    try:
        compiled.enable_caching()
    except RuntimeError:
        pass  # neither the source tree nor the user's cache folder can be written: compile afresh
    else:
        _renew_with_any_kernel(compiled)
    return compiled


def _dispatcher(function: Callable[P, R], **options: bool) -> Any:
    """Return what compiles a function, in half the time where numba is built as it was."""
    try:
        from wearsim.mechanics.numerics.kernel_dispatcher import Whole  # noqa: PLC0415  (may not be there)

        return Whole(function, targetoptions=_OPTIONS | options)
    except (ImportError, AttributeError, TypeError):
        plain: Any = numba.njit
        return plain(error_model="numpy", **options)(function)


def own_array(array: FloatArray) -> FloatArray:
    """Return a contiguous copy that can be written to: kernels are compiled for such alone."""
    return np.array(array, dtype=np.float64, order="C")


def _renew_with_any_kernel(compiled: Any) -> None:
    """Make the cache stale when any kernel's source changes, not the function's own file alone.

    A kernel holds compiled copies of those it calls; numba does not look at their files.
    """
    cache_file = getattr(compiled._cache, "_cache_file", None)
    if cache_file is not None:
        cache_file._source_stamp = (cache_file._source_stamp, _sources())


@cache
def _sources() -> str:
    """Return a digest of all kernels' sources."""
    digest = sha256()
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
