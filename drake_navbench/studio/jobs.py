"""Runs that a studio continues, each `drake-navbench run --resume` in its own process."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from drake_navbench.errors import printable


@dataclass
class _Job:
    process: subprocess.Popen[bytes]
    output: IO[bytes]


class Jobs:
    """The runs that were continued on the page; they go on when the studio is closed."""

    def __init__(self) -> None:
        self._jobs: dict[Path, _Job] = {}
        self.told: dict[Path, str] = {}

    def resume(self, path: Path) -> None:
        """Starts driving the trials that a results folder lacks."""
        # Closed when the run has ended and its last line has been read.
        output = tempfile.TemporaryFile()  # noqa: SIM115
        command = [sys.executable, "-m", "drake_navbench", "run", "--resume", str(path), "--quiet"]
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        self.told.pop(path, None)
        self._jobs[path] = _Job(process, output)

    def is_running(self, path: Path) -> bool:
        """Returns whether a run that was started here is still driving; notes how it ended."""
        job = self._jobs.get(path)
        if job is None:
            return False
        if job.process.poll() is None:
            return True
        job.output.seek(0)
        lines = job.output.read().decode(errors="replace").strip().splitlines()
        if job.process.returncode:
            self.told[path] = printable(lines[-1] if lines else "ended without a word")
        job.output.close()
        del self._jobs[path]
        return False

    def stop(self, path: Path) -> None:
        """Ends a run that was started here, as Ctrl-C does: finished logs are kept."""
        job = self._jobs.get(path)
        if job is not None and job.process.poll() is None:
            job.process.send_signal(signal.SIGINT)
