"""Whole trials of robots with wheels and casters: repeatable, logged, and as hard as they look."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench import run_benchmark
from drake_navbench.inputs.robot import load_robot, overridden
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.trial import run_trial

MULTIBODY, PLANAR = "wheelchair_multibody", "wheelchair_casters"
BOTH = [MULTIBODY, PLANAR]


def told_by(log):
    """Returns the bytes of all samples that are a function of the trial."""
    return log.samples.drop(columns=list(UNREPEATABLE_COLUMNS)).to_numpy().tobytes()


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    path = tmp_path_factory.mktemp("course") / "course.yaml"
    path.write_text(
        "description: past a box\n"
        "world: {obstacles: [{type: box, min: [1.2, 0.1], max: [1.6, 1.0]}]}\n"
        "goal: [2.5, 0.3, 0.0]\n"
        "timeout_s: 30.0\n"
    )
    return str(path)


@pytest.mark.parametrize("robot", BOTH)
def test_a_trial_gives_the_same_bytes_again(robot, course):
    first, second = (run_trial(course, "rpp", 3, robot=robot) for _ in range(2))
    assert first.outcome is Outcome.SUCCEEDED
    assert told_by(first) == told_by(second)
    assert first.info["robot"]["drive"]["physics"] in ("multibody", "planar_casters")


@pytest.mark.usefixtures("real_workers")
@pytest.mark.long
def test_two_jobs_write_what_one_writes(course, tmp_path):
    logs = {}
    for jobs in (1, 2):
        for robot in BOTH:
            folder = tmp_path / f"{robot}_{jobs}"
            run_benchmark([course], ["rpp"], trials=2, jobs=jobs, robot=robot, out=folder)
            paths = sorted(folder.rglob("trial_*.parquet"))
            logs[robot, jobs] = [told_by(TrialLog.read(path)) for path in paths]
    for robot in BOTH:
        assert len(logs[robot, 1]) == 2
        assert logs[robot, 1] == logs[robot, 2]


@pytest.mark.long
@pytest.mark.parametrize("robot", BOTH)
def test_stiff_casters_make_the_chair_restless(robot):
    """What is steady on ideal wheels sways once casters hold back and have to be swung round."""
    stiff = load_robot(robot)
    casters = {"swivel_friction_nm": 2.0, "start_angles_rad": [3.0, 3.0]}
    stiff = overridden(stiff, {"drive": {"casters": casters}}, "test")
    swaying = {}
    for name, chair in (("ideal", load_robot("wheelchair")), ("stiff", stiff)):
        samples = run_trial("empty", "rpp", 1, robot=chair).samples
        cruise = samples[(samples["time_s"] > 3.0) & (samples["time_s"] < 12.0)]
        swaying[name] = cruise["w_radps"].std()
    assert swaying["ideal"] < 0.02
    assert swaying["stiff"] > 0.05


def test_contact_is_found_on_wheels_as_without(tmp_path):
    path = tmp_path / "wall.yaml"
    path.write_text(
        "description: a wall that nobody knows of\n"
        "world: {obstacles: [{type: box, min: [1.5, -2.0], max: [1.6, 2.0],"
        " known_to_planner: false, height_m: 0.1}]}\n"
        "goal: [4.0, 0.0, 0.0]\n"
        "timeout_s: 30.0\n"
    )
    places = []
    for robot in ("wheelchair", *BOTH):
        log = run_trial(str(path), "rpp", 1, robot=robot)
        assert log.outcome is Outcome.COLLIDED
        places.append(log.samples["x_m"].iloc[-1])
    # The front reaches 0.85 m ahead; tyres that give let it nod by a little.
    np.testing.assert_allclose(places, 1.5 - 0.85, atol=2e-3)
