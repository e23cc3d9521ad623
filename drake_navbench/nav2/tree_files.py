"""Finds the XML file of a behaviour tree from its path in a Nav2 file.

The path is one on the robot. The machine that reads the file may have only a part of its folders.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from drake_navbench.plugins.releases import Release

# Folders, relative to that of the Nav2 file, in which a tree is searched by its name.
FOLDERS = (".", "behavior_trees", "behavior_tree", "bt", "../behavior_trees", "../bt")
# Folders in which a tree is searched by the end of its path: the package lies around the Nav2 file.
PACKAGE_FOLDERS = (".", "..", "../..")
NAV2_TREES = Path("share", "nav2_bt_navigator", "behavior_trees")
# The variable by which ROS names the folders of installed packages.
PREFIXES = "AMENT_PREFIX_PATH"
ROS_FOLDER = Path("/opt/ros")


def tree_beside(folder: Path, named: str) -> Path | None:
    """Returns the first file near a Nav2 file that fits a tree's path in it; None without one.

    folder: folder of the Nav2 file. named: the path in it, as '$(find-pkg-share mine)/trees/a.xml'.
    """
    parts = re.sub(r"\$\([^)]*\)", "", named).strip("/").split("/")
    places = [folder / place / parts[-1] for place in FOLDERS]
    for count in range(2, len(parts) + 1):
        end = Path(*parts[-count:])
        places += [folder / place / end for place in PACKAGE_FOLDERS]
    return next((place for place in places if place.is_file()), None)


def installed_tree(file_name: str, release: Release) -> Path | None:
    """Returns a tree of the Nav2 on this machine; None where it has none of this name."""
    prefixes = [*filter(None, os.environ.get(PREFIXES, "").split(os.pathsep))]
    folders = [*map(Path, prefixes), ROS_FOLDER / release]
    places = [folder / NAV2_TREES / file_name for folder in folders]
    return next((place for place in places if place.is_file()), None)
