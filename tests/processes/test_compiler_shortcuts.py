"""numba compiles with less work, and what it compiles is the same."""

from __future__ import annotations

import gc
import operator
from contextlib import suppress
from itertools import product

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest
from numba import njit, types
from numba.core import caching, codegen, cpu, dispatcher, ir
from numba.core.errors import TypingError
from numba.core.registry import cpu_target
from numba.core.types.functions import BaseFunction

from drake_navbench.processes import compiler_shortcuts
from drake_navbench.processes.kernel_cache import prepare_kernels

pytestmark = pytest.mark.skipif(
    not numba.__version__.startswith(compiler_shortcuts.TRIED_WITH),
    reason="this numba is left as it is",
)
CONTEXT = cpu_target.typing_context
NUMBERS = (types.int8, types.uint8, types.int64, types.float32, types.float64, types.boolean)
PERHAPS = types.Optional(types.float64)
GRID = types.Array(types.uint8, 2, "C", readonly=True)


@pytest.fixture(scope="module", autouse=True)
def numba_is_prepared():
    prepare_kernels()
    # As before the first kernel: its own operators are known.
    CONTEXT.refresh()


@pytest.fixture
def asked(monkeypatch) -> list:
    """What numba itself is asked: operands, each time."""
    told = []
    ask = BaseFunction.get_call_type

    def listening(self, context, args, kws):
        told.append(args)
        return ask(self, context, args, kws)

    monkeypatch.setattr(BaseFunction, "get_call_type", listening)
    return told


def answer(function, *operands):
    return CONTEXT.resolve_value_type(function).get_call_type(CONTEXT, operands, {})


@pytest.mark.parametrize(
    ("function", "operands"),
    [
        (operator.add, (types.uint16, types.float32)),
        (operator.getitem, (GRID, types.UniTuple(types.int16, 2))),
        (bool, (types.uint16,)),
    ],
)
def test_numba_is_asked_once_what_an_operator_gives(function, operands, asked):
    first = answer(function, *operands)
    assert answer(function, *operands) == first
    assert asked == [operands]


@pytest.mark.parametrize(
    ("function", "operands"),
    [
        (operator.add, (PERHAPS, types.float64)),
        (operator.getitem, (types.UniTuple(PERHAPS, 2), types.int64)),
    ],
)
def test_what_is_no_number_nor_array_nor_a_tuple_of_them_is_asked_each_time(
    function, operands, asked
):
    assert answer(function, *operands) == answer(function, *operands)
    assert asked == [operands, operands]


@pytest.mark.parametrize(
    "function", [operator.add, operator.mul, operator.truediv, operator.floordiv, operator.lt]
)
def test_the_answer_is_numbas_own(function):
    asked = CONTEXT.resolve_value_type(function)
    for pair in product(NUMBERS, repeat=2):
        own = BaseFunction.get_call_type(asked, CONTEXT, pair, {})
        assert [answer(function, *pair) for _ in range(2)] == [own, own]


def test_what_has_no_answer_is_told_each_time():
    for _ in range(2):
        with pytest.raises(TypingError, match="No implementation of function"):
            answer(operator.lshift, types.float64, types.float64)


def test_only_what_a_module_defines_is_optimized():
    module = llvm.parse_assembly("declare i64 @f(i64)\ndefine i64 @g(i64 %x) {\n  ret i64 %x\n}\n")
    seen = compiler_shortcuts._Definitions(module)
    assert [function.name for function in seen.functions] == ["g"]
    seen.data_layout = "e-m:e"
    assert module.data_layout == seen.data_layout == "e-m:e"


def test_a_kernel_has_the_same_instructions(monkeypatch):
    def mean_of_squares(values):
        total = 0.0
        for value in values:
            total += value * value
        return total / len(values)

    def instructions() -> list[str]:
        kernel = njit(mean_of_squares)
        assert kernel(np.array([3.0, 4.0])) == 12.5
        (text,) = kernel.inspect_asm().values()
        # Without labels and names, which count up in a process.
        return [line.split()[0] for line in text.splitlines() if line.startswith("\t")]

    with_shortcuts = instructions()
    every = property(lambda self: self._module.functions)
    monkeypatch.setattr(compiler_shortcuts._Definitions, "functions", every)
    monkeypatch.setattr(types.Function, "get_call_type", BaseFunction.get_call_type)
    assert instructions() == with_shortcuts


@pytest.mark.parametrize(("version", "is_changed"), [("0.69.0", False), ("0.68.2", True)])
def test_only_a_numba_that_the_shortcuts_were_tried_with_gets_them(
    version, is_changed, monkeypatch
):
    library = codegen.CPUCodeLibrary
    # Both are undone after the test.
    monkeypatch.delattr(types.Function, "get_call_type")
    monkeypatch.setattr(library, "_optimize_functions", library._optimize_functions)
    for owner, name in (
        (cpu.CPUContext, "create_cfunc_wrapper"),
        (caching.CompileResultCacheImpl, "reduce"),
        (dispatcher._FunctionCompiler, "compile"),
    ):
        monkeypatch.setattr(owner, name, getattr(owner, name))
    monkeypatch.setattr(ir.Inst, "_rec_list_vars", ir.Inst._rec_list_vars)
    monkeypatch.setattr(numba, "__version__", version)
    compiler_shortcuts.take_shortcuts()
    assert ("get_call_type" in vars(types.Function)) is is_changed


def twice(x):
    return 2.0 * x


@pytest.mark.parametrize(("module", "is_made"), [("drake_navbench.any", False), ("theirs", True)])
def test_only_kernels_of_others_can_be_called_from_c(module, is_made, monkeypatch):
    monkeypatch.setattr(twice, "__module__", module)
    kernel = njit(twice)
    assert kernel(1.5) == 3.0
    (made,) = kernel.overloads.values()
    assert (
        made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name) > 0
    ) == is_made


def test_garbage_is_collected_again_after_a_kernel_even_one_that_fails():
    def sum_of_text(x):
        return x + "m"

    for function in (twice, sum_of_text):
        with suppress(TypingError):
            njit(function)(1.5)
        assert gc.isenabled()


def test_a_kept_kernel_has_no_listing():
    kernel = njit(twice)
    assert kernel(1.5) == 3.0
    (made,) = kernel.overloads.values()
    assert "2.0" in str(made.type_annotation)
    kept = caching.CompileResultCacheImpl.reduce(None, made)
    rebuilt = caching.CompileResultCacheImpl.rebuild(None, cpu_target.target_context, kept)
    assert rebuilt.type_annotation == ""
    assert rebuilt.entry_point(1.5) == 3.0


def test_the_variables_of_an_instruction_are_listed_in_its_order():
    place = ir.Loc("file", 1)
    a, b, c = (ir.Var(None, name, place) for name in "abc")
    called = ir.Expr.call(a, [b, ir.Expr.build_tuple([c, a], place)], [("name", c)], place)
    assert called.list_vars() == [a, b, c, a, c]
    nested = {"x": [(a, b), 1.0, "text"], "y": None, "z": called}
    assert called._rec_list_vars(nested) == [a, b, *called.list_vars()]
