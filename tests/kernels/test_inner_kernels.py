"""Kernels without an entry point for Python are called by kernels alone."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
ROOTS = {
    "drake_navbench": "drake_navbench",
    "controllers": "drake_navbench.controllers",
    "analysis": "drake_navbench.analysis",
}
INNER, ENTRY = "register_jitable", "njit"


def is_decorated(node: ast.stmt, *words: str) -> bool:
    if not isinstance(node, ast.FunctionDef):
        return False
    return any(word in ast.unparse(mark) for mark in node.decorator_list for word in words)


def inner_kernels(modules: Mapping[str, ast.Module]) -> set[str]:
    return {
        f"{module}.{node.name}"
        for module, tree in modules.items()
        for node in tree.body
        if is_decorated(node, INNER)
    }


def named_by_python(module: str, tree: ast.Module) -> set[str]:
    """The functions that a module's code outside of kernels names, as module.function."""
    known = {node.name: f"{module}.{node.name}" for node in tree.body if is_decorated(node, INNER)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            known |= {(a.asname or a.name): f"{node.module}.{a.name}" for a in node.names}
    python = [node for node in tree.body if not is_decorated(node, INNER, ENTRY)]
    named = {n.id for node in python for n in ast.walk(node) if isinstance(n, ast.Name)}
    return {known[name] for name in named & known.keys()}


def called_from_python(texts: Mapping[str, str]) -> set[str]:
    """The inner kernels that code outside of kernels names."""
    kernels = {name: ast.parse(text) for name, text in texts.items() if "numba" in text}
    inner = inner_kernels(kernels)
    names = {name.rpartition(".")[2] for name in inner}
    others = {
        module: ast.parse(text)
        for module, text in texts.items()
        if module not in kernels and not names.isdisjoint(re.findall(r"\w+", text))
    }
    trees = kernels | others
    return inner & {
        name for module, tree in trees.items() for name in named_by_python(module, tree)
    }


def product() -> dict[str, str]:
    files = {
        file: (name, *file.relative_to(REPOSITORY / root).with_suffix("").parts)
        for root, name in ROOTS.items()
        for file in (REPOSITORY / root).rglob("*.py")
    }
    return {".".join(parts): file.read_text(encoding="utf-8") for file, parts in files.items()}


def test_python_calls_no_kernel_that_is_compiled_for_kernels_alone():
    """It would run as plain Python, a hundred times slower."""
    assert called_from_python(product()) == set()


def test_such_a_call_is_found():
    kernels = (
        "from numba import njit\nfrom numba.extending import register_jitable\n"
        "@register_jitable\ndef half(x): return x / 2.0\n"
        "@register_jitable\ndef third(x): return x / 3.0\n"
        "@njit(cache=True)\ndef sixth(x): return half(third(x))\n"
    )
    caller = "from lab import half, sixth\ndef f(): return sixth(1.0)\n"
    assert called_from_python({"lab": kernels, "caller": caller}) == set()
    caller += "def g(): return half(1.0)\n"
    assert called_from_python({"lab": kernels, "caller": caller}) == {"lab.half"}
    assert called_from_python({"lab": kernels + "third(1.0)\n"}) == {"lab.third"}
