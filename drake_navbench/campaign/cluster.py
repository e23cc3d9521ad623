"""Drives the trials of a campaign on a cluster, by dask.distributed.

A task of dask is a chunk of trials of one scenario and controller. The machine that gets it drives
them in worker processes, as a campaign on one machine does: a trial that breaks, hangs or ends its
process harms no other. The result is the logs: a machine that shares the results folder writes them
there, any other sends them back as bytes. So the chunk of a machine that is lost runs again on
another one.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from drake_navbench.campaign.trial_tasks import TRIALS_PER_WORKER, trial_task
from drake_navbench.campaign.warm_up import start_worker_server
from drake_navbench.errors import InputError, NavbenchError, one_line
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.processes.fingerprint import Fingerprint, fingerprint
from drake_navbench.processes.tasks import Died, Ending
from drake_navbench.processes.workers import run_tasks
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.typed_files.output_file import write_whole

if TYPE_CHECKING:
    from distributed import Client, Future

# Enough trials to make dask's own work negligible, and few enough to lose.
TRIALS_PER_CHUNK = 16
# Waiting chunks for each worker, and at least so many in all: a worker that joins late finds work,
# and the scheduler never holds a whole campaign in its memory.
CHUNKS_PER_WORKER, LEAST_CHUNKS = 4, 32

Row = dict[str, object]


class ChunkEnding(NamedTuple):
    """The endings of a chunk's trials, in order, as a cluster's worker returns them.

    logs: the bytes of each log, None where the worker itself can write to the results folder.
    worker: its address in dask. refusal: why the worker drove no trial, '' if it drove them.
    """

    endings: list[Ending]
    logs: list[bytes | None]
    made_by: Fingerprint
    worker: str
    refusal: str = ""


class TrialEnding(NamedTuple):
    """The ending of one trial of the campaign; place: its index.

    made_by: the machine of the cluster that drove it; None if this machine did, or if the trial was
    lost. workers: the number of the cluster's workers.
    """

    place: int
    ending: Ending
    made_by: Fingerprint | None
    workers: int = 0


def chunks_of(specs: Sequence[TrialSpec], indices: Sequence[int]) -> list[list[int]]:
    """Returns the indices in chunks, each of one scenario and controller, in order."""
    cells: dict[tuple[str, str], list[int]] = {}
    for index in indices:
        spec = specs[index]
        cells.setdefault((spec.scenario.name, spec.preset.name), []).append(index)
    return [
        own[first : first + TRIALS_PER_CHUNK]
        for own in cells.values()
        for first in range(0, len(own), TRIALS_PER_CHUNK)
    ]


def drive_on_cluster(
    client: Client,
    specs: Sequence[TrialSpec],
    indices: Sequence[int],
    folder: ResultsFolder,
    identity: str,
    *,
    on_refused_worker: Callable[[str], None],
) -> Iterator[TrialEnding]:
    """Drives specs on a cluster; yields how each trial ended, as chunks end.

    Chunks that are still running when the iterator is closed are cancelled. on_refused_worker: is
    called for each worker with other versions of the software; it gets no more work. Raises
    NavbenchError where no worker with the right software is left.
    """
    from distributed import as_completed

    ours = fingerprint()
    waiting = chunks_of(specs, indices)[::-1]
    chunk_of: dict[Future[Any], list[int]] = {}
    refused: Counter[str] = Counter()
    pool = as_completed([], loop=client.loop, raise_errors=False)

    def hand_out() -> int:
        """Submits as many chunks as the cluster should have; returns its number of workers."""
        workers = client.scheduler_info(n_workers=-1)["workers"]
        most = max(LEAST_CHUNKS, CHUNKS_PER_WORKER * len(workers))
        while waiting and len(chunk_of) < most:
            chunk = waiting.pop()
            arguments = [specs[index] for index in chunk], folder.path, identity, ours
            future = client.submit(_drive_chunk, *arguments, pure=False)
            chunk_of[future] = chunk
            pool.add(future)
        return len(workers)

    try:
        worker_count = hand_out()
        for future in pool:
            chunk = chunk_of.pop(future)
            ending = _ending_of(future)
            if isinstance(ending, ChunkEnding) and ending.refusal:
                if not refused[ending.worker]:
                    on_refused_worker(f"worker {ending.worker} is refused: {ending.refusal}")
                refused[ending.worker] += 1
                with suppress(Exception):
                    client.retire_workers([ending.worker])
                waiting.append(chunk)
                if set(client.scheduler_info(n_workers=-1)["workers"]) <= set(refused):
                    raise NavbenchError(f"every worker of the cluster is refused: {ending.refusal}")
            elif isinstance(ending, ChunkEnding):
                _keep_logs(ending, [specs[index] for index in chunk], folder)
                for index, one in zip(chunk, ending.endings, strict=True):
                    yield TrialEnding(index, one, ending.made_by, worker_count)
            else:
                for index in chunk:
                    yield TrialEnding(index, ending, None, worker_count)
            worker_count = hand_out()
    finally:
        for future in chunk_of:
            with suppress(Exception):
                future.cancel()


def _ending_of(future: Future[Any]) -> ChunkEnding | Died:
    """Returns the ending of a chunk; Died where the cluster failed, which no trial caused."""
    try:
        found: ChunkEnding = future.result()
    except Exception as error:
        return Died(f"the cluster gave it up: {one_line(error)}", is_from_outside=True)
    return found


def _keep_logs(ending: ChunkEnding, specs: Sequence[TrialSpec], folder: ResultsFolder) -> None:
    for spec, content in zip(specs, ending.logs, strict=True):
        if content is not None:
            path = folder.log_path(spec.scenario.name, spec.preset.name, spec.trial)
            write_whole(path, partial(Path.write_bytes, data=content))


def _drive_chunk(
    specs: Sequence[TrialSpec], folder: Path, identity: str, wanted: Fingerprint
) -> ChunkEnding:
    """Drives a chunk in the process that dask has chosen."""
    own = fingerprint()
    worker = _worker_address()
    if differing := own.differing(wanted):
        return ChunkEnding([], [], own, worker, differing)
    if _is_folder_of(folder, identity):
        return ChunkEnding(
            _driven(specs, ResultsFolder(folder), identity), [None] * len(specs), own, worker
        )
    with tempfile.TemporaryDirectory(prefix="drake_navbench-") as temporary:
        here = ResultsFolder(Path(temporary))
        endings = _driven(specs, here, None)
        return ChunkEnding(endings, [_log_bytes(here, spec) for spec in specs], own, worker)


def _driven(
    specs: Sequence[TrialSpec], folder: ResultsFolder, identity: str | None
) -> list[Ending]:
    start_worker_server()
    tasks = {trial_task(spec, folder, identity): place for place, spec in enumerate(specs)}
    endings: dict[int, Ending] = {}
    with closing(run_tasks(list(tasks), jobs=1, tasks_per_worker=TRIALS_PER_WORKER)) as ended:
        for task, ending in ended:
            endings[tasks[task]] = ending
    return [endings[place] for place in range(len(specs))]


def _is_folder_of(folder: Path, identity: str) -> bool:
    """Returns whether this machine has the results folder of the campaign."""
    try:
        return ResultsFolder(folder).read_manifest().get("identity") == identity
    except InputError:
        return False


def _log_bytes(folder: ResultsFolder, spec: TrialSpec) -> bytes | None:
    path = folder.log_path(spec.scenario.name, spec.preset.name, spec.trial)
    return path.read_bytes() if path.is_file() else None


def _worker_address() -> str:
    from distributed import get_worker

    try:
        return str(get_worker().address)
    except ValueError:
        return ""
