"""Compilation options of the kernels, the disk cache, and the arrays that kernels accept."""

from __future__ import annotations

import gc
import os
import shutil
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np
from numba.core import event
from numba.extending import register_jitable

from wearsim.types import FloatArray

P = ParamSpec("P")
R = TypeVar("R")

_CONFIG: Any = numba.config

# kernels are never passed to C code, for which numba would compile a second wrapper
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}
KEPT = 86400.0  # seconds for which the compiled kernels of other sources are kept
_KERNELS: list[Any] = []  # all kernels, as numba's dispatchers


class _WithoutCollection(event.Listener):
    """Listener that disables Python's garbage collector, a tenth of the time, in compilations."""

    def __init__(self) -> None:
        self.depth, self.collecting = 0, True

    def on_start(self, event: Any) -> None:
        """Disable the collector at the start of the outermost compilation."""
        if self.depth == 0:
            self.collecting = gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: Any) -> None:
        """Enable the collector at the end of the outermost compilation."""
        self.depth -= 1
        if self.depth == 0 and self.collecting:
            gc.enable()


event.register("numba:compile", _WithoutCollection())


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` with numba when it is called, and cache it on disk where possible.

    No fastmath and no parallel reduction: a resumed run must equal an unbroken run bit for bit.
    Every kernel is called with one signature only (C-contiguous float64 arrays, floats, ints), so
    that processes that start at the same time write identical cache entries.
    """
    folder, folder_of_user = _cache_folder(), _CONFIG.CACHE_DIR
    try:
        if folder is not None:
            _CONFIG.CACHE_DIR = str(folder)
        compiled: Any = numba.njit(function, cache=folder is not None, **_OPTIONS)
    finally:
        _CONFIG.CACHE_DIR = folder_of_user
    _KERNELS.append(compiled)
    return compiled  # type: ignore[no-any-return]


def subroutine(function: Callable[P, R]) -> Callable[P, R]:
    """Let kernels call `function`, which is compiled with each of them; Python interprets it.

    A subroutine needs no wrapper for Python and no entry in the cache, which saves a third of the
    compilation time.
    """
    return register_jitable(**_OPTIONS)(function)


class _Compilations(event.Listener):
    """Listener that reports every kernel when its compilation starts."""

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report

    def on_start(self, event: Any) -> None:
        """Report the kernel; subroutines are compiled as a part of it."""
        dispatcher = event.data["dispatcher"]
        if any(dispatcher is compiled for compiled in _KERNELS):
            self._report(dispatcher.__name__)

    def on_end(self, event: Any) -> None:
        """Do nothing at the end of a compilation."""


@contextmanager
def compilation_reported(report: Callable[[str], None]) -> Iterator[None]:
    """Call `report` with the name of every kernel that is compiled in the context, at its start.

    A kernel that is read from the cache is not compiled.
    """
    with event.install_listener("numba:compile", _Compilations(report)):
        yield


def ready_kernels() -> set[str]:
    """Return the names of the kernels that this process has compiled or read from the cache."""
    return {kernel.__name__ for kernel in _KERNELS if kernel.signatures}


def not_cached(names: Iterable[str]) -> set[str]:
    """Return the kernels, by name, that the disk cache lacks; all if there is no cache.

    The file names are those of numba. If another version names its files differently, the kernels
    are only considered to be missing.
    """
    folder = _cache_folder()
    found = () if folder is None else folder.glob("*/*.nbi")
    return set(names) - {path.name.partition(".")[2].partition("-")[0] for path in found}


def own_array(array: FloatArray) -> FloatArray:
    """Return a writable contiguous copy, the only kind of array that kernels accept."""
    return np.array(array, dtype=np.float64, order="C")


@cache
def _cache_folder() -> Path | None:
    """Return the folder of the compiled kernels of these sources; None where none is writable.

    A kernel contains compiled copies of the subroutines it calls, whose files numba does not check.
    The name of the folder therefore contains a digest of all Python files under
    `wearsim/mechanics`: a change of any of them recompiles all kernels. The folder is in the user's
    `NUMBA_CACHE_DIR`, next to the kernels, or in the user's folder of cached files.
    """
    package = Path(__file__).parents[1]
    install = f"wearsim-{sha256(str(package).encode()).hexdigest()[:8]}-"
    digest = sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(path.read_bytes())
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or "~/.cache"
    places = [_CONFIG.CACHE_DIR, package / "__pycache__", os.path.expanduser(home)]
    for place in filter(None, places):
        folder = Path(place, install + digest.hexdigest()[:12])
        found = folder.is_dir()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with TemporaryFile(dir=folder):
                pass
        except OSError:
            continue
        if not found:
            _remove_former(folder, install)
        return folder
    return None


def _remove_former(folder: Path, install: str) -> None:
    """Remove the kernels of former sources of this install, which are next to `folder`.

    Processes that still use them are not disturbed: numba compiles a kernel again whose file is
    missing, and creates the folder again. Folders of the last day are kept, as such a process may
    be writing into one.
    """
    for former in folder.parent.glob(install + "*"):
        with suppress(OSError):
            if former != folder and former.stat().st_mtime < time.time() - KEPT:
                shutil.rmtree(former)
