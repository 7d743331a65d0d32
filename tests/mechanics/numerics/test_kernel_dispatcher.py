"""Compilation of kernels: optimised once, within the kernel that Python calls."""

from __future__ import annotations

import gc
import sys

import numba
import numpy as np
import pytest

from wearsim.mechanics.numerics import kernel_dispatcher
from wearsim.mechanics.numerics.jit import kernel


@kernel
def _root(x: float) -> float:
    return np.sqrt(x) / 3.0


@kernel
def _shifted(x: float) -> float:
    return _root(x) + 0.1


@kernel
def _sum(x: float, count: int) -> float:
    total = 0.0
    for i in range(count):
        total += _shifted(x + i)
    return total


@kernel
def _misnamed(x: float) -> float:
    return x.no_such_attribute


def test_called_kernels_have_no_machine_code():
    _sum(2.0, 5)
    _sum.recompile()  # ignores the cache
    assert len(_sum.signatures) == 1
    for called in (_shifted, _root):
        assert not called.signatures
        assert len(called.part.signatures) == 1


def test_kernel_is_bitwise_equal_from_python_and_from_kernels():
    separate = 0.0
    for i in range(100):
        separate += kernel(_root.py_func)(0.7 + i) + 0.1
    assert _sum(0.7, 100) == separate


def test_other_compiled_functions_call_kernels():
    @numba.njit
    def twice(x: float) -> float:
        return 2.0 * _shifted(x)

    assert twice(9.0) == 2.0 * (1.0 + 0.1)


def test_kernels_compile_without_the_dispatcher_module(monkeypatch):
    monkeypatch.setitem(sys.modules, "wearsim.mechanics.numerics.kernel_dispatcher", None)
    plain = kernel(_root.py_func)
    assert not hasattr(plain, "part")
    assert plain(9.0) == _root(9.0)


def test_kernels_compile_with_a_changed_numba_compiler(monkeypatch):
    def changed(self):
        raise AttributeError("no such pass")

    monkeypatch.setattr(kernel_dispatcher._PartCompiler, "define_pipelines", changed)
    monkeypatch.setattr(kernel_dispatcher.Whole, "plain", False)

    @kernel
    def third(x: float) -> float:
        return x / 3.0

    @kernel
    def shifted(x: float) -> float:
        return third(x) + 0.1

    assert shifted(6.0) == 2.1
    assert kernel_dispatcher.Whole.plain


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
