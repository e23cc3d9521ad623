"""Shortcuts through work that numba repeats while it compiles; the compiled code is the same.

The shortcuts together save about three tenths of the processor time of compiling. They take the
place of private functions of numba, so any numba but the one that they were tried with is left as
it is.
"""

from __future__ import annotations

import gc
import operator
from collections.abc import Iterator
from typing import Any

TRIED_WITH = "0.68."
# Our kernels are those of this package; others, such as a plugin's, get all that numba makes.
OWN_MODULES = "drake_navbench."
# The module of LLVM with the function by which Python calls a kernel.
WRAPPER = "wrapper"
# The functions behind operators, and the truth value that each `if` asks for.
OPERATORS = frozenset({bool, *filter(callable, vars(operator).values())})


def take_shortcuts() -> None:
    """Gives this process's numba the shortcuts, if they were tried with its release."""
    import numba
    from llvmlite.binding import ffi
    from numba.core import caching, codegen, cpu, dispatcher, ir, types

    if not numba.__version__.startswith(TRIED_WITH):
        return

    function: Any = types.Function
    library: Any = codegen.CPUCodeLibrary
    context: Any = cpu.CPUContext
    instruction: Any = ir.Inst
    kept: Any = caching.CompileResultCacheImpl
    dispatchers: Any = dispatcher
    compiler = dispatchers._FunctionCompiler
    if "get_call_type" in vars(function):
        return
    function.get_call_type = _remembering(types)
    library._optimize_functions = _of_definitions(library._optimize_functions)
    context.create_cfunc_wrapper = _of_others(context.create_cfunc_wrapper)
    kept.reduce = _without_listing(kept.reduce)
    compiler.compile = _without_collector(compiler.compile)
    instruction._rec_list_vars = _variables_by_class(ir)
    # numba would measure how long each call of LLVM takes, tens of thousands for a column.
    ffi.lib._lock._cblist.clear()


def _of_others(make_wrapper: Any) -> Any:
    """Returns numba's making of the function by which C calls a kernel, but for our kernels.

    C never calls them.
    """

    def make(self: Any, library: Any, fndesc: Any, *rest: Any) -> None:
        if not fndesc.modname.startswith(OWN_MODULES):
            make_wrapper(self, library, fndesc, *rest)

    return make


def _without_collector(compile_kernel: Any) -> Any:
    """Returns numba's compiling of a kernel with all that it calls, without a garbage collection.

    Python would look through all objects of Drake, SciPy and pandas again and again, as numba makes
    so many.
    """

    def compiled(self: Any, *signature: Any) -> Any:
        if not gc.isenabled():
            return compile_kernel(self, *signature)
        gc.disable()
        try:
            return compile_kernel(self, *signature)
        finally:
            gc.enable()

    return compiled


def _without_listing(reduce: Any) -> Any:
    """Returns numba's reduction of a kernel to what is kept, without its listing with types."""

    def reduced(self: Any, kernel: Any) -> Any:
        return reduce(self, kernel._replace(type_annotation=""))

    return reduced


def _variables_by_class(ir: Any) -> Any:
    """Returns numba's listing of the variables in an instruction, which looks at classes once.

    numba lists them in a dozen passes, a million values for the kernels of `rpp`, and would ask
    each up to four times what it is: most are names, places in the source, or constants.
    """
    kinds: dict[type, Any] = {list: list, tuple: list, dict: dict}

    def kind_of(cls: type) -> Any:
        known = (ir.Var, ir.Inst, list, tuple, dict)
        found = next((kind for kind in known if issubclass(cls, kind)), None)
        kinds[cls] = list if found is tuple else found
        return kinds[cls]

    def variables(self: Any, value: Any) -> list[Any]:
        cls = type(value)
        kind = kinds[cls] if cls in kinds else kind_of(cls)
        if kind is None:
            return []
        if kind is ir.Var:
            return [value]
        if kind is ir.Inst:
            return list(value.list_vars())
        values = value.values() if kind is dict else value
        return [variable for one in values for variable in variables(self, one)]

    return variables


def _remembering(types: Any) -> Any:
    """Returns numba's look-up of a function's signature, which remembers those of operators.

    At each `a + b` numba would ask the dozens of templates of `+` in turn, as often as a kernel
    adds two floats: 5,200 times with 355 different questions in the kernels of `dwb`. The answer
    depends on the types of the operands alone where these are numbers, arrays, or tuples of them.
    """
    plain = (types.Number, types.Boolean, types.Array, types.SliceType)
    # The function's identity, its operands' types -> the function, so that its identity is not
    # given again, and the signature.
    known: dict[tuple[Any, ...], tuple[Any, Any]] = {}

    def is_plain(operand: Any) -> bool:
        if isinstance(operand, types.BaseTuple):
            return all(map(is_plain, operand))
        return isinstance(operand, plain)

    def get_call_type(self: Any, context: Any, args: tuple[Any, ...], kws: Any) -> Any:
        key = (id(self), context, args)
        if (found := known.get(key)) is not None and not kws:
            return found[1]
        signature = super(types.Function, self).get_call_type(context, args, kws)
        name = self.typing_key
        if not kws and callable(name) and name in OPERATORS and all(map(is_plain, args)):
            known[key] = (self, signature)
        return signature

    return get_call_type


def _of_definitions(optimize: Any) -> Any:
    """Returns numba's passes over the functions of a module, without those only declared in it.

    numba makes a manager of passes for each function, most of which are declarations of Python's
    and numba's own functions: there is nothing in them to optimize. The function by which Python
    calls a kernel is optimized once, with the kernel, and not before as well.
    """

    def optimize_functions(self: Any, module: Any) -> None:
        if module.name == WRAPPER:
            module.data_layout = self._codegen._data_layout
        else:
            optimize(self, _Definitions(module))

    return optimize_functions


class _Definitions:
    """A module of LLVM that shows only the functions that it defines."""

    def __init__(self, module: Any) -> None:
        object.__setattr__(self, "_module", module)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._module, name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._module, name, value)

    @property
    def functions(self) -> Iterator[Any]:
        return (function for function in self._module.functions if not function.is_declaration)
