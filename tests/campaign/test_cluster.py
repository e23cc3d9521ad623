"""A campaign on a cluster is the same campaign: trials, bytes, resume and failures."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import pandas as pd
import pytest

from drake_navbench.analysis.metrics import registry
from drake_navbench.analysis.metrics.metric_file import metric_in_file
from drake_navbench.analysis.metrics.registry import unrepeatable_names
from drake_navbench.campaign import cluster, cluster_connection, driving
from drake_navbench.campaign.campaign import Campaign, plan_campaign
from drake_navbench.campaign.cluster import TRIALS_PER_CHUNK, chunks_of
from drake_navbench.campaign.cluster_connection import ClusterPlace
from drake_navbench.campaign.driving import run_campaign
from drake_navbench.commands import run as command
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.processes.fingerprint import fingerprint
from drake_navbench.processes.worker_process import Returned

SCENARIO = "description: nothing in the way\ngoal: [0.6, 0.0, 0.0]\ntimeout_s: 20.0\n"
METRIC = """
from drake_navbench.analysis.metrics import metric


@metric(unit="", better="neither")
def samples(log):
    \"\"\"How many samples the log has.\"\"\"
    return float(len(log.samples))
"""


def short_campaign(folder: Path, trials: int) -> Campaign:
    (folder / "short.yaml").write_text(SCENARIO)
    return plan_campaign([str(folder / "short.yaml")], ["rpp"], trials=trials)


def begun(path: Path, campaign: Campaign) -> ResultsFolder:
    folder = ResultsFolder(path)
    folder.write_manifest({"identity": campaign.identity})
    return folder


def test_a_chunk_is_of_one_scenario_and_controller_and_nothing_is_left_out():
    campaign = plan_campaign(["empty", "doorway"], ["rpp", "dwb"], trials=20)
    indices = [index for index in range(len(campaign.specs)) if index != 3]
    chunks = chunks_of(campaign.specs, indices)
    assert sorted(index for chunk in chunks for index in chunk) == indices
    for chunk in chunks:
        cells = {(s.scenario.name, s.preset.name) for s in map(campaign.specs.__getitem__, chunk)}
        assert len(cells) == 1
        assert len(chunk) <= TRIALS_PER_CHUNK


def test_where_the_folder_is_not_shared_the_log_comes_back_as_bytes(tmp_path):
    campaign = short_campaign(tmp_path, 1)
    there = cluster._drive_chunk(campaign.specs, tmp_path / "gone", "id", fingerprint())
    folder = begun(tmp_path / "here", campaign)
    here = cluster._drive_chunk(campaign.specs, folder.path, campaign.identity, fingerprint())
    assert isinstance(there.endings[0], Returned)
    assert here.logs == [None]
    path = folder.log_path("short", "rpp", 0)
    written = TrialLog.read(path)
    cluster._keep_logs(there, campaign.specs, folder)
    sent = TrialLog.read(path)
    assert written.info == sent.info
    repeatable = [name for name in written.samples if name not in UNREPEATABLE_COLUMNS]
    pd.testing.assert_frame_equal(
        written.samples[repeatable], sent.samples[repeatable], check_exact=True
    )


def test_a_process_with_other_software_drives_nothing_and_says_what_differs(tmp_path):
    campaign = short_campaign(tmp_path, 1)
    other = fingerprint()._replace(software=fingerprint().software | {"numba": "0.1"})
    ending = cluster._drive_chunk(campaign.specs, tmp_path, "", other)
    assert ending.endings == []
    numba = fingerprint().software["numba"]
    assert ending.refusal == f"numba {numba} instead of 0.1"
    # Another processor is no reason to refuse; it is told.
    assert not fingerprint()._replace(features="other").differing(fingerprint())


# A run that waits for its scheduler, which a busy computer starts late, as long as it takes.
PATIENT_RUN = """
import sys
from drake_navbench.campaign import cluster_connection
from drake_navbench.commands import run

cluster_connection.CONNECT_TIMEOUT_S = float(sys.argv[1])
sys.exit(run.main(sys.argv[2:]))
"""
PATIENCE_S = 1e6


class Cluster:
    """A scheduler and workers on loopback, each a process, started by hand as on many machines."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._processes: list[subprocess.Popen[bytes]] = []
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self._start("scheduler", "--host", self.address, "--no-dashboard")
        self.workers: list[subprocess.Popen[bytes]] = []

    def add_worker(self) -> None:
        name = f"w{len(self.workers)}"
        arguments = ["--nthreads", "1", "--no-nanny", "--no-dashboard", "--name", name]
        folder = ["--local-directory", str(self._folder)]
        self.workers.append(self._start("worker", self.address, *arguments, *folder))

    def start_run(self, scenario: Path, trials: int, out: Path) -> subprocess.Popen[bytes]:
        asked = [str(scenario), "--controllers", "rpp", "--trials", str(trials)]
        rest = ["--replay", "none", "--figures", "none", "--cluster", self.address]
        rest += ["--trust-network", "--out", str(out)]
        return self._begin("-c", PATIENT_RUN, str(PATIENCE_S), "--quiet", *asked, *rest)

    def _start(self, *arguments: str) -> subprocess.Popen[bytes]:
        return self._begin("-m", "dask", *arguments)

    def _begin(self, *arguments: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(
            [sys.executable, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self._processes.append(process)
        return process

    def close(self) -> None:
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.wait()


@pytest.fixture
def loopback(tmp_path) -> Iterator[Cluster]:
    made = Cluster(tmp_path)
    yield made
    made.close()


def logs_in(folder: Path) -> list[Path]:
    return sorted(folder.glob("trials/*/*/*.parquet"))


def wait_for(condition, *needed: subprocess.Popen[bytes]) -> None:
    """Waits for what only comes while some processes run."""
    while not condition():
        assert [process.poll() for process in needed] == [None] * len(needed)
        time.sleep(0.05)


def assert_same_results(found: Path, expected: Path) -> None:
    """Compares tables and logs, apart from what depends on the machine."""
    tables = [pd.read_parquet(ResultsFolder(path).trials_path) for path in (found, expected)]
    tables = [table.drop(columns=unrepeatable_names()) for table in tables]
    pd.testing.assert_frame_equal(*tables, check_exact=True)
    assert len(logs_in(found)) == len(logs_in(expected)) == len(tables[0])
    for first, second in zip(logs_in(found), logs_in(expected), strict=True):
        own, other = TrialLog.read(first), TrialLog.read(second)
        assert own.info["identity"] == other.info["identity"]
        repeatable = [name for name in own.samples if name not in UNREPEATABLE_COLUMNS]
        pd.testing.assert_frame_equal(
            own.samples[repeatable], other.samples[repeatable], check_exact=True
        )


def test_a_metric_of_a_file_is_measured_here_where_a_cluster_drives(tmp_path, monkeypatch):
    """The cluster's machines do not have the file, so that their rows lack its metric."""
    campaign = short_campaign(tmp_path, 1)
    folder = begun(tmp_path / "here", campaign)

    def drive_there(client, specs, indices, folder, identity, **_):
        chunk = cluster._drive_chunk(specs, tmp_path / "gone", "id", fingerprint())
        cluster._keep_logs(chunk, specs, folder)
        yield cluster.TrialEnding(0, chunk.endings[0], fingerprint(), 1)

    monkeypatch.setattr(driving, "drive_on_cluster", drive_there)
    monkeypatch.setattr(driving, "connected", lambda place: nullcontext())
    (tmp_path / "my.py").write_text(METRIC)
    own = metric_in_file(f"{tmp_path / 'my.py'}:samples")
    monkeypatch.setattr(driving, "asked_metrics", lambda: (own,))
    monkeypatch.setattr(registry, "asked_metrics", lambda: (own,))
    driven = run_campaign(campaign, folder, jobs=1, cluster=ClusterPlace("tcp://nobody:1"))
    log = TrialLog.read(folder.log_path("short", "rpp", 0))
    assert driven.trials["samples"].tolist() == [len(log.samples)]


@pytest.mark.long
def test_workers_of_this_machine_give_what_a_campaign_without_a_cluster_gives(tmp_path):
    campaign = short_campaign(tmp_path, 20)
    folders = [begun(tmp_path / name, campaign) for name in ("local", "cluster")]
    run_campaign(campaign, folders[0], jobs=1)
    driven = run_campaign(campaign, folders[1], jobs=1, cluster=ClusterPlace("local:2"))
    assert driven.undriven == []
    assert [(made_by, count) for made_by, count in driven.machines] == [(fingerprint(), 20)]
    assert_same_results(folders[1].path, folders[0].path)


@pytest.mark.long
def test_killed_workers_and_a_killed_client_lose_nothing(tmp_path, loopback, monkeypatch):
    """Four workers, one of them late, one killed; the client killed and its run resumed."""
    trials = 8 * TRIALS_PER_CHUNK
    for _ in range(3):
        loopback.add_worker()
    out = tmp_path / "cluster"
    campaign = short_campaign(tmp_path, trials)
    client = loopback.start_run(tmp_path / "short.yaml", trials, out)
    wait_for(lambda: len(logs_in(out)) >= 3, client)
    loopback.workers[0].send_signal(signal.SIGKILL)
    loopback.add_worker()
    wait_for(lambda: len(logs_in(out)) >= 40, client)
    client.kill()
    client.wait()
    before = {path: path.stat().st_mtime_ns for path in logs_in(out)}
    assert len(before) < trials
    monkeypatch.setattr(cluster_connection, "CONNECT_TIMEOUT_S", PATIENCE_S)
    resume = ["--quiet", "--resume", str(out), "--cluster", loopback.address, "--trust-network"]
    assert command.main(resume) == 0
    # What was driven before the end of the client was not driven again, but for chunks in flight.
    kept = [path for path, made_ns in before.items() if path.stat().st_mtime_ns == made_ns]
    assert len(kept) >= len(before) - 4 * TRIALS_PER_CHUNK
    manifest = ResultsFolder(out).read_manifest()
    driven_again = sum(entry["trials"] for entry in manifest["cluster"])
    assert 0 < driven_again <= trials - len(kept)
    plain = begun(tmp_path / "plain", campaign)
    run_campaign(campaign, plain, jobs=2)
    assert_same_results(out, plain.path)
