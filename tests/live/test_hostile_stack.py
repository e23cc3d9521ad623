"""Messages of strangers in the domain: they are left out, and the trial goes on."""

from __future__ import annotations

import math
import threading
from contextlib import contextmanager, suppress

import numpy as np
import pytest
from stand_ins import CYCLONE, ROBOT, live, stand_in, way

pytest.importorskip("cyclonedds")

from cyclonedds.core import DDSException
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic

from drake_navbench.logs.outcome import Outcome
from drake_navbench.ros2.live import lookout
from drake_navbench.ros2.live.domain import LATCHED, NODE_TOPIC, NODE_TYPE, PLAIN, LiveDomain, _qos
from drake_navbench.ros2.live.endpoints import Quality
from drake_navbench.ros2.live.stack_topics import TWIST
from drake_navbench.ros2.live.wire_types import dds_topic, encoded, wire_type
from drake_navbench.ros2.recordings import topics
from drake_navbench.ros2.recordings.messages import MessageMaker
from drake_navbench.trial.trial import run_trial

CUTS = (4, 8, 12, 20)


@pytest.fixture(autouse=True)
def _short_listening(monkeypatch):
    monkeypatch.setattr(lookout, "LISTEN_S", 0.3)


def broken(data: bytes) -> list[bytes]:
    """Returns a message's bytes cut short, and with a count of 2^32 - 1 in each place."""
    counts = [
        data[:start] + b"\xff" * 4 + data[start + 4 :] for start in range(4, min(len(data), 64), 4)
    ]
    return [*(data[:length] for length in CUTS), *counts]


def broken_messages() -> list[tuple[str, str, Quality, list[bytes]]]:
    """Returns DDS's topic, type, quality and bytes of what a stranger sends.

    Commands are cut or not finite: any other bytes are a command.
    """
    make = MessageMaker()
    command = encoded(make.twist(0.1, 0.1), TWIST).data
    never = [encoded(make.twist(*one), TWIST).data for one in ((math.nan, 0.0), (0.0, math.inf))]
    plans = [make.path(0, "map", np.full((count, 3), math.nan)) for count in (0, 3)]
    plans_sent = [encoded(plan, topics.PLAN.type).data for plan in plans]
    states = make.goal_status(0, bytes(16), 6)
    states_sent = encoded(states, topics.NAVIGATE_STATUS.type).data
    moved = make.transform(0, "map", "base_link", (0.0, 0.0, 0.0))
    moved_sent = encoded(make.make(topics.TF.type, transforms=[moved]), topics.TF.type).data
    return [
        (dds_topic("/cmd_vel"), TWIST, PLAIN, [*(command[:cut] for cut in CUTS), *never]),
        (dds_topic("/plan"), topics.PLAN.type, PLAIN, plans_sent + broken(plans_sent[1])),
        (
            dds_topic(topics.NAVIGATE_STATUS.name),
            topics.NAVIGATE_STATUS.type,
            LATCHED,
            [states_sent[:cut] for cut in CUTS],
        ),
        (dds_topic("/tf"), topics.TF.type, PLAIN, broken(moved_sent)),
        (NODE_TOPIC, NODE_TYPE, LATCHED, broken(bytes(200))),
    ]


@contextmanager
def babble(domain: int):
    """Sends broken and senseless messages on the topics that are read, until it is left.

    Yields the topics on which Cyclone DDS let some of them through.
    """
    stranger = LiveDomain(domain)
    sent = []
    for name, kind, quality, pieces in broken_messages():
        topic = Topic(stranger._participant, name, wire_type(kind))
        writer = DataWriter(stranger._participant, topic, _qos(quality))
        sent += [(writer, wire_type(kind)(piece)) for piece in pieces]
    left, heard_on = threading.Event(), set()

    def speak() -> None:
        while not left.wait(0.05):
            for writer, piece in sent:
                # Cyclone DDS refuses most bytes that are none of the type, at both ends.
                with suppress(DDSException):
                    writer.write(piece)
                    heard_on.add(writer.topic.name)

    speaker = threading.Thread(target=speak)
    speaker.start()
    try:
        yield heard_on
    finally:
        left.set()
        speaker.join()
        stranger.close()


def test_messages_of_a_stranger_change_no_way_and_end_no_trial(domain):
    with stand_in(CYCLONE, domain), babble(domain) as heard_on:
        log = run_trial(way(0.6), live(domain, patience_s=5.0), robot=ROBOT)
    assert heard_on >= {"rt/cmd_vel", "rt/plan", "rt/tf"}
    assert log.outcome is Outcome.SUCCEEDED, log.info["reason"]
    assert log.samples.iloc[-1]["x_m"] == pytest.approx(0.6, abs=0.13)
    assert np.isfinite(log.samples[["command_v_mps", "command_w_radps"]]).all(axis=None)
    assert [len(plan.poses) > 1 for plan in log.plans] == [True] * len(log.plans)
