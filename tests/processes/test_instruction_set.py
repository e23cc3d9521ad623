"""Kernels, numpy and OpenBLAS are held to one instruction set."""

import os
import subprocess
import sys

import pytest

from drake_navbench.processes import instruction_set as subject
from drake_navbench.processes.fingerprint import fingerprint

BASELINE_FLAGS = "fpu sse2 avx avx2 bmi1 bmi2 f16c fma abm movbe"
DIFFERS = "trials may differ in the last bit from those of other processors"
CODE = (
    "import drake_navbench, numpy, numba, os;"
    "from drake_navbench.processes.fingerprint import fingerprint;"
    "from drake_navbench.processes.instruction_set import instruction_set;"
    "print(numba.config.CPU_NAME, os.environ.get('OPENBLAS_CORETYPE'), instruction_set(),"
    " fingerprint().features)"
)


@pytest.fixture
def cpu_info(tmp_path, monkeypatch):
    """A function that makes the processor one with some flags, or with none that Linux tells."""
    monkeypatch.setattr(subject.platform, "machine", lambda: "x86_64")
    for name in subject.VARIABLES:
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)

    def make(flags):
        file = tmp_path / "cpuinfo"
        if flags is not None:
            file.write_text(f"processor\t: 0\nflags\t\t: {flags}\nbugs\t\t: none\n")
        monkeypatch.setattr(subject, "CPU_INFO", file)
        subject.has_baseline.cache_clear()

    yield make
    subject.has_baseline.cache_clear()


def told(**variables):
    """Returns numba's processor, OpenBLAS's, our name and the fingerprint's of a new process."""
    environment = {k: v for k, v in os.environ.items() if k not in subject.VARIABLES} | variables
    return subprocess.check_output([sys.executable, "-c", CODE], env=environment, text=True).split()


@pytest.mark.skipif(not subject.has_baseline(), reason="this processor lacks the baseline")
def test_importing_the_package_holds_the_process_to_the_baseline():
    assert told() == ["x86-64-v3", "Haswell", "x86-64-v3", "x86-64-v3"]


@pytest.mark.skipif(not subject.has_baseline(), reason="this processor lacks the baseline")
def test_what_the_user_has_set_stays_and_is_no_longer_the_baseline():
    numba, blas, ours, features = told(NUMBA_CPU_NAME="generic")
    assert (numba, blas, ours) == ("generic", "None", "generic")
    assert len(features) == 12


def test_a_processor_with_all_flags_is_held_to_the_baseline(cpu_info):
    cpu_info(f"{BASELINE_FLAGS} avx512f")
    subject.hold_to_baseline()
    assert {name: os.environ[name] for name in subject.VARIABLES} == subject.VARIABLES
    assert subject.instruction_set() == "x86-64-v3"
    assert subject.notice() == ""


@pytest.mark.parametrize("flags", [BASELINE_FLAGS.replace("fma", ""), "", None])
def test_a_processor_without_one_of_them_uses_what_it_has(cpu_info, flags):
    cpu_info(flags)
    subject.hold_to_baseline()
    assert not os.environ.keys() & subject.VARIABLES.keys()
    assert subject.instruction_set() == "host"
    reason = "lacks fma of" if flags else "is not known to have"
    assert subject.notice() == f"This processor {reason} x86-64-v3: {DIFFERS}"


def test_what_the_user_has_set_is_told_by_its_name(cpu_info, monkeypatch):
    cpu_info(BASELINE_FLAGS)
    monkeypatch.setenv("OPENBLAS_CORETYPE", "SkylakeX")
    subject.hold_to_baseline()
    assert os.environ["OPENBLAS_CORETYPE"] == "SkylakeX"
    assert os.environ["NUMBA_CPU_NAME"] == "x86-64-v3"
    assert subject.instruction_set() == "host"
    assert len(fingerprint.__wrapped__().features) == 12
    by = "Held to other instructions than x86-64-v3 by OPENBLAS_CORETYPE=SkylakeX"
    assert subject.notice() == f"{by}: {DIFFERS}"
