"""Compilation options of the kernels, the disk cache, and the arrays that kernels accept."""

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

# kernels are never passed to C code, for which numba would compile a second wrapper
_OPTIONS = {"nopython": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` with numba and cache it on disk where possible.

    No fastmath and no parallel reduction: a resumed run must equal an unbroken run bit for bit.
    Every kernel is called with one signature only (C-contiguous float64 arrays, floats, ints), so
    that processes that start at the same time write identical cache entries.
    """
    return _compiled(function)


def inlined_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` as `kernel` does and inline it into every caller.

    For small functions called in an inner loop: a loop that contains a call is not vectorised.
    """
    return _compiled(function, forceinline=True)


def _compiled(function: Callable[P, R], **options: bool) -> Callable[P, R]:
    """Return the dispatcher of a function; numba's own where its internals have changed."""
    try:
        from wearsim.mechanics.numerics.kernel_dispatcher import Whole  # noqa: PLC0415  (imports numba's internals)

        compiled: Any = Whole(function, targetoptions=_OPTIONS | options)
    except (ImportError, AttributeError, TypeError):
        compiled = numba.njit(error_model="numpy", forceinline="forceinline" in options)(function)
    try:
        compiled.enable_caching()
    except RuntimeError:  # neither the source tree nor the user's cache folder is writable
        return compiled  # type: ignore[no-any-return]
    # a kernel contains compiled copies of the kernels it calls, whose files numba does not check
    cache_file = getattr(compiled._cache, "_cache_file", None)
    if cache_file is not None:
        cache_file._source_stamp = (cache_file._source_stamp, _sources())
    return compiled  # type: ignore[no-any-return]


def own_array(array: FloatArray) -> FloatArray:
    """Return a writable contiguous copy, the only kind of array that kernels accept."""
    return np.array(array, dtype=np.float64, order="C")


@cache
def _sources() -> str:
    """Return a digest of all Python files under `wearsim/mechanics`, at any depth.

    It is part of the cache key, so that a change of any kernel recompiles all kernels.
    """
    digest = sha256()
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
