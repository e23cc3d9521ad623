"""A disk that fills up in the middle of a campaign costs no trial: room is all it needs."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

# Everything in a mount namespace of its own, where a user may mount a small disk.
MOUNTED = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c"]

SCRIPT = """
import subprocess, sys
from pathlib import Path
from worker_here import working_here
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.driving import run_campaign
from drake_navbench.errors import CannotBeWritten
from drake_navbench.logs.results import ResultsFolder

disk, scenario = Path(sys.argv[1]), sys.argv[2]
campaign = plan_campaign([scenario], ["rpp"], trials=5)
folder = ResultsFolder(disk / "out")
folder.write_manifest({"identity": campaign.identity})
try:
    with working_here():
        run_campaign(campaign, folder, jobs=1)
except CannotBeWritten as error:
    print(error)
print("whole", len(list(folder.path.rglob("trial_*.parquet"))))
print("unfinished", len(list(folder.path.rglob(".*"))))
subprocess.run(["mount", "-o", "remount,size=50m", str(disk)], check=True)
with working_here():
    trials, undriven, _ = run_campaign(campaign, folder, jobs=1)
print("then", len(trials), *set(trials["outcome"]), len(undriven))
"""


@pytest.fixture
def disk(tmp_path):
    """A folder to mount a disk of 120 kB on; skips where that is not allowed."""
    path = tmp_path / "disk"
    path.mkdir()
    mount = f"mount -t tmpfs -o size=120k none {path}"
    if shutil.which("unshare") is None:
        pytest.skip("no unshare: the full disk is faked in test_driving.py alone")
    tried = subprocess.run([*MOUNTED, mount], capture_output=True, check=False)
    if tried.returncode != 0:
        pytest.skip("no mounts allowed: the full disk is faked in test_driving.py alone")
    return path, mount


def test_a_full_disk_leaves_whole_logs_and_the_rest_to_be_driven_when_there_is_room(disk, tmp_path):
    path, mount = disk
    (tmp_path / "script.py").write_text(SCRIPT)
    (tmp_path / "short.yaml").write_text("description: short\ngoal: [1.0, 0.0, 0.0]\n")
    python = f"PYTHONPATH={Path(__file__).parents[1]} {sys.executable}"
    command = f"{mount} && {python} script.py {path} {tmp_path / 'short.yaml'}"
    done = subprocess.run(
        [*MOUNTED, command], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    refused, whole, unfinished, then = done.stdout.splitlines()
    assert refused.startswith(str(path / "out" / "trials" / "short" / "rpp" / "trial_00"))
    assert ": cannot be written: " in refused
    assert refused.endswith("No space left on device")
    assert 0 < int(whole.split()[1]) < 5
    assert unfinished == "unfinished 0"
    assert then == "then 5 succeeded 0"
