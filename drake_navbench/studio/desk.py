"""The state that all pages of a studio share: folder, workers, jobs, drawing, trials."""

from __future__ import annotations

import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from drake_navbench.errors import InputError, printable
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.studio.engine import Engine
from drake_navbench.studio.open_folder import OpenFolder
from drake_navbench.studio.run_states import RESULTS, run_states
from drake_navbench.typed_files.typed_yaml import parse_yaml

if TYPE_CHECKING:
    from drake_navbench.studio.open_scenario import OpenScenario
    from drake_navbench.studio.tuning_desk import TuningDesk

DEFAULT_ROBOT = "wheelchair"
MAX_LOGS = 300


class Desk:
    """The state of a studio; it outlives its pages, which may be closed and opened again.

    ways: the content of scenarios that the command line names, by name.
    """

    def __init__(self, folder: OpenFolder, ways: Mapping[str, Mapping[str, Any]]) -> None:
        self.folder, self.ways = folder, ways
        self.engine = Engine()
        self.jobs = Jobs()
        self.robot = DEFAULT_ROBOT
        self._scenario: OpenScenario | None = None
        self._tuning: TuningDesk | None = None

    @property
    def tuning(self) -> TuningDesk:
        """The column that is driven."""
        if self._tuning is None:
            from drake_navbench.studio.tuning_desk import TuningDesk

            self._tuning = TuningDesk(self.folder)
        return self._tuning

    @property
    def scenario(self) -> OpenScenario:
        """The scenario that is open; its modules are loaded when it is first asked for."""
        if self._scenario is None:
            from drake_navbench.studio.open_scenario import OpenScenario

            self._scenario = OpenScenario(self.folder)
        return self._scenario

    def logs(self) -> list[str]:
        """Returns the names of the runs' logs, the newest runs first, at most MAX_LOGS."""
        found = [
            self.folder.name_of(path)
            for state in run_states(self.folder)
            for path in sorted(state.path.glob("trials/*/*/trial_*.parquet"))
            if path.resolve().is_relative_to(self.folder.root)
        ]
        return found[:MAX_LOGS]

    def robots(self) -> list[str]:
        """Returns the robots to choose from: those of the package, and robot files."""
        from drake_navbench.inputs.robot import ROBOT_FILES
        from drake_navbench.studio.open_scenario import files_of

        return [*ROBOT_FILES.names, *files_of(self.folder, "robot")]

    def robot_argument(self) -> str:
        """Returns the chosen robot as loaders take it: a name, or a path inside the folder.

        Raises InputError where its file names others outside.
        """
        from drake_navbench.inputs.robot import ROBOT_FILES

        if self.robot in ROBOT_FILES.names:
            return self.robot
        path = self.folder.inside(self.robot)
        self.folder.require_inside(
            parse_yaml(self.folder.read(self.robot).text, self.robot), path.parent
        )
        return str(path)

    def resume(self, path: Path) -> None:
        """Continues a run; raises InputError if the run uses files outside the folder."""
        self._require_inside(path)
        self.jobs.resume(path)

    def begin_again(self, path: Path) -> Future[Path]:
        """Drives a run's request again into a new folder, with the files as they are now."""
        self._require_inside(path)
        stem = datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
        return self.engine.look("begin_again", path, self.folder.root / RESULTS / stem)

    def reasons(self, log: str, drive: Any) -> Future[Any]:
        """Asks why the controller of a log's trial decided as it did; see `tasks.reasons_of`.

        Raises InputError if the log's run used files outside the folder.
        """
        if drive is None:
            self._require_inside(Path(log).parents[3])
        return self.engine.drive("reasons_of", log, drive)

    def _require_inside(self, path: Path) -> None:
        request = ResultsFolder(path).read_manifest().get("request")
        if request is None:
            raise InputError(f"{path.name}: was not made by the command line; expected a request")
        self.folder.require_inside(request, Path.cwd())

    def close(self) -> None:
        """Ends the workers."""
        self.engine.close()


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
