"""Shows trials in a browser while they run."""

from __future__ import annotations

from pydrake.geometry import Meshcat, MeshcatParams
from rich.console import Console

from drake_navbench.campaign.campaign import Campaign
from drake_navbench.log import Outcome
from drake_navbench.trial.trial import simulate

REAL_TIME = 1.0


def show_live(campaign: Campaign, console: Console) -> bool:
    """Runs the trials one by one in real time; returns whether any ended in an error.

    Nothing is written: `--live` is for looking. The server listens on this machine alone.
    """
    meshcat = Meshcat(MeshcatParams(host="localhost"))
    console.print(f"Open {meshcat.web_url()} in a browser. Ctrl-C ends it.")
    any_error = False
    for spec in campaign.specs:
        meshcat.Delete()
        console.print(f"{spec.scenario.name}, {spec.preset.name}, trial {spec.trial} ...")
        log = simulate(spec, meshcat=meshcat, realtime_rate=REAL_TIME)
        console.print(f"  {log.outcome} after {log.end_time_s:.1f} s: {log.info['reason']}")
        any_error |= log.outcome is Outcome.ERROR
    if console.is_terminal:
        console.input("Enter closes the page. ")
    return any_error
