"""Scenarios in the mode navigate_to_pose, and what their logs tell of the behaviour tree."""

from stub_controller import StubPreset

from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.typed_files.typed_yaml import validate


def scenario(**fields) -> Scenario:
    """Returns a scenario in the mode navigate_to_pose; an empty world unless it is said."""
    data = {
        "name": "test",
        "description": "made by a test",
        "goal": [3.0, 0.0, 0.0],
        "navigation_mode": "navigate_to_pose",
        "timeout_s": 60.0,
    }
    return validate(Scenario, data | fields, "test.yaml")


def simulate_stub(step, task: Scenario) -> TrialLog:
    """Runs a controller that is one function."""
    robot = load_robot("wheelchair", task.robot_overrides)
    return simulate(TrialSpec(task, robot, StubPreset(step), seed=0))


def statuses(log: TrialLog, *nodes: str, idle: bool = False) -> list[tuple[str, str]]:
    """Returns the changes of status of some nodes, in order."""
    return [
        (event["node"], event["status"])
        for _, event in log.events
        if event.get("node") in nodes and (idle or event["status"] != "idle")
    ]


def box(low, high, **more):
    """Returns an obstacle between two corners (x, y) m, with more of its fields."""
    return {"type": "box", "min": list(low), "max": list(high), **more}
