"""Compilation options of the kernels, the disk cache, and the arrays that kernels accept."""

from __future__ import annotations

import gc
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache, update_wrapper
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, NamedTuple, ParamSpec, TypeVar

import numpy as np

from wearsim.operating_system import lock_file, processors
from wearsim.types import FloatArray

P = ParamSpec("P")
R = TypeVar("R")

# kernels are never passed to C code, for which numba would compile a second wrapper
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}
OPTIMISATION = 1  # level at which LLVM optimises kernels
KEPT = 86400.0  # seconds for which the compiled kernels of other sources are kept
_KERNELS: list[Kernel] = []
# those that numba has not been given yet, by the functions that Python calls
_SUBROUTINES: list[tuple[Callable[..., Any], Callable[..., Any]]] = []
_REPORTS: list[Callable[[str], None]] = []
_ALONGSIDE: dict[str, list[Alongside]] = {}  # by the name of a kernel
# kernels of another process; each is interpreted until the cache holds the kernel of the value
_INTERPRETED: dict[str, str] = {}
_SEARCHED: dict[str, float] = {}  # when the cache was last searched for those kernels
SEARCH = 0.1  # seconds between two searches of the cache
_STARTED: list[Any] = []  # processes that compile kernels
_LOCK = threading.RLock()


class Kernel:
    """Function that numba compiles, or reads from the cache, when it is first called.

    numba takes half a second to import and to prepare, and many commands call no kernel. While
    another process compiles the function, Python may interpret it, see `compile_alongside`.

    Parameters
    ----------
    function : callable
        The function in Python.
    """

    may_be_interpreted = True  # of all kernels, see `only_compiled`

    def __init__(self, function: Callable[..., Any]) -> None:
        update_wrapper(self, function)
        self.__name__: str = function.__name__
        self._function = function
        self._dispatcher: Any = None
        self.is_short: Callable[..., bool] | None = None  # whether a call may be interpreted

    def __call__(self, *arguments: Any) -> Any:
        """Call the compiled function, or the interpreted one while another process compiles it."""
        if self._dispatcher is not None:
            return self._dispatcher(*arguments)
        if self._is_interpreted(arguments):
            arrays = [a for a in arguments if isinstance(a, np.ndarray) and a.flags.writeable]
            saved = [array.copy() for array in arrays]
            try:
                with np.errstate(all="ignore"):
                    return self._function(*arguments)
            except (ArithmeticError, ValueError):  # compiled functions return what is not finite
                for array, before in zip(arrays, saved, strict=True):
                    array[...] = before
        # of the objects of numba and of a compilation almost all remain; collecting garbage among
        # them takes a tenth of the time
        with _without_collection():
            return self.dispatcher(*arguments)

    def _is_interpreted(self, arguments: Sequence[Any]) -> bool:
        """Return whether another process compiles the function, which is started if need be."""
        if not Kernel.may_be_interpreted:
            return False
        name, is_short = self.__name__, self.is_short
        if is_short and name in _ALONGSIDE and is_short(False, *arguments) and not_cached({name}):
            _call_elsewhere(name, interpreted=True)
        if name not in _INTERPRETED or (is_short and not is_short(True, *arguments)):
            return False
        for report in _REPORTS if name not in _SEARCHED else ():
            report(name)
        if time.monotonic() > _SEARCHED.get(name, 0.0) + SEARCH:
            if _STARTED[-1].poll() is not None or not not_cached({_INTERPRETED[name]}):
                del _INTERPRETED[name]
                return False
            _SEARCHED[name] = time.monotonic()
        return True

    @property
    def dispatcher(self) -> Any:
        """Dispatcher of numba, which compiled functions call."""
        with _LOCK:
            if self._dispatcher is None:
                if self.__name__ in _ALONGSIDE and not_cached({self.__name__}):
                    # before numba is imported, for half a second
                    _call_elsewhere(self.__name__, interpreted=False)
                self._dispatcher = _compiled(self._function)
        return self._dispatcher

    @property
    def is_ready(self) -> bool:
        """Whether this process has compiled the function or read it from the cache."""
        return self._dispatcher is not None and bool(self._dispatcher.signatures)


def _compiled(function: Callable[..., Any]) -> Any:
    """Return a dispatcher of numba with the options of kernels and their cache."""
    numba = _prepared_numba()
    _register_subroutines()
    folder, folder_of_user = _cache_folder(), numba.config.CACHE_DIR
    try:
        if folder is not None:
            numba.config.CACHE_DIR = str(folder)
        return numba.njit(function, cache=folder is not None, **_OPTIONS)
    finally:
        numba.config.CACHE_DIR = folder_of_user


@cache
def _prepared_numba() -> Any:
    """Import numba, let compiled functions call kernels, and report compilations."""
    with _without_scipy_linalg():
        import numba  # noqa: PLC0415
        import numba.np.arraymath  # noqa: PLC0415
    from llvmlite.binding import set_option  # noqa: PLC0415
    from numba.core import event  # noqa: PLC0415
    from numba.extending import typeof_impl  # noqa: PLC0415

    config: Any = numba.config

    class Compilations(event.Listener):
        """Listener that reports every kernel when its compilation starts, and sets its level.

        The second level makes compilation a twentieth longer, the third one more, and no kernel
        faster. Loops over the strips of a contact are too short for being unrolled: without it
        compilation takes four fifths of the time, and a batch of contacts nine tenths.
        """

        def __init__(self) -> None:
            self.levels: list[Any] = []  # of the compilations in progress, each within the last

        def on_start(self, event: Any) -> None:
            """Report the kernel; subroutines are compiled as a part of it."""
            dispatcher = event.data["dispatcher"]
            self.levels.append(config.OPT)
            if any(kernel._dispatcher is dispatcher for kernel in _KERNELS):
                config.OPT = min(config.OPT, OPTIMISATION)
                set_option("wearsim", "-unroll-runtime=0")
                for report in _REPORTS:
                    report(dispatcher.__name__)

        def on_end(self, event: Any) -> None:
            """Restore the optimisation of other functions."""
            config.OPT = self.levels.pop()
            if not self.levels:
                set_option("wearsim", "-unroll-runtime=1")

    event.register("numba:compile", Compilations())
    _compile_borrowed()
    typeof_impl.register(Kernel)(lambda kernel, _: numba.typeof(kernel.dispatcher))
    return numba


def _compile_borrowed() -> None:
    """Let compiled functions call `borrowed` and `kept`: arrays without an owner are not counted.

    Both are compiled into the caller, since separate functions take far longer to compile.
    """
    from numba.core import cgutils, types  # noqa: PLC0415
    from numba.extending import lower_builtin, type_callable  # noqa: PLC0415

    def without_owner(context: Any, builder: Any, kind: Any, value: Any) -> Any:
        if isinstance(kind, types.BaseTuple):
            parts: Any = kind
            for place, part in enumerate(parts.types):
                item = builder.extract_value(value, place)
                item = without_owner(context, builder, part, item)
                value = builder.insert_value(value, item, place)
        elif isinstance(kind, types.Array):
            array = cgutils.create_struct_proxy(kind)(context, builder, value=value)
            array.meminfo = cgutils.get_null_value(array.meminfo.type)
            return array._getvalue()
        return value

    type_callable(borrowed)(lambda _: lambda values: values)
    lower_builtin(borrowed, types.Any)(
        lambda context, builder, signature, arguments: without_owner(
            context, builder, signature.return_type, arguments[0]
        )
    )
    type_callable(kept)(lambda _: lambda values: types.none)
    lower_builtin(kept, types.Any)(lambda context, *_: context.get_dummy_value())


def borrowed(values: R) -> R:
    """Return an array, or a tuple of arrays, whose references compiled functions do not count.

    numba counts the references to each array of a tuple at most calls of a subroutine, which takes
    up to half of the time of short loops. The owner of the memory must be in use until the last use
    of the arrays returned: an argument of a kernel is, for other arrays see `kept`.
    """
    return values


def kept(values: object) -> None:
    """Do nothing; arrays that a kernel has allocated remain allocated up to this call."""


def _register_subroutines() -> None:
    from numba.extending import overload  # noqa: PLC0415

    # a call passes an array of a tuple as nine numbers: a quarter of the time of a contact
    options: Any = _OPTIONS | {"forceinline": True}
    while _SUBROUTINES:
        called, compiled = _SUBROUTINES.pop()
        overload(called, jit_options=options, strict=False)(lambda *_, one=compiled, **__: one)


@contextmanager
def _without_scipy_linalg() -> Iterator[None]:
    """Let numba find no scipy.linalg in the context, which takes a tenth of a second to import.

    numba asks whether it exists for a faster numpy.convolve, and imports it again where a function
    calls BLAS. In the threads of a pool another one may be importing scipy, which would then fail.
    """
    name, main = "scipy.linalg", threading.main_thread()
    hidden = name not in sys.modules and threading.current_thread() is main
    if hidden:
        sys.modules[name] = None  # type: ignore[assignment]
    try:
        yield
    finally:
        if hidden:
            del sys.modules[name]


@contextmanager
def _without_collection() -> Iterator[None]:
    """Disable Python's garbage collector in the context."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Compile `function` with numba when it is called, and cache it on disk where possible.

    No fastmath and no parallel reduction: a resumed run must equal an unbroken run bit for bit.
    Every kernel is called with one signature only (C-contiguous float64 arrays, floats, ints), so
    that processes that start at the same time write identical cache entries.
    """
    compiled: Any = Kernel(function)
    _KERNELS.append(compiled)
    return compiled  # type: ignore[no-any-return]


def subroutine(function: Callable[P, R]) -> Callable[P, R]:
    """Let kernels call `function`, which is compiled with each of them; Python interprets it.

    A subroutine needs no wrapper for Python and no entry in the cache, which saves a third of the
    compilation time.
    """
    return subroutine_of(function)(function)


def subroutine_of(in_python: Callable[P, R]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Let kernels call a subroutine, in place of which Python calls `in_python`.

    Python takes ten times as long for a loop over the elements of arrays as for whole arrays, of
    which numba would compile the operations one by one. The results must be equal to the last bit.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        _SUBROUTINES.append((in_python, function))
        if "numba" in sys.modules:
            _register_subroutines()
        return in_python

    return decorate


@contextmanager
def only_compiled() -> Iterator[None]:
    """Let Python interpret no kernel in the context, as other processes need them compiled."""
    before, Kernel.may_be_interpreted = Kernel.may_be_interpreted, False
    try:
        yield
    finally:
        Kernel.may_be_interpreted = before


@contextmanager
def compilation_reported(report: Callable[[str], None]) -> Iterator[None]:
    """Call `report` with the name of every kernel that is compiled in the context, at its start."""
    _REPORTS.append(report)
    try:
        yield
    finally:
        _REPORTS.remove(report)


class Alongside(NamedTuple):
    """Function that compiles kernels in another process, as of `compile_alongside`."""

    function: Callable[[], None]
    kernels: tuple[str, ...]
    within: bool


def compile_alongside(
    name: str,
    function: Callable[[], None],
    *kernels: str,
    within: bool = False,
    is_short: Callable[..., bool] | None = None,
) -> None:
    """Register a function that compiles kernels in another process, while this one compiles.

    This process reads from the cache what the other one has compiled by then, and compiles the
    rest. Nothing is started without a cache or a second processor. A test of few strips needs less
    time in Python than its kernels take to be compiled: if the first call of the kernel `name` is
    short, the other process compiles all kernels, and Python interprets those it has not compiled
    yet. Interpreted and compiled kernels have equal results to the last bit.

    Parameters
    ----------
    name : str
        Kernel whose first call starts the process, if the cache lacks it.
    function : callable
        Public function of a module.
    *kernels : str
        Kernels that it compiles.
    within : bool
        Whether the kernel `name` calls them; they are then compiled first.
    is_short : callable, optional
        Of the kernel `name` itself: returns whether a call may be interpreted, by whether the
        process has been started, and by the arguments of the call.
    """
    registered = _ALONGSIDE.setdefault(name, [])
    registered.append(Alongside(function, kernels, within))
    registered.sort(key=lambda other: 0 if other.within else 1 if name in other.kernels else 2)
    if is_short is not None:
        next(one for one in _KERNELS if one.__name__ == name).is_short = is_short


def _call_elsewhere(name: str, *, interpreted: bool) -> None:
    """Start a process that calls the functions registered for a kernel.

    Nothing is started without a cache or a second processor. The process ends when the last
    function returns, also after the end of this process. It compiles the kernel itself, too, if
    Python interprets kernels meanwhile.
    """
    registered = [a for a in _ALONGSIDE.pop(name, ()) if interpreted or name not in a.kernels]
    if not registered or processors() == 1 or _cache_folder() is None:
        return
    # the kernel contains those that it calls
    called = [a.function for a in registered if not (interpreted and a.within)]
    functions = [(one.__module__, one.__name__) for one in called]
    code = (
        f"import sys; sys.path[:] = {sys.path!r}; "
        f"from {__name__} import call_functions; call_functions({functions!r})"
    )
    quiet: dict[str, Any] = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    with suppress(OSError):
        command = [sys.executable, "-c", code]
        _STARTED.append(subprocess.Popen(command, **quiet, start_new_session=True))
        for one in registered if interpreted else ():
            _INTERPRETED.update((kernel, name if one.within else kernel) for kernel in one.kernels)


def call_functions(names: Sequence[tuple[str, str]]) -> None:
    """Call functions, by module and name, in a process in which every kernel is compiled.

    While another process does so, this one waits for it, and then finds its kernels in the cache.
    """
    functions = [getattr(import_module(module), name) for module, name in names]
    _ALONGSIDE.clear()
    folder = _cache_folder()
    assert folder is not None
    with Path(folder, "compiling").open("w") as file:
        while True:
            try:
                lock_file(file.fileno())
                break
            except OSError:
                time.sleep(SEARCH)
        for function in functions:
            function()


def ready_kernels() -> set[str]:
    """Return the names of the kernels that this process has compiled or read from the cache."""
    return {kernel.__name__ for kernel in _KERNELS if kernel.is_ready}


def not_cached(names: Iterable[str]) -> set[str]:
    """Return the kernels, by name, that the disk cache lacks; all if there is no cache.

    The file names are those of numba, which writes the index of a kernel before its code. If
    another version names its files differently, the kernels are only considered to be missing.
    """
    folder = _cache_folder()
    cached = () if folder is None else folder.glob("*/*.nbc")
    return set(names) - {path.name.partition(".")[2].partition("-")[0] for path in cached}


def own_array(array: FloatArray) -> FloatArray:
    """Return a writable contiguous copy, the kind of array that kernels accept."""
    return np.array(array, dtype=np.float64, order="C")


def kernel_input(array: FloatArray) -> FloatArray:
    """Return `array` if kernels accept it, or a copy; for arrays that kernels do not change."""
    return array if array.flags.carray and array.dtype == np.float64 else own_array(array)


def kernel_inputs(*arrays: FloatArray) -> list[FloatArray]:
    """Return arrays as of `kernel_input`."""
    for array in arrays:
        if not (array.flags.carray and array.dtype == np.float64):
            return [kernel_input(array) for array in arrays]
    return [*arrays]


def _cache_folder() -> Path | None:
    """Return the folder of the compiled kernels of these sources; None where none is writable."""
    home = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or "~/.cache"
    return cache_folder(Path(__file__).parents[1], os.environ.get("NUMBA_CACHE_DIR", ""), home)


@cache
def cache_folder(package: Path, of_user: str, home: str) -> Path | None:
    """Return the folder of the kernels of a package, created if it does not exist.

    A kernel contains compiled copies of the subroutines it calls, whose files numba does not check.
    The name of the folder therefore contains a digest of all Python files of the package: a change
    of any of them recompiles all kernels.

    Parameters
    ----------
    package : Path
    of_user : str
        The user's `NUMBA_CACHE_DIR`, or an empty string; preferred to the folder of the package.
    home : str
        Folder of cached files of the user, for a package in a folder that cannot be written.

    Returns
    -------
    Path or None
        None where none of the three can be written.
    """
    install = f"wearsim-{sha256(str(package).encode()).hexdigest()[:8]}-"
    digest = sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(path.read_bytes())
    places: list[Any] = [of_user, package / "__pycache__", os.path.expanduser(home)]
    for place in filter(None, places):
        folder = Path(place, install + digest.hexdigest()[:12])
        writable = folder.is_dir()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with TemporaryFile(dir=folder):
                pass
        except OSError:
            continue
        if not writable:
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
