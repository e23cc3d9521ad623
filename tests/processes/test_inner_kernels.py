"""What kernels call compiles without the functions by which Python would call it."""

from __future__ import annotations

import importlib
import textwrap

import pytest
from numba import njit

from drake_navbench.kernels.angles import wrap

SOURCE = """
from numba import njit
from drake_navbench.kernels.angles import wrap

@njit(cache=True)
def half(x):
    return 0.5 * wrap(x)

@njit(cache=True)
def of_python(x):
    return half(x) + 1.0

@njit(cache=True)
def factorial(n):
    if n <= 1:
        return 1
    return n * factorial(n - 1)

@njit(cache=True)
def of_recursion(n):
    return factorial(n)
"""


@pytest.fixture
def lab(site_folder, monkeypatch):
    monkeypatch.setenv("DRAKE_NAVBENCH_KERNELS", str(site_folder))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(site_folder / "kernels"))
    (site_folder / "lab_of_kernels").mkdir()
    (site_folder / "lab_of_kernels" / "__init__.py").write_text(SOURCE)
    return importlib.import_module("lab_of_kernels")


def test_python_and_kernels_call_a_kernel_with_the_same_result(lab):
    assert lab.of_python(3.0) == 2.5
    assert not lab.half.overloads
    assert lab.half(3.0) == 1.5
    assert lab.of_python(-3.0) == -0.5


def test_a_kernel_that_python_has_called_is_not_compiled_anew_for_kernels(lab):
    assert lab.half(3.0) == 1.5
    assert lab.of_python(3.0) == 2.5
    files = [file.name for file in lab.half._cache._impl.locator._folder.iterdir()]
    assert [name for name in files if "half" in name and "inner" in name] == []
    assert any("half" in name for name in files)


def test_a_kernel_that_calls_itself_compiles(lab):
    assert lab.of_recursion(5) == 120
    assert lab.factorial(4) == 24


def test_kernels_of_others_are_left_alone():
    assert wrap.targetoptions["no_cfunc_wrapper"]
    assert "no_cfunc_wrapper" not in njit(cache=True)(textwrap.indent).targetoptions
