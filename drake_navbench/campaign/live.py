"""Shows trials in a browser while they run, drawn and explained as in a replay."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Meshcat
from rich.console import Console

from drake_navbench.analysis.replay.live_scene import Course, LiveScene
from drake_navbench.analysis.replay.scene import goal_tolerance_m
from drake_navbench.analysis.replay.stage import make_meshcat, without_late_texture_warnings
from drake_navbench.campaign.campaign import Campaign
from drake_navbench.campaign.live_controls import LiveControls, Patience, Restart
from drake_navbench.campaign.live_parameters import Change
from drake_navbench.campaign.live_server import LiveServer
from drake_navbench.campaign.manifest import begin
from drake_navbench.campaign.request import Request
from drake_navbench.errors import printable
from drake_navbench.logs.log import LIVE_CHANGES, TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder, only_run_in, require_writable
from drake_navbench.trial.diagram import Observers
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate
from drake_navbench.typed_files.output_file import write_whole

REAL_TIME = 1.0
DEFAULT_WAIT_S = 120.0
# The subfolder of logs of trials whose sliders were moved, which no report reads.
CHANGED_FOLDER = "changed_live"


class LiveOptions(NamedTuple):
    """The pace, the patience and the port of watched trials.

    rate: pace as a multiple of real time; 0: as fast as possible. wait_s: time to wait for a
    browser; None: no waiting. port: the page's, 0 for a free one.
    """

    rate: float = REAL_TIME
    wait_s: float | None = DEFAULT_WAIT_S
    port: int = 0


class Kept(NamedTuple):
    """The results folder of the logs, and the request that was asked for."""

    folder: ResultsFolder
    request: Request | None


def show_live(
    campaign: Campaign,
    console: Console,
    options: LiveOptions | None = None,
    kept: Kept | None = None,
) -> bool:
    """Runs the trials one by one in real time; returns whether any ended in an error.

    kept: None keeps no log. Raises InputError where no browser opens the page, or it is closed. The
    servers listen on this machine alone.
    """
    options = options or LiveOptions()
    if kept is None:
        return _show(campaign, console, options, None)
    with only_run_in(kept.folder.path):
        require_writable(kept.folder.path)
        begin(kept.folder, campaign, kept.request, 1)
        return _show(campaign, console, options, kept.folder)


def _show(
    campaign: Campaign, console: Console, options: LiveOptions, folder: ResultsFolder | None
) -> bool:
    any_error = False
    with live_page(console, port=options.port) as page:
        for spec in campaign.specs:
            console.print(f"{spec.scenario.name}, {spec.preset.name}, trial {spec.trial} ...")
            if spec.preset.is_running_stack:
                log = page.drive(spec)
            else:
                log = page.drive_with_controls(spec, options)
            console.print(f"  {log.outcome} after {log.end_time_s:.1f} s: {log.info['reason']}")
            any_error |= log.outcome is Outcome.ERROR
            for line in change_lines(log):
                console.print(f"  {printable(line)}", soft_wrap=True)
            if folder is not None:
                console.print(f"  {keep(log, folder)}", soft_wrap=True)
        if console.is_terminal:
            console.input("Enter closes the page. ")
    return any_error


def change_lines(log: TrialLog) -> list[str]:
    """Returns a line on each moved slider of a trial."""
    return [
        f"{entry['name']} = {entry['value']:g} from {entry['time_s']:.2f} s on"
        for entry in log.info.get(LIVE_CHANGES, ())
    ]


def keep(log: TrialLog, folder: ResultsFolder) -> Path:
    """Writes a log into a results folder; returns its path.

    A log of a trial whose sliders were moved goes to a folder of its own, as it is no result of its
    column.
    """
    path = folder.path_of(log)
    if not log.info.get(LIVE_CHANGES):
        folder.write_log(log)
        return path
    path = folder.path / CHANGED_FOLDER / path.relative_to(folder.path / "trials")
    write_whole(path, log.write)
    return path


class LivePage:
    """The page on which trials are shown, one after another."""

    def __init__(self, meshcat: Meshcat, server: LiveServer, console: Console) -> None:
        self._meshcat, self._server, self._console = meshcat, server, console

    def drive(self, spec: TrialSpec) -> TrialLog:
        """Drives a trial while the page shows it; returns its log."""
        # The controller's diagnostics are a layer of the scene, too; computing them does not change
        # the motion.
        watched = replace(spec, wants_diagnostics=True)
        return simulate(watched, Observers(self._scene(spec, has_controls=False).show))

    def drive_with_controls(self, spec: TrialSpec, options: LiveOptions) -> TrialLog:
        """Drives a trial with buttons and sliders on the page, again after each restart.

        Returns the log of the last drive, which equals that of a trial without a page if no slider
        was moved. Raises InputError where no browser opens the page, or it is closed.
        """
        address = self._server.address
        patience = None if options.wait_s is None else Patience(options.wait_s, address)
        controls = LiveControls(
            self._meshcat,
            spec,
            rate=options.rate,
            patience=patience,
            tell=lambda text: self._console.print(printable(text), soft_wrap=True),
        )
        with controls:
            while True:
                scene = self._scene(spec, has_controls=True)
                controls.begin()
                try:
                    log = simulate(spec, controls.observers(scene.show))
                except Restart:
                    continue
                return with_changes(log, controls.changes)

    def _scene(self, spec: TrialSpec, *, has_controls: bool) -> LiveScene:
        scene = LiveScene(
            self._meshcat,
            _course(spec),
            spec.preset.name,
            subtitle=f"{spec.scenario.description}; trial {spec.trial}, seed {spec.seed}",
            has_controls=has_controls,
        )
        self._server.show(scene.page)
        return scene


def with_changes(log: TrialLog, changes: list[Change]) -> TrialLog:
    """Returns the log with the trial's moved sliders in it; its identity changes, too."""
    if not changes:
        return log
    told = [change.as_plain() for change in changes]
    identity = sha256(json.dumps([log.info["identity"], told]).encode()).hexdigest()
    return replace(log, info={**log.info, LIVE_CHANGES: told, "identity": identity})


@contextmanager
def live_page(console: Console, *, port: int = 0) -> Iterator[LivePage]:
    """Opens the page, prints its address, and closes it at the end; raises InputError.

    port: the page's, 0 for a free one.
    """
    meshcat = make_meshcat()
    with LiveServer(meshcat.web_url(), port=port) as server, without_late_texture_warnings():
        console.print(f"Open {server.address} in a browser. Ctrl-C ends it.")
        yield LivePage(meshcat, server, console)


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
        scenario.navigation_mode == "navigate_through_poses",
    )
