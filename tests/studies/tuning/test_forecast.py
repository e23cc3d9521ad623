"""The number of trials that a search says beforehand, and their time."""

from __future__ import annotations

import pytest

from drake_navbench.commands.tune import QUICK, WHOLE, _size_of, build_parser
from drake_navbench.studies.tuning.tune import Forecast, duration_text


def test_the_forecast_counts_baseline_configurations_and_judgement():
    forecast = Forecast(configurations=16, each=13, judgement=174)
    assert forecast.trials == 17 * 13 + 174
    assert forecast.text.startswith(
        "At most 395 trials: 221 for the baseline and 16 configurations and 174 to judge the front."
    )
    # 13 trials in 26 s are 2 s each; of 16 configurations 6 are left: 78 + 174 trials.
    assert forecast.time_text(26.0, known=10) == (
        "The baseline's 13 trials took 26 s: if none is dropped, 252 more like these take about "
        "9 min."
    )


@pytest.mark.parametrize(
    ("seconds", "text"), [(1.0, "1 min"), (61.0, "2 min"), (5399.0, "90 min"), (9000.0, "2.5 h")]
)
def test_times_are_minutes_and_then_hours(seconds, text):
    assert duration_text(seconds) == text


def test_a_size_that_is_given_counts_also_beside_quick():
    def size(*options):
        return _size_of(build_parser().parse_args(["rpp", "--out", "x", *options]))

    assert size() == WHOLE
    assert size("--quick") == QUICK
    assert size("--quick", "--fresh", "40") == QUICK._replace(fresh=40)
