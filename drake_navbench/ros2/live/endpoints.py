"""Publishers and subscriptions of others in a domain, and their differences from ours."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

BEST_EFFORT, RELIABLE = "best_effort", "reliable"
VOLATILE, TRANSIENT_LOCAL = "volatile", "transient_local"
UNKNOWN_NODE = "an unknown node"


class Quality(NamedTuple):
    """A quality of service in ROS's words; a publisher offers it, a subscription asks for it."""

    reliability: str = RELIABLE
    durability: str = VOLATILE


class Endpoint(NamedTuple):
    """One publisher or subscription of another participant.

    topic, type: ROS's names. type_hash: '' where the other side tells none, as before Iron. node:
    its node's name, '' where unknown. key: an identifier that no other endpoint ever has.
    """

    topic: str
    type: str
    is_publisher: bool
    quality: Quality = Quality()
    type_hash: str = ""
    node: str = ""
    key: bytes = b""

    @property
    def shown_node(self) -> str:
        """The endpoint's node, as a sentence names it."""
        return f"node {self.node}" if self.node else UNKNOWN_NODE


class OwnTopic(NamedTuple):
    """A topic that this side publishes or listens to, as the other side must have it."""

    topic: str
    types: tuple[str, ...]
    is_published: bool
    quality: Quality = Quality()
    type_hashes: tuple[str, ...] = ()


def publishers_of(endpoints: Iterable[Endpoint], topic: str) -> list[Endpoint]:
    """Returns the publishers of a topic."""
    return [one for one in endpoints if one.topic == topic and one.is_publisher]


def listeners_of(endpoints: Iterable[Endpoint], topic: str) -> list[Endpoint]:
    """Returns the subscriptions to a topic."""
    return [one for one in endpoints if one.topic == topic and not one.is_publisher]


def robots_there(endpoints: Sequence[Endpoint], topics_of_a_robot: Iterable[str]) -> list[str]:
    """Returns a sentence for each publisher of a topic that only a robot or a simulator has."""
    signs = [
        f"{one.shown_node} publishes {topic}"
        for topic in topics_of_a_robot
        for one in publishers_of(endpoints, topic)
    ]
    return list(dict.fromkeys(signs))


def may_be_robots(endpoints: Sequence[Endpoint], command_topic: str) -> list[str]:
    """Returns a sentence for each listener to commands: a robot would drive by them."""
    signs = [
        f"{one.shown_node} listens to {command_topic} and may be a robot that would drive"
        for one in listeners_of(endpoints, command_topic)
    ]
    return list(dict.fromkeys(signs))


def mismatches(endpoints: Iterable[Endpoint], own: Sequence[OwnTopic]) -> list[str]:
    """Returns a sentence for each endpoint that cannot match ours, with the words of both sides."""
    by_topic = {topic.topic: topic for topic in own}
    found = []
    for one in endpoints:
        ours = by_topic.get(one.topic)
        if ours is not None and one.is_publisher != ours.is_published:
            found += _mismatch(one, ours)
    return list(dict.fromkeys(found))


def _mismatch(one: Endpoint, ours: OwnTopic) -> list[str]:
    verb = "publishes" if one.is_publisher else "expects"
    if one.type not in ours.types:
        does = "publishes" if ours.is_published else "expects"
        expected = " or ".join(ours.types)
        return [
            f"{one.topic}: {one.shown_node} {verb} {one.type}, drake_navbench {does} {expected}"
        ]
    if one.type_hash and ours.type_hashes and one.type_hash not in ours.type_hashes:
        return [
            f"{one.topic}: {one.shown_node} has another {one.type} than drake_navbench: "
            f"{one.type_hash} against {ours.type_hashes[0]}"
        ]
    requested, offered = one.quality, ours.quality
    if one.is_publisher:
        requested, offered = offered, requested
    faults = []
    for name, wanted, best in (
        ("reliability", requested.reliability, RELIABLE),
        ("durability", requested.durability, TRANSIENT_LOCAL),
    ):
        given = getattr(offered, name)
        if wanted == best and given != best:
            asks = "drake_navbench" if one.is_publisher else one.shown_node
            offers = one.shown_node if one.is_publisher else "drake_navbench"
            faults.append(
                f"{one.topic}: {asks} asks for {name} {wanted}, {offers} offers {given}: "
                "nothing arrives"
            )
    return faults
