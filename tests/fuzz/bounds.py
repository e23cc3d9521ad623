"""How often a target is tried, and what a loader must keep to."""

from __future__ import annotations

import os
import resource
import time
from contextlib import contextmanager

from hypothesis import HealthCheck, settings

from drake_navbench.errors import InputError

# A few seconds' worth in every run.
FEW_CASES = 20
CASES = int(os.environ.get("FUZZ_CASES", FEW_CASES))
MAX_TIME_S = 5.0
MAX_MEMORY_BYTES = 1e9

fuzz = settings(
    max_examples=CASES,
    # Few cases are the same in every run, many are new ones each time.
    derandomize=CASES == FEW_CASES,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)


@contextmanager
def only_input_errors(limit_s: float = MAX_TIME_S):
    """Lets only errors through that a user can read, and asserts that time and memory are kept."""
    started = time.process_time()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        yield
    except InputError as error:
        lines = str(error).splitlines()
        assert lines
        assert all(line.isprintable() and len(line) <= 1000 for line in lines)
    grown_bytes = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    assert time.process_time() - started < limit_s
    assert grown_bytes < MAX_MEMORY_BYTES
