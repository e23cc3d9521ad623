"""How the time that a drive loses is split into parts."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

STUDIES = Path(__file__).parents[3] / "studies"


def test_at_half_the_speed_half_of_each_part_is_lost():
    sys.path.insert(0, str(STUDIES))
    import harmony_time

    sys.path.remove(str(STUDIES))
    # 6 s at 0.25 m/s: 2.5 s of start, 1.5 s, 2 s of goal; 1.5 m at 0.5 m/s would take 3 s.
    parts = harmony_time.parts_of(np.arange(10.0, 16.1, 0.5), np.full(13, 0.25))
    assert parts == pytest.approx({"start [s]": 1.25, "between [s]": 0.75, "goal [s]": 1.0})
