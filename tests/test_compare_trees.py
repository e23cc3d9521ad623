"""Benchmarks of two trees are compared only where they were measured alike."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "benchmarks"))
from compare_trees import Incomparable, main, ratios, table


def results(processor="EPYC", **medians):
    rows = [{"fullname": name, "stats": {"median": value}} for name, value in medians.items()]
    return {"machine_info": {"cpu": {"brand_raw": processor}}, "benchmarks": rows}


def test_the_median_over_the_rounds_counts():
    base = [results(rpp=value) for value in (1.0, 2.0, 9.0)]
    head = [results(rpp=value) for value in (3.0, 2.0, 0.1)]
    assert ratios(base, head) == {"rpp": 1.0}


def test_a_row_that_takes_15_percent_more_is_told_and_the_slowest_stands_first():
    found = ratios([results(rpp=1.0, dwb=1.0)], [results(rpp=1.1, dwb=1.2)])
    assert table(found).splitlines() == ["  1.20  dwb  slower", "  1.10  rpp"]


@pytest.mark.parametrize(
    ("base", "head", "told"),
    [
        ([results(rpp=1.0)], [results("Xeon", rpp=1.0)], "different processors: EPYC, Xeon"),
        ([results(rpp=1.0)], [results(dwb=1.0)], "in one tree only: dwb, rpp"),
        ([results(rpp=1.0), results(rpp=1.0, dwb=1.0)], [results(rpp=1.0)], "every round: dwb"),
        ([results()], [results()], "no benchmark was run"),
    ],
)
def test_what_was_not_measured_alike_is_refused(base, head, told):
    with pytest.raises(Incomparable, match=told):
        ratios(base, head)


def test_a_tree_without_an_environment_is_one_line_and_status_2(tmp_path, capsys):
    assert main([str(tmp_path), str(tmp_path)]) == 2
    assert "no .venv" in capsys.readouterr().err
