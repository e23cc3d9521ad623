"""What the tests of recordings share."""

from __future__ import annotations

from pathlib import Path

import pytest
from robot_bags import ROBOT_YAML

from drake_navbench.ros2.recordings import import_bags
from drake_navbench.ros2.recordings.messages import MessageMaker


@pytest.fixture(scope="session")
def make() -> MessageMaker:
    return MessageMaker()


@pytest.fixture(scope="session")
def robot_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("robot") / "burger.yaml"
    path.write_text(ROBOT_YAML)
    return path


@pytest.fixture
def without_curves(monkeypatch) -> None:
    """Imports draw no curves of the simulation's gap: test_simulation_gap.py looks at them."""
    monkeypatch.setattr(import_bags, "write_curves", lambda gap, log_path: None)
