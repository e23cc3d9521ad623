"""Kernels compile without what nobody asks of them.

Of a small kernel's compile time a third goes into the functions by which Python and C would call
it. C never does, and most kernels are called by kernels alone. So each has a second one within,
without such functions, which kernels call; Python cannot reach it.
"""

from __future__ import annotations

from typing import Any

from numba.core.caching import CompileResultCacheImpl, FunctionCache


class _InnerFiles(CompileResultCacheImpl):
    """The files of kernels that Python cannot call, beside those of the others."""

    def get_filename_base(self, fullname: str, abiflags: str) -> str:
        """Returns the beginning of the files' names."""
        return f"{super().get_filename_base(fullname, abiflags)}.inner"


class _InnerCache(FunctionCache):
    _impl_class = _InnerFiles


def spare_callers(kernel: Any) -> None:
    """Has a kernel of numba compile what Python or other kernels call, each on its own.

    What Python has called already, kernels call as well: it is not compiled twice.
    """
    kind = type(kernel)
    kernel.targetoptions["no_cfunc_wrapper"] = True
    inner: Any = None

    def that_has(arguments: Any) -> Any:
        nonlocal inner
        if tuple(arguments) in kernel.overloads:
            return kernel
        if inner is None:
            options = {**kernel.targetoptions, "no_cpython_wrapper": True}
            inner = kind(kernel.py_func, kernel.locals, options, kernel._compiler.pipeline_class)
            inner._cache = _InnerCache(kernel.py_func)
            # By it numba knows a kernel that calls itself.
            inner._compiling_counter = kernel._compiling_counter
        return inner

    def get_call_template(arguments: Any, keywords: Any) -> Any:
        _, folded = kernel.fold_argument_types(arguments, keywords)
        return kind.get_call_template(that_has(folded), arguments, keywords)

    def get_overload(arguments: Any) -> Any:
        return kind.get_overload(that_has(arguments), arguments)

    kernel.get_call_template = get_call_template
    kernel.get_overload = get_overload
