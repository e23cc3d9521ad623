"""Lidars and depth cameras of a model, as Gazebo's elements describe them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple
from xml.etree import ElementTree

from drake_navbench.inputs.descriptions.model import Model, Sensor
from drake_navbench.inputs.descriptions.poses import inverse, number, yaw_of
from drake_navbench.inputs.descriptions.xml_file import text_of
from drake_navbench.kernels.arrays import Array

# Words in names of links that hold a sensor.
HOLDERS = re.compile("rod|mount|bracket|hold|support|plate|pole|post|cover")
# Words in names of links that stand for a lidar where no sensor is described.
LIDAR_LINK = re.compile(
    r"(?:^|_)(?:(?:rp?|yd)?lidar|laser|base_scan|scan|hokuyo|livox|ouster|velodyne|sick)(?:_|\d|$)"
)
LIDARS = ("ray", "gpu_ray", "lidar", "gpu_lidar")
DEPTH_CAMERAS = ("depth", "depth_camera", "rgbd_camera", "rgbd")
# Gazebo's defaults for a lidar or camera, m and Hz.
DEFAULT_RATE_HZ = 10.0
FARTHEST_M = 200.0
# The least time between scans, s: no controller looks more often, and a trial keeps each scan.
LEAST_PERIOD_S = 0.05
# A sensor with a narrower view is no scanner.
LEAST_REACH_M, LEAST_BEAMS = 1.0, 16
MAX_BEAMS = 100_000
# The rays of a depth camera: enough for costmaps, fewer than pixels.
MAX_COLUMNS, MAX_ROWS = 96, 32
MAX_LAYER_COLUMNS, MAX_LAYERS = 360, 128
STEEPEST_RAD = math.radians(88.0)
# A beam that leaves the level by more than this meets the floor before anything else.
LEVEL_RAD = math.radians(10.0)


class FoundSensor(NamedTuple):
    """A sensor as fields of a robot file; name: as in the model. remark: a difference, or ''.

    topic: its topic, '' where the model does not tell. is_camera: whether it is a depth camera.
    """

    name: str
    fields: dict[str, Any]
    remark: str = ""
    topic: str = ""
    is_camera: bool = False

    @property
    def sees_level(self) -> bool:
        """Tells whether a depth sensor sees what is as high as it is."""
        return abs(self.fields["pitch_rad"]) < 0.5 * self.fields["vertical_fov_rad"]


class FoundSensors(NamedTuple):
    """The sensors of a model by kind.

    scanners: planar lidars. clouds: depth cameras and lidars of many layers. others: all other
    sensors.
    """

    scanners: list[FoundSensor]
    clouds: list[FoundSensor]
    others: list[str]


def sensors_of(model: Model, to_base: Array, floor_m: float) -> FoundSensors:
    """Returns a model's sensors; to_base: (4, 4). floor_m: the floor's height in the base frame."""
    found = FoundSensors([], [], [])
    for sensor in model.sensors:
        pose = to_base @ sensor.pose
        if sensor.kind in LIDARS and _is_proximity(sensor):
            found.others.append(f"{sensor.name} (proximity)")
        elif sensor.kind in LIDARS:
            if _layers(sensor) > 1:
                found.clouds.append(_layered(sensor, pose, floor_m))
            else:
                found.scanners.append(_scanner(sensor, pose, floor_m))
        elif sensor.kind in DEPTH_CAMERAS or _is_depth_plugin(sensor):
            found.clouds.append(_depth_camera(sensor, pose, floor_m))
        elif sensor.kind:
            found.others.append(f"{sensor.name} ({sensor.kind})")
    return found


def lidar_link(model: Model, base: str, floor_m: float) -> FoundSensor | None:
    """Returns the pose of the first link with a lidar's name; None where no link has one.

    In a chain of links, such as mount and laser, the last one counts; a rod of a lidar counts where
    no link is called like the lidar itself.
    """
    all_named = [name for name in model.links if LIDAR_LINK.search(name.lower())]
    named = [name for name in all_named if not HOLDERS.search(name.lower())] or all_named
    if not named:
        return None
    ends = {joint.parent for joint in model.joints}
    link = next((name for name in named if name not in ends), named[0])
    pose = inverse(model.links[base].pose) @ model.links[link].pose
    return FoundSensor(link, _place(pose, floor_m))


def sending_to(topics: Sequence[str], scanners: Sequence[FoundSensor]) -> list[FoundSensor]:
    """Returns the scanners that send to topics, whatever namespaces stand before theirs.

    For /robot1/rear/scan, one that sends to rear/scan counts, and one that sends to scan does not.
    """
    chosen = []
    for topic in topics:
        whole = f"/{topic.strip('/')}"
        fits = [s for s in scanners if s.topic and whole.endswith(f"/{s.topic.strip('/')}")]
        most = max((s.topic.strip("/").count("/") for s in fits), default=0)
        chosen += [s for s in fits if s.topic.strip("/").count("/") == most]
    return [scanner for scanner in scanners if scanner in chosen]


def _is_proximity(sensor: Sensor) -> bool:
    """Tells whether a ray sensor is one for cliffs or bumps, with a short reach or few beams."""
    reach_m = number(text_of(_block(sensor), "range/max"))
    beams = number(text_of(_block(sensor), "scan/horizontal/samples"))
    is_short = reach_m is not None and reach_m < LEAST_REACH_M
    return is_short or (beams is not None and beams < LEAST_BEAMS)


def _is_depth_plugin(sensor: Sensor) -> bool:
    names = (plugin.get("filename", "") for plugin in sensor.element.findall("plugin"))
    return any("kinect" in name or "depth" in name for name in names)


def _block(sensor: Sensor) -> ElementTree.Element:
    """Returns the element that describes a lidar."""
    for name in ("lidar", "ray"):
        block = sensor.element.find(name)
        if block is not None:
            return block
    return sensor.element


def _topic(sensor: Sensor) -> str:
    """Returns the topic of a sensor, by its own element or by the plugin of classic Gazebo."""
    for place in ("topic", "plugin/topicName", "plugin/topic"):
        if told := text_of(sensor.element, place):
            return told
    remapped = (element.text or "" for element in sensor.element.iter("remapping"))
    return next((text.partition(":=")[2].strip() for text in remapped if "out:=" in text), "")


def _layers(sensor: Sensor) -> int:
    return int(number(text_of(_block(sensor), "scan/vertical/samples")) or 1)


def _period_s(sensor: Sensor) -> float:
    rate = number(text_of(sensor.element, "update_rate")) or DEFAULT_RATE_HZ
    return round(min(max(1.0 / rate, 1e-3), 3600.0), 6) if rate > 0.0 else 1.0 / DEFAULT_RATE_HZ


def _ranges(low: float | None, high: float | None) -> dict[str, float]:
    fields = {}
    if high is not None and high > 0.0:
        fields["range_max_m"] = min(high, FARTHEST_M)
    if low is not None and 0.0 <= low < fields.get("range_max_m", math.inf):
        fields["range_min_m"] = low
    return fields


def _is_tilted(pose: Array) -> bool:
    """Tells whether a sensor's x axis leaves the level by more than LEVEL_RAD."""
    return math.asin(min(abs(float(pose[2, 0])), 1.0)) > LEVEL_RAD


def _place(pose: Array, floor_m: float) -> dict[str, Any]:
    x, y, z = (float(value) for value in pose[:3, 3])
    return {
        "pose": [round(x, 4), round(y, 4), round(yaw_of(pose), 5)],
        "height_m": round(max(z - floor_m, 0.0), 4),
    }


def _scanner(sensor: Sensor, pose: Array, floor_m: float) -> FoundSensor:
    block = _block(sensor)

    def told(path: str) -> float | None:
        return number(text_of(block, path))

    low, high = told("scan/horizontal/min_angle"), told("scan/horizontal/max_angle")
    low, high = -math.pi if low is None else low, math.pi if high is None else high
    # Gazebo also scans from the larger angle to the smaller one.
    low, high = min(low, high), max(low, high)
    remark = "tilted; here it scans level" if _is_tilted(pose) else ""
    if pose[2, 2] < 0.0:
        low, high, remark = -high, -low, "hangs upside down: its angles count the other way"
    fields = _place(pose, floor_m) | _ranges(told("range/min"), told("range/max"))
    span = min(high - low, 2.0 * math.pi)
    if span > 0.0:
        # At a full turn the last beam equals the first one, whatever the rounding of pi.
        full = span > 2.0 * math.pi - 0.02
        fields["angle_span_rad"] = 2.0 * math.pi if full else round(span, 6)
        first = (low + math.pi) % (2.0 * math.pi) - math.pi
        fields["angle_min_rad"] = -math.pi if full and low < -3.1 else round(first, 6)
    beams = told("scan/horizontal/samples")
    if beams is not None and 1 <= beams <= MAX_BEAMS:
        # Gazebo interpolates to resolution times as many ranges.
        ranges = beams * (told("scan/horizontal/resolution") or 1.0)
        fields["beam_count"] = int(ranges if 1 <= ranges <= MAX_BEAMS else beams)
    spread = told("noise/stddev")
    if spread is None:
        spread = number(text_of(sensor.element, "noise/stddev"))
    if spread is not None and spread >= 0.0:
        fields["range_std_m"] = spread
    period_s = _period_s(sensor)
    if period_s < LEAST_PERIOD_S:
        rates = f"{1.0 / period_s:.3g} Hz, here {1.0 / LEAST_PERIOD_S:g} Hz"
        remark = f"{remark}; {rates}" if remark else rates
    fields["period_s"] = max(period_s, LEAST_PERIOD_S)
    return FoundSensor(sensor.name, fields, remark, _topic(sensor))


def _layered(sensor: Sensor, pose: Array, floor_m: float) -> FoundSensor:
    block = _block(sensor)

    def told(path: str, default: float) -> float:
        value = number(text_of(block, path))
        return default if value is None else value

    low, high = told("scan/vertical/min_angle", -0.26), told("scan/vertical/max_angle", 0.26)
    remarks = ["tilted; here it stands level"] if _is_tilted(pose) else []
    if pose[2, 2] < 0.0:
        low, high, remarks = -high, -low, ["hangs upside down: its upper layers look down"]
    left = told("scan/horizontal/max_angle", math.pi)
    right = told("scan/horizontal/min_angle", -math.pi)
    span = min(max(left - right, 0.01), 2.0 * math.pi)
    columns = int(told("scan/horizontal/samples", 360.0))
    ranges = (number(text_of(block, "range/min")), number(text_of(block, "range/max")))
    # The axis of a depth sensor points to the middle of its layers.
    pitch = _clamped(-0.5 * (low + high), STEEPEST_RAD)
    fields = _place(pose, floor_m) | _ranges(*ranges)
    fields |= {
        "pitch_rad": round(pitch, 5),
        "horizontal_fov_rad": 2.0 * math.pi if span > 2.0 * math.pi - 0.02 else round(span, 6),
        "vertical_fov_rad": _vertical(high - low, pitch),
        "column_count": min(max(columns, 1), MAX_LAYER_COLUMNS),
        "row_count": min(_layers(sensor), MAX_LAYERS),
        "period_s": _period_s(sensor),
    }
    if columns > MAX_LAYER_COLUMNS:
        remarks.append(f"{columns} columns, here {MAX_LAYER_COLUMNS}")
    return FoundSensor(sensor.name, fields, "; ".join(remarks))


def _depth_camera(sensor: Sensor, pose: Array, floor_m: float) -> FoundSensor:
    camera = sensor.element.find("camera")
    depth = sensor.element.find("camera/depth_camera")

    def told(path: str, default: float) -> float:
        value = number(text_of(camera, path))
        return default if value is None or value <= 0.0 else value

    across = min(told("horizontal_fov", 1.047), 2.0 * STEEPEST_RAD)
    width, height = told("image/width", 320.0), told("image/height", 240.0)
    vertical = 2.0 * math.atan(math.tan(0.5 * across) * height / width)
    pitch = math.asin(_clamped(-float(pose[2, 0]), 1.0))
    near, far = (
        number(text_of(depth, f"clip/{end}")) or number(text_of(camera, f"clip/{end}"))
        for end in ("near", "far")
    )
    remark = f"{width:g} x {height:g} pixels, here {MAX_COLUMNS} x {MAX_ROWS} rays"
    if abs(pitch) > STEEPEST_RAD - 0.1:
        remark = "looks straight up or down; here a little less"
        pitch = _clamped(pitch, STEEPEST_RAD - 0.1)
    fields = _place(pose, floor_m) | _ranges(near, far)
    fields |= {
        "pitch_rad": round(pitch, 5),
        "horizontal_fov_rad": round(across, 5),
        "vertical_fov_rad": _vertical(vertical, pitch),
        "column_count": int(min(width, MAX_COLUMNS)),
        "row_count": int(min(height, MAX_ROWS)),
        "period_s": _period_s(sensor),
    }
    return FoundSensor(sensor.name, fields, remark, is_camera=True)


def _vertical(span: float, pitch: float) -> float:
    """Returns a vertical field of view in which no ray points straight up or down."""
    return round(min(max(span, 0.0), 2.0 * (STEEPEST_RAD - abs(pitch))), 5)


def _clamped(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)


def alike(one: FoundSensor, other: FoundSensor) -> bool:
    """Tells whether two scanners differ in their places and their noise alone."""
    own = ("pose", "height_m", "range_std_m")
    first, second = ({k: v for k, v in s.fields.items() if k not in own} for s in (one, other))
    return first == second
