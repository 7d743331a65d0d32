"""Compilation of kernels together with the subroutines that they call."""

from __future__ import annotations

import gc
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest

from wearsim.mechanics.numerics import jit
from wearsim.mechanics.numerics.jit import borrowed, compile_alongside, kept, kernel, subroutine


def _third_of_root(x: float) -> float:
    return np.sqrt(x) / 3.0


_root = subroutine(_third_of_root)


@subroutine
def _shifted(x: float) -> float:
    return _root(x) + 0.1


@subroutine
def _inverse(x: float) -> float:
    return 1.0 / x


@kernel
def _sum(x: float, count: int) -> float:
    total = 0.0
    for i in range(count):
        total += _shifted(x + i)
    return total


@kernel
def _combined(x: float, count: int) -> float:
    return _inverse(x) + _sum(x, count)


@kernel
def _misnamed(x: float) -> float:
    return x.no_such_attribute


class _Rows(NamedTuple):
    first: np.ndarray
    second: np.ndarray


@subroutine
def _add_row(number: int, rows: _Rows, total: np.ndarray) -> None:
    for i in range(total.shape[0]):
        rows.second[i] = 2.0 * rows.first[i]
        total[i] += rows.second[i] + number


@kernel
def _row_sums(first: np.ndarray, total: np.ndarray, count: int) -> None:
    owned = _Rows(first, np.empty(first.shape[0]))
    rows, total = borrowed(owned), borrowed(total)
    for number in range(count):
        other = np.full(first.shape[0], np.nan)  # would reuse memory that is free too early
        _add_row(number, rows, total)
        total[0] += np.isnan(other[0]) - 1.0
    kept(owned)


def test_borrowed_arrays_are_not_counted_and_kept_ones_not_freed():
    first, total = np.arange(50.0), np.zeros(50)
    counts = sys.getrefcount(first), sys.getrefcount(total)
    _row_sums(first, total, 20)
    assert (sys.getrefcount(first), sys.getrefcount(total)) == counts
    np.testing.assert_array_equal(total, 20 * 2.0 * first + 190.0)


def test_arrays_of_a_kernel_that_borrows_them_are_freed():
    resource = pytest.importorskip("resource")  # not on every platform
    first, total = np.arange(1e5), np.zeros(100_000)
    _row_sums(first, total, 1)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(300):  # 240 MB
        _row_sums(first, total, 1)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000


@pytest.mark.parametrize("collecting", [True, False])
def test_garbage_collector_is_restored_after_compilation(collecting: bool):
    before = gc.isenabled()
    (gc.enable if collecting else gc.disable)()
    try:
        with pytest.raises(numba.TypingError):
            _misnamed(1.0)
        assert gc.isenabled() == collecting
    finally:
        (gc.enable if before else gc.disable)()


def test_only_kernels_are_compiled_at_their_own_level(monkeypatch):
    levels = []

    def level(_: str) -> None:
        levels.append(numba.config.OPT)

    monkeypatch.setattr(numba.config, "OPT", 3)
    with jit.compilation_reported(level), pytest.raises(numba.TypingError):
        _misnamed(1)
    assert (levels, numba.config.OPT) == ([jit.OPTIMISATION], 3)


def test_subroutine_in_a_kernel_is_bitwise_equal_to_a_kernel():
    third_of_root = kernel(_third_of_root)
    separate = 0.0
    for i in range(100):
        separate += third_of_root(0.7 + i) + 0.1
    assert _sum(0.7, 100) == separate


def test_kernels_call_subroutines_and_kernels():
    assert _combined(4.0, 2) == 1.0 / 4.0 + _sum(4.0, 2)


def test_subroutines_run_in_python():
    assert _shifted(9.0) == 1.1
    assert _inverse(4.0) == 0.25


def test_other_compiled_functions_call_subroutines():
    @numba.njit
    def twice(x: float) -> float:
        return 2.0 * _shifted(x)

    assert twice(9.0) == 2.0 * (1.0 + 0.1)


@pytest.mark.parametrize("place", ["", "somewhere"])
def test_cache_folder_of_other_functions_is_unchanged(place: str, monkeypatch, tmp_path):
    own = str(tmp_path / place) if place else ""
    monkeypatch.setattr(numba.config, "CACHE_DIR", own)
    kernel(_third_of_root)
    assert own == numba.config.CACHE_DIR


def _largest(x: float) -> float:
    return 5.0 * x


def _refused(**_: object) -> None:
    raise PermissionError


def _compile_others() -> None:
    raise AssertionError("is called in another process")


def _compile_parts() -> None:
    raise AssertionError("is called in another process")


@pytest.mark.parametrize("cached", [True, False])
def test_other_kernels_are_compiled_in_a_process_alongside(cached, monkeypatch, tmp_path):
    started = []
    fake = SimpleNamespace(DEVNULL=None, Popen=lambda command, **_: started.append(command))
    monkeypatch.setattr(jit, "subprocess", fake)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    if not cached:
        monkeypatch.setattr(jit, "TemporaryFile", _refused)
    monkeypatch.setattr(jit.os, "sched_getaffinity", lambda _: {0, 1}, raising=False)

    @kernel
    def large(x: float) -> float:
        return 3.0 * x

    compile_alongside("large", _compile_others)
    compile_alongside("large", _compile_parts, within=True)
    assert large(1.0) + large(2.0) == 9.0
    ends = [command[-1].partition("call_functions; ")[2] for command in started]
    names = [(__name__, "_compile_parts"), (__name__, "_compile_others")]
    ends = [end.partition("call_functions(")[2] for end in ends]
    assert ends == [f"{names!r})"] * cached


def test_no_process_is_started_for_a_kernel_in_the_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(jit.os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    assert kernel(_largest)(2.0) == 10.0  # the cache holds it from now on
    compile_alongside("_largest", _compile_others)
    before = len(jit._STARTED)
    assert kernel(_largest)(1.0) == 5.0
    assert len(jit._STARTED) == before


def test_nothing_is_started_on_one_processor(monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(jit.os, "sched_getaffinity", lambda _: {0}, raising=False)

    @kernel
    def larger(x: float) -> float:
        return 4.0 * x

    compile_alongside("larger", _compile_others)
    before = len(jit._STARTED)
    assert larger(1.0) == 4.0
    assert len(jit._STARTED) == before


@pytest.fixture
def process(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SimpleNamespace:
    """Pretend that a process is started that compiles kernels, and let Python interpret them."""
    one = SimpleNamespace(poll=lambda: None, commands=[])

    def started(command: list[str], **_: object) -> SimpleNamespace:
        one.commands.append(command[-1])
        return one

    monkeypatch.setattr(jit, "subprocess", SimpleNamespace(DEVNULL=None, Popen=started))
    monkeypatch.setattr(jit.os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    monkeypatch.setattr(jit, "SEARCH", 0.0)
    monkeypatch.setattr(jit.Kernel, "may_be_interpreted", True)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    return one


def _interpreted(function: Any, limit: float = 10.0) -> Any:
    """Return a kernel; Python may interpret its calls if their first argument is below `limit`."""
    compiled = kernel(function)
    name = function.__name__
    compile_alongside(name, _compile_others, "other")
    compile_alongside(name, _compile_parts, name, is_short=lambda _, x, *__: x < limit)
    return compiled


def test_short_calls_are_interpreted_until_the_kernel_is_in_the_cache(process):
    def halved(x: float) -> float:
        return 0.5 * x

    one = _interpreted(halved)
    assert one(3.0) == one(3.0) == 1.5
    assert not one.is_ready
    assert len(process.commands) == 1  # which compiles the kernel itself before the others
    assert process.commands[0].index("_compile_parts") < process.commands[0].index(
        "_compile_others"
    )
    folder = jit._cache_folder() / "numerics"
    folder.mkdir()
    (folder / "test_jit.halved-1.py311.1.nbc").touch()
    assert one(3.0) == 1.5
    assert one.is_ready


def test_long_calls_are_compiled(process):
    def doubled(x: float) -> float:
        return 2.0 * x

    one = _interpreted(doubled)
    assert one(11.0) == 22.0
    assert one.is_ready
    assert "_compile_parts" not in process.commands[0]  # this process compiles the kernel


def test_kernels_are_compiled_if_the_other_process_has_ended(process):
    def tripled(x: float) -> float:
        return 3.0 * x

    one = _interpreted(tripled)
    assert (one(1.0), one.is_ready) == (3.0, False)
    process.poll = lambda: 1
    assert (one(1.0), one.is_ready) == (3.0, True)


def test_nothing_is_interpreted_where_kernels_must_be_compiled(process):
    def quartered(x: float) -> float:
        return 0.25 * x

    one = _interpreted(quartered)
    with jit.only_compiled():
        assert (one(1.0), one.is_ready) == (0.25, True)


def test_calls_that_fail_in_python_are_compiled_with_their_first_arguments(process):
    def reciprocal(x: float, total: np.ndarray) -> float:
        total[0] += 1.0
        return 1.0 / x

    one, total = _interpreted(reciprocal), np.zeros(1)
    assert (one(2.0, total), one.is_ready) == (0.5, False)
    assert (one(0.0, total), one.is_ready) == (np.inf, True)  # Python refuses to divide by zero
    assert total[0] == 2.0
