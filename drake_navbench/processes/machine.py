"""The machine on which compute times are measured: its processor, and the load on it."""

from __future__ import annotations

import os
import platform
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

CPU_INFO = Path("/proc/cpuinfo")


def processor_name(cpu_info: Path = CPU_INFO) -> str:
    """Returns the name of the processor's model, as far as the system tells it.

    cpu_info: the file in which Linux tells it.
    """
    with suppress(OSError):
        found = re.search(r"^model name\s*: (.+)$", cpu_info.read_text(), re.M)
        if found:
            return " ".join(found[1].split())
    return platform.processor() or platform.machine() or "unknown"


def available_cores() -> int:
    """Returns the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def load_average() -> float | None:
    """Returns the mean number of runnable processes in the last minute; None where unknown."""
    with suppress(AttributeError, OSError):
        return round(os.getloadavg()[0], 2)
    return None


def machine_facts(jobs: int) -> dict[str, Any]:
    """Returns the manifest's entry on the machine, for readers of compute times.

    jobs: number of parallel workers. The load is measured when this is called, so call it before
    the work begins: it is then the load of other programs.
    """
    return {
        "processor": processor_name(),
        "cores": available_cores(),
        "jobs": jobs,
        "load_before": load_average(),
    }
