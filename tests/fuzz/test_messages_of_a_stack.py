"""Whatever bytes a stack or a stranger in its domain sends, they are a message or a ValueError."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from bounds import fuzz, only_input_errors
from damage import damaged_bytes
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("cyclonedds")

from drake_navbench.ros2.live.goal_watch import GoalWatch
from drake_navbench.ros2.live.stack_topics import TWIST, TWIST_STAMPED, _entry, _planar
from drake_navbench.ros2.live.wire_types import WireMessage, encoded
from drake_navbench.ros2.recordings import topics
from drake_navbench.ros2.recordings.messages import MessageMaker

# A sequence that claims 4,294,967,295 elements.
ALL_ONES = b"\xff\xff\xff\xff"


def sound_messages() -> dict[str, bytes]:
    """Returns the bytes of one message of each type that is read from a stack."""
    make = MessageMaker()
    transform = make.transform(0, "map", "odom", (0.0, 0.0, 0.0))
    messages = {
        TWIST: make.twist(0.1, 0.2),
        TWIST_STAMPED: make.twist_stamped(0, "base_link", 0.1, 0.2),
        topics.NAVIGATE_STATUS.type: make.goal_status(0, bytes(range(16)), 2),
        topics.PLAN.type: make.path(0, "map", np.zeros((3, 3))),
        topics.TF.type: make.make(topics.TF.type, transforms=[transform]),
    }
    return {kind: encoded(message, kind).data for kind, message in messages.items()}


SOUND = sound_messages()


@st.composite
def messages(draw: st.DrawFn) -> WireMessage:
    """Draws a message whose bytes are damaged, here and there with an endless sequence."""
    kind = draw(st.sampled_from(sorted(SOUND)))
    data = draw(damaged_bytes(SOUND[kind]))
    if draw(st.booleans()):
        start = 4 * draw(st.integers(0, len(data) // 4))
        data = data[:start] + ALL_ONES + data[start + 4 :]
    return WireMessage(kind, data)


@fuzz
@given(message=messages())
def test_messages_of_a_stack(message):
    with only_input_errors(), suppress(ValueError):
        decoded = message.decoded()
        if message.type_name == topics.NAVIGATE_STATUS.type:
            GoalWatch().note(map(_entry, decoded.status_list))
        elif message.type_name == topics.PLAN.type:
            np.array([_planar(one.pose) for one in decoded.poses])
