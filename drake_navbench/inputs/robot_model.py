"""The model that a robot file names: its outline on the floor, and its mass."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Role, SceneGraph
from pydrake.multibody.plant import MultibodyPlant

from drake_navbench.descriptions.drawing import write_drawing
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.described_robot import DescribedRobot, describe_robot
from drake_navbench.typed_files.model_file import add_models

Array = NDArray[np.float64]

BASE_LINK = "base_link"


class RobotModel(NamedTuple):
    """outline: (K, 2) convex, counter-clockwise, around everything of the robot, seen from above,
    in the frame of its base link, m. mass_kg: of all links together.
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

    That is the file itself, else a drawing of what was read of it.
    """
    path = found.source.path
    is_plain = not found.source.is_expanded and found.base == BASE_LINK
    if is_plain and _can_be_drawn(path):
        return {**found.fields, "model": str(path)}
    try:
        drawing = write_drawing(found.source.model, found.base)
    except OSError:
        return dict(found.fields)
    return {**found.fields, "model": str(drawing)} if _can_be_drawn(drawing) else dict(found.fields)


def _can_be_drawn(path: Path) -> bool:
    """Tells whether Drake reads a file as a model in which there is something to see."""
    # The plant keeps no hold of it: it must live as long.
    scene_graph = SceneGraph()
    plant = MultibodyPlant(0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    try:
        with tempfile.TemporaryDirectory() as scratch:
            add_models(plant, path, Path(scratch), is_drawn=True)
            plant.GetFrameByName(BASE_LINK)
            plant.Finalize()
            return scene_graph.model_inspector().NumGeometriesWithRole(Role.kIllustration) > 0
    # Drake reports a failed check as SystemExit.
    except (InputError, RuntimeError, ValueError, SystemExit):
        return False
