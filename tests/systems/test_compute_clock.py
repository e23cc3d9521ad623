"""How often a controller server looks whether its next cycle may begin."""

import pytest

from drake_navbench.inputs.timeline import Timeline, timeline
from drake_navbench.inputs.timing import TimingSettings
from drake_navbench.trial.systems.compute_clock import ComputeClock

PERIOD_S = 0.05


@pytest.mark.parametrize(
    ("compute_time", "ticks"), [(0.0, 1), (20.0, 1), (50.0, 4), (60.0, 4), ("measured", 4)]
)
def test_only_cycles_that_may_miss_their_period_are_looked_for_within_one(compute_time, ticks):
    timing = Timeline.constant(TimingSettings(compute_time=compute_time))
    assert ComputeClock(timing, None).ticks_a_period(PERIOD_S) == ticks


def test_one_slow_while_is_enough():
    slow = TimingSettings(compute_time=80.0)
    timing = timeline(TimingSettings(), [(3.0, 4.0, lambda usual: slow)])
    assert ComputeClock(timing, None).ticks_a_period(PERIOD_S) == 4
