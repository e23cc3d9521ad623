"""The table of a robot's model: a row on each part, and the robot file's fields that it gives."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.inputs.descriptions.body import Body, plain_name
from drake_navbench.inputs.descriptions.drive_kinds import (
    ACKERMANN,
    DIFFERENTIAL,
    OMNIDIRECTIONAL,
    FoundDrive,
)
from drake_navbench.inputs.descriptions.gazebo_sensors import (
    LEAST_PERIOD_S,
    FoundSensor,
    FoundSensors,
    alike,
    sending_to,
)
from drake_navbench.inputs.descriptions.model import Shape
from drake_navbench.inputs.descriptions.model_source import Source
from drake_navbench.inputs.descriptions.resting_joints import Resting
from drake_navbench.inputs.known_base import KnownBase, around_origin
from drake_navbench.kernels.arrays import Array
from drake_navbench.navigation.costmaps.observation_layers import ObstacleLayerParameters
from drake_navbench.typed_files.quantities import MAX_LENGTH_M, MIN_SIZE_M

# The values of a drive that are fields of every base; the other values describe wheels.
LIMITS = (
    "max_linear_velocity_mps",
    "min_linear_velocity_mps",
    "max_linear_acceleration_mps2",
)
TURNING = ("max_angular_velocity_radps", "max_angular_acceleration_radps2")
LATERAL = ("max_lateral_velocity_mps", "max_lateral_acceleration_mps2")
# The largest distance of an axle from the base frame's origin that is rounding, m.
AXLE_TOLERANCE_M = 0.005
# The least distance of the wheels' middle from the base origin that is told, m.
FAR_CENTRE_M = 0.05
DEFAULTS = "the default"
LIDAR_WORDS = re.compile("(?i)lidar|laser|scan")


class ModelTable:
    """The rows of the table, and the fields, that are made of a model."""

    def __init__(self, node: str) -> None:
        self._node = node
        self.rows: list[CheckRow] = []

    def add(self, status: Status, name: str, remark: str = "") -> None:
        """Adds a row."""
        self.rows.append(CheckRow(status, self._node, name, remark))

    def note_base(self, base: str, wanted: str | None, source: Source) -> None:
        """Notes the base link and the arguments of xacro."""
        if source.arguments:
            told = ", ".join(f"{name}={value}" for name, value in source.arguments.items())
            self.add(Status.USED, "xacro arguments", told)
        if wanted is not None and plain_name(base) != wanted:
            self.add(Status.STAND_IN, "base frame", f"no link {wanted}; {base} is taken")
        else:
            self.add(Status.USED, "base frame", base)

    def note_resting(self, resting: Resting) -> None:
        """Notes where the joints of an arm rest."""
        if resting.remark:
            status = Status.USED if resting.is_told else Status.ASSUMED
            self.add(status, "joints", resting.remark)

    def body(self, body: Body, source: Source, known: KnownBase, shown: str) -> dict[str, Any]:
        """Returns the outline; raises InputError where no part of the input gives one."""
        if body.outline is None:
            nothing = "expected links with collision or visual shapes, found none"
            why = "; ".join(dict.fromkeys((*body.left_out, *source.model.remarks))) or nothing
            if known.outline:
                self.add(Status.STAND_IN, "footprint", f"{why}; that of the Nav2 file is taken")
                if known.footprint is None:
                    return known.outline
                return {"footprint": around_origin(np.array(known.footprint)).tolist()}
            raise InputError(
                f"{shown}: no outline found: {why}; give it in a robot file, or by a Nav2 file's "
                "footprint or robot_radius"
            )
        outline = around_origin(body.outline)
        if len(outline) != len(body.outline) or not np.allclose(outline, body.outline):
            self.add(Status.STAND_IN, "footprint", f"made larger: {body.base} lies outside of it")
        unseen = [
            shape.uri for shape in _visuals(source) if shape.kind == "mesh" and not shape.mesh
        ]
        if unseen and body.role == "collisions":
            more = f" and {len(set(unseen)) - 1} more" if len(set(unseen)) > 1 else ""
            remark = f"left out {unseen[0]}{more}, no such file or package; only looks change"
            self.add(Status.OTHER_FORM, "shapes", remark)
        size = body.outline.max(axis=0) - body.outline.min(axis=0)
        what = "collision" if body.role == "collisions" else "visual"
        remark = f"{size[0]:.3g} x {size[1]:.3g} m, hull of the {what} shapes"
        self.add(Status.USED, "footprint", remark)
        return {"footprint": outline.tolist()}

    def mass(self, mass_kg: float) -> dict[str, Any]:
        """Returns the mass, if the model has one."""
        if mass_kg <= 0.0:
            self.add(Status.STAND_IN, "mass", "0 kg in all links; no energy is told")
            return {}
        self.add(Status.USED, "mass", f"{mass_kg:.4g} kg")
        return {"mass_kg": mass_kg}

    def heard(self, scanners: list[FoundSensor], topics: Sequence[str]) -> list[FoundSensor]:
        """Returns the scanners that send to one of these topics or, where none does, all."""
        chosen = sending_to(topics, scanners)
        for other in scanners if chosen else ():
            if other not in chosen:
                remark = f"left out: the Nav2 file's costmaps listen to {', '.join(topics)}"
                if other.topic:
                    remark += f", not to its topic {other.topic}"
                self.add(Status.OTHER_FORM, f"lidar {other.name}", remark)
        return chosen or scanners

    def sensors(self, found: FoundSensors) -> dict[str, Any]:
        """Returns the fields lidar and depth_sensors."""
        fields: dict[str, Any] = {}
        if found.scanners:
            fields["lidar"] = self._scanners(found.scanners)
        elif found.clouds:
            layered = [c for c in found.clouds if not c.is_camera]
            if layered:
                fields["lidar"] = self._scan_of_layers(layered[0])
        clouds: dict[str, Any] = {}
        for sensor in found.clouds:
            name = _unique(sensor.name or "cloud", clouds)
            clouds[name] = sensor.fields
            self.add(Status.USED, f"sensor {sensor.name}", _sight(sensor))
        if clouds:
            fields["depth_sensors"] = clouds
        if found.others:
            self.add(Status.NO_MEANING, ", ".join(dict.fromkeys(found.others)))
        return fields

    def layers(self, lidar: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the field navigation for a lidar that is higher than the default layers look."""
        usual = ObstacleLayerParameters()
        height_m = lidar.get("height_m", 0.0)
        if height_m <= usual.max_obstacle_height:
            return {}
        remark = f"look up to {height_m:.3g} m, where the lidar is; Nav2's default would not see it"
        self.add(Status.OTHER_FORM, "obstacle layers", remark)
        top = {"max_obstacle_height": height_m}
        sources = {
            name: source.model_dump(mode="json", exclude_unset=True) | top
            for name, source in usual.observation_sources.items()
        }
        layer = {**top, "observation_sources": sources}
        return {
            "navigation": {
                costmap: {"obstacle_layer": layer}
                for costmap in ("local_costmap", "global_costmap")
            }
        }

    def lidar_by_link(
        self,
        found: FoundSensor | None,
        cameras: Sequence[FoundSensor],
        arguments: Mapping[str, str],
    ) -> dict[str, Any]:
        """Returns the field lidar of a model that describes none; {} for the default one.

        found: a link with a lidar's name. cameras: depth cameras, the first of which to see level
        scans if there is no such link. arguments: of xacro, one of which may leave the lidar out.
        """
        level = [camera for camera in cameras if camera.sees_level]
        if found is None and level:
            return {"lidar": self._scan_of_camera(level[0])}
        if found is None:
            off = [
                name
                for name, value in arguments.items()
                if LIDAR_WORDS.search(name) and value.lower() in ("false", "0")
            ]
            hint = f"; --set {off[0]}=true may add one" if off else ""
            self.add(Status.STAND_IN, "lidar", f"none described; the default one at the base{hint}")
            return {}
        x, y, yaw = found.fields["pose"]
        place = f"{x:.3g}, {y:.3g}, {found.fields['height_m']:.3g} m up, yaw {yaw:.3g} rad"
        remark = f"none described; the default one where the link {found.name} is: {place}"
        self.add(Status.STAND_IN, "lidar", remark)
        return {"lidar": found.fields}

    def _scanners(self, scanners: Sequence[FoundSensor]) -> dict[str, Any]:
        first, *others = scanners
        fields = dict(first.fields)
        self.add(Status.USED, f"lidar {first.name}", _sight(first))
        if first.remark:
            self.add(Status.OTHER_FORM, f"lidar {first.name}", first.remark)
        for other in others:
            if not alike(first, other):
                remark = f"left out; of another kind than {first.name}: {_sight(other)}"
                self.add(Status.STAND_IN, f"lidar {other.name}", remark)
                continue
            fields.setdefault("further_poses", []).append(other.fields["pose"])
            noise = max(s.get("range_std_m", 0.0) for s in (fields, other.fields))
            fields |= {"range_std_m": noise} if noise else {}
            self.add(Status.USED, f"lidar {other.name}", "another of the same kind")
        return fields

    def _scan_of_layers(self, sensor: FoundSensor) -> dict[str, Any]:
        remark = "has many layers; the planar scan is a level one from where it is"
        self.add(Status.OTHER_FORM, f"lidar {sensor.name}", remark)
        names = ("pose", "height_m", "range_min_m", "range_max_m", "period_s")
        fields = {name: sensor.fields[name] for name in names if name in sensor.fields}
        return fields | {"beam_count": sensor.fields["column_count"]}

    def _scan_of_camera(self, camera: FoundSensor) -> dict[str, Any]:
        remark = (
            f"none described; the depth camera {camera.name} scans level, over "
            f"{math.degrees(camera.fields['horizontal_fov_rad']):.0f} degrees, as "
            "depthimage_to_laserscan does"
        )
        self.add(Status.STAND_IN, "lidar", remark)
        names = ("pose", "height_m", "range_min_m", "range_max_m", "period_s")
        fields = {name: camera.fields[name] for name in names if name in camera.fields}
        span_rad = camera.fields["horizontal_fov_rad"]
        return fields | {
            "angle_span_rad": span_rad,
            "angle_min_rad": -0.5 * span_rad,
            "beam_count": camera.fields["column_count"],
            "period_s": max(fields["period_s"], LEAST_PERIOD_S),
        }

    def note_remark(self, remark: str) -> None:
        """Notes a part that is left out, or a value that a launch file gives xacro."""
        if remark.startswith(("argument ", "environment variable ")):
            self.add(Status.OTHER_FORM, "xacro", remark)
        else:
            self.add(Status.STAND_IN, "shapes", remark)

    def note_turning(self, centre: Array | None, fields: Mapping[str, Any]) -> None:
        """Adds a remark where the model turns about another point than the base frame's origin.

        centre: (2,) m in the base frame, the middle of the driven wheels; None: not known.
        """
        is_car = fields.get("drive", {}).get("type") == ACKERMANN
        if centre is None or is_car or np.hypot(*centre) < FAR_CENTRE_M:
            return
        x, y = np.round(centre, 3) + 0.0
        remark = f"the middle of its wheels is at {x:.3g}, {y:.3g} m; here it turns about 0, 0"
        self.add(Status.STAND_IN, "base frame's origin", remark)

    def note_rolling(self, base: str) -> None:
        """Notes wheels that roll across the base frame's x, along which a robot is commanded."""
        remark = f"roll along y of {base}, where ROS commands along its x; here they roll along x"
        self.add(Status.DOUBTFUL, "wheels", remark)

    def note_held(self, joints: Sequence[str]) -> None:
        """Notes wheels that a plugin is to turn, and that the model fixes."""
        if joints:
            remark = (
                f"{', '.join(joints)}: fixed, so Gazebo's plugin cannot turn them; here they turn"
            )
            self.add(Status.DOUBTFUL, "drive", remark)

    def drive(self, found: FoundDrive, *, is_omni: bool = False) -> dict[str, Any]:
        """Returns the fields drive and actuators.

        is_omni: whether a Nav2 file takes the base for an omnidirectional one.
        """
        values = found.values
        wheels = [
            f"{text} {values[name]:.4g} m"
            for name, text in (("wheel_radius_m", "radius"), ("wheel_separation_m", "separation"))
            if name in values
        ]
        if wheels:
            self.add(Status.USED, "wheels", ", ".join(wheels))
        if found.differs:
            remark = f"{found.source} gives {found.differs}: the base drives and turns otherwise"
            self.add(Status.DOUBTFUL, "wheels", f"{remark} than commanded")
        kind = self._kind_of_drive(found, is_omni=is_omni)
        fields: dict[str, Any] = {}
        if kind in (OMNIDIRECTIONAL, ACKERMANN):
            fields["type"] = kind
        names = LIMITS if kind == ACKERMANN else LIMITS + TURNING
        fields |= {name: values[name] for name in names if name in values}
        if kind == ACKERMANN:
            fields |= {name: values[name] for name in ("wheelbase_m", "min_turning_radius_m")}
            fields |= self._axle(values.get("rear_axle_x_m"))
        if kind == OMNIDIRECTIONAL:
            fields |= {name: values[name] for name in LATERAL if name in values}
        limits = [
            f"{name} {value:.4g}" for name, value in fields.items() if name in names + LATERAL
        ]
        if kind == OMNIDIRECTIONAL and "max_linear_velocity_mps" in values:
            fields.setdefault(LATERAL[0], values["max_linear_velocity_mps"])
        if limits:
            self.add(Status.USED, "limits", ", ".join(limits))
        missing = [name for name in names if name not in fields and name != LIMITS[1]]
        if missing:
            self.add(Status.ASSUMED, ", ".join(missing), DEFAULTS)
        if found.remark:
            self.add(Status.STAND_IN, "limits", found.remark)
        found_fields = {"drive": fields} if fields else {}
        # Wheels that skid are commanded as if they were farther apart.
        separation_m = values.get("wheel_separation_m", 0.0)
        separation_m *= values.get("wheel_separation_multiplier", 1.0)
        if kind == DIFFERENTIAL and MIN_SIZE_M <= separation_m <= MAX_LENGTH_M:
            found_fields["actuators"] = {"wheel_separation_m": separation_m}
        return found_fields

    def _kind_of_drive(self, found: FoundDrive, *, is_omni: bool) -> str:
        """Returns the kind of base that is driven in place of the model's; '' for the default."""
        values, kind = found.values, found.kind
        if kind == ACKERMANN and not {"wheelbase_m", "min_turning_radius_m"} <= values.keys():
            remark = f"{found.source}: without wheelbase and steering limit; a differential base"
            self.add(Status.STAND_IN, "drive", remark)
            kind = DIFFERENTIAL
        elif is_omni and found.may_roll_sideways:
            kind = OMNIDIRECTIONAL
            remark = f"{kind}, as in the Nav2 file: the model has {found.source} only"
            self.add(Status.OTHER_FORM, "drive", remark)
        elif kind:
            turning = ""
            if kind == ACKERMANN:
                turning = (
                    f"; wheelbase {values['wheelbase_m']:.3g} m, least turning radius "
                    f"{values['min_turning_radius_m']:.3g} m"
                )
            status = Status.ASSUMED if found.is_guess else Status.USED
            self.add(status, "drive", f"{kind}, by {found.source}{turning}")
        else:
            self.add(Status.STAND_IN, "drive", "none described; the default differential base")
        return kind

    def _axle(self, ahead_m: float | None) -> dict[str, float]:
        """Returns the field of a rear axle that is not at the base frame's origin; None: untold."""
        if ahead_m is None:
            remark = "not told by the model; the base turns about its frame's origin"
            self.add(Status.STAND_IN, "rear axle", remark)
            return {}
        if abs(ahead_m) < AXLE_TOLERANCE_M:
            return {}
        side = "ahead of" if ahead_m > 0.0 else "behind"
        remark = f"{abs(ahead_m):.3g} m {side} the base frame; the base turns about it"
        self.add(Status.USED, "rear axle", remark)
        return {"rear_axle_x_m": round(ahead_m, 4)}


def _sight(sensor: FoundSensor) -> str:
    """Returns a sensor's pose, range, beams and rate, as a remark."""
    fields = sensor.fields
    # The sum with 0 leaves no -0.
    x, y, yaw = (value + 0.0 for value in fields["pose"])
    place = f"at {x:.3g}, {y:.3g}, {fields['height_m']:.3g} m up"
    turned = f", turned by {yaw:.3g} rad" if abs(yaw) > 1e-3 else ""
    reach = f", {fields['range_max_m']:g} m" if "range_max_m" in fields else ""
    beams = f", {fields['beam_count']} beams" if "beam_count" in fields else ""
    span_rad = fields.get("angle_span_rad", math.tau)
    if beams and span_rad < math.tau:
        beams += f" over {math.degrees(span_rad):.0f} degrees"
    more = f"; {sensor.remark}" if sensor.remark and "beam_count" not in fields else ""
    return f"{place}{turned}{reach}{beams}, {1.0 / fields['period_s']:.3g} Hz{more}"


def _visuals(source: Source) -> list[Shape]:
    return [shape for link in source.model.links.values() for shape in link.visuals]


def _unique(name: str, taken: Mapping[str, Any]) -> str:
    number, unique = 2, name
    while unique in taken:
        unique, number = f"{name}_{number}", number + 1
    return unique
