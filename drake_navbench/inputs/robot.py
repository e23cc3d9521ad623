"""The robot file: outline, drive, sensors and the settings of its navigation stack."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import (
    Field,
    model_validator,
)

from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.actuators import ActuatorSettings
from drake_navbench.inputs.depth_sensor import DepthSensorSettings
from drake_navbench.inputs.descriptions.model_source import is_model_file
from drake_navbench.inputs.drive import DifferentialDrive, Drive, overrides_for
from drake_navbench.inputs.known_base import NOTHING_KNOWN, KnownBase
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.localization import LocalizationSettings
from drake_navbench.inputs.named_files import NamedFiles
from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.inputs.overrides import merged
from drake_navbench.inputs.range_sensor import RangeSensorSettings
from drake_navbench.inputs.required_sensors import Sensors, require_sensors
from drake_navbench.inputs.timing import TimingSettings
from drake_navbench.kernels.footprint import circle_footprint, footprint_radii, pad_footprint
from drake_navbench.typed_files.file_kinds import ROBOT, require_kind
from drake_navbench.typed_files.quantities import (
    Length,
    Mass,
    Size,
)
from drake_navbench.typed_files.typed_yaml import QuietModel, read_yaml, validate

if TYPE_CHECKING:
    from drake_navbench.inputs.running_gear import RunningGear

# The height of a robot whose file gives none, m.
GUESSED_TOP_M = 0.5
# The farthest corner of a robot from its base frame's origin, m: farther ones are millimetres.
FARTHEST_CORNER_M = 50.0
ROBOT_FILES = NamedFiles(kind="robot", package="drake_navbench.models")


class Robot(QuietModel):
    """A robot: its body, drive, sensors and navigation stack."""

    quiet: ClassVar = frozenset({"actuators", "range_sensors", "timing"})

    description: str = Field(
        min_length=1, description="Description of the robot in one line, for --list."
    )
    like: str | None = Field(
        None,
        exclude=True,
        description="Name or file (path from this file) of another robot, whose fields apply "
        "where this file has none.",
    )
    model: str | None = Field(
        None,
        description="SDF, URDF or xacro file: beside this file, or one that comes with the "
        "package. It is shown in the replay and gives footprint and mass where "
        "this file does not.",
    )
    footprint: list[tuple[Length, Length]] | None = Field(
        None,
        min_length=3,
        description="Corners of the footprint in the base frame, x forward, y left [m].",
    )
    robot_radius: Size | None = Field(None, description="Radius of a round robot [m].")
    mass_kg: Mass | None = Field(
        None,
        gt=0.0,
        description="Mass of the robot with its load, for the energy metric and for physics "
        "with wheels [kg].",
    )
    rolling_resistance_ratio: float = Field(
        0.015,
        ge=0.0,
        le=1.0,
        description="Rolling resistance of the wheels, for the energy metric and for casters "
        "that roll.",
    )
    drag_area_m2: float = Field(
        0.0,
        ge=0.0,
        le=100.0,
        description="Frontal area times drag coefficient, for the energy metric [m^2].",
    )
    collision_outline: list[tuple[Length, Length]] | None = Field(
        None,
        min_length=3,
        description="Outline that touches obstacles, where it differs from the footprint in "
        "the costmap [m].",
    )
    directory: str = Field("", exclude=True, description="Folder of the file; set by the loader.")
    drive: Drive = Field(
        default_factory=DifferentialDrive, description="Base of the robot: its drive and limits."
    )
    lidar: LidarSettings = Field(default_factory=LidarSettings)
    depth_sensors: dict[str, DepthSensorSettings] = Field(
        default_factory=dict,
        description="Depth cameras and multi-layer lidars by name; they send PointCloud2 to "
        "costmap layers.",
    )
    range_sensors: dict[str, RangeSensorSettings] = Field(
        default_factory=dict,
        description="Sonars and infrared distance sensors by name, for RangeSensorLayer and "
        "the collision monitor.",
    )
    localization: LocalizationSettings = Field(default_factory=LocalizationSettings)
    actuators: ActuatorSettings = Field(default_factory=ActuatorSettings)
    timing: TimingSettings = Field(default_factory=TimingSettings)
    navigation: NavigationSettings = Field(default_factory=NavigationSettings)

    @model_validator(mode="after")
    def _check(self) -> Robot:
        if (self.footprint is None) == (self.robot_radius is None):
            raise ValueError("expected either footprint or robot_radius, and not both")
        farthest_m = float(np.abs(self.outline).max())
        if farthest_m > FARTHEST_CORNER_M:
            name = "footprint" if self.robot_radius is None else "robot_radius"
            raise ValueError(
                f"{name}: expected metres, at most {FARTHEST_CORNER_M:g}, got {farthest_m:g}"
            )
        for name in ("footprint", "collision_outline"):
            corners = getattr(self, name)
            if corners is not None and not _is_around_origin(corners):
                raise ValueError(
                    f"{name} must be a simple polygon around the base origin (0, 0), got "
                    f"{[list(p) for p in corners]}"
                )
        drive = self.drive
        if isinstance(drive, DifferentialDrive) and drive.has_wheels and self.model is None:
            raise ValueError(
                f"drive.physics: {drive.physics} takes the wheels from a model; expected an "
                "SDF or URDF file in the field model"
            )
        sensors = Sensors(self.lidar, self.depth_sensors, self.range_sensors)
        require_sensors(self.navigation, sensors)
        return self

    @property
    def outline(self) -> NDArray[np.float64]:
        """(K, 2) true outline in the base frame, m: it touches obstacles, and people see it."""
        if self.collision_outline is not None:
            return np.array(self.collision_outline)
        return self.costmap_outline

    @property
    def costmap_outline(self) -> NDArray[np.float64]:
        """(K, 2) outline of the robot for its costmaps, in the base frame, m, without padding."""
        if self.robot_radius is not None:
            return circle_footprint(self.robot_radius)
        return np.array(self.footprint)

    @property
    def padded_outline(self) -> NDArray[np.float64]:
        """(K, 2) outline as the costmap and the controllers see it, m."""
        padding = self.navigation.local_costmap.footprint_padding
        return pad_footprint(self.costmap_outline, padding)

    @property
    def is_circle(self) -> bool:
        """Whether the robot is given by a radius: Nav2 then plans for its centre."""
        return self.robot_radius is not None

    @property
    def model_path(self) -> Path | None:
        """The SDF file, or None where the robot has none."""
        return ROBOT_FILES.beside(self.directory, self.model) if self.model else None

    @property
    def file_hashes(self) -> dict[str, str]:
        """The SHA-256 of each file that a trial with the robot depends on, by path."""
        path = self.model_path
        if path is None or not self.drive.has_wheels:
            return {}
        return {str(path): sha256(path.read_bytes()).hexdigest()}

    def running_gear(self, source: str) -> RunningGear:
        """Returns wheels, casters and weight; source: the name of the robot's file in errors.

        Raises InputError where the model has no such wheels, or the file does not fit it.
        """
        # Imported late: most robots need no running gear.
        from drake_navbench.inputs.descriptions.drawing import is_drawing
        from drake_navbench.inputs.running_gear import running_gear_of

        if not isinstance(self.drive, DifferentialDrive) or self.model_path is None:
            raise TypeError("expected a differential drive with a model")
        if is_drawing(self.model_path):
            raise InputError(
                f"{source}: drive.physics: {self.drive.physics} takes wheels and masses from the "
                "model itself, not from one that is expanded or moved onto the floor for the "
                "replay; expected an SDF or URDF file in the field model"
            )
        return running_gear_of(
            self.model_path,
            self.drive,
            source,
            outline=self.outline,
            mass_kg=self.mass_kg,
            payload_kg=self.actuators.payload_kg,
        )

    @property
    def radii(self) -> tuple[float, float]:
        """Inscribed and circumscribed radius of the padded outline, m."""
        return footprint_radii(self.padded_outline)


def _is_around_origin(corners: Sequence[Sequence[float]]) -> bool:
    polygon = shapely.Polygon(corners)
    return polygon.is_valid and polygon.contains(shapely.Point(0.0, 0.0))


def load_robot(
    name_or_path: str,
    overrides: Mapping[str, Any] | None = None,
    *,
    overrides_source: str = "overrides",
    arguments: Mapping[str, str] | None = None,
    packages: Sequence[Path] = (),
    known: KnownBase = NOTHING_KNOWN,
) -> Robot:
    """Returns a built-in robot by name, or one from a file; `overrides` replace single fields.

    A model in SDF, URDF or xacro is a robot as the model describes it, with defaults for the rest.
    Raises InputError where the name is unknown, or the file or an override is wrong;
    `overrides_source` names the overrides in the error. arguments: arguments of xacro. packages:
    folders searched for ROS packages. known: facts about a model's base from elsewhere.
    """
    if is_model(name_or_path):
        path = Path(name_or_path)
        data: Mapping[str, Any] = _read_model(path, arguments, packages, known)
    else:
        path = ROBOT_FILES.find(name_or_path)
        data = _read_robot(path)
    data = _with_model(data, path)
    folder = _folder_of(path)
    robot = _robot_of(data, str(path), folder)
    if not overrides:
        return robot
    fitting = _fitting(overrides, robot)
    return _robot_of(merged(data, fitting), overrides_source, folder)


def is_model(name_or_path: str) -> bool:
    """Tells whether a robot is given by its model alone."""
    return is_model_file(Path(name_or_path))


def _read_model(
    path: Path,
    arguments: Mapping[str, str] | None = None,
    packages: Sequence[Path] = (),
    known: KnownBase = NOTHING_KNOWN,
) -> dict[str, Any]:
    """Returns the fields of a robot that its model alone describes."""
    # Drake takes a while to load, and most robots do without.
    from drake_navbench.inputs.described_robot import describe_robot
    from drake_navbench.inputs.robot_model import described_fields, warn_of_shapes

    found = describe_robot(path, arguments, packages, known)
    warn_of_shapes(found)
    return described_fields(found)


def _read_robot(path: Path, above: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Returns the fields of a robot file, and of the robots that it names by `like`.

    above: the files that led here by `like`. A model is searched beside the file that names it.
    """
    if is_model(path.name):
        return _read_model(path)
    data = read_yaml(path)
    require_kind(data, ROBOT, path)
    other = data.pop("like", None)
    if other is None:
        return data
    if not isinstance(other, str) or not other:
        raise InputError(f"{path}: like: expected the name or file of a robot, got {other!r}")
    is_name = other in ROBOT_FILES.names
    try:
        found = ROBOT_FILES.find(other if is_name else str(_folder_of(path) / other))
    except InputError as error:
        raise InputError(f"{path}: like: {error}") from error
    if found.resolve() in (file.resolve() for file in (path, *above)):
        raise InputError(f"{path}: like: {other!r} is like this file itself")
    fields = _read_robot(found, (path, *above))
    folder = found.resolve().parent
    if isinstance(fields.get("model"), str) and folder != path.resolve().parent:
        fields["model"] = str(folder / fields["model"])
    return merged(fields, data)


def _with_model(data: Mapping[str, Any], path: Path) -> Mapping[str, Any]:
    """Returns a robot's fields, with outline and mass of its model where the file has none."""
    model = data.get("model")
    gives_outline = any(data.get(name) is not None for name in ("footprint", "robot_radius"))
    if gives_outline or not isinstance(model, str):
        return data
    file = ROBOT_FILES.beside(_folder_of(path), model)
    if not file.is_file():
        raise InputError(f"{path}: model: no such file: {file}")
    # Drake takes a while to load, and most robots do without.
    from drake_navbench.inputs.robot_model import read_robot_model

    found = read_robot_model(file)
    told: dict[str, Any] = {"mass_kg": found.mass_kg}
    if found.mass_kg <= 0.0 and "mass_kg" not in data:
        remark = f"{file}: its links have no mass; give mass_kg in a robot file where it matters"
        warnings.warn(remark, InputWarning, stacklevel=2)
        told = {}
    return told | dict(data) | {"footprint": found.outline.tolist()}


def overridden(robot: Robot, overrides: Mapping[str, Any], source: str) -> Robot:
    """Returns a robot with single fields replaced; source: their name in an InputError."""
    if not overrides:
        return robot
    data = robot.model_dump(mode="json", exclude_unset=True)
    data.pop("directory", None)
    return _robot_of(merged(data, _fitting(overrides, robot)), source, Path(robot.directory))


def _fitting(overrides: Mapping[str, Any], robot: Robot) -> dict[str, Any]:
    """Returns the overrides without those for other kinds of base than the robot's."""
    drive = overrides.get("drive")
    if not isinstance(drive, Mapping):
        return dict(overrides)
    return {**overrides, "drive": overrides_for(robot.drive, drive)}


def _folder_of(path: Path) -> Path:
    """Returns the folder of a file as it is given; of a link the folder of the file behind it."""
    return (path.resolve() if path.is_symlink() else path).parent


def _robot_of(data: Mapping[str, Any], source: str, folder: Path) -> Robot:
    if "directory" in data:
        raise InputError(f"{source}: directory: unknown field; the file's place gives it")
    if "like" in data:
        raise InputError(f"{source}: like: only a robot file may name another robot")
    directory = str(folder.resolve())
    robot = validate(Robot, data, source).model_copy(update={"directory": directory})
    if robot.model and not ROBOT_FILES.beside(folder, robot.model).is_file():
        raise InputError(f"{source}: model: no such file: {folder / robot.model}")
    if robot.drive.has_wheels:
        robot.running_gear(source)
    return robot


def body_top_m(robot: Robot) -> float:
    """Returns a robot's height over the floor, m: that of its model, else a guess."""
    path = robot.model_path
    if path is None:
        return GUESSED_TOP_M
    from drake_navbench.inputs.described_robot import describe_robot

    try:
        return describe_robot(path).height_m
    except InputError:
        return GUESSED_TOP_M
