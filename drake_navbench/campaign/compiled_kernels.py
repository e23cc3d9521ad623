"""The kernels of whole benchmarks, compiled into one folder, as a wheel brings them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.warm_up import Compiling, cold_parts, warm_up, warm_ups
from drake_navbench.inputs.floor_scenario import SCENARIO_FILES
from drake_navbench.inputs.presets import preset_files
from drake_navbench.processes.cache_folder import COMPILER_FILE
from drake_navbench.processes.kernel_sources import compiler

# Drives in the scenarios that only differ by what is in them.
WORLD_COLUMN = "rpp"


def compile_into(
    folder: Path, columns: Sequence[str], scenarios: Sequence[str], *, jobs: int
) -> None:
    """Compiles kernels into an empty folder, and names the compiler in it.

    folder: the one that numba keeps its kernels in. columns, scenarios: those that the kernels
    serve; empty for all that are built in. jobs: number of processes.
    """
    specs = [
        *plan_campaign(["empty"], list(columns or preset_files()), trials=1).specs,
        *plan_campaign(list(scenarios or SCENARIO_FILES.names), [WORLD_COLUMN], trials=1).specs,
    ]
    cold = cold_parts(specs)
    print(f"compiling for {', '.join(cold.names)}", flush=True)
    warm_up(
        Compiling(warm_ups(cold)),
        jobs=jobs,
        on_progress=lambda done, total: print(f"{done} of {total} steps", flush=True),
    )
    (folder / COMPILER_FILE).write_text(f"{compiler()}\n", encoding="utf-8")
