"""A campaign that is killed at any moment, and resumed, ends as one that was not."""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

from drake_navbench.analysis.metrics.registry import unrepeatable_names
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.driving import run_campaign
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.results import ResultsFolder, remove_unfinished

SCENARIO = "description: nothing in the way\ngoal: [2.0, 0.0, 0.0]\ntimeout_s: 20.0\n"
VICTIMS = {
    "main, killed": (0, signal.SIGKILL),
    "main, terminated": (0, signal.SIGTERM),
    "main, interrupted": (0, signal.SIGINT),
    "the server, killed": (1, signal.SIGKILL),
    "a worker, killed": (2, signal.SIGKILL),
}
KILLS = 20


def start(*arguments: str) -> subprocess.Popen:
    command = [sys.executable, "-m", "drake_navbench.run", "--quiet", "--jobs", "2", *arguments]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )


def finish(running: subprocess.Popen) -> str:
    output, _ = running.communicate()
    assert "Traceback" not in output
    return output


def children_of(pid: int) -> list[int]:
    try:
        return [
            int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        ]
    except OSError:
        return []


def family_of(pid: int) -> list[list[int]]:
    """Returns the process, the servers that it has started, and the workers of these."""
    servers = [child for child in children_of(pid) if b"forkserver" in command_of(child)]
    return [[pid], servers, [worker for server in servers for worker in children_of(server)]]


def command_of(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def wait_until_gone(pids: list[int]) -> None:
    while any(command_of(pid) for pid in pids):
        time.sleep(0.05)


def files_in(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


@pytest.fixture(scope="module")
def task(tmp_path_factory) -> list[str]:
    """What is asked for: four short trials and their report."""
    path = tmp_path_factory.mktemp("task") / "short.yaml"
    path.write_text(SCENARIO)
    return [str(path), "--controllers", "rpp,dwb", "--trials", "2", "--replay", "none"]


@pytest.fixture(scope="module")
def undisturbed(task, tmp_path_factory) -> Iterator[tuple[Path, float]]:
    """A folder that nobody disturbed, and how long it took."""
    folder = tmp_path_factory.mktemp("undisturbed") / "out"
    started = time.monotonic()
    running = start(*task, "--out", str(folder))
    assert finish(running) == ""
    assert running.returncode == 0
    return folder, time.monotonic() - started


def kill(running: subprocess.Popen, generation: int, number: int) -> None:
    """Sends a signal to one of a generation of a run's processes, as soon as there is one."""
    while running.poll() is None:
        victims = family_of(running.pid)[generation]
        if victims:
            os.kill(random.choice(victims), number)
            return
        time.sleep(0.02)


def check_kill(seed: int, task: list[str], undisturbed: tuple[Path, float], folder: Path) -> None:
    """Kills a run where and when the seed says; checks what comes of it when it is resumed."""
    expected, duration_s = undisturbed
    chance = random.Random(seed)
    generation, number = VICTIMS[list(VICTIMS)[seed % len(VICTIMS)]]
    running = start(*task, "--out", str(folder))
    time.sleep(chance.uniform(0.0, duration_s))
    family = [pid for generation in family_of(running.pid) for pid in generation]
    kill(running, generation, number)
    finish(running)
    wait_until_gone(family)
    if not (folder / "manifest.json").is_file():
        # Killed before it began: there is nothing to resume, and nothing in the way.
        again = start(*task, "--out", str(folder))
    else:
        again = start("--resume", str(folder))
    assert finish(again) == ""
    assert again.returncode == 0
    check_equal(expected, folder)
    varying = unrepeatable_names()
    first, second = (pd.read_parquet(f / "trials.parquet") for f in (expected, folder))
    pd.testing.assert_frame_equal(
        first.drop(columns=varying), second.drop(columns=varying), check_exact=True
    )


def check_equal(expected: Path, folder: Path) -> None:
    """Asserts that two folders hold the same files, and the same logs but for compute times."""
    assert files_in(folder) == files_in(expected)
    for path in expected.rglob("trial_*.parquet"):
        one = TrialLog.read(path)
        other = TrialLog.read(folder / path.relative_to(expected))
        assert one.info == other.info
        assert one.samples.drop(columns=list(UNREPEATABLE_COLUMNS)).equals(
            other.samples.drop(columns=list(UNREPEATABLE_COLUMNS))
        )


SCRIPT = """
from drake_navbench import run_benchmark
run_benchmark([{scenario!r}], ["rpp"], trials=8, jobs=2, out={out!r})
"""


def test_a_run_killed_while_it_drives_goes_on_from_what_it_had(task, tmp_path):
    folder = ResultsFolder(tmp_path / "out")
    script = SCRIPT.format(scenario=task[0], out=str(folder.path))
    running = subprocess.Popen([sys.executable, "-c", script])
    while not list(folder.path.rglob("trial_*.parquet")):
        assert running.poll() is None
        time.sleep(0.01)
    family = [pid for generation in family_of(running.pid) for pid in generation]
    assert len(family) >= 3
    running.kill()
    running.wait()
    wait_until_gone(family)
    kept = {path: path.read_bytes() for path in folder.path.rglob("trial_*.parquet")}
    assert 0 < len(kept) < 8
    campaign = plan_campaign([task[0]], ["rpp"], trials=8)
    # As a resumed run begins: a worker may have been killed while it wrote a log.
    remove_unfinished(folder.path)
    run_campaign(campaign, folder, jobs=2)
    whole = ResultsFolder(tmp_path / "whole")
    whole.write_manifest({"identity": campaign.identity})
    run_campaign(campaign, whole, jobs=2)
    assert all(path.read_bytes() == content for path, content in kept.items())
    check_equal(whole.path / "trials", folder.path / "trials")


@pytest.mark.long
@pytest.mark.parametrize("seed", range(KILLS))
def test_a_run_killed_at_any_moment_is_resumed_to_the_same_end(seed, task, undisturbed, tmp_path):
    check_kill(seed, task, undisturbed, tmp_path / "out")
