"""Writes messages as a folder of rosbag2: one MCAP file, chunks compressed, and metadata.yaml."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from drake_navbench.errors import InputError, writing
from drake_navbench.ros2.recordings.rosbags_extra import require_rosbags, ros2_types
from drake_navbench.ros2.recordings.topics import Message
from drake_navbench.typed_files.output_file import UNFINISHED

if TYPE_CHECKING:
    from rosbags.interfaces import Qos

# The version of rosbag2's metadata that Jazzy and later write, and older releases read after a
# reindex.
METADATA_VERSION: Final = 9


def write_bag(path: Path, messages: Iterable[Message]) -> None:
    """Writes a bag folder, whole or not at all; an existing bag is replaced.

    messages: in any order. Raises CannotBeWritten where the folder cannot be written, InputError
    where something else than a bag has its path.
    """
    require_rosbags()
    if path.exists() and not (path / "metadata.yaml").is_file():
        raise InputError(
            f"{path}: exists and is not a bag, expected a bag or a new folder; left as it is"
        )
    unfinished = path.with_name(f".{path.name}.{os.getpid()}{UNFINISHED}")
    with writing(path):
        try:
            unfinished.mkdir(parents=True)
            # The file is named after its folder.
            _write(unfinished / path.name, messages)
            if path.exists():
                shutil.rmtree(path)
            (unfinished / path.name).rename(path)
        finally:
            shutil.rmtree(unfinished, ignore_errors=True)


def _write(path: Path, messages: Iterable[Message]) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    types = ros2_types()
    encoded = [
        (stamp, order, topic, types.serialize_cdr(message, topic.type))
        for order, (topic, stamp, message) in enumerate(messages)
    ]
    encoded.sort(key=lambda entry: entry[:2])
    writer = Writer(path, version=METADATA_VERSION, storage_plugin=StoragePlugin.MCAP)
    # Chunk by chunk, which MCAP's readers expect: a file compressed as a whole could not be
    # searched.
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        connections = {
            topic: writer.add_connection(
                topic.name,
                topic.type,
                typestore=types,
                offered_qos_profiles=[_latched()] if topic.is_latched else [],
            )
            for topic in dict.fromkeys(topic for _, _, topic, _ in encoded)
        }
        for stamp, _, topic, data in encoded:
            writer.write(connections[topic], stamp, data)


def _latched() -> Qos:
    """Returns the quality of service with which a late subscriber still gets the last message.

    The other topics name no quality of service: a player then offers its default.
    """
    from rosbags.interfaces import (
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    # The value of RMW_DURATION_INFINITE.
    unlimited = QosTime(9223372036, 854775807)
    return Qos(
        QosHistory.KEEP_LAST,
        1,
        QosReliability.RELIABLE,
        QosDurability.TRANSIENT_LOCAL,
        unlimited,
        unlimited,
        QosLiveliness.AUTOMATIC,
        unlimited,
        False,
    )
