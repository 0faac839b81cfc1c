"""Functions that only compiled functions call: numba types them and hands them on, no more.

As numba stands, each function that another one calls becomes machine code of its own, with two
wrappers for callers in Python and C that never come: half of the time that a kernel takes to
compile. Here only the kernel at the top is optimised and becomes machine code, with all that it
calls inside, numba's own `min`, `max` and `int` among them. A plain call from Python still works,
and compiles as ever.
"""

from typing import Any

from llvmlite.binding import create_new_function_pass_manager
from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import (
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.typing.templates import _OverloadFunctionTemplate
from numba.core.untyped_passes import (
    DeadBranchPrune,
    FixupArgs,
    GenericRewrites,
    IRProcessing,
    ReconstructSSA,
    RewriteSemanticConstants,
    TranslateByteCode,
)
from numba.cpython import builtins

_Library: Any = JITCodeLibrary
_Compiler: Any = Compiler
_Dispatcher: Any = CPUDispatcher
_Passes: Any = PassManager
_Overload: Any = _OverloadFunctionTemplate
_usual_compiler = _Overload._get_jit_decorator  # noqa: SLF001

# Those of numba's steps that scalar code needs: no closures, array expressions, lists or parallel
# loops, and no variables to let go of, for nothing is counted.
_STEPS = (
    TranslateByteCode,
    FixupArgs,
    IRProcessing,
    RewriteSemanticConstants,
    DeadBranchPrune,
    GenericRewrites,
    ReconstructSSA,
    NopythonTypeInference,
    PreLowerStripPhis,
    NativeLowering,
    NoPythonBackend,
)


class _Text(_Library):  # type: ignore[misc]
    """LLVM text of one function and of those that it calls, to be linked into a caller."""

    def _optimize_functions(self, module: Any) -> None:
        """Shorten them by the quickest steps, so that there is less to link and to inline."""
        codegen = self._codegen
        module.data_layout = codegen._data_layout  # noqa: SLF001
        steps, builder = create_new_function_pass_manager(), codegen._pass_builder()  # noqa: SLF001
        steps.add_sroa_pass()
        steps.add_instruction_combine_pass()
        steps.add_simplify_cfg_pass()
        for function in module.functions:
            if not function.is_declaration:
                steps.run(function, builder)

    def _optimize_final_module(self) -> None:
        """Leave this to the caller, who sees the whole."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    @property
    def codegen(self) -> "_Text":
        """Itself, for there is no engine that holds it."""
        return self

    def set_env(self, name: str, env: object) -> None:
        """Do nothing: constants of Python's, which this would bring, are not for the nested."""

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0, as for any symbol that is not there: this is no machine code."""
        return 0


class _TextCompiler(_Compiler):  # type: ignore[misc]
    """The fewest of numba's own steps, into text."""

    def __init__(
        self, typing: Any, target: Any, library: Any, args: Any, result: Any, flags: Any, own: Any
    ) -> None:
        super().__init__(typing, target, library, args, result, flags, own)
        if library is None:
            self.state.library = _Text(self.state.targetctx.codegen(), "law")

    def define_pipelines(self) -> list[Any]:
        """Return the steps, as numba asks for them."""
        steps = _Passes("law")
        for step in _STEPS:
            steps.add_pass(step, step.__name__)
        steps.finalize()
        return [steps]


class _Kernel(_Library):  # type: ignore[misc]
    """Machine code of a kernel, optimised as a whole only: that begins with each function alone."""

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout  # noqa: SLF001


class KernelCompiler(_Compiler):  # type: ignore[misc]
    """All of numba's steps, into machine code."""

    def __init__(
        self, typing: Any, target: Any, library: Any, args: Any, result: Any, flags: Any, own: Any
    ) -> None:
        super().__init__(typing, target, library, args, result, flags, own)
        if library is None:
            self.state.library = _Kernel(self.state.targetctx.codegen(), "kernel")
            self.state.library.enable_object_caching()


class NestedDispatcher(_Dispatcher):  # type: ignore[misc]
    """What numba makes of a function, but for callers that are compiled only text."""

    def __init__(self, function: Any, options: dict[str, object]) -> None:
        options = {**options, "nopython": True}
        super().__init__(function, targetoptions=options)
        self._text = _as_text(function, options)

    @property
    def _numba_type_(self) -> Any:
        return types.Dispatcher(self._text)


def _as_text(function: Any, options: dict[str, object]) -> Any:
    own = {**options, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return _Dispatcher(function, targetoptions=own, pipeline_class=_TextCompiler)


def _compiler_of(overload: Any) -> Any:
    """Return what compiles numba's own version of a function for some types."""
    if overload._overload_func.__module__ != builtins.__name__:  # noqa: SLF001
        return _usual_compiler(overload)
    return lambda **options: lambda function: _as_text(function, {**options, "nopython": True})


def nest_builtins() -> None:
    """Let what numba writes for Python's own functions of numbers be text too, in this process."""
    _Overload._get_jit_decorator = _compiler_of  # noqa: SLF001
