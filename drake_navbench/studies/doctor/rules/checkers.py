"""Rules about the goal checker and the progress checker."""

from __future__ import annotations

import math

from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.quantities import driven_mps
from drake_navbench.studies.doctor.rules.rule import Rule, down, put, up, upgrade
from drake_navbench.studies.doctor.rules.servers import SERVER, step_m
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

# The estimate of a pose at rest wanders by about this much, m; that of a robot whose outline
# reaches less, by its reach at most.
POSE_NOISE_M = 0.06
# A distance that a goal's tolerance and progress may have on a robot of usual size, m.
USUAL_M = 0.2


def _pose_noise_m(f: Facts) -> float:
    return round(POSE_NOISE_M * _smallness(f), 4)


def _usual_m(f: Facts) -> float:
    return round(USUAL_M * _smallness(f), 3)


def _smallness(f: Facts) -> float:
    """Returns the share of usual distances that fits the robot: 1 but for a tiny one."""
    reach_m = f.circumscribed_radius_m if f.has_outline else POSE_NOISE_M
    return min(reach_m / POSE_NOISE_M, 1.0)


def _progress_mps(f: Facts) -> float:
    return f.number("progress_checker.required_movement_radius", 0.5) / max(
        f.number("progress_checker.movement_time_allowance", 10.0), 0.1
    )


def _least_tolerance_m(f: Facts) -> float:
    return max(step_m(f), _pose_noise_m(f))


# A turn that takes this share of the patience leaves too little for what comes before and after.
OF_PATIENCE = 0.6


def _half_turn_s(f: Facts) -> float:
    """Returns the duration of the largest turn on the spot at full speed, s."""
    return math.pi / max(f.number("controller.rotate_to_heading_angular_vel", 2.0), 1e-3)


def _patience_s(f: Facts) -> float:
    return f.number("progress_checker.movement_time_allowance", 10.0)


RULES = (
    Rule(
        "progress-is-noise",
        lambda f: (
            f["progress_checker.required_movement_radius"] is not None
            and f.number("progress_checker.required_movement_radius") < _pose_noise_m(f)
        ),
        lambda f: (
            f"required_movement_radius is {f['progress_checker.required_movement_radius']} "
            f"m: on most robots the estimated pose wanders by about {_pose_noise_m(f):g} m, so a "
            "robot that stands may count as moving"
        ),
        {S.NO_RECOVERY: 1.0, S.GIVES_UP_LATE: 1.0},
        (up("progress_checker.required_movement_radius", _usual_m),),
        f"{SERVER}: simple_progress_checker.cpp",
    ),
    Rule(
        "progress-waits-long",
        lambda f: f.number("progress_checker.movement_time_allowance") > 45.0,
        lambda f: (
            f"movement_time_allowance is {f['progress_checker.movement_time_allowance']} s: "
            "the robot stands this long before a recovery starts"
        ),
        {S.NO_RECOVERY: 0.8, S.GIVES_UP_LATE: 0.9},
        (down("progress_checker.movement_time_allowance", 20.0),),
        f"{SERVER}: simple_progress_checker.cpp",
    ),
    Rule(
        "progress-faster-than-allowed-drive",
        lambda f: (
            f["progress_checker.movement_time_allowance"] is not None
            and (
                _progress_mps(f) > 0.25 * max(f.speed_mps, 0.05)
                or f.number("progress_checker.movement_time_allowance") <= 10.0
            )
        ),
        lambda f: (
            f"the progress checker expects {f['progress_checker.required_movement_radius']} "
            f"m of motion in {f['progress_checker.movement_time_allowance']} s: a robot that "
            "drives slowly, turns or waits moves less and is stopped as stuck"
        ),
        {S.FALSE_ABORT: 1.0, S.GOAL_NOT_REACHED: 0.3},
        (
            up("progress_checker.movement_time_allowance", 20.0),
            down("progress_checker.required_movement_radius"),
        ),
        f"{SERVER}: simple_progress_checker.cpp",
        is_certain=False,
    ),
    Rule(
        "progress-forgets-turns",
        lambda f: (
            str(f["progress_checker.plugin"]).endswith("SimpleProgressChecker")
            and _half_turn_s(f) > OF_PATIENCE * _patience_s(f)
        ),
        lambda f: (
            "SimpleProgressChecker counts turns on the spot as no progress, and half a turn takes "
            f"{_half_turn_s(f):.1f} s; movement_time_allowance is {_patience_s(f):g} s"
        ),
        {S.FALSE_ABORT: 0.9},
        (
            put("progress_checker.plugin", "nav2_controller::PoseProgressChecker"),
            up("progress_checker.movement_time_allowance"),
        ),
        f"{SERVER}: pose_progress_checker.cpp (in Humble from 1.1.7 on)",
    ),
    Rule(
        "goal-smaller-than-a-step",
        lambda f: 0.0 < f.number("goal_checker.xy_goal_tolerance") < _least_tolerance_m(f),
        lambda f: (
            f"xy_goal_tolerance is {f['goal_checker.xy_goal_tolerance']} m: less than "
            + (
                f"the {step_m(f):.2f} m between two commands at {driven_mps(f):g} m/s"
                if step_m(f) > _pose_noise_m(f)
                else f"the {_pose_noise_m(f):g} m by which the estimated pose wanders on most "
                "robots"
            )
        ),
        {
            S.GOAL_OSCILLATION: 1.0,
            S.GOAL_NOT_REACHED: 1.0,
            S.GOAL_OVERSHOOT: 0.5,
            S.SPINS: 0.6,
            S.STALL_BEFORE_GOAL: 0.4,
        },
        (
            up(
                "goal_checker.xy_goal_tolerance",
                lambda f: max(_usual_m(f), round(1.1 * step_m(f) + 0.005, 2)),
            ),
        ),
        f"{SERVER}: simple_goal_checker.cpp",
    ),
    Rule(
        "goal-heading-smaller-than-a-step",
        lambda f: 0.0 < f.number("goal_checker.yaw_goal_tolerance") < 0.07,
        lambda f: (
            f"yaw_goal_tolerance is {f['goal_checker.yaw_goal_tolerance']} rad: on most "
            "robots the estimated heading wanders by about as much"
        ),
        {S.GOAL_OSCILLATION: 0.9, S.GOAL_NOT_REACHED: 0.9, S.SPINS: 0.8, S.GOAL_OVERSHOOT: 0.4},
        (up("goal_checker.yaw_goal_tolerance", 0.2),),
        f"{SERVER}: simple_goal_checker.cpp",
    ),
    Rule(
        "goal-heading-in-degrees",
        lambda f: 2.0 * math.pi < f.number("goal_checker.yaw_goal_tolerance") <= 360.0,
        lambda f: (
            f"yaw_goal_tolerance is {f['goal_checker.yaw_goal_tolerance']} rad, more than a turn: "
            "every heading counts as the goal's, which is no fault unless it was meant in degrees"
        ),
        {S.GOAL_OVERSHOOT: 0.2},
        (
            put(
                "goal_checker.yaw_goal_tolerance",
                lambda f: round(math.radians(f.number("goal_checker.yaw_goal_tolerance")), 3),
            ),
        ),
        f"{SERVER}: simple_goal_checker.cpp",
    ),
    Rule(
        "goal-asked-again-while-turning",
        lambda f: f["goal_checker.stateful"] is False,
        lambda f: (
            "goal_checker.stateful is off: a robot that drifts out of xy_goal_tolerance while it "
            "turns to the goal's heading must drive back"
        ),
        {S.GOAL_OSCILLATION: 1.0, S.GOAL_NOT_REACHED: 0.5, S.SPINS: 0.4},
        (put("goal_checker.stateful", True),),
        f"{SERVER}: simple_goal_checker.cpp",
    ),
    Rule(
        "goal-kept-by-the-checker-alone",
        lambda f: (
            f["goal_checker.stateful"] is True
            and f.release < Release.LYRICAL
            and f.is_kind("rpp", "mppi", "graceful")
        ),
        lambda f: (
            "the goal checker remembers that the goal's position was reached, but the controller "
            "does not remember it and drives to it again"
        ),
        {S.GOAL_OSCILLATION: 0.4},
        (
            up("goal_checker.xy_goal_tolerance"),
            upgrade("lyrical or newer, with navigation2#6071 and #6124"),
        ),
        "navigation2#5166",
        is_certain=False,
    ),
)
