"""A tree from an XML file drives as the same tree does that comes from the settings."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from drake_navbench.inputs.robot import load_robot, overridden
from drake_navbench.inputs.scenario import scenario_on_map
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.navigation.behavior_tree.tree_file import read_tree_file
from drake_navbench.trial.trial import run_trial

WARD = Path(__file__).parents[2] / "scenarios" / "maps" / "ward.yaml"
# Written for this test: plan every second, clear and recover whatever the failure.
ALWAYS_RECOVERING = """<root><BehaviorTree ID="t">
  <RecoveryNode number_of_retries="6">
    <PipelineSequence>
      <RateController hz="1.0">
        <RecoveryNode number_of_retries="1">
          <ComputePathToPose goal="{goal}" path="{path}" planner_id="GridBased"/>
          <ClearEntireCostmap service_name="global_costmap/clear_entirely_global_costmap"/>
        </RecoveryNode>
      </RateController>
      <RecoveryNode number_of_retries="1">
        <FollowPath path="{path}" controller_id="FollowPath"/>
        <ClearEntireCostmap service_name="local_costmap/clear_entirely_local_costmap"/>
      </RecoveryNode>
    </PipelineSequence>
    <ReactiveFallback>
      <GoalUpdated/>
      <RoundRobin wrap_around="true">
        <Sequence>
          <ClearEntireCostmap service_name="local_costmap/clear_entirely_local_costmap"/>
          <ClearEntireCostmap service_name="global_costmap/clear_entirely_global_costmap"/>
        </Sequence>
        <Spin spin_dist="1.57"/><Wait wait_duration="5"/>
        <BackUp backup_dist="0.30" backup_speed="0.05"/>
      </RoundRobin>
    </ReactiveFallback>
  </RecoveryNode>
</BehaviorTree></root>"""


def drive(tree: dict, goal=(3.0, -1.0, 0.0)) -> TrialLog:
    robot = overridden(load_robot("round_robot"), {"navigation": {"behavior_tree": tree}}, "test")
    return run_trial(scenario_on_map(WARD, (0.0, -1.0, 0.0), goal), "rpp", robot=robot)


def samples(log: TrialLog) -> pd.DataFrame:
    measured = [name for name in log.samples if name.endswith("_time_ms")]
    return log.samples.drop(columns=measured)


@pytest.fixture(scope="module")
def from_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("trees") / "tree.xml"
    path.write_text(ALWAYS_RECOVERING)
    return read_tree_file(path).model_dump(mode="json")


def test_the_tree_of_humble_is_the_same_by_settings_and_by_file(from_file):
    humble = {"nav2_release": "humble", "wrap_around": True}
    by_settings, by_file = drive(humble | {"backup_speed": 0.05}), drive({"tree": from_file})
    assert by_file.outcome is Outcome.SUCCEEDED
    pd.testing.assert_frame_equal(samples(by_settings), samples(by_file))
    # Every second a new plan until the goal; lyrical's tree keeps the last one near it.
    assert len(by_file.plans) >= int(by_file.end_time_s)
    assert len(drive({}).plans) == 1
