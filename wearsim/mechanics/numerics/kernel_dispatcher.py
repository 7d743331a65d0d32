"""Numba dispatchers that optimise a kernel once, together with the kernels that it calls.

By default numba optimises each function, generates its machine code and Python wrapper, saves it,
and copies it into its callers, where it is optimised again. Kernels call each other several levels
deep, and Python calls few of them. Here a kernel that is called by another kernel is only
translated to LLVM's intermediate representation (`Part`) and optimised once, within the kernel that
Python calls (`Whole`). This halves the compilation time.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import Any

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import AnalysisPass, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import AnnotateTypes


class Whole(CPUDispatcher):
    """Dispatcher for calls from Python: machine code of the kernel and all kernels it calls."""

    #: whether numba's internals differ from those used here, so that its own compiler is used
    plain = False

    @cached_property
    def part(self) -> Part:
        """Dispatcher of the same kernel for calls from other kernels."""
        options = self.targetoptions | {"no_cpython_wrapper": True}
        return Part(self.py_func, self.locals, options, _PartCompiler)

    @property
    def _numba_type_(self) -> Any:
        """Type of a reference to this kernel in another kernel."""
        return types.Dispatcher(self if Whole.plain else self.part)

    def compile(self, sig: Any) -> Any:
        """Compile for the signature `sig`, or load it from the cache."""
        with _no_collection():
            if not Whole.plain:
                try:
                    return super().compile(sig)
                except (AttributeError, TypeError, NotImplementedError):
                    Whole.plain = True  # an error in a kernel would be a NumbaError
            return super().compile(sig)


class Part(CPUDispatcher):
    """Dispatcher for calls from other kernels: LLVM code without machine code."""

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return the call template, with literal arguments typed as ordinary numbers."""
        plain = tuple(types.unliteral(arg) for arg in args)
        return super().get_call_template(plain, {k: types.unliteral(v) for k, v in kws.items()})

    def add_overload(self, cres: Any) -> None:
        """Register a compiled signature, with a placeholder object as its entry point."""
        place = object()
        self.targetctx.insert_user_function(place, cres.fndesc, [cres.library])
        self.overloads[tuple(cres.signature.args)] = cres._replace(entry_point=place)


class _PartLibrary(JITCodeLibrary):
    """LLVM code of a kernel and its callees, not optimised here."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=True)
class _LeaveToCallers(AnalysisPass):
    """Compiler pass that emits the function into a `_PartLibrary` without machine code."""

    _name = "leave_to_callers"

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        new_library: Any = _PartLibrary  # the base class is not typed
        state.library = new_library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        return False


class _PartCompiler(CompilerBase):
    """Numba's default compiler with `_LeaveToCallers` instead of code generation."""

    def define_pipelines(self) -> list[Any]:
        pipeline = DefaultPassBuilder.define_nopython_pipeline(self.state)
        pipeline.add_pass_after(_LeaveToCallers, AnnotateTypes)
        pipeline.finalize()
        return [pipeline]


@contextmanager
def _no_collection() -> Iterator[None]:
    """Disable Python's garbage collector, which takes a tenth of the compilation time."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()
