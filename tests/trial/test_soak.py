"""Memory does not grow with what was driven, and what a trial has built is freed after it."""

import gc
import weakref
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from resident_memory import resident_mb

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario, scenario_on_map
from drake_navbench.inputs.task_check import check_task
from drake_navbench.trial import simulation as trial_module
from drake_navbench.trial.diagram import TrialDiagram
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate

HOUR_S = 3600.0


@pytest.mark.parametrize(
    "mode", [pytest.param("follow_path", marks=pytest.mark.long), "navigate_to_pose"]
)
def test_what_a_trial_has_built_is_freed_after_it(mode, monkeypatch):
    built: list[weakref.ref] = []

    def build(*arguments, **options) -> TrialDiagram:
        trial = build_trial_diagram(*arguments, **options)
        built.extend(weakref.ref(part) for part in (trial.diagram, *trial.diagram.GetSystems()))
        return trial

    build_trial_diagram = trial_module.build_trial_diagram
    monkeypatch.setattr(trial_module, "build_trial_diagram", build)
    scenario = Scenario(
        name="ahead", description="ahead", goal=(0.5, 0.0, 0.0), navigation_mode=mode
    )
    simulate(TrialSpec(scenario, load_robot("wheelchair"), load_preset("rpp"), seed=0))
    gc.collect()
    assert len(built) > 10
    assert [part() for part in built if part() is not None] == []


def hall(folder: Path) -> Path:
    """Writes the map of a hall of 40 m x 20 m with two pillars; returns its file."""
    cells = np.full((200, 400), 254, np.uint8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 0
    cells[90:100, 130:140] = cells[110:120, 260:270] = 0
    (folder / "hall.pgm").write_bytes(b"P5 400 200 255\n" + cells.tobytes())
    map_file = folder / "hall.yaml"
    map_file.write_text(
        "image: hall.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return map_file


def drawn_task(map_file: Path, random: np.random.Generator) -> Scenario:
    """Returns the task between two drawn poses where the robot can stand."""
    robot = load_robot("wheelchair")
    while True:
        start, goal = random.uniform((1.5, 1.5, -3.0), (38.5, 18.5, 3.0), (2, 3)).tolist()
        there = scenario_on_map(map_file, tuple(start), tuple(goal))
        try:
            check_task(there, robot)
            check_task(scenario_on_map(map_file, tuple(goal), tuple(start)), robot)
        except InputError:
            continue
        return there.model_copy(update={"navigation_mode": "follow_path"})


@pytest.mark.long
def test_memory_after_a_day_of_driving_is_that_after_an_hour(tmp_path):
    map_file = hall(tmp_path)
    random = np.random.default_rng(0)
    # Few beams, so that a day takes a quarter of an hour.
    robot = load_robot("wheelchair", {"lidar": {"beam_count": 60}})
    rpp = load_preset("rpp")
    driven_s, outcomes, memory_mb = 0.0, Counter(), {}
    for hours in (1, 24):
        while driven_s < hours * HOUR_S:
            task = drawn_task(map_file, random)
            spec = TrialSpec(task, robot, rpp, seed=outcomes.total(), keeps_costmaps=False)
            log = simulate(spec)
            driven_s += log.end_time_s
            outcomes[log.outcome] += 1
            del log
        memory_mb[hours] = resident_mb()
        print(f"{dict(outcomes)} after {driven_s:.0f} s: {memory_mb[hours]:.1f} MiB")
    assert memory_mb[24] <= 1.05 * memory_mb[1]
