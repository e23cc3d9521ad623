"""A repository's Nav2 files and maps, and the arguments that `--package` fills in."""

from __future__ import annotations

from drake_navbench.campaign.package_arguments import with_package
from drake_navbench.commands.run import build_parser

NAV2 = """controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController
      desired_linear_vel: 0.9
local_costmap:
  local_costmap:
    ros__parameters: {robot_base_frame: base_footprint, robot_radius: 0.9}
"""


DWB = """controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath:
      plugin: dwb_core::DWBLocalPlanner
      max_vel_x: 0.3
      max_vel_theta: 4.0
      critics: [BaseObstacle, PathDist, GoalDist]
"""


SMOOTHER = """velocity_smoother:
  ros__parameters:
    max_velocity: [0.5, 0.0, 1.0]
    min_velocity: [-0.5, 0.0, -1.0]
    scale_velocities: false
"""


def filled(*words):
    parser = build_parser()
    return with_package(parser.parse_args(list(words)), parser.get_default("robot"))


def map_files(folder, *names):
    folder.mkdir(parents=True)
    for name in names:
        (folder / f"{name}.pgm").write_bytes(b"P5 2 2 255\n" + bytes(4))
        said = f"image: {name}.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"
        (folder / f"{name}.yaml").write_text(said)
