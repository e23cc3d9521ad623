"""Processor time of compiling the default columns in this process, from an empty cache of kernels.

`python tests/benchmarks/compiling.py [COLUMN ...]` prints a line a column, in the order given; a
column compiles what those before it have not. To compare two trees, let them take turns.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time

COLUMNS = ("rpp", "dwb", "teb_upstream", "mppi_nav2", "teb", "mppi")
SCENARIO, ROBOT = "static_obstacles", "wheelchair"


def main(columns: tuple[str, ...]) -> None:
    """Drives the first tenth of a second of each column, rehearsed, and prints what it took."""
    from drake_navbench.errors import InputError
    from drake_navbench.inputs.presets import load_preset
    from drake_navbench.inputs.robot import load_robot
    from drake_navbench.inputs.scenario import load_scenario
    from drake_navbench.trial.spec import TrialSpec
    from drake_navbench.trial.trial import simulate

    try:
        presets = [load_preset(column) for column in columns]
    except InputError as error:
        print(f"compiling.py: {error}", file=sys.stderr)
        sys.exit(2)
    total_s = 0.0
    for column, preset in zip(columns, presets, strict=True):
        scenario = load_scenario(SCENARIO).model_copy(update={"timeout_s": 0.1})
        spec = TrialSpec(scenario, load_robot(ROBOT), preset, seed=1)
        begun_s = time.process_time()
        simulate(spec)
        taken_s = time.process_time() - begun_s
        total_s += taken_s
        print(f"{column:14}{taken_s:6.1f} s", flush=True)
    print(f"{'together':14}{total_s:6.1f} s")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.environ["NUMBA_CACHE_DIR"] = folder
        main(tuple(sys.argv[1:]) or COLUMNS)
