"""How numba compiles kernels: each one that Python calls as a whole, with all those that it calls.

By itself numba optimises every function for the machine, wraps it for Python, saves it, and copies
it into its callers to be optimised once more, layer upon layer. Kernels call kernels several layers
deep, and Python calls few of them. So one that another calls is only translated for LLVM here
(`Part`), and optimised once, within what Python calls (`Whole`). That halves a first run's time.
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
    """A kernel as Python calls it: machine code of itself and of all kernels that it calls."""

    #: whether numba is built otherwise than what follows, and compiles kernels in its own way
    plain = False

    @cached_property
    def part(self) -> Part:
        """The same kernel as other kernels call it."""
        options = self.targetoptions | {"no_cpython_wrapper": True}
        return Part(self.py_func, self.locals, options, _PartCompiler)

    @property
    def _numba_type_(self) -> Any:
        """What a kernel finds that names this one."""
        return types.Dispatcher(self if Whole.plain else self.part)

    def compile(self, sig: Any) -> Any:
        """Compile for the types of `sig`, or read what was compiled before."""
        with _no_collection():
            if not Whole.plain:
                try:
                    return super().compile(sig)
                except (AttributeError, TypeError, NotImplementedError):
                    Whole.plain = True  # what a kernel lacks is a NumbaError
            return super().compile(sig)


class Part(CPUDispatcher):
    """A kernel as other kernels call it: LLVM's code, to become a piece of theirs."""

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how it is called: a number written into a call is no type of its own."""
        plain = tuple(types.unliteral(arg) for arg in args)
        return super().get_call_template(plain, {k: types.unliteral(v) for k, v in kws.items()})

    def add_overload(self, cres: Any) -> None:
        """Take in what was compiled; without machine code, a bare object stands for its address."""
        place = object()
        self.targetctx.insert_user_function(place, cres.fndesc, [cres.library])
        self.overloads[tuple(cres.signature.args)] = cres._replace(entry_point=place)


class _PartLibrary(JITCodeLibrary):
    """LLVM's code of a kernel and of those it calls, left as it is for the callers to optimise."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=True)
class _LeaveToCallers(AnalysisPass):
    """Have the function's code put in a `_PartLibrary`, and none made for the machine."""

    _name = "leave_to_callers"

    def __init__(self) -> None:
        super().__init__()  # type: ignore[no-untyped-call]

    def run_pass(self, state: Any) -> bool:
        new_library: Any = _PartLibrary  # numba's own have no types
        state.library = new_library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        return False


class _PartCompiler(CompilerBase):
    """Numba's own compiler, but for the end."""

    def define_pipelines(self) -> list[Any]:
        pipeline = DefaultPassBuilder.define_nopython_pipeline(self.state)
        pipeline.add_pass_after(_LeaveToCallers, AnnotateTypes)
        pipeline.finalize()
        return [pipeline]


@contextmanager
def _no_collection() -> Iterator[None]:
    """Keep Python's collector of garbage out: it takes a tenth of the time, for nothing."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()
