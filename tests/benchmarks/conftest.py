"""What the JSON of `make bench` holds besides the times."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
from typing import Any

import pytest

KIBIBYTES_PER_MEGABYTE = 1e6 / 1024
LOOPS = 5_000_000


@pytest.fixture(scope="session", autouse=True)
def _no_rehearsals() -> None:
    """Here trials are rehearsed: what a process does once is no part of their times."""


@pytest.fixture(scope="session", autouse=True)
def _works_here() -> None:
    """Here workers are processes, as they are for users."""


@pytest.fixture(autouse=True)
def peak_memory(request: pytest.FixtureRequest) -> Iterator[None]:
    """Adds the most memory that the process has held so far to a benchmark's row."""
    is_one = "benchmark" in request.fixturenames
    benchmark = request.getfixturevalue("benchmark") if is_one else None
    yield
    if benchmark is not None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / KIBIBYTES_PER_MEGABYTE
        benchmark.extra_info["peak_memory_mb"] = round(peak)


def pytest_benchmark_update_machine_info(config: pytest.Config, machine_info: dict[str, Any]):
    """Adds how long a loop of plain Python takes, best of three: a measure of the machine."""
    del config
    machine_info["python_loop_s"] = min(_python_loop_s() for _ in range(3))


def _python_loop_s() -> float:
    started = time.perf_counter()
    total = 0
    for i in range(LOOPS):
        total += i
    return time.perf_counter() - started
