"""Shows trials in a browser while they run, drawn and explained as in a replay."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from pydrake.geometry import Meshcat
from rich.console import Console

from drake_navbench.analysis.replay.live_scene import Course, LiveScene
from drake_navbench.analysis.replay.scene import goal_tolerance_m
from drake_navbench.analysis.replay.stage import make_meshcat, without_late_texture_warnings
from drake_navbench.campaign.campaign import Campaign
from drake_navbench.campaign.live_server import LiveServer
from drake_navbench.logs.log import Outcome, TrialLog
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate

REAL_TIME = 1.0


def show_live(campaign: Campaign, console: Console, *, realtime_rate: float = REAL_TIME) -> bool:
    """Runs the trials one by one in real time; returns whether any ended in an error.

    Nothing is written: `--live` is for looking. The servers listen on this machine alone.
    """
    any_error = False
    with live_page(console) as page:
        for spec in campaign.specs:
            console.print(f"{spec.scenario.name}, {spec.preset.name}, trial {spec.trial} ...")
            log = page.drive(spec, realtime_rate)
            console.print(f"  {log.outcome} after {log.end_time_s:.1f} s: {log.info['reason']}")
            any_error |= log.outcome is Outcome.ERROR
        if console.is_terminal:
            console.input("Enter closes the page. ")
    return any_error


class LivePage:
    """The page on which trials are shown, one after another."""

    def __init__(self, meshcat: Meshcat, server: LiveServer) -> None:
        self._meshcat, self._server = meshcat, server

    def drive(self, spec: TrialSpec, realtime_rate: float) -> TrialLog:
        """Drives a trial while the page shows it; returns its log."""
        scene = LiveScene(
            self._meshcat,
            _course(spec),
            spec.preset.name,
            subtitle=f"{spec.scenario.description}; trial {spec.trial}, seed {spec.seed}",
        )
        self._server.show(scene.page)
        # The controller's diagnostics are a layer of the scene, too; they do not change the
        # motion.
        watched = replace(spec, wants_diagnostics=True)
        return simulate(watched, watch=scene.show, realtime_rate=realtime_rate)


@contextmanager
def live_page(console: Console) -> Iterator[LivePage]:
    """Opens the page, tells its address, and closes it in the end."""
    meshcat = make_meshcat()
    with LiveServer(meshcat.web_url()) as server, without_late_texture_warnings():
        console.print(f"Open {server.address} in a browser. Ctrl-C ends it.")
        yield LivePage(meshcat, server)


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
