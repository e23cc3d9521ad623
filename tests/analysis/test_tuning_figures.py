"""Figures of a search of parameters."""

from __future__ import annotations

import pytest

from drake_navbench.analysis.figures.tuning import front_figure, slices_figure


def configurations(*means: float) -> list[dict]:
    """One configuration a mean: relative differences to the baseline in time and clearance."""
    return [
        {
            "number": number,
            "means": [mean, mean],
            "tuning": [mean, mean],
            "ending": "through",
            "parameters": {"lookahead_dist": 0.1 * number},
        }
        for number, mean in enumerate(means)
    ]


@pytest.mark.parametrize("is_front", [True, False])
def test_one_failure_does_not_press_the_others_together(is_front):
    """It counts 100% worse; the others lie between -4% and 4%."""
    drawn = configurations(-0.04, -0.02, 0.0, 0.02, 0.04, 0.03, -0.01, 1.0)
    names = ["time", "clearance"]
    if is_front:
        figure = front_figure(drawn, drawn[:1], names)
    else:
        figure = slices_figure(drawn, "lookahead_dist", names)
    low, high = figure.axes[0].get_ylim()
    # Three quarters stay below 3.25%; two spreads above that are 17.75%.
    assert 10.0 < high < 25.0
    assert low < -4.0
    beyond = [line for line in figure.axes[0].lines if line.get_marker() == "^"]
    assert [list(line.get_ydata()) for line in beyond] == [[pytest.approx(17.75, abs=0.1)]]


def test_where_all_fit_nothing_is_beyond():
    figure = slices_figure(configurations(-0.04, 0.0, 0.04, 0.05), "lookahead_dist", ["a", "b"])
    assert not [line for line in figure.axes[0].lines if line.get_marker() == "^"]


def test_where_most_are_better_the_axis_reaches_beyond_no_change_all_the_same():
    # Three quarters stay below -6%; two spreads, of 2% each, above 0% are 4%.
    drawn = configurations(-0.08, -0.08, -0.08, -0.06, 1.0)
    figure = slices_figure(drawn, "lookahead_dist", ["time", "clearance"])
    beyond = [line for line in figure.axes[0].lines if line.get_marker() == "^"]
    assert [list(line.get_ydata()) for line in beyond] == [[pytest.approx(4.0)]]
