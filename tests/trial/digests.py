"""Digests of trials, kept in digests.yaml: what every processor with the baseline must drive.

`python tests/trial/digests.py` drives the trials and writes the file anew.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import yaml

from drake_navbench import run_trial
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS
from drake_navbench.logs.log import TrialLog

FILE = Path(__file__).with_name("digests.yaml")
QUICK = ("rpp", "dwb")
SLOW = ("mppi", "teb", "mppi_nav2", "teb_upstream", "harmony", "graceful", "vector_pursuit")


def digest(log: TrialLog) -> str:
    """Returns the first 16 digits of a SHA-256 over the samples' bytes, compute times apart."""
    found = hashlib.sha256()
    for name, column in log.samples.items():
        if not str(name).startswith("compute_"):
            found.update(str(name).encode() + column.to_numpy().tobytes())
    return found.hexdigest()[:16]


def kept() -> dict[str, dict[str, str]]:
    """Returns the digests of the file, by scenario and preset."""
    return yaml.safe_load(FILE.read_text(encoding="utf-8"))


def main() -> None:
    """Drives the trials and writes their digests."""
    driven = {
        scenario: {preset: digest(run_trial(scenario, preset)) for preset in (*QUICK, *SLOW)}
        for scenario in PUBLISHED_SCENARIOS
    }
    FILE.write_text(yaml.safe_dump(driven, sort_keys=False), encoding="utf-8")


if __name__ == "__main__":
    main()
