"""A user's critic of MPPI: as docs/controllers.md shows it, installed, and with faults."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from mppi_scenes import critic_of, round_robot, scene_of
from scenes import straight_plan

from drake_navbench.controllers.mppi.noise import Noise
from drake_navbench.controllers.mppi.parameters import MppiParameters
from drake_navbench.controllers.mppi.sampler import Sampler
from drake_navbench.errors import InputError
from drake_navbench.typed_files.typed_yaml import validate

GUIDE = Path(__file__).parents[3] / "docs" / "controllers.md"
GROUP = "drake_navbench.mppi_critics"
STEPS = 56


def documented_code() -> str:
    """The module that the guide shows."""
    section = GUIDE.read_text(encoding="utf-8").split("## Your own MPPI critic")[1]
    return re.search(r"```python\n(.*?)```", section, re.DOTALL).group(1)


@pytest.fixture
def installed_turn_left(install_package):
    """Installs a distribution with the guide's critic."""
    install_package(
        "my_package", documented_code(), {GROUP: {"TurnLeft": "my_package.my_package:TurnLeft"}}
    )
    return "TurnLeft"


@pytest.fixture
def install_critic(install_package):
    """A function that installs a distribution with one critic of a given code, called Theirs."""

    def install(code: str) -> None:
        install_package("theirs", code, {GROUP: {"Theirs": "theirs.theirs:Theirs"}})

    return install


def read(**values) -> MppiParameters:
    return validate(MppiParameters, values, "f.yaml")


def run_with(turn_left: dict):
    """Runs one cycle from 0.3 m/s along a straight plan, always with the same noise."""
    parameters = read(critics=["GoalCritic", "TurnLeft"], TurnLeft=turn_left)
    sampler = Sampler(parameters, round_robot())
    noise = Noise.empty(1000, STEPS, holonomic=False)
    noise.draw((4,), (0.2, 0.0, 0.4))
    return sampler.run(
        scene_of(straight_plan(1.0)),
        (0.3, 0.0, 0.0),
        sampler.initial_state()._replace(last_command=np.array([0.3, 0.0, 0.0])),
        draw=lambda resets, index: noise,
    )


@pytest.mark.usefixtures("installed_turn_left")
def test_the_documented_critic_is_found_by_entry_point_and_steers():
    heavy, light = run_with({"weight": 10.0}), run_with({"weight": 0.0})
    assert heavy.critic_costs.shape == (2, 1000)
    assert heavy.trajectory[-1, 2] > light.trajectory[-1, 2] + 0.1


@pytest.mark.usefixtures("installed_turn_left")
def test_a_critic_that_is_not_enabled_is_not_asked():
    off = run_with({"weight": 10.0, "enabled": False})
    assert not off.critic_costs[1].any()
    np.testing.assert_array_equal(off.controls, run_with({"weight": 0.0}).controls)


@pytest.mark.usefixtures("installed_turn_left")
@pytest.mark.parametrize(
    ("block", "line"),
    [
        ({"wieght": 1.0}, "TurnLeft.wieght: critic TurnLeft has no such parameter; did you mean"),
        ({"weight": "a"}, "TurnLeft.weight: input should be a valid number, got 'a'"),
        ({"weight": -1.0}, "TurnLeft.weight: input should be greater than or equal to 0, got -1"),
        (3.0, "TurnLeft: input should be an object, got 3.0"),
    ],
)
def test_a_wrong_parameter_of_a_users_critic_is_one_line(block, line):
    with pytest.raises(InputError) as caught:
        read(critics=["TurnLeft"], TurnLeft=block)
    assert str(caught.value).startswith(f"f.yaml: {line}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("critics", "line"),
    [
        (["GoalCritik"], "critics: critic 'GoalCritik' is not registered; did you mean 'GoalCrit"),
        (["TurnLeft"], "critics: critic 'TurnLeft' is not registered"),
    ],
)
def test_a_critic_that_is_not_installed_is_one_line(critics, line):
    with pytest.raises(InputError) as caught:
        read(critics=critics, **{critics[0]: {"weight": 1.0}})
    assert str(caught.value).startswith(f"f.yaml: {line}")
    assert "\n" not in str(caught.value)


def test_a_misspelt_block_gets_the_nearest_name():
    with pytest.raises(InputError, match=r"^f.yaml: GoalCritik: unknown field; did you mean 'Goal"):
        read(GoalCritik={"cost_weight": 1.0})


def test_a_subclass_without_parameters_of_its_own_has_what_every_critic_has(install_critic):
    install_critic("""
        from drake_navbench.controllers.mppi.critics.base import Critic

        class Theirs(Critic):
            def score(self, batch): ...
    """)
    assert critic_of("Theirs", enabled=False).parameters.model_dump() == {"enabled": False}
    with pytest.raises(InputError, match=r"Theirs.weight: critic Theirs has no such parameter"):
        read(critics=["Theirs"], Theirs={"weight": 1.0})


@pytest.mark.parametrize(
    ("code", "line"),
    [
        (
            "class Theirs:\n    def score(self, batch): ...",
            "is not a class with Parameters, as docs/contr",
        ),
        (
            "class Theirs:\n    Parameters = dict\n    def score(self, batch): ...",
            "critic 'Theirs': its Parameters are no CriticParameters, as docs/controllers.md",
        ),
    ],
)
def test_a_critic_without_a_model_for_its_block_is_one_line(code, line, install_critic):
    install_critic(code)
    with pytest.raises(InputError, match=line) as caught:
        read(critics=["Theirs"])
    assert "\n" not in str(caught.value)


def test_resolved_parameters_hold_the_listed_critics_and_read_back_as_the_same():
    parameters = read(critics=["GoalCritic", "TwirlingCritic"], TwirlingCritic={"cost_power": 2})
    resolved = parameters.model_dump(mode="json")
    assert resolved["GoalCritic"] == {
        "enabled": True,
        "cost_power": 1,
        "cost_weight": 5.0,
        "threshold_to_consider": 1.4,
    }
    assert resolved["TwirlingCritic"]["cost_power"] == 2
    assert "CostCritic" not in resolved
    assert read(**resolved) == parameters
