"""A repository of a robot, for the tests of packages."""

from __future__ import annotations

import pytest
from descriptions_scenes import ROOM, world, write_repository
from package_scenes import NAV2


@pytest.fixture
def repository(tmp_path):
    """A repository with a robot, a file of parts, a Nav2 file, two worlds and a keepout mask."""
    root = tmp_path / "cart"
    write_repository(root)
    files = {
        "cart_description/urdf/lidar_macro.xacro": '<robot name="part"><link name="a"/></robot>',
        "cart_nav/config/nav2_params.yaml": NAV2,
        "cart_nav/config/slam.yaml": "slam_toolbox:\n  ros__parameters: {mode: mapping}\n",
        "cart_gazebo/worlds/empty.world": world(""),
        "cart_gazebo/worlds/room.world": world(ROOM),
        "cart_gazebo/worlds/room.wbt": "#VRML_SIM",
    }
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root
