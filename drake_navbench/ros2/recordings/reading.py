"""Reads the messages of a recording in a separate process that has limits of memory and time.

The recording itself defines the layout of its messages and their unpacked size: a file of 300 bytes
can request all the memory of the machine.
"""

from __future__ import annotations

import resource
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Final, NamedTuple

from drake_navbench.errors import InputError, as_line
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.worker_process import Raised, Returned
from drake_navbench.processes.workers import run_tasks, start_server
from drake_navbench.ros2.recordings.bag_files import BagFiles, size_of
from drake_navbench.ros2.recordings.bag_source import BagSource, open_bag
from drake_navbench.ros2.recordings.recorded_columns import Column, choose_topics, read_columns
from drake_navbench.ros2.recordings.rosbags_extra import require_rosbags

NANOSECONDS = 1e9
LEAST_MEMORY_BYTES: Final = 1_000_000_000
# Decoded transforms take some 30 times the memory that they take packed on the disk.
MEMORY_PER_BYTE: Final = 30
LEAST_TIME_S: Final = 60.0
TIME_PER_BYTE_S: Final = 10e-6
PAGES_FILE = Path("/proc/self/statm")


class Piece(NamedTuple):
    """The part of a recording to read.

    topics: role -> topic, as given by the user. start_s, end_s: seconds since the recording's
    beginning, None for all. needed: roles without whose topic the recording is refused, each with
    the reason.
    """

    topics: Mapping[str, str]
    namespace: str | None
    start_s: float | None
    end_s: float | None
    needed: tuple[tuple[str, str], ...] = ()


class Recording(NamedTuple):
    """A recording as read. topics: role -> topic. start_ns: when its first message was received.

    losses: a line for each part that could not be read.
    """

    topics: dict[str, str]
    columns: dict[str, Column]
    start_ns: int
    losses: tuple[str, ...]


def read_bag(path: Path, piece: Piece) -> Recording:
    """Reads a part of a recording; raises InputError where that is not possible.

    Reading may take 1 GB of memory, or 30 times the recording's size, and a minute, or 10 s a
    megabyte.
    """
    require_rosbags()
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    size = size_of(path)
    memory = max(LEAST_MEMORY_BYTES, MEMORY_PER_BYTE * size)
    limit_s = max(LEAST_TIME_S, TIME_PER_BYTE_S * size)
    start_server([__name__])
    with tempfile.TemporaryDirectory() as scratch:
        task = Task(_read, (path, piece, Path(scratch), memory), time_limit_s=limit_s)
        with closing(run_tasks([task], jobs=1)) as running:
            ((_, ending),) = running
    if isinstance(ending, Returned):
        found: Recording = ending.value
        return found
    if isinstance(ending, Raised) and isinstance(ending.error, InputError):
        raise ending.error
    raise InputError(f"{path}: cannot be read: {ending.sentence}")


def _read(path: Path, piece: Piece, scratch: Path, memory_bytes: int) -> Recording:
    try:
        with _memory_limit(memory_bytes):
            return _read_whole(path, piece, BagFiles(scratch, memory_bytes))
    except MemoryError:
        raise InputError(
            f"{path}: reading it takes more than {memory_bytes / 1e9:.3g} GB of memory"
        ) from None
    except InputError as error:
        # Names of topics, types and frames may contain anything.
        raise InputError(as_line(str(error))) from None


def _read_whole(path: Path, piece: Piece, files: BagFiles) -> Recording:
    with open_bag(path, files) as source:
        begin_ns, past_ns = _bounds(source, piece)
        topics, remarks = choose_topics(source, piece.topics, piece.namespace)
        for role, reason in piece.needed:
            if role not in topics:
                raise InputError(f"{path}: {reason}")
        columns = read_columns(source, topics, begin_ns, past_ns)
        losses = [*source.losses, *remarks, *_left_out(path, topics, columns)]
        return Recording(topics, columns, source.start_ns, tuple(map(as_line, losses)))


def _left_out(
    path: Path, topics: Mapping[str, str], columns: Mapping[str, Column]
) -> Iterator[str]:
    """Yields a line for each topic with unusable messages."""
    for role, column in columns.items():
        if column.unusable:
            count = len(column.values) + column.unusable
            yield (
                f"{path}: {topics[role]}: {column.unusable} of {count} left out: "
                "numbers that are not finite, or cells of size 0"
            )


def _bounds(source: BagSource, piece: Piece) -> tuple[int | None, int | None]:
    """Returns the first and the past-the-last time of receipt to read, ns."""
    begin, end = piece.start_s, piece.end_s
    length_s = (source.end_ns - source.start_ns) / NANOSECONDS
    for name, value in (("start", begin), ("end", end)):
        if value is not None and not 0.0 <= value <= length_s:
            raise InputError(
                f"{source.path}: --{name} {value:g}: expected 0 to {length_s:.3f} s, its length"
            )
    if begin is not None and end is not None and end <= begin:
        raise InputError(f"{source.path}: --end {end:g}: expected more than --start {begin:g}")
    begin_ns = None if begin is None else source.start_ns + round(begin * NANOSECONDS)
    # Up to a second more is read, for the sample behind the end.
    past_ns = None if end is None else source.start_ns + round((end + 1.0) * NANOSECONDS)
    return begin_ns, past_ns


@contextmanager
def _memory_limit(more_bytes: int) -> Iterator[None]:
    """Limits this process to `more_bytes` beyond its present memory, where the system can."""
    try:
        has_bytes = int(PAGES_FILE.read_text().split()[0]) * resource.getpagesize()
    except OSError:
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    most = has_bytes + more_bytes
    if hard != resource.RLIM_INFINITY:
        most = min(most, hard)
    resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
