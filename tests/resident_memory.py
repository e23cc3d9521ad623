"""The memory that this process holds, without garbage and what it has freed but kept."""

import ctypes
import gc
from pathlib import Path

PAGE_BYTES = 4096
MEBIBYTE = 2**20


def resident_mb() -> float:
    """Returns it in MiB."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE_BYTES / MEBIBYTE
