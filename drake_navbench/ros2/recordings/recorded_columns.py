"""The messages read from a recording: one topic for each role, decoded into plain arrays.

Times are seconds from the first message of the recording, on the clock of the stamps, which is that
of the computer or of the simulator. A message without a stamp has only the time at which it was
received. That time is converted to the stamps' clock by the odometry, whose messages have both
times.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.ros2.recordings.bag_source import BagSource
from drake_navbench.ros2.recordings.decoded_messages import DECODERS, is_usable
from drake_navbench.ros2.recordings.topics import SCALARS
from drake_navbench.typed_files.name_lists import packaged_table

# Messages of these roles hold until the next one, so that earlier ones count, too.
LATCHED_ROLES = frozenset({"tf_static", "map", "trial", "status", "goal", "plan"})
# Roles without which metrics are lost: a hint lists the topics of a fitting type.
HINTED_ROLES = ("command", "scan", "plan")
MAX_HINTED_TOPICS = 5


class Role(NamedTuple):
    """The role of a topic. names: usual ones, the likeliest first. types: accepted ones."""

    names: tuple[str, ...]
    types: tuple[str, ...]


ROLES: Mapping[str, Role] = {
    **{
        name: Role(tuple(role["names"]), tuple(role["types"]))
        for name, role in packaged_table(__package__, "roles.yaml").items()
    },
    **{name: Role((topic.name,), (topic.type,)) for name, topic in SCALARS.items()},
}


def choose_topics(
    source: BagSource, given: Mapping[str, str], namespace: str | None
) -> tuple[dict[str, str], list[str]]:
    """Returns role -> topic for the roles in a recording, and a line on each topic left out.

    given: the user's topics by role; '' leaves a role out. namespace: namespace of the robot; None
    finds it where the recording has only one. Raises InputError where a given topic is missing or
    has another type, or where the recording has topics of several robots.
    """
    for role in given:
        if role not in ROLES:
            raise InputError(f"--topics {role}: unknown role{nearest_name_hint(role, ROLES)}")
    prefix = _prefix(source, namespace) if "odom" not in given else _as_prefix(namespace)
    chosen: dict[str, str] = {}
    remarks: list[str] = []
    for role, (names, types) in ROLES.items():
        if role in given:
            topic = given[role]
            if not topic:
                continue
            if topic not in source.topics:
                hint = nearest_name_hint(topic, source.topics)
                raise InputError(f"{source.path}: --topics {role}={topic}: no message on it{hint}")
        else:
            # Maps and transforms are often shared by all robots.
            candidates = [f"{prefix}{name}" for name in names] + list(names)
            present = [name for name in candidates if name in source.topics]
            fitting = [name for name in present if source.topics[name] in types]
            if not present:
                remarks += _hint_of(role, source, namespace)
                continue
            topic = (fitting or present)[0]
        if source.topics[topic] not in types:
            fault = (
                f"{source.path}: {topic} ({role}): has messages of {source.topics[topic]}, "
                f"expected {' or '.join(types)}"
            )
            if role in given or role == "odom":
                raise InputError(fault)
            remarks.append(f"{fault}; left out")
            continue
        chosen[role] = topic
    if "odom" not in chosen:
        found = ", ".join(sorted(source.topics)[:40])
        raise InputError(
            f"{source.path}: no odometry on {' or '.join(ROLES['odom'].names)}; name its topic "
            f"with --topics odom=TOPIC; found: {found}"
        )
    return chosen, remarks


def _hint_of(role: str, source: BagSource, namespace: str | None) -> list[str]:
    """Returns a line with the topics whose type fits a role; none without such a topic."""
    if role not in HINTED_ROLES:
        return []
    start = f"{_as_prefix(namespace)}/"
    types = ROLES[role].types
    fitting = [t for t, kind in source.topics.items() if kind in types and t.startswith(start)]
    if not fitting:
        return []
    named = ", ".join(sorted(fitting)[:MAX_HINTED_TOPICS])
    return [
        f"{source.path}: no {role} where it usually is; by its type it could be {named}: name it "
        f"with --topics {role}=TOPIC"
    ]


def _as_prefix(namespace: str | None) -> str:
    return f"/{namespace.strip('/')}" if namespace and namespace.strip("/") else ""


def _prefix(source: BagSource, namespace: str | None) -> str:
    """Returns the prefix of a robot's topics: '' or its namespace."""
    role = ROLES["odom"]
    if namespace is not None:
        return _as_prefix(namespace)
    if any(source.topics.get(name) in role.types for name in role.names):
        return ""
    apart = set(ROLES["truth"].names)
    prefixes = sorted(
        {
            topic.removesuffix(name)
            for topic, kind in source.topics.items()
            for name in role.names
            if kind in role.types and topic.endswith(name) and topic not in apart
        }
    )
    if len(prefixes) > 1:
        raise InputError(
            f"{source.path}: holds {len(prefixes)} robots: {', '.join(prefixes)}; choose one with "
            "--namespace"
        )
    return prefixes[0] if prefixes else ""


class Column(NamedTuple):
    """The messages of one topic.

    receive_ns: (N,) int64, when the recorder received each. stamp_ns: (N,) int64, -1 for a message
    without a stamp. values: decoded. unusable: the number of messages that were left out because
    they contain NaN or cells of no size.
    """

    receive_ns: NDArray[np.int64]
    stamp_ns: NDArray[np.int64]
    values: list[Any]
    unusable: int = 0


def read_columns(
    source: BagSource, topics: Mapping[str, str], start_ns: int | None, end_ns: int | None
) -> dict[str, Column]:
    """Returns role -> messages received in [start, end) ns; latched roles from the beginning on."""
    kept: dict[str, list[tuple[int, int, Any]]] = {role: [] for role in topics}
    unusable = dict.fromkeys(topics, 0)
    latched = {role: topic for role, topic in topics.items() if role in LATCHED_ROLES}
    others = {role: topic for role, topic in topics.items() if role not in LATCHED_ROLES}
    for part, begin in ((latched, None), (others, start_ns)):
        # A topic may have several roles, such as a simulator's odometry, which is the truth, too.
        for topic, receive_ns, message in source.read(set(part.values()), begin, end_ns):
            for role in (role for role, name in part.items() if name == topic):
                usable, left_out = _decoded(source, topic, role, message)
                kept[role] += [(receive_ns, *entry) for entry in usable]
                unusable[role] += left_out
    columns = {}
    for role, rows in kept.items():
        rows.sort(key=lambda row: row[0])
        received = np.array([row[0] for row in rows], dtype=np.int64)
        stamps = np.array([row[1] for row in rows], dtype=np.int64)
        columns[role] = Column(received, stamps, [row[2] for row in rows], unusable[role])
    return columns


def _decoded(
    source: BagSource, topic: str, role: str, message: Any
) -> tuple[list[tuple[int, Any]], int]:
    """Returns stamps, ns, with the usable values in a message, and the number of other values.

    Raises InputError where a field is missing.
    """
    try:
        decoded = DECODERS[role](message)
        usable = [entry for entry in decoded if is_usable(entry[1])]
    except (AttributeError, TypeError, ValueError, IndexError) as error:
        raise InputError(
            f"{source.path}: {topic} ({role}): a message of {source.topics[topic]} "
            f"lacks an expected field: {error}"
        ) from error
    return usable, len(decoded) - len(usable)
