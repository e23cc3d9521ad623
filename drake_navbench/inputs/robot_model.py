"""The model that a robot file names: its outline on the floor, and its mass."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drake_navbench.errors import CannotBeWritten, InputWarning
from drake_navbench.inputs.described_robot import DescribedRobot, describe_robot
from drake_navbench.inputs.descriptions.body import base_of
from drake_navbench.inputs.descriptions.drawing import write_drawing
from drake_navbench.kernels.arrays import Array

# A base frame nearer to the floor than this is on it, m.
FLAT_M = 1e-3


class RobotModel(NamedTuple):
    """The outline and the mass of a model.

    outline: (K, 2) m, convex, counter-clockwise, around the whole robot as seen from above, in the
    frame of its base link. mass_kg: mass of all links together.
    """

    outline: Array
    mass_kg: float


def read_robot_model(path: Path) -> RobotModel:
    """Returns outline and mass of the first model in an SDF, URDF or xacro file.

    The outline is that of its collision shapes, or of its visual ones where it has none, with all
    joints at zero. Shapes that cannot be read are left out with an InputWarning. Raises InputError
    where the file cannot be parsed, or no shape has an outline.
    """
    found = describe_robot(path)
    warn_of_shapes(found)
    return RobotModel(np.array(found.fields["footprint"]), found.source.model.mass_kg)


def warn_of_shapes(found: DescribedRobot) -> None:
    """Warns of the shapes of a model that were left out."""
    for row in found.check.rows:
        if row.parameter == "shapes":
            warnings.warn(f"{found.source.path}: {row.remark}", InputWarning, stacklevel=3)


def described_fields(found: DescribedRobot) -> dict[str, Any]:
    """Returns the fields of a robot file, with a model that the replay can draw.

    The model is the file itself where it is read without arguments, folders and another base frame,
    and its base frame is on the floor; else a drawing of the parts that were read.
    """
    source = found.source
    shown = [shape for link in source.model.links.values() for shape in link.shown]
    if not shown:
        return dict(found.fields)
    is_plain = not (source.is_expanded or source.packages.is_told_folders)
    is_on_floor = abs(found.floor_m) < FLAT_M
    if is_plain and is_on_floor and found.base == base_of(source.model):
        return {**found.fields, "model": str(source.path)}
    try:
        return {
            **found.fields,
            "model": str(write_drawing(source.model, found.base, found.floor_m)),
        }
    except CannotBeWritten:
        return dict(found.fields)
