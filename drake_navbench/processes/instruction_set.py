"""One instruction set for all processors of an architecture: equal trials give equal bytes on each.

Kernels, numpy and OpenBLAS would each use the best instructions that the processor has. They round
differently: a fused product and sum once, vectorised sines in another last bit. So all three are
held to a baseline that nearly every processor has, x86-64-v3 (Intel since 2013, AMD since 2015).
Drake brings its own LAPACK, which knows no processors. Sines and exponentials of kernels are those
of the C library, whose fused versions every processor of the baseline takes.
"""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Mapping
from functools import cache

from drake_navbench.processes.machine import CPU_INFO

BASELINE = "x86-64-v3"
HOST = "host"
# Linux's names for those instructions of the baseline that not all x86-64 processors have.
NEEDED_FLAGS = frozenset({"abm", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"})
NUMBA_VARIABLE = "NUMBA_CPU_NAME"
# The variables that numba, numpy and OpenBLAS read when imported. numpy has had two sets of names
# for instructions above the baseline, and ignores unknown names.
VARIABLES: Mapping[str, str] = {
    NUMBA_VARIABLE: BASELINE,
    "NUMBA_CPU_FEATURES": "",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR AVX512F AVX512CD AVX512_SKX "
    "AVX512_CLX AVX512_CNL",
    "OPENBLAS_CORETYPE": "Haswell",
}


def hold_to_baseline() -> None:
    """Sets the baseline in the environment, for this process and those that it starts.

    Where the processor lacks the baseline, or the user has named a processor for numba, nothing is
    set. A variable that the user has set stays.
    """
    if not has_baseline() or os.environ.get(NUMBA_VARIABLE, BASELINE) != BASELINE:
        return
    for name, value in VARIABLES.items():
        os.environ.setdefault(name, value)
    if "numba.core.config" in sys.modules:
        # numba has read the environment already.
        sys.modules["numba.core.config"].reload_config()


def instruction_set() -> str:
    """Returns BASELINE where this process is held to it, else the user's processor, or HOST."""
    name = os.environ.get(NUMBA_VARIABLE, HOST)
    if name != BASELINE:
        return name
    return BASELINE if all(os.environ.get(key) == VARIABLES[key] for key in VARIABLES) else HOST


def notice() -> str:
    """Returns a line where this process is not held to the baseline, with the reason, else ''."""
    if instruction_set() == BASELINE:
        return ""
    return f"{_reason()}: trials may differ in the last bit from those of other processors"


def _reason() -> str:
    """Returns why this process is not held to the baseline."""
    if has_baseline():
        given = {key: os.environ.get(key, value) for key, value in VARIABLES.items()}
        others = [f"{key}={value}" for key, value in given.items() if value != VARIABLES[key]]
        return f"Held to other instructions than {BASELINE} by {', '.join(others)}"
    lacking = NEEDED_FLAGS - _flags()
    if platform.machine() != "x86_64" or lacking == NEEDED_FLAGS:
        return f"This processor is not known to have {BASELINE}"
    return f"This processor lacks {', '.join(sorted(lacking))} of {BASELINE}"


@cache
def has_baseline() -> bool:
    """Returns whether this processor has the baseline's instructions, as far as Linux tells."""
    return platform.machine() == "x86_64" and _flags() >= NEEDED_FLAGS


def _flags() -> set[str]:
    """Returns the processor's instructions as Linux names them; none where it does not tell."""
    try:
        found = re.search(r"^flags\s*: (.+)$", CPU_INFO.read_text(), re.MULTILINE)
    except OSError:
        return set()
    return set() if found is None else set(found[1].split())
