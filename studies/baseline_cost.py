"""Measures the cost of the one instruction set: trials with it and with all that the processor has.

    python studies/baseline_cost.py [PAIRS]

Two processes take turns, one held to the baseline and one with the host's instructions; each drives
the same trials. Prints by preset the median ratio of the processor times of the pairs, with the
baseline / without, of whole trials and of control cycles, and how many trials have the same bytes.
The first pair compiles, and is left out.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

from llvmlite.binding import get_host_cpu_name

from drake_navbench import run_trial
from drake_navbench.processes.instruction_set import NUMBA_VARIABLE, VARIABLES

sys.path.append(str(Path(__file__).parents[1] / "tests" / "trial"))

SCENARIOS = ("one_obstacle", "static_obstacles")
PRESETS = ("rpp", "dwb", "mppi_nav2", "teb_upstream", "teb", "mppi")
PAIRS = 8


def driven(preset: str) -> dict[str, Any]:
    """Drives a preset's trials in this process; returns their processor times, s, and digests."""
    from digests import digest

    trials_s, cycles_s, digests = 0.0, 0.0, []
    for scenario in SCENARIOS:
        run_trial(scenario, preset)
        began_s = time.process_time()
        log = run_trial(scenario, preset)
        trials_s += time.process_time() - began_s
        cycles = log.samples.drop_duplicates("cycle_count")
        cycles_s += 1e-3 * float(cycles["compute_cpu_time_ms"].sum())
        digests.append(digest(log))
    return {"trials": trials_s, "cycles": cycles_s, "digests": digests}


def driven_apart(**variables: str) -> dict[str, Any]:
    """Returns `driven` of every preset in a new process with environment variables."""
    environment = {k: v for k, v in os.environ.items() if k not in VARIABLES} | variables
    command = [sys.executable, __file__, "--drive"]
    told = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    found: dict[str, Any] = json.loads(told.stdout.splitlines()[-1])
    return found


def main(pairs: int) -> None:
    """Drives the pairs and prints the ratios."""
    # numba knows no word for the host: a processor that is named must be one of LLVM's.
    host = {NUMBA_VARIABLE: get_host_cpu_name()}
    both = [(driven_apart(), driven_apart(**host)) for _ in range(pairs + 1)][1:]
    told = f"processor time with the baseline / as {host[NUMBA_VARIABLE]}"
    print(f"{told}, medians of {pairs} pairs")
    for preset in PRESETS:
        ratios = {
            what: median(held[preset][what] / free[preset][what] for held, free in both)
            for what in ("trials", "cycles")
        }
        held, free = (one[preset]["digests"] for one in both[0])
        same = sum(a == b for a, b in zip(held, free, strict=True))
        print(
            f"{preset:13} trials {ratios['trials']:.3f}, cycles {ratios['cycles']:.3f}, "
            f"{same} of {len(SCENARIOS)} with the same bytes"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Measures the cost of the one instruction set.")
    parser.add_argument("pairs", type=int, nargs="?", default=PAIRS)
    parser.add_argument("--drive", action="store_true", help="drive once in this process")
    arguments = parser.parse_args()
    if arguments.pairs < 1:
        parser.error(f"argument pairs: got {arguments.pairs}, expected at least 1")
    if arguments.drive:
        print(json.dumps({preset: driven(preset) for preset in PRESETS}))
    else:
        main(arguments.pairs)
