"""Prepares the files of a recording for the library: finds, unpacks, renames and mends them.

The first bytes of a file tell its format; where they do not, its name does.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from drake_navbench.errors import InputError
from drake_navbench.ros2.recordings.rosbags_extra import open_zstd
from drake_navbench.typed_files.input_file import LFS_POINTER, read_head, require_fetched

MCAP_MAGIC = b"\x89MCAP0\r\n"
RECORD_HEADER = struct.Struct("<BQ")
# The records that end an MCAP file: DataEnd without a checksum, Footer without a summary.
MCAP_END = RECORD_HEADER.pack(0x0F, 4) + bytes(4) + RECORD_HEADER.pack(0x02, 20) + bytes(20)
DATA_END, FOOTER = 0x0F, 0x02
COPIED_BYTES = 1 << 20
STORAGES = (".mcap", ".db3", ".bag")
ZSTD_MAGIC: Final = b"\x28\xb5\x2f\xfd"
PACKED = (".zstd", ".zst")
# The first bytes of each storage.
MAGICS = {MCAP_MAGIC: ".mcap", b"SQLite format 3\0": ".db3", b"#ROSBAG V": ".bag"}
METADATA = "metadata.yaml"


@dataclass
class BagFiles:
    """The files of a recording.

    scratch: a folder for files that must be changed. most_bytes: limit of the total size of the
    files that are unpacked there. losses: a line for each file that is not read as a whole.
    """

    scratch: Path
    most_bytes: int
    losses: list[str] = field(default_factory=list)
    _unpacked_bytes: int = 0
    _count: int = 0

    def ready(self, file: Path) -> Path:
        """Returns the file, unpacked and mended, with the suffix of its format.

        Raises InputError where the file cannot be unpacked or mended.
        """
        require_content(file)
        ready = self._unpacked(file) if _starts_with(file, ZSTD_MAGIC) else file
        ready = self._named(ready)
        if is_cut(ready):
            whole = self._place(ready.name)
            self.losses.append(_mend(ready, whole, file))
            return whole
        return ready

    def _place(self, name: str) -> Path:
        """Returns a path for a file of this name, in a new folder."""
        self._count += 1
        folder = self.scratch / str(self._count)
        folder.mkdir()
        return folder / name

    def _unpacked(self, file: Path) -> Path:
        place = self._place(_unpacked_name(file))
        with open_zstd(file) as packed, place.open("wb") as unpacked:
            while piece := packed.read(COPIED_BYTES):
                self._unpacked_bytes += len(piece)
                if self._unpacked_bytes > self.most_bytes:
                    raise InputError(
                        f"{file}: unpacks to more than {self.most_bytes / 1e9:.3g} GB; unpack it "
                        "yourself where that is right: zstd -d"
                    )
                unpacked.write(piece)
        return place

    def _named(self, file: Path) -> Path:
        """Returns a path to the file whose suffix tells the library its format."""
        suffix = next((s for magic, s in MAGICS.items() if _starts_with(file, magic)), None)
        if suffix is None or file.suffix == suffix:
            return file
        link = self._place(f"{file.stem}{suffix}")
        link.symlink_to(file.absolute())
        return link


def files_in(folder: Path) -> list[Path]:
    """Returns the files of a folder that hold messages; raises InputError where it has none."""
    files = sorted(file for file in folder.iterdir() if file.is_file() and _holds_messages(file))
    if not files:
        is_told = (folder / METADATA).is_file()
        why = f"the files that its {METADATA} names are not there" if is_told else "not a recording"
        raise InputError(f"{folder}: a folder without {', '.join(STORAGES)}; {why}")
    return files


def is_packed(file: Path) -> bool:
    """Returns whether a file is packed as a whole, by rosbag2's compression_mode file."""
    return file.suffix in PACKED


def require_recording(file: Path) -> None:
    """Raises InputError where neither name nor first bytes of a file tell a recording."""
    if not (_holds_messages(file) or _starts_with(file, *MAGICS, LFS_POINTER)):
        raise InputError(
            f"{file}: not a recording: expected {', '.join(STORAGES)} or a rosbag2 folder"
        )


def require_content(path: Path) -> None:
    """Raises InputError for a pointer to the recording, as a clone without Git LFS has it."""
    require_fetched(path, read_head(path, len(LFS_POINTER)))


def size_of(path: Path) -> int:
    """Returns the size of a recording on the disk, bytes."""
    files: Sequence[Path] = [path]
    if path.is_dir():
        files = [file for file in path.iterdir() if file.is_file()]
    return sum(file.stat().st_size for file in files)


def is_cut(path: Path) -> bool:
    """Returns whether a file is an unfinished MCAP file: its end is missing or wrong."""
    if path.suffix != ".mcap" or not _starts_with(path, MCAP_MAGIC):
        return False
    with path.open("rb") as file:
        file.seek(-len(MCAP_MAGIC), os.SEEK_END)
        return file.read() != MCAP_MAGIC


def _holds_messages(file: Path) -> bool:
    return _unpacked_name(file).endswith(STORAGES)


def _unpacked_name(file: Path) -> str:
    return file.stem if is_packed(file) else file.name


def _starts_with(path: Path, *beginnings: bytes) -> bool:
    with path.open("rb") as file:
        return file.read(max(map(len, beginnings))).startswith(beginnings)


def _mend(path: Path, whole: Path, named: Path) -> str:
    """Copies the complete records of an MCAP file and ends the copy; returns a line on the loss."""
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
    return f"{named}: cut off: the last {size - kept} of {size} bytes are no whole record"
