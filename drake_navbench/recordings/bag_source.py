"""Opens recordings: MCAP and rosbag2 (sqlite3), files or folders, and ROS 1 bags.

Only the topics that are asked for are decoded, by the definitions in the recording where it has
them. An MCAP file whose end is missing is read as far as it goes.
"""

from __future__ import annotations

import os
import struct
import tempfile
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.errors import InputError, as_line
from drake_navbench.recordings.rosbags_extra import require_rosbags, ros2_types

MCAP_MAGIC = b"\x89MCAP0\r\n"
RECORD_HEADER = struct.Struct("<BQ")
# What ends the data of an MCAP file: DataEnd without a checksum, Footer without a summary.
MCAP_END = RECORD_HEADER.pack(0x0F, 4) + bytes(4) + RECORD_HEADER.pack(0x02, 20) + bytes(20)
LFS_POINTER = b"version https://git-lfs"
DATA_END, FOOTER = 0x0F, 0x02
COPIED_BYTES = 1 << 20
STORAGES = (".mcap", ".db3", ".bag")


class Received(NamedTuple):
    """A message as it was recorded. receive_ns: when the recorder got it, ns."""

    topic: str
    receive_ns: int
    message: Any


@dataclass(frozen=True)
class BagSource:
    """An open recording.

    topics: name -> type. counts: name -> messages. start_ns, end_ns: of all messages received.
    losses: what could not be read, a line each.
    """

    path: Path
    readers: tuple[Any, ...]
    is_ros1: bool
    topics: Mapping[str, str] = field(default_factory=dict)
    counts: Mapping[str, int] = field(default_factory=dict)
    start_ns: int = 0
    end_ns: int = 0
    losses: tuple[str, ...] = ()

    def read(
        self, topics: Collection[str], start_ns: int | None = None, end_ns: int | None = None
    ) -> Iterator[Received]:
        """Yields the messages of some topics received in [start, end) ns, roughly in order.

        Raises InputError where one cannot be decoded, or the recording is damaged there.
        """
        with _errors_as_lines(self.path):
            for reader in self.readers:
                wanted = [c for c in reader.connections if c.topic in topics]
                if not wanted:
                    continue
                types = self._types_of(wanted)
                decode = types.deserialize_ros1 if self.is_ros1 else types.deserialize_cdr
                for connection, receive_ns, data in _messages(reader, wanted, start_ns, end_ns):
                    message = decode(data, connection.msgtype)
                    yield Received(connection.topic, receive_ns, message)

    def _types_of(self, connections: list[Any]) -> Any:
        """Returns the types of these connections alone: what others are is no matter here."""
        from rosbags.interfaces import MessageDefinitionFormat
        from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

        types = get_typestore(Stores.EMPTY)
        known = ros2_types().fielddefs
        for connection in connections:
            text, kind = connection.msgdef.data, connection.msgdef.format
            if kind == MessageDefinitionFormat.MSG:
                types.register(get_types_from_msg(text, connection.msgtype))
            elif kind == MessageDefinitionFormat.IDL:
                types.register(get_types_from_idl(text))
            elif connection.msgtype in known and not self.is_ros1:
                types.register(known)
            else:
                raise InputError(
                    f"{self.path}: {connection.topic}: no definition of {connection.msgtype} in "
                    "the recording"
                )
        for connection in connections:
            _require_whole(self.path, types, connection)
        return types


def _require_whole(path: Path, types: Any, connection: Any) -> None:
    """Raises InputError where a message has a field of a type that nothing defines."""
    try:
        types.generate_msgdef(connection.msgtype)
    except LookupError as error:
        raise InputError(
            f"{path}: {connection.topic}: message definition not understood: "
            f"{connection.msgtype} needs the unknown type {as_line(str(error))}"
        ) from error


@contextmanager
def open_bag(path: Path) -> Iterator[BagSource]:
    """Opens a recording; raises InputError where it is none, or holds no message."""
    require_rosbags()
    with ExitStack() as stack:
        with _errors_as_lines(path):
            source = _opened(path, stack)
        yield source


def _opened(path: Path, stack: ExitStack) -> BagSource:
    losses: list[str] = []
    readers = _open_readers(path, stack, losses)
    connections = [c for reader in readers for c in reader.connections]
    counts: dict[str, int] = {}
    for connection in connections:
        counts[connection.topic] = counts.get(connection.topic, 0) + connection.msgcount
    if not sum(counts.values()):
        raise InputError(f"{path}: holds no message")
    filled = [reader for reader in readers if reader.message_count]
    return BagSource(
        path,
        tuple(readers),
        any(reader.path.suffix == ".bag" for reader in readers),
        {c.topic: c.msgtype for c in connections if counts[c.topic]},
        {name: count for name, count in counts.items() if count},
        min(reader.start_time for reader in filled),
        max(reader.end_time for reader in filled),
        tuple(losses),
    )


def _open_readers(path: Path, stack: ExitStack, losses: list[str]) -> list[Any]:
    """Returns an open reader of each file, or one of a folder with metadata."""
    from rosbags.rosbag1 import Reader as Ros1Reader
    from rosbags.rosbag2 import Reader, ReaderError

    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    files = [path]
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if file.suffix in STORAGES)
        if (path / "metadata.yaml").is_file():
            try:
                return [stack.enter_context(Reader(path))]
            except ReaderError:
                # An interrupted recording: its metadata may tell of more than its files hold.
                if not any(_is_cut(file) for file in files):
                    raise
        if not files:
            raise InputError(f"{path}: a folder without {', '.join(STORAGES)}; not a recording")
    elif path.suffix not in STORAGES:
        raise InputError(
            f"{path}: not a recording: expected {', '.join(STORAGES)} or a rosbag2 folder"
        )
    readers = []
    for file in files:
        _require_content(file)
        whole = file
        if _is_cut(file):
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            whole = folder / file.name
            losses.append(_mend(file, whole))
        kind = Ros1Reader if file.suffix == ".bag" else Reader
        readers.append(stack.enter_context(kind(whole)))
    return readers


def _require_content(path: Path) -> None:
    """Raises InputError where a file only points to one, as a clone without Git LFS has it."""
    with path.open("rb") as file:
        if file.read(len(LFS_POINTER)) == LFS_POINTER:
            raise InputError(f"{path}: a pointer of Git LFS, not the recording; run git lfs pull")


def _is_cut(path: Path) -> bool:
    """Returns whether a file is MCAP that was not finished: its end is not as it should be."""
    if path.suffix != ".mcap":
        return False
    with path.open("rb") as file:
        if file.read(len(MCAP_MAGIC)) != MCAP_MAGIC:
            return False
        file.seek(-len(MCAP_MAGIC), os.SEEK_END)
        return file.read() != MCAP_MAGIC


def _mend(path: Path, whole: Path) -> str:
    """Copies the whole records of an MCAP file and ends the copy; returns what was lost."""
    size, kept = path.stat().st_size, len(MCAP_MAGIC)
    with path.open("rb") as source:
        while kept + RECORD_HEADER.size <= size:
            source.seek(kept)
            kind, length = RECORD_HEADER.unpack(source.read(RECORD_HEADER.size))
            past = kept + RECORD_HEADER.size + length
            if kind in (DATA_END, FOOTER) or past > size:
                break
            kept = past
        source.seek(0)
        with whole.open("wb") as copy:
            left = kept
            while left:
                left -= copy.write(source.read(min(left, COPIED_BYTES)))
            copy.write(MCAP_END + MCAP_MAGIC)
    return f"{path}: cut off: the last {size - kept} of {size} bytes are no whole record"


def _messages(
    reader: Any, wanted: list[Any], start_ns: int | None, end_ns: int | None
) -> Iterator[tuple[Any, int, Any]]:
    # A bag of ROS 1 has none.
    storage: Any = getattr(reader, "storage", None)
    if hasattr(storage, "messages_scan") and not storage.chunks:
        # Without an index, and so perhaps out of order, which the usual way refuses.
        yield from storage.messages_scan(wanted, start_ns, end_ns)
    else:
        yield from reader.messages(wanted, start_ns, end_ns)


@contextmanager
def _errors_as_lines(path: Path) -> Iterator[None]:
    """Turns whatever a damaged recording makes the library raise into an InputError."""
    from rosbags.serde import SerdeError
    from rosbags.typesys import TypesysError

    try:
        yield
    except (InputError, MemoryError):
        raise
    except (SerdeError, TypesysError) as error:
        reason = as_line(str(error))
        raise InputError(f"{path}: message definition not understood: {reason}") from error
    except Exception as error:
        # Of damaged bytes the library, and those below it, raise what they come upon.
        reason = as_line(str(error)) or type(error).__name__
        raise InputError(f"{path}: not a readable recording: {reason}") from error
