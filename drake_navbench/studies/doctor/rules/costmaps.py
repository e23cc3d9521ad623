"""Rules about costmaps: outline, layers, window."""

from __future__ import annotations

from drake_navbench.nav2.body import REACHES
from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.new_layer import LAYER
from drake_navbench.studies.doctor.rules.quantities import driven_mps, half_window_m, whole_m
from drake_navbench.studies.doctor.rules.rule import Rule, down, outside, put, up, upgrade
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

CODE = "nav2_costmap_2d"
BLIND = ("inflation", "static", "keepout", "speed", "filter", "denoise")
# The base's deceleration if no velocity smoother of the file limits it, m/s^2.
USUAL_DECELERATION_MPS2 = 1.0
# The check's remark on a layer that listens to no sensor.
WITHOUT_SOURCES = "without observation_sources"
# Parts of the check's remarks for which there are rules.
OF_RULES = (
    "sees nothing", "inscribed radius", "has a radius", "velocity smoother lets through", REACHES,
)  # fmt: skip


def _has_obstacle_layer(f: Facts) -> bool:
    """Tells whether some layer may see obstacles: one that its name does not say to be blind."""
    names = [str(name).lower() for name in f["local_costmap.plugins"] or ()]
    return any(not any(word in name for word in BLIND) for name in names)


def _stop_m(f: Facts) -> float:
    """Returns the reach of the outline, a second of driving and the way to stop, m."""
    decel = abs(f.axis("velocity_smoother.max_decel", 0) or 0.0) or USUAL_DECELERATION_MPS2
    speed = driven_mps(f)
    return f.circumscribed_radius_m + speed * 1.0 + speed**2 / (2.0 * decel)


def _blind_layers(f: Facts) -> list[str]:
    """Returns the layers of the local costmap that listen to no sensor."""
    return [
        place.partition(": ")[2]
        for place, remark in f.doubts.items()
        if place.startswith("local_costmap") and WITHOUT_SOURCES in remark
    ]


def _lacking_outline(f: Facts) -> str:
    if f.raw.get("local_costmap.footprint") in (None, "", "[]"):
        return "the file gives the local costmap neither robot_radius nor footprint"
    return "Nav2 cannot read the local costmap's footprint, and the file gives no robot_radius"


def _lists_layers(f: Facts) -> bool:
    """Tells whether the local costmap is there, and not only some values laid over another file."""
    return "local_costmap.plugins" in f.given


def _doubts(f: Facts) -> list[str]:
    """Returns the doubts of the check for which there is no rule."""
    return [
        place for place, remark in f.doubts.items() if not any(part in remark for part in OF_RULES)
    ]


RULES = (
    Rule(
        "layer-sees-nothing",
        lambda f: _lists_layers(f) and bool(_blind_layers(f)),
        lambda f: (
            f"{', '.join(_blind_layers(f))} of the local costmap has no observation_sources: the "
            "layer listens to no sensor and marks no obstacles"
        ),
        {S.COLLISION: 1.2, S.IGNORES_OBSTACLES: 1.2, S.NEAR_MISS: 0.9},
        (put("local_costmap.observation_sources"),),
        f"{CODE}: obstacle_layer.cpp",
    ),
    Rule(
        "probably-a-mistake",
        lambda f: bool(_doubts(f)),
        lambda f: "; ".join(f"{place}: {f.doubts[place]}" for place in _doubts(f)[:2]),
        {S.COLLISION: 0.2, S.TOO_SLOW: 0.2, S.NO_START: 0.2, S.GOAL_NOT_REACHED: 0.1},
        (put("local_costmap.plugins"),),
        "drake-navbench run --nav2 FILE --check",
        advice="correct what this names, or give --robot the robot that the file is for",
    ),
    Rule(
        "outline-not-given",
        lambda f: f.is_whole and _lists_layers(f) and not f.has_outline,
        lambda f: f"{_lacking_outline(f)}: Nav2 then plans for a round robot of 0.1 m radius",
        {S.COLLISION: 1.0, S.NEAR_MISS: 0.8},
        (put("local_costmap.footprint"), up("local_costmap.robot_radius")),
        f"{CODE}: costmap_2d_ros.cpp",
    ),
    Rule(
        "outline-of-another-robot",
        lambda f: 0.0 < f.number("local_costmap.robot_radius", 1.0) < 0.11,
        lambda f: (
            f"local_costmap.robot_radius is {f['local_costmap.robot_radius']} m: nearly every "
            "robot with a lidar is larger"
        ),
        {S.COLLISION: 1.0, S.NEAR_MISS: 0.8},
        (up("local_costmap.robot_radius"),),
        f"{CODE}; navigation2#669",
        is_certain=False,
    ),
    Rule(
        "marks-farther-than-it-clears",
        lambda f: (
            f["local_costmap.raytrace_max_range"] is not None
            and f.number("local_costmap.obstacle_max_range", 2.5)
            > f.number("local_costmap.raytrace_max_range", 3.0)
        ),
        lambda f: (
            f"obstacle_max_range is {f['local_costmap.obstacle_max_range']} m, more than "
            f"raytrace_max_range {f['local_costmap.raytrace_max_range']} m: obstacles that were "
            "marked between the two ranges are never cleared"
        ),
        {S.GHOST_OBSTACLES: 1.0, S.NO_RECOVERY: 0.4, S.DOOR_STOP: 0.4, S.PLANNER_FAILS: 0.4},
        (
            up(
                "local_costmap.raytrace_max_range",
                lambda f: f.number("local_costmap.obstacle_max_range", 2.5),
            ),
        ),
        f"{CODE}: obstacle_layer.cpp",
    ),
    Rule(
        "clears-farther-than-it-marks",
        lambda f: (
            f["local_costmap.raytrace_max_range"] is not None
            and f.number("local_costmap.raytrace_max_range", 3.0)
            > f.number("local_costmap.obstacle_max_range", 2.5)
            and f.release < Release.LYRICAL
        ),
        lambda f: (
            f"obstacle_max_range is {f['local_costmap.obstacle_max_range']} m, less than "
            f"raytrace_max_range {f['local_costmap.raytrace_max_range']} m: in this release "
            "a beam that hits something between the two clears the cell that it hits"
        ),
        {S.COLLISION: 0.45, S.IGNORES_OBSTACLES: 0.9},
        (
            put("local_costmap.raytrace_max_range"),
            upgrade("a release with navigation2#5697"),
        ),
        "navigation2#5476",
        is_certain=False,
    ),
    Rule(
        "seldom-updated",
        lambda f: 0.0 < f.number("local_costmap.update_frequency", 5.0) < 3.0,
        lambda f: (
            f"local_costmap.update_frequency is {f['local_costmap.update_frequency']} Hz: "
            "moving obstacles reach the local costmap late"
        ),
        {S.COLLISION: 0.7, S.IGNORES_OBSTACLES: 0.6, S.GHOST_OBSTACLES: 0.4, S.FALSE_ABORT: 0.3},
        (up("local_costmap.update_frequency", 5.0),),
        CODE,
    ),
    Rule(
        "coarse-cells",
        lambda f: f.number("local_costmap.resolution", 0.05) > 0.075,
        lambda f: (
            f"local_costmap.resolution is {f['local_costmap.resolution']} m: cells this "
            "large close a door on both sides"
        ),
        {S.DOOR_STOP: 0.8, S.WOBBLE_STRAIGHT: 0.1},
        (down("local_costmap.resolution", 0.05),),
        CODE,
        is_certain=False,
    ),
    Rule(
        "fine-cells",
        lambda f: 0.0 < f.number("local_costmap.resolution", 0.05) < 0.025,
        lambda f: (
            f"local_costmap.resolution is {f['local_costmap.resolution']} m: updating so "
            "many cells takes time"
        ),
        {S.LATE_CYCLES: 0.7},
        (up("local_costmap.resolution", 0.05),),
        CODE,
        is_certain=False,
    ),
    Rule(
        "large-window",
        lambda f: half_window_m(f) < 1e8 and half_window_m(f) > 5.0,
        lambda f: (
            f"the local costmap reaches {half_window_m(f):.0f} m to each side: updating it "
            "takes time"
        ),
        {S.LATE_CYCLES: 0.5},
        (down("local_costmap.width"),),
        CODE,
        is_certain=False,
    ),
    Rule(
        "window-ends-before-the-stop",
        lambda f: half_window_m(f) < _stop_m(f),
        lambda f: (
            f"the local costmap reaches {half_window_m(f):.1f} m from the robot's centre, "
            f"but from {driven_mps(f):g} m/s and with 1 s of delay the robot's front stops "
            f"only after {_stop_m(f):.1f} m"
        ),
        {S.COLLISION: 0.7, S.TOO_SLOW: 0.6, S.STOP_START_JERK: 0.3},
        (up("local_costmap.width", lambda f: whole_m(2.0 * _stop_m(f))),),
        CODE,
    ),
    Rule(
        "no-obstacle-layer",
        lambda f: (
            f.is_whole
            and bool(f["local_costmap.plugins"])
            and not _has_obstacle_layer(f)
            and not _blind_layers(f)
        ),
        lambda f: (
            f"local_costmap.plugins is {f['local_costmap.plugins']}: it lists no layer that "
            "marks obstacles"
        ),
        {S.COLLISION: 1.0, S.IGNORES_OBSTACLES: 1.0, S.NEAR_MISS: 0.8},
        (put("local_costmap.plugins", LAYER),),
        CODE,
    ),
    Rule(
        "window-stands-still",
        lambda f: f["local_costmap.rolling_window"] is False,
        lambda f: "local_costmap.rolling_window is off: the robot drives out of the local costmap",
        {S.COLLISION: 0.8, S.FALSE_ABORT: 0.6, S.IGNORES_OBSTACLES: 0.6},
        (put("local_costmap.rolling_window", True),),
        CODE,
    ),
    Rule(
        "band-of-heights-misses",
        lambda f: (
            # Of a source that gives none another rule tells.
            "local_costmap.max_obstacle_height" in f.given
            and f.number("local_costmap.max_obstacle_height", 2.0) < 0.3
        ),
        lambda f: (
            f"max_obstacle_height is {f['local_costmap.max_obstacle_height']} m: the local "
            "costmap drops every point of a sensor above this height"
        ),
        {S.IGNORES_OBSTACLES: 1.0, S.COLLISION: 0.8},
        (up("local_costmap.max_obstacle_height", 2.0),),
        f"{CODE}: observation_buffer.cpp",
    ),
    Rule(
        "floor-is-marked",
        lambda f: f.number("local_costmap.min_obstacle_height") < -0.05,
        lambda f: (
            f"min_obstacle_height is {f['local_costmap.min_obstacle_height']} m: the layer "
            "marks points of the floor as obstacles"
        ),
        {S.GHOST_OBSTACLES: 0.9, S.DOOR_STOP: 0.2, S.STOP_START_JERK: 0.2},
        (up("local_costmap.min_obstacle_height", 0.05),),
        f"{CODE}: observation_buffer.cpp",
        is_certain=False,
    ),
    Rule(
        "voxels-below-the-band",
        lambda f: (
            f.number("local_costmap.z_voxels", 10) * f.number("local_costmap.z_resolution", 0.2)
            < 0.9 * f.number("local_costmap.max_obstacle_height", 0.0)
            and "local_costmap.z_voxels" in f.given
        ),
        lambda f: (
            "z_voxels times z_resolution is less than max_obstacle_height: the voxel layer "
            "does not mark obstacles between these two heights"
        ),
        {S.IGNORES_OBSTACLES: 0.7, S.COLLISION: 0.4},
        (up("local_costmap.z_voxels", 16), up("local_costmap.z_resolution")),
        f"{CODE}: voxel_layer.cpp",
        is_certain=False,
    ),
    Rule(
        "old-marks-kept",
        lambda f: f.number("local_costmap.observation_persistence") > 1.0,
        lambda f: (
            f"observation_persistence is {f['local_costmap.observation_persistence']} s: an "
            "obstacle that has moved away stays in the local costmap this long"
        ),
        {S.GHOST_OBSTACLES: 1.0, S.DOOR_STOP: 0.5, S.NO_RECOVERY: 0.3},
        (down("local_costmap.observation_persistence", 0.0),),
        f"{CODE}: observation_buffer.cpp",
    ),
    Rule(
        "beams-to-nothing-do-not-clear",
        lambda f: (
            f["local_costmap.inf_is_valid"] is False and "local_costmap.inf_is_valid" in f.given
        ),
        lambda f: "inf_is_valid is off: a beam that hits nothing does not clear obstacles",
        {S.GHOST_OBSTACLES: 0.5},
        (put("local_costmap.inf_is_valid", True),),
        f"{CODE}: obstacle_layer.cpp",
        is_certain=False,
    ),
    Rule(
        "robot-sees-itself",
        # In a static layer another default holds, which does no harm.
        lambda f: (
            f["local_costmap.footprint_clearing_enabled"] is False
            and "local_costmap.footprint_clearing_enabled" in f.given
        ),
        lambda f: (
            "footprint_clearing_enabled is off: cells that the robot's own body marked are not "
            "cleared"
        ),
        {S.NO_START: 0.7, S.GHOST_OBSTACLES: 0.6, S.NO_RECOVERY: 0.4},
        (put("local_costmap.footprint_clearing_enabled", True),),
        f"{CODE}: obstacle_layer.cpp",
    ),
    Rule(
        "frames-differ",
        lambda f: (
            len(
                {
                    str(value)
                    for place, value in f.values.items()
                    if place.endswith(".robot_base_frame")
                }
            )
            > 1
        ),
        lambda f: (
            "robot_base_frame differs between nodes: "
            + ", ".join(
                sorted({str(v) for p, v in f.values.items() if p.endswith(".robot_base_frame")})
            )
        ),
        {S.GOAL_NOT_REACHED: 0.3, S.NO_START: 0.3, S.GOAL_OSCILLATION: 0.2},
        (outside("frames"),),
        CODE,
        is_certain=False,
    ),
)
