"""Replays of the site's gallery: `python studies/site_replays.py` writes them into build/replays.

`make site` does it once. A replay shows the controllers of the section's picture, with its seed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from gallery import IN_EVERY_SCENARIO, drive

from drake_navbench.analysis.replay import write_race_replay

FOLDER = Path(__file__).parents[1] / "build" / "replays"
SCENARIOS = ("static_obstacles", "doorway", "crossing")


def main() -> None:
    """Drives the trials and writes a replay for each scenario."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    for scenario in SCENARIOS:
        logs = [drive(scenario, preset) for preset in IN_EVERY_SCENARIO]
        path = FOLDER / f"{scenario}.html"
        write_race_replay(logs, path, model=None, columns=list(IN_EVERY_SCENARIO))


if __name__ == "__main__":
    main()
