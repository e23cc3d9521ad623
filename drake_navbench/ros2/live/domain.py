"""One participant of a DDS domain: its publishers and subscriptions, and the other participants.

Without peers it sends to 127.0.0.1 alone, hears this machine alone, and finds others by asking
every port that a participant may have. CYCLONEDDS_URI is not read: it could open the network.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any
from xml.sax.saxutils import quoteattr

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import (
    DDSException,
    InstanceState,
    Policy,
    Qos,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from drake_navbench.errors import InputError
from drake_navbench.ros2.live.endpoints import (
    BEST_EFFORT,
    RELIABLE,
    TRANSIENT_LOCAL,
    VOLATILE,
    Endpoint,
    Quality,
)
from drake_navbench.ros2.live.loopback import bind_to_loopback
from drake_navbench.ros2.live.wire_types import (
    WireMessage,
    dds_topic,
    encoded,
    ros_topic,
    ros_type,
    type_hash,
    wire_type,
)

LOOPBACK = "127.0.0.1"
# The number of a domain's ports that are asked; each process of a stack has one or more
# participants.
MAX_PARTICIPANTS = 60
# Messages that wait for a stopped reader are limited, so that they cannot stop the simulation.
MAX_UNREAD = "64 MB"
# Descriptions of types are exchanged with no vendor of DDS: Cyclone DDS cannot read those of Fast
# DDS and would wait for better ones. Without them, topics match by the names of their types, as in
# ROS.
VENDORS = ",".join(f"1.{number}" for number in range(2, 33))
BLOCKED_FOR = duration(milliseconds=50)
DEPTH = 10
MAX_ENDPOINTS = 10_000
MAX_TAKEN = 1000
# The topic on which participants tell their nodes, and the node of each endpoint.
NODE_TOPIC = "ros_discovery_info"
NODE_TYPE = "rmw_dds_common/msg/ParticipantEntitiesInfo"
ALIVE = ViewState.Any | SampleState.Any | InstanceState.Alive
NEW = ViewState.Any | SampleState.NotRead | InstanceState.Any
PLAIN = Quality()
LATCHED = Quality(RELIABLE, TRANSIENT_LOCAL)

# The domains of this process and their peers: Cyclone DDS configures a domain once in a process.
_domains: dict[int, tuple[tuple[str, ...], Domain]] = {}


def configuration(peers: Sequence[str] = ()) -> str:
    """Returns Cyclone DDS's configuration: loopback alone, or the network with these peers."""
    interface = "autodetermine='true'" if peers else f"address='{LOOPBACK}'"
    addresses = "".join(f"<Peer address={quoteattr(peer)}/>" for peer in (LOOPBACK, *peers))
    return (
        "<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces>"
        f"<NetworkInterface {interface} multicast='false'/></Interfaces></General>"
        "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
        f"<MaxAutoParticipantIndex>{MAX_PARTICIPANTS}</MaxAutoParticipantIndex>"
        f"<SPDPInterval>1s</SPDPInterval><Peers>{addresses}</Peers></Discovery>"
        f"<Compatibility><IgnoreTypeInformation>{VENDORS}</IgnoreTypeInformation></Compatibility>"
        f"<Internal><Watermarks><WhcHigh>{MAX_UNREAD}</WhcHigh></Watermarks></Internal>"
        "</Domain></CycloneDDS>"
    )


class Publisher:
    """A publisher of one topic. lost_count: messages that a stopped reader did not take."""

    def __init__(self, writer: DataWriter[Any], type_name: str) -> None:
        self._writer = writer
        self._type = type_name
        self.lost_count = 0

    def send(self, message: Any) -> None:
        """Sends a message of rosbags."""
        try:
            self._writer.write(encoded(message, self._type))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise
            self.lost_count += 1


class Subscription:
    """A subscription to one topic."""

    def __init__(self, participant: DomainParticipant, reader: DataReader[Any]) -> None:
        self._reader = reader
        self._waitset = WaitSet(participant)
        self._waitset.attach(ReadCondition(reader, NEW))

    def take(self) -> list[WireMessage]:
        """Returns the messages that have come since the last call."""
        taken = self._reader.take(MAX_TAKEN)
        return [one for one in taken if isinstance(one, WireMessage)]

    def wait(self, patience_s: float) -> bool:
        """Waits for a message, `patience_s` at most; returns whether there is one."""
        return bool(self._waitset.wait(duration(seconds=patience_s)))

    def wait_with(self, other: Subscription) -> None:
        """Makes `wait` end with a message of another subscription as well."""
        self._waitset.attach(ReadCondition(other._reader, NEW))


class LiveDomain:
    """Our own participant of a domain; raises InputError where the domain cannot be opened."""

    def __init__(self, number: int, peers: Sequence[str] = ()) -> None:
        self.number = number
        try:
            _open_domain(number, tuple(peers))
            self._participant = DomainParticipant(number)
        except DDSException as error:
            raise InputError(f"live: domain {number} cannot be opened: {error}") from error
        self._own_key = self._participant.guid
        self._readers = [
            (BuiltinDataReader(self._participant, topic), is_publisher)
            for topic, is_publisher in (
                (BuiltinTopicDcpsPublication, True),
                (BuiltinTopicDcpsSubscription, False),
            )
        ]
        self._alive = [ReadCondition(reader, ALIVE) for reader, _ in self._readers]
        self._nodes = self._subscribe(NODE_TOPIC, NODE_TYPE, LATCHED)
        self._node_of: dict[bytes, str] = {}

    def publisher(self, topic: str, type_name: str, quality: Quality = PLAIN) -> Publisher:
        """Returns a publisher of a topic such as /scan."""
        qos = _qos(quality, Policy.Userdata(f"typehash={type_hash(type_name)};".encode()))
        dds = Topic(self._participant, dds_topic(topic), wire_type(type_name))
        return Publisher(DataWriter(self._participant, dds, qos), type_name)

    def subscription(
        self, topic: str, type_name: str, quality: Quality = PLAIN, *, hears_own: bool = True
    ) -> Subscription:
        """Returns a subscription to a topic such as /cmd_vel.

        hears_own: whether it gets messages of this participant, too.
        """
        own = () if hears_own else (Policy.IgnoreLocal.Participant,)
        return self._subscribe(dds_topic(topic), type_name, quality, *own)

    def endpoints(self) -> list[Endpoint]:
        """Returns the publishers and subscriptions of all other participants on ROS's topics."""
        self._read_nodes()
        found = []
        for (reader, is_publisher), alive in zip(self._readers, self._alive, strict=True):
            for one in reader.read(MAX_ENDPOINTS, alive):
                topic = ros_topic(one.topic_name)
                if topic is None or one.participant_key == self._own_key:
                    continue
                found.append(
                    Endpoint(
                        topic,
                        ros_type(one.type_name),
                        is_publisher,
                        _quality(one.qos),
                        _told_hash(one.qos),
                        self._node_of.get(one.key.bytes, ""),
                        one.key.bytes,
                    )
                )
        return found

    def wait_until(
        self, is_there: Callable[[list[Endpoint]], bool], patience_s: float
    ) -> list[Endpoint]:
        """Waits, `patience_s` at most, until `is_there` is true of the endpoints; returns them."""
        deadline = time.monotonic() + patience_s
        while True:
            found = self.endpoints()
            if is_there(found) or time.monotonic() >= deadline:
                return found
            time.sleep(0.02)

    def close(self) -> None:
        """Leaves the domain."""
        with suppress(DDSException):
            self._participant._delete(self._participant._ref)

    def _subscribe(
        self, dds_name: str, type_name: str, quality: Quality, *further: Any
    ) -> Subscription:
        user_data = Policy.Userdata(f"typehash={type_hash(type_name)};".encode())
        dds = Topic(self._participant, dds_name, wire_type(type_name))
        reader = DataReader(self._participant, dds, _qos(quality, user_data, *further))
        return Subscription(self._participant, reader)

    def _read_nodes(self) -> None:
        """Reads the node of each endpoint, as ROS's participants tell it."""
        for received in self._nodes.take():
            with suppress(ValueError):
                for node in received.decoded().node_entities_info_seq:
                    name = f"{node.node_namespace.rstrip('/')}/{node.node_name}"
                    for gid in (*node.reader_gid_seq, *node.writer_gid_seq):
                        self._node_of[bytes(gid.data[:16])] = name


def _open_domain(number: int, peers: tuple[str, ...]) -> None:
    """Configures a domain the first time that this process opens it."""
    known = _domains.get(number)
    if known is None:
        domain = Domain(number, configuration(peers))
        if not peers:
            bind_to_loopback(number)
        _domains[number] = peers, domain
    elif known[0] != peers:
        raise InputError(
            f"live: domain {number}: this process has it open with the peers "
            f"{', '.join(known[0]) or 'none'}; expected the same, got {', '.join(peers) or 'none'}"
        )


def _qos(quality: Quality, *further: Any) -> Qos:
    is_latched = quality.durability == TRANSIENT_LOCAL
    reliable = Policy.Reliability.Reliable(BLOCKED_FOR)
    return Qos(
        reliable if quality.reliability == RELIABLE else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if is_latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(1 if is_latched else DEPTH),
        *further,
    )


def _quality(qos: Qos) -> Quality:
    """Returns an endpoint's quality of service in ROS's words."""
    is_best_effort = qos[Policy.Reliability] == Policy.Reliability.BestEffort
    is_volatile = qos[Policy.Durability] == Policy.Durability.Volatile
    return Quality(
        BEST_EFFORT if is_best_effort else RELIABLE,
        VOLATILE if is_volatile else TRANSIENT_LOCAL,
    )


def _told_hash(qos: Qos) -> str:
    """Returns the type hash in an endpoint's user data, '' without one."""
    told = qos[Policy.Userdata]
    match = re.search(rb"typehash=(RIHS\w+);", told.data) if told is not None else None
    return "" if match is None else match[1].decode()
