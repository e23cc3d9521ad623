"""DWB's parameters: Nav2's names, and one line for whatever is wrong."""

import numpy as np
import pytest
from dwb_cases import BRINGUP, SETUP, observe, parameters

from drake_navbench.controllers.dwb import DynamicWindowApproach, DynamicWindowApproachParameters
from drake_navbench.controllers.dwb.critics.registry import load_critic
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.typed_files.typed_yaml import validate


def read(**changes):
    return validate(DynamicWindowApproachParameters, BRINGUP | changes, "f.yaml")


def test_defaults_are_those_of_nav2():
    p = validate(DynamicWindowApproachParameters, {"critics": ["PathAlign", "Twirling"]}, "f.yaml")
    assert (p.max_vel_x, p.max_speed_xy, p.linear_granularity) == (0.0, 0.0, 0.5)
    assert (p.sim_time, p.vx_samples, p.vy_samples, p.sim_period) == (1.7, 20, 5, None)
    assert p.critic("PathAlign").forward_point_distance == 0.325
    assert p.critic("Twirling").scale == 1.0


def test_resolved_parameters_read_back_as_the_same():
    p = read()
    assert validate(DynamicWindowApproachParameters, p.model_dump(mode="json"), "f.yaml") == p


def test_critic_may_have_a_name_of_its_own():
    p = read(critics=["Near", "Far"], Near={"class": "PathDist"}, Far={"class": "GoalDist"})
    planner = DynamicWindowApproach(p, SETUP)._planner
    assert [type(critic).__name__ for critic in planner._critics] == ["PathDist", "GoalDist"]


def test_critics_answer_to_nav2s_class_names():
    assert load_critic("dwb_critics::PathDistCritic") is load_critic("PathDist")


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"critics": ["PathDits"]}, "critics: critic 'PathDits' is not registered; did you mean"),
        ({"critics": []}, "critics: tuple should have at least 1 item"),
        ({"critics": "PathDist"}, "critics: input should be a valid"),
        ({"PathDits": {"scale": 1.0}}, "PathDits: unknown field; did you mean 'PathDist'?"),
        ({"sim_tme": 1.0}, "sim_tme: unknown field; did you mean 'sim_time'?"),
        ({"PathDist": {"scale": -1.0}}, "PathDist.scale: input should be greater than or equal"),
        ({"PathDist": {"scale": "a"}}, "PathDist.scale: input should be a valid number"),
        (
            {"PathDist": {"scael": 1.0}},
            "PathDist.scael: critic PathDist has no such parameter; did you mean",
        ),
        ({"PathDist": 1.0}, "PathDist: input should be an object"),
        ({"sim_time": 0.0}, "sim_time: input should be greater than 0, got 0"),
        ({"vx_samples": 2.5}, "vx_samples: input should be a valid integer"),
        ({"angular_granularity": 0.0}, "angular_granularity: input should be greater than or"),
        ({"decel_lim_x": 2.5}, "decel_lim_x: input should be less than or equal to 0, got 2.5"),
        ({"trajectory_generator_name": ""}, "trajectory_generator_name: got '', expected a"),
        (
            {"trajectory_generator_name": "dwb_plugins::StandardTrajectoryGen"},
            "did you mean 'dwb_plugins::StandardTrajectoryGenerator'?",
        ),
        ({"min_vel_x": 0.3}, "min_vel_x: got 0.3, expected at most max_vel_x 0.26"),
    ],
)
def test_wrong_input_is_one_line_that_names_the_parameter(changes, line):
    with pytest.raises(InputError) as caught:
        read(**changes)
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_critics_are_named():
    with pytest.raises(InputError, match=r"^f.yaml: critics: missing"):
        validate(DynamicWindowApproachParameters, {}, "f.yaml")


@pytest.mark.parametrize("changes", [{"max_vel_y": 0.1}, {"min_vel_y": -0.1}])
def test_lateral_velocity_is_refused_for_a_differential_base(changes):
    (name,) = changes
    with pytest.raises(InputError, match=rf"^{name}: got .*, expected 0"):
        DynamicWindowApproach(parameters(**changes), SETUP)


USER_CRITIC = """
    import numpy as np
    from pydantic import Field

    from drake_navbench.controllers.dwb.critics.base import Critic, CriticParameters, Verdict


    class KeepLeft(Critic):
        class Parameters(CriticParameters):
            border_y: float = Field(0.0, description="smallest y of an end pose [m]")

        reasons = ("Trajectory ends right of the border.",)

        def initial_memory(self):
            return 0

        def debrief(self, situation, command, memory):
            return memory + 1

        def score(self, scene, memory):
            ends_y = scene.end_poses[:, 1]
            return Verdict(-ends_y + 10.0, ends_y < self._parameters.border_y)
"""


@pytest.fixture
def installed_critic(install_package):
    """Installs a distribution with one critic."""
    points = {"drake_navbench.dwb_critics": {"KeepLeft": "keep_left.keep_left:KeepLeft"}}
    install_package("keep_left", USER_CRITIC, points)


@pytest.mark.usefixtures("installed_critic")
def test_critic_of_an_installed_package_scores_rejects_and_remembers():
    p = read(critics=["KeepLeft", "PathDist"], KeepLeft={"scale": 100.0, "border_y": 0.01})
    controller = DynamicWindowApproach(p, SETUP)
    decision = controller.step(observe(), controller.initial_memory())
    # The farther left the better: full speed and a turn to the left.
    assert decision.command[0] == pytest.approx(0.26)
    assert decision.command[1] > 0.5
    assert decision.diagnostics["illegal_count"] > 200
    assert decision.memory.critics == (1, None)


@pytest.mark.usefixtures("installed_critic")
def test_parameters_of_an_installed_critic_are_checked():
    with pytest.raises(InputError, match=r"KeepLeft.border: critic KeepLeft has no such parameter"):
        read(critics=["KeepLeft"], KeepLeft={"border": np.pi})


def test_the_preset_dwb_differs_from_bringups_in_the_obstacle_critic_alone():
    dwb, bringup = (load_preset(name).parameters for name in ("dwb", "dwb_bringup"))
    others = [name for name in bringup.critics if name != "BaseObstacle"]
    assert dwb.critics == tuple(
        "ObstacleFootprint" if name == "BaseObstacle" else name for name in bringup.critics
    )
    assert dwb.critic("ObstacleFootprint").scale == bringup.critic("BaseObstacle").scale == 0.02
    assert [dwb.critic(name) for name in others] == [bringup.critic(name) for name in others]
    for name in DynamicWindowApproachParameters.model_fields.keys() - {"critics"}:
        assert getattr(dwb, name) == getattr(bringup, name), name
