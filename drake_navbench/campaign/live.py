"""Shows trials in a browser while they run, drawn and explained as in a replay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from rich.console import Console

from drake_navbench.analysis.replay.live_scene import Course, LiveScene
from drake_navbench.analysis.replay.scene import goal_tolerance_m
from drake_navbench.analysis.replay.stage import make_meshcat, without_late_texture_warnings
from drake_navbench.campaign.campaign import Campaign
from drake_navbench.campaign.live_server import LiveServer
from drake_navbench.logs.log import Outcome
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate

REAL_TIME = 1.0


def show_live(campaign: Campaign, console: Console, *, realtime_rate: float = REAL_TIME) -> bool:
    """Runs the trials one by one in real time; returns whether any ended in an error.

    Nothing is written: `--live` is for looking. The servers listen on this machine alone.
    """
    meshcat = make_meshcat()
    any_error = False
    with LiveServer(meshcat.web_url()) as server, without_late_texture_warnings():
        console.print(f"Open {server.address} in a browser. Ctrl-C ends it.")
        for spec in campaign.specs:
            scene = LiveScene(
                meshcat,
                _course(spec),
                spec.preset.name,
                subtitle=f"{spec.scenario.description}; trial {spec.trial}, seed {spec.seed}",
            )
            server.show(scene.page)
            console.print(f"{spec.scenario.name}, {spec.preset.name}, trial {spec.trial} ...")
            # The controller's diagnostics are a layer of the scene, too; they do not change the
            # motion.
            watched = replace(spec, wants_diagnostics=True)
            log = simulate(watched, watch=scene.show, realtime_rate=realtime_rate)
            console.print(f"  {log.outcome} after {log.end_time_s:.1f} s: {log.info['reason']}")
            any_error |= log.outcome is Outcome.ERROR
        if console.is_terminal:
            console.input("Enter closes the page. ")
    return any_error


def _course(spec: TrialSpec) -> Course:
    scenario, robot = spec.scenario, spec.preset.robot(spec.robot)
    return Course(
        scenario.name,
        scenario.true_world,
        np.array(scenario.start, dtype=float),
        np.array(scenario.goals, dtype=float),
        goal_tolerance_m(robot.navigation.goal_checker.model_dump()),
        robot.outline,
        robot.model_path,
    )
