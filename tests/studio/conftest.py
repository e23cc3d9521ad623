"""A studio of its own process, on a folder of its own."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

# The browser's driver stands beside the tests of the report.
sys.path.append(str(Path(__file__).parents[1] / "analysis"))


class Studio(NamedTuple):
    """A studio that runs: its folder, that of its logs, its first page's address, its process."""

    folder: Path
    logs: Path
    address: str
    process: subprocess.Popen[str]

    def page(self, name: str) -> str:
        """Returns the address of a page, by a name that the browser of the tests may look up."""
        return f"{self.address.rpartition('/')[0]}/{name}".replace("127.0.0.1", "localhost")


@pytest.fixture(scope="session")
def studio(tmp_path_factory) -> Iterator[Studio]:
    """One studio for all modules: it loads Drake and drives two columns before it is asked."""
    folder = tmp_path_factory.mktemp("studio")
    repository = Path(__file__).parents[2]
    shutil.copy(repository / "models" / "nav2" / "turtlebot3_waffle.yaml", folder)
    # Where the logs of its trials are.
    own = tmp_path_factory.mktemp("logs")
    process = subprocess.Popen(
        [sys.executable, "-m", "drake_navbench", "studio", str(folder), "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        env={**os.environ, "TMPDIR": str(own)},
    )
    address = process.stdout.readline().split()[1]
    yield Studio(folder, own, address, process)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate()
    assert process.returncode == 0, errors
    assert "Traceback" not in errors
