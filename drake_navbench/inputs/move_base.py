"""Parameter files of ROS 1's move_base, which are told and not read."""

from __future__ import annotations

import re
from pathlib import Path

from drake_navbench.typed_files.input_file import read_head_text

MOVE_BASE_FILE = "a file of ROS 1's move_base; expected one of Nav2 (ROS 2)"
# Planners by the names of their blocks, and parameters that move_base and its costmaps alone have.
MARKS = re.compile(
    r"^\s*(?:\w*PlannerROS|base_(?:local|global)_planner|NavfnROS|obstacle_range|raytrace_range|"
    r"oscillation_timeout|planner_patience|controller_patience|recovery_behaviors|static_map)\s*:|"
    # A costmap whose parameters follow its name at once.
    r"^(?:local|global)_costmap\s*:[^\n]*\n\s+(?:\w+_frame|\w+_frequency|rolling_window)\s*:",
    re.MULTILINE,
)


def is_of_move_base(file: Path) -> bool:
    """Tells whether a YAML file has parameters of ROS 1's move_base.

    A Nav2 file has the key `ros__parameters`, which ROS 1 does not know.
    """
    if file.suffix not in (".yaml", ".yml"):
        return False
    text = read_head_text(file)
    return "ros__parameters" not in text and MARKS.search(text) is not None
