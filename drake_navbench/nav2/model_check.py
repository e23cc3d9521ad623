"""Checks a Nav2 file against the robot's model: contradictions point to users' errors."""

from __future__ import annotations

import shapely

from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.inputs.described_robot import DescribedRobot
from drake_navbench.nav2.nav2_setup import Nav2Setup

# The largest distance by which the costmap's outline may reach beyond the body, m.
TOO_LARGE_M = 0.15
# A smaller excess of a speed over the limit is rounding, m/s and rad/s.
SPEED_TOLERANCE = 0.01


def contradictions(setup: Nav2Setup, described: DescribedRobot) -> list[CheckRow]:
    """Returns a row for each property in which the Nav2 files and the model differ."""
    node = f"Nav2 file and model {described.source.path.name}"
    told = [*_outline(setup, described), *_speeds(setup, described), *_ranges(setup, described)]
    told += _smoother(setup)
    return [CheckRow(Status.DOUBTFUL, node, name, remark) for name, remark in told]


def _outline(setup: Nav2Setup, described: DescribedRobot) -> list[tuple[str, str]]:
    """Returns a remark on an outline that is too large; `note_body` reports too small ones."""
    if not described.tells_outline:
        return []
    body = shapely.Polygon(described.fields["footprint"])
    padded = shapely.Polygon(setup.robot.padded_outline)
    larger_m = max(body.distance(shapely.Point(p)) for p in padded.exterior.coords)
    if larger_m > TOO_LARGE_M:
        remark = (
            f"the costmap's padded outline reaches {larger_m:.2g} m beyond the body: gaps that the "
            "robot fits through are closed to it"
        )
        return [("footprint", remark)]
    return []


def _speeds(setup: Nav2Setup, described: DescribedRobot) -> list[tuple[str, str]]:
    limits = described.fields.get("drive", {})
    told = []
    for plugin, preset in setup.controllers.items():
        speeds = preset.parameters.asked_speeds()
        for name, value, limit in (
            ("linear speed", speeds.max_linear_mps, limits.get("max_linear_velocity_mps")),
            ("turning speed", speeds.max_angular_radps, limits.get("max_angular_velocity_radps")),
        ):
            if limit is not None and value is not None and value > limit + SPEED_TOLERANCE:
                unit = "m/s" if name == "linear speed" else "rad/s"
                remark = f"asks for up to {value:.3g} {unit}, the model allows {limit:.3g} {unit}"
                told.append((f"{plugin}: {name}", remark))
    return told


def _smoother(setup: Nav2Setup) -> list[tuple[str, str]]:
    """Returns a remark where the velocity smoother cuts the turns that a controller counts on.

    Each axis has its own limit unless the smoother scales: the base then drives a wider arc than
    planned.
    """
    smoother = setup.robot.navigation.velocity_smoother
    if smoother is None or smoother.scale_velocities:
        return []
    most = smoother.max_velocity[2]
    told = []
    for plugin, preset in setup.controllers.items():
        speeds = preset.parameters.asked_speeds().max_angular_radps
        if speeds is not None and speeds > most + SPEED_TOLERANCE:
            remark = (
                f"{plugin} turns with up to {speeds:.3g} rad/s, the velocity smoother lets "
                f"{most:.3g} rad/s pass: arcs are wider than the controller has checked"
            )
            told.append(("velocity_smoother.max_velocity", remark))
    return told


def _ranges(setup: Nav2Setup, described: DescribedRobot) -> list[tuple[str, str]]:
    reach_m = described.fields.get("lidar", {}).get("range_max_m")
    if reach_m is None:
        return []
    told = []
    for costmap in ("local_costmap", "global_costmap"):
        settings = getattr(setup.robot.navigation, costmap)
        for layer in settings.plugins:
            sources = getattr(settings.block(layer), "observation_sources", {})
            for source in sources.values():
                most_m = getattr(source, "obstacle_max_range", 0.0)
                if source.data_type == "LaserScan" and most_m > reach_m:
                    remark = f"{most_m:g} m, the model's lidar sees {reach_m:g} m"
                    told.append((f"{costmap}.{layer}.obstacle_max_range", remark))
    return told
