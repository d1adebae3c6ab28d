"""Compilation of the functions that kernels consist of.

Numba makes machine code, and entries for calls from Python and C, of every function that a kernel
calls. That takes as long as the kernel itself, and nobody calls them: the kernel contains copies.
Here a function is translated to the code of LLVM only, and optimised where it has been copied to.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core import codegen, compiler, compiler_machinery, typed_passes

__all__ = ["part"]

Function = TypeVar("Function", bound=Callable[..., Any])

# untyped, or with less than there is
_njit: Any = numba.njit
_unliteral: Any = numba.types.unliteral
_JITCodeLibrary: Any = codegen.JITCodeLibrary
_CompilerBase: Any = compiler.CompilerBase
_NativeLowering: Any = typed_passes.NativeLowering
_NopythonRewrites: Any = typed_passes.NopythonRewrites
_DefaultPassBuilder: Any = compiler.DefaultPassBuilder
_register_pass: Any = compiler_machinery.register_pass


class _Library(_JITCodeLibrary):  # type: ignore[misc]
    """LLVM code of a function, to be linked into kernels."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


class _Place:
    """Stands for the address of a function that has none."""


@_register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(_NativeLowering):  # type: ignore[misc]
    """Translates a typed function to a `_Library`."""

    _name = "rigid_envs_part_lowering"

    def run_pass(self, state: Any) -> bool:
        state.library = _Library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        place = _Place()
        state.targetctx.insert_user_function(place, state.cr.fndesc, [state.library])
        state.cr = state.cr._replace(cfunc=place)
        return True


class _Compiler(_CompilerBase):  # type: ignore[misc]
    """Numba's compiler with another last pass."""

    def define_pipelines(self) -> list[Any]:
        usual = _DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager = type(usual)(usual.pipeline_name)
        for each, text in usual.passes:
            if each is _NopythonRewrites:  # of expressions of arrays, which parts do not have
                continue
            manager.add_pass(_Lowering if each is _NativeLowering else each, text)
        manager.finalize()
        return [manager]


def part(function: Function, **options: bool) -> Function:
    """Compile a function for kernels, and as numba does when Python calls it."""
    compiled = _njit(error_model="numpy", **options)(function)
    if compiled is function:  # with NUMBA_DISABLE_JIT
        return function
    options |= {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    inside = _njit(error_model="numpy", pipeline_class=_Compiler, **options)(function)
    # numba would keep an address for calls from Python, where there is none
    inside.add_overload = lambda result: inside.overloads.__setitem__(
        tuple(result.signature.args), result
    )
    # one translation for all values of an argument, where numba makes one for each constant
    compiled.get_call_template = lambda positional, named: inside.get_call_template(
        tuple(map(_unliteral, positional)), {key: _unliteral(named[key]) for key in named}
    )
    compiled.get_overload = inside.get_overload
    return cast(Function, compiled)
