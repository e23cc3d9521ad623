"""The Rotation Shim from one task to the next."""

from __future__ import annotations

import pytest

from drake_navbench.controllers.rotation_shim.controller import RotationShim, ShimMemory
from drake_navbench.controllers.rotation_shim.releases import RULES


class _Primary:
    """A primary controller that keeps nothing."""

    def initial_memory(self):
        return "fresh"


@pytest.mark.parametrize("release", list(RULES))
def test_a_turn_and_the_goal_outlive_the_task_and_up_to_iron_the_last_command(release):
    shim = object.__new__(RotationShim)
    shim._primary, shim._release = _Primary(), RULES[release]
    before = ShimMemory("old", True, 0.7, 4, (1.0, 2.0, 3.0), False, True)
    after = shim.next_memory(before)
    last_w = 0.7 if release in {"humble", "iron"} else 0.0
    assert after == ShimMemory("fresh", True, last_w, None, (1.0, 2.0, 3.0), False, False)
