"""The world and the robot of a scenario as a simulator for a running ROS 2 stack."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import Any

from rich.console import Console

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.live import live_page
from drake_navbench.campaign.manifest import begin
from drake_navbench.errors import printable
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder, only_run_in, require_writable
from drake_navbench.trial.trial import simulate

COLUMN = "live"
# Facts of the log that are printed: key, and a text for the value.
TOLD = (
    ("command_count", "commands received: {}"),
    ("clock_late_p99_ms", "99 of 100 steps of /clock were at most {} ms late"),
    ("clock_stall_count", "stalls of the clock: {}"),
    ("missed_command_count", "commands that did not come in time: {}"),
    ("restart_count", "times that the stack was started anew: {}"),
    ("lost_message_count", "messages lost, as a listener had stopped reading: {}"),
)


def simulate_for_stack(
    scenario: Scenario,
    parameters: Mapping[str, Any],
    *,
    robot: str,
    seed: int,
    folder: ResultsFolder,
    shows_page: bool,
    console: Console,
) -> bool:
    """Simulates until Ctrl-C, a touch or the scenario's time; writes the log as a trial's.

    parameters: the column `live`'s. Returns whether the trial ended in an error.
    """
    source = "drake-navbench live"
    preset = Preset(COLUMN, COLUMN, "a running ROS 2 stack", parameters, source).checked()
    campaign = plan_campaign([scenario], [preset], trials=1, seed=seed, robot=robot)
    (spec,) = campaign.specs
    with only_run_in(folder.path):
        require_writable(folder.path)
        begin(folder, campaign, None, 1)
        if shows_page:
            with live_page(console) as page:
                log = page.drive(spec)
        else:
            log = simulate(spec)
        folder.write_log(log)
    _tell(console, log, folder.path)
    return log.outcome is Outcome.ERROR


def _tell(console: Console, log: TrialLog, path: Path) -> None:
    stack = log.info.get("running_stack", {})
    told = [f"Ended after {log.end_time_s:.1f} s: {log.info['reason']}"]
    told += [text.format(stack[key]) for key, text in TOLD if stack.get(key)]
    told += stack.get("faults", [])
    for line in told:
        console.print(printable(line), soft_wrap=True)
    console.print(
        f"drake-navbench export {quote(str(path))} --mcap writes it as a bag.", soft_wrap=True
    )
