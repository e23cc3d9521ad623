"""One trial as a Drake Diagram: driven in pieces, and watched by systems of a user's own."""

import numpy as np
import pytest
from pydrake.systems.framework import EventStatus, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from drake_navbench import open_trial, run_trial
from drake_navbench.errors import InputError
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.outcome import Outcome
from drake_navbench.typed_files.typed_yaml import validate


def scenario(**changes):
    """A straight way of 2 m ahead."""
    data = {
        "name": "ahead",
        "description": "a straight way",
        "world": {"obstacles": []},
        "plan": {"type": "polyline", "points": [[0.0, 0.0], [2.0, 0.0]]},
        "goal": [2.0, 0.0, 0.0],
        "timeout_s": 20.0,
    }
    return validate(Scenario, data | changes, "ahead.yaml")


AHEAD = scenario()


@pytest.fixture(scope="module")
def whole():
    return run_trial(AHEAD, "rpp", seed=3)


def assert_equal_samples(one, other):
    columns = [name for name in one.samples if name not in UNREPEATABLE_COLUMNS]
    np.testing.assert_array_equal(one.samples[columns], other.samples[columns])
    assert one.outcome is other.outcome


def test_a_trial_driven_in_pieces_has_the_log_of_a_whole_one(whole):
    with open_trial(AHEAD, "rpp", seed=3) as trial:
        trial.advance_to(0.5)
        assert trial.context.get_time() == 0.5
        trial.simulator.AdvanceTo(2.0)
        assert not trial.has_ended
        trial.advance_to()
        assert trial.has_ended
        log = trial.log()
    assert log.outcome is Outcome.SUCCEEDED
    assert_equal_samples(log, whole)


def test_a_log_in_between_ends_there():
    with open_trial(AHEAD, "rpp", seed=3) as trial:
        trial.advance_to(1.0)
        log = trial.log()
    assert log.outcome is Outcome.TIMED_OUT
    assert log.end_time_s == 1.0


def test_a_trial_ends_at_the_scenarios_time_limit():
    with open_trial(scenario(timeout_s=1.5), "rpp") as trial:
        trial.advance_to(9.0)
        assert trial.has_ended
        assert trial.context.get_time() == 1.5
        trial.advance_to(9.0)
        assert trial.context.get_time() == 1.5


@pytest.mark.parametrize("drive", ["advance_to", "AdvanceTo"])
def test_a_touch_ends_the_trial_at_the_touch(drive):
    # No beam of the lidar returns, so the robot does not know the box.
    blind = {"lidar": {"dropout_probability": 1.0}}
    box = {"type": "box", "min": [1.4, -0.1], "max": [1.6, 0.1]}
    wall = scenario(world={"obstacles": [box]}, robot_overrides=blind)
    with open_trial(wall, "rpp") as trial:
        (trial.advance_to if drive == "advance_to" else trial.simulator.AdvanceTo)(10.0)
        assert trial.has_ended
        log = trial.log()
    assert log.outcome is Outcome.COLLIDED
    assert log.samples["clearance_m"].iloc[-1] == 0.0
    assert log.end_time_s == trial.context.get_time()
    assert_equal_samples(log, run_trial(wall, "rpp"))


def test_a_logger_of_the_user_sees_the_state_and_changes_no_sample(whole):
    sinks = []

    def add_systems(builder):
        base = builder.GetSubsystemByName("base")
        sinks.append(LogVectorOutput(base.get_state_output_port(), builder, publish_period=0.1))

    with open_trial(AHEAD, "rpp", seed=3, add_systems=add_systems) as trial:
        trial.advance_to()
        seen = sinks[0].FindLog(trial.context)
        log = trial.log()
    assert_equal_samples(log, whole)
    samples = log.samples.set_index("time_s")
    at_1_s = np.flatnonzero(np.isclose(seen.sample_times(), 1.0))[0]
    np.testing.assert_array_equal(seen.data()[:2, at_1_s], samples.loc[1.0, ["x_m", "y_m"]])


class Counter(LeafSystem):
    """Notes when it looked at a costmap."""

    def __init__(self, costmap_port):
        super().__init__()
        self.times = []
        self.DeclareAbstractInputPort("costmap", costmap_port.Allocate())
        self.DeclarePeriodicPublishEvent(0.5, 0.0, self.look)

    def look(self, context):
        self.times.append(context.get_time())
        return EventStatus.Succeeded()


def test_a_leaf_system_of_the_user_keeps_what_it_saw_after_the_trial():
    def add_systems(builder):
        port = builder.GetSubsystemByName("local_costmap").GetOutputPort("costmap")
        counter = builder.AddNamedSystem("counter", Counter(port))
        builder.Connect(port, counter.GetInputPort("costmap"))

    with open_trial(AHEAD, "rpp", add_systems=add_systems) as trial:
        counter = trial.diagram.GetSubsystemByName("counter")
        trial.advance_to(1.2)
    assert counter.times == [0.0, 0.5, 1.0]


def test_two_trials_may_be_open_at_once(whole):
    with (
        open_trial(AHEAD, "rpp", seed=3) as one,
        open_trial(AHEAD, "rpp:lookahead_dist=0.5", seed=3) as other,
    ):
        for time_s in (1.0, 2.0, 20.0):
            one.advance_to(time_s)
            other.advance_to(time_s)
        assert_equal_samples(one.log(), whole)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("nowhere", "rpp"), "nowhere"),
        ((AHEAD, "nobody"), "nobody"),
        ((AHEAD, "live"), "expected a controller; a running stack has none"),
    ],
)
def test_wrong_arguments_are_refused_in_one_line(arguments, named):
    with pytest.raises(InputError, match=named), open_trial(*arguments):
        pass
