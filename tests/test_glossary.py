"""Frames and words: ports and columns carry the frames that docs/glossary.md says."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from drake_navbench.logs.log_columns import COLUMNS, ODOMETRY_COLUMNS

REPOSITORY = Path(__file__).parents[1]
PRODUCT = sorted(
    path
    for house in ("drake_navbench", "controllers", "analysis")
    for path in (REPOSITORY / house).rglob("*.py")
)
ESTIMATES = {"estimate", "odometry_estimate"}


def crossed_estimates(source):
    """Returns 'port=signal' where a port of one frame is given the estimate of the other one."""
    if "estimate=" not in source:
        return []
    return [
        f"{keyword.arg}={keyword.value.attr}"
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Call)
        for keyword in node.keywords
        if keyword.arg in ESTIMATES
        and isinstance(keyword.value, ast.Attribute)
        and keyword.value.attr in ESTIMATES
        and keyword.value.attr != keyword.arg
    ]


def test_a_port_that_is_given_the_estimate_of_another_frame_is_found():
    assert crossed_estimates("connect(a, estimate=s.odometry_estimate)") == [
        "estimate=odometry_estimate"
    ]
    assert crossed_estimates("connect(a, estimate=s.estimate)") == []


def test_a_port_is_given_the_estimate_of_the_frame_in_its_name():
    found = {path.name: crossed_estimates(path.read_text(encoding="utf-8")) for path in PRODUCT}
    assert {name: crossed for name, crossed in found.items() if crossed} == {}


def test_no_name_uses_the_monogram_notation():
    """X_AB is for formulas in docstrings; names have plain frames, `pose_W` occurs nowhere."""
    monogram = re.compile(r"\b(pose|scan|p|X|R)_[A-Z]\b")
    for path in PRODUCT:
        code = path.read_text(encoding="utf-8")
        if monogram.search(code):
            names = {n.id for n in ast.walk(ast.parse(code)) if isinstance(n, ast.Name)}
            assert {name for name in names if monogram.fullmatch(name)} <= {"X_X"}, path


@pytest.mark.parametrize(
    ("columns", "prefix", "frame"),
    [(COLUMNS, "estimated_", "map frame"), (ODOMETRY_COLUMNS, "odometry_", "odometry frame")],
)
def test_a_column_of_a_log_tells_its_frame(columns, prefix, frame):
    told = {name: meaning for name, meaning in columns.items() if name.startswith(prefix)}
    assert len(told) == 3
    assert all(frame in meaning for meaning in told.values())


def test_words_of_the_glossary_stand_once_and_in_order():
    text = (REPOSITORY / "docs" / "glossary.md").read_text(encoding="utf-8")
    words = re.findall(r"^\| ([a-z ]+) \| ", text.partition("## Frames")[0], re.M)[1:]
    assert words == sorted(set(words))
    known = ["column", "preset", "variant", "trial", "campaign", "plan", "release", "task", "probe"]
    assert set(known) <= set(words)
