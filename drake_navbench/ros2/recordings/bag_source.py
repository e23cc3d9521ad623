"""Opens recordings: MCAP and rosbag2 (sqlite3), files or folders, and ROS 1 bags.

Only the requested topics are decoded, by the definitions in the recording if it has any. An MCAP
file whose end is missing is read up to its last complete record.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.errors import InputError, as_line
from drake_navbench.ros2.recordings.bag_files import (
    METADATA,
    BagFiles,
    files_in,
    is_cut,
    is_packed,
    require_content,
    require_recording,
)
from drake_navbench.ros2.recordings.definition_limits import require_short, require_small
from drake_navbench.ros2.recordings.rosbags_extra import ros2_types

# Types by the definitions of the messages that are read, the oldest first. The library compiles
# code for them in 0.1 s a recording; a robot's recordings, and the readings of one, have the same
# definitions.
_TYPES: dict[tuple[Any, ...], Any] = {}
KEPT_TYPES = 16


class Received(NamedTuple):
    """A message as it was recorded. receive_ns: when the recorder got it, ns."""

    topic: str
    receive_ns: int
    message: Any


@dataclass(frozen=True)
class BagSource:
    """An open recording.

    topics: name -> type. counts: name -> messages. start_ns, end_ns: times of receipt of the first
    and last message. losses: a line for each part that could not be read.
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

        Raises InputError where a message cannot be decoded, or the recording is damaged in between.
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
        """Returns the types of these connections alone: faulty types of others do no harm."""
        definitions = ((c.msgtype, c.msgdef.format, c.msgdef.data) for c in connections)
        key = (self.is_ros1, *definitions)
        if key not in _TYPES:
            if len(_TYPES) == KEPT_TYPES:
                del _TYPES[next(iter(_TYPES))]
            _TYPES[key] = self._understood(connections)
        return _TYPES[key]

    def _understood(self, connections: list[Any]) -> Any:
        """Returns the types that these connections' definitions tell; raises InputError."""
        from rosbags.interfaces import MessageDefinitionFormat
        from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

        types = get_typestore(Stores.EMPTY)
        known = ros2_types().fielddefs
        for connection in connections:
            text, kind = connection.msgdef.data, connection.msgdef.format
            place = as_line(f"{self.path}: {connection.topic}")
            require_short(text, place)
            if kind == MessageDefinitionFormat.MSG:
                defined = get_types_from_msg(text, connection.msgtype)
                require_small(defined, place)
                types.register(defined)
            elif kind == MessageDefinitionFormat.IDL:
                defined = get_types_from_idl(text)
                require_small(defined, place)
                types.register(defined)
            elif connection.msgtype in known and not self.is_ros1:
                types.register(known)
            else:
                raise InputError(f"{place}: no definition of {connection.msgtype} in the recording")
        for connection in connections:
            _require_whole(self.path, types, connection)
        return types


def _require_whole(path: Path, types: Any, connection: Any) -> None:
    """Raises InputError where a message has a field of an undefined type."""
    try:
        types.generate_msgdef(connection.msgtype)
    except LookupError as error:
        raise InputError(
            f"{path}: {connection.topic}: message definition not understood: "
            f"{connection.msgtype} needs the unknown type {as_line(str(error))}"
        ) from error


@contextmanager
def open_bag(path: Path, files: BagFiles) -> Iterator[BagSource]:
    """Opens a recording; raises InputError where the path is no recording, or has no message.

    files: prepares the recording's files for the library.
    """
    with ExitStack() as stack:
        with _errors_as_lines(path):
            source = _opened(path, stack, files)
        yield source


def _opened(path: Path, stack: ExitStack, files: BagFiles) -> BagSource:
    readers = _open_readers(path, stack, files)
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
        tuple(files.losses),
    )


def _open_readers(path: Path, stack: ExitStack, files: BagFiles) -> list[Any]:
    """Returns an open reader for each file, or one reader for a folder with metadata."""
    from rosbags.rosbag1 import Reader as Ros1Reader
    from rosbags.rosbag2 import Reader

    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    found = [path]
    if path.is_dir():
        found = files_in(path)
        reader = _reader_of_folder(path, found, files)
        if reader is not None:
            return [stack.enter_context(reader)]
    else:
        require_recording(path)
    readers = []
    for file in found:
        ready = files.ready(file)
        kind = Ros1Reader if ready.suffix == ".bag" else Reader
        readers.append(stack.enter_context(kind(ready)))
    return readers


def _reader_of_folder(path: Path, found: list[Path], files: BagFiles) -> Any | None:
    """Returns the reader of a folder by its metadata; None: each file is read by itself."""
    from rosbags.rosbag2 import Reader, ReaderError

    metadata = path / METADATA
    for file in [*found, metadata]:
        if file.is_file():
            require_content(file)
    # The library would unpack whole files without a limit.
    if not metadata.is_file() or any(map(is_packed, found)):
        return None
    reader = Reader(path)
    try:
        reader.open()
    except ReaderError as error:
        # The recording was interrupted: its metadata may name more than its files hold.
        if any(map(is_cut, found)):
            return None
        if "files are missing" not in str(error):
            raise
        files.losses.append(f"{metadata}: names files that are missing; the others are read")
        return None
    reader.close()
    return Reader(path)


def _messages(
    reader: Any, wanted: list[Any], start_ns: int | None, end_ns: int | None
) -> Iterator[tuple[Any, int, Any]]:
    # A bag of ROS 1 has no storage.
    storage: Any = getattr(reader, "storage", None)
    if hasattr(storage, "messages_scan") and not storage.chunks:
        # The file has no index, and so perhaps no order; `messages` refuses such a file.
        yield from storage.messages_scan(wanted, start_ns, end_ns)
    else:
        yield from reader.messages(wanted, start_ns, end_ns)


@contextmanager
def _errors_as_lines(path: Path) -> Iterator[None]:
    """Turns every error that the library raises for a damaged recording into an InputError."""
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
        # The library, and those below it, raise errors of many types for damaged bytes.
        reason = as_line(str(error)) or type(error).__name__
        raise InputError(f"{path}: not a readable recording: {reason}") from error
