"""Rules about the carrot and the speeds of Regulated Pure Pursuit and its kin."""

from __future__ import annotations

from collections.abc import Callable

from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.quantities import half_window_m, whole_m
from drake_navbench.studies.doctor.rules.rule import Rule, down, put, up
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

RPP = ("rpp",)
PURSUIT = ("rpp", "vector_pursuit")
CODE = "nav2_regulated_pure_pursuit_controller"
# With a carrot nearer than this many seconds of driving, a lagging base swings.
LEAST_LOOKAHEAD_S = 0.9
# Carrots farther than this leave the path in any bend of a house, m.
FAR_M = 1.2
# The deceleration of a gentle approach, m/s^2.
GENTLE_MPS2 = 0.3


def lookahead_m(f: Facts) -> float:
    """Returns the distance of the carrot at full speed, m."""
    if f.controller("use_velocity_scaled_lookahead_dist") is not True:
        return f.number("controller.lookahead_dist", 0.6)
    scaled = f.speed_mps * f.number("controller.lookahead_time", 1.5)
    least = f.number("controller.min_lookahead_dist", 0.3)
    return min(max(scaled, least), f.number("controller.max_lookahead_dist", 0.9))


def _names_of_lookahead(f: Facts) -> str:
    is_scaled = f.controller("use_velocity_scaled_lookahead_dist") is True
    return "lookahead_time, min and max_lookahead_dist" if is_scaled else "lookahead_dist"


def _projection_m(f: Facts) -> float:
    return f.speed_mps * f.number("controller.max_allowed_time_to_collision_up_to_carrot", 1.0)


def gentle_approach_m(f: Facts) -> float:
    """Returns the way in which a robot slows down by GENTLE_MPS2, at least 0.8 s of driving, m."""
    return max(0.8 * f.speed_mps, f.speed_mps**2 / (2.0 * GENTLE_MPS2))


def _other_decay(
    name: str,
    is_other: Callable[[float, float], bool],
    meaning: str,
    symptoms: dict[Symptom, float],
) -> Rule:
    """Returns a rule on a controller that computes distances by another decay than the costmap's.

    is_other: tells by the controller's and the costmap's factor whether the rule fires.
    """
    own, costmap = "controller.inflation_cost_scaling_factor", "local_costmap.cost_scaling_factor"
    return Rule(
        name,
        lambda f: (
            f.controller("use_cost_regulated_linear_velocity_scaling") is True
            and f[costmap] is not None
            and is_other(f.number(own, 3.0), f.number(costmap, 3.0))
        ),
        lambda f: (
            f"inflation_cost_scaling_factor is {f.number(own, 3.0):g}, but cost_scaling_factor of "
            f"the local costmap is {f[costmap]}: the controller {meaning}"
        ),
        symptoms,
        (put("inflation_cost_scaling_factor"),),
        f"{CODE}, README",
        PURSUIT,
    )


RULES = (
    Rule(
        "pursuit-near-carrot",
        lambda f: lookahead_m(f) < LEAST_LOOKAHEAD_S * f.speed_mps,
        lambda f: (
            f"by {_names_of_lookahead(f)} the carrot is, at {f.speed_mps:g} m/s, "
            f"{lookahead_m(f):.2f} m ahead, less than {LEAST_LOOKAHEAD_S} s of driving. By a "
            "rule of thumb a robot with so near a carrot may swing around the path"
        ),
        {S.WOBBLE_STRAIGHT: 1.0, S.GOAL_OSCILLATION: 0.6, S.GOAL_OVERSHOOT: 0.4, S.SPINS: 0.4},
        (
            up("lookahead_dist", lambda f: 1.2 * f.speed_mps),
            up("min_lookahead_dist"),
            up("max_lookahead_dist", lambda f: 1.2 * f.speed_mps),
        ),
        f"{CODE}, README: lookahead; Coulter 1992",
        PURSUIT,
    ),
    Rule(
        "pursuit-far-carrot",
        lambda f: lookahead_m(f) > FAR_M,
        lambda f: (
            f"by {_names_of_lookahead(f)} the carrot is {lookahead_m(f):.2f} m ahead, so the "
            "robot cuts bends"
        ),
        {S.CORNER_CUTTING: 1.0, S.NEAR_MISS: 0.7, S.COLLISION: 0.5, S.DOOR_STOP: 0.5},
        (down("lookahead_dist", 0.6), down("max_lookahead_dist", 0.9)),
        f"{CODE}, README: lookahead",
        PURSUIT,
    ),
    Rule(
        "pursuit-carrot-beyond-window",
        lambda f: lookahead_m(f) > half_window_m(f),
        lambda f: (
            f"the carrot is {lookahead_m(f):.1f} m ahead, but the local costmap reaches "
            f"only {half_window_m(f):.1f} m from the robot"
        ),
        {S.TOO_SLOW: 0.7, S.COLLISION: 0.4},
        (
            up("local_costmap.width", lambda f: whole_m(2.0 * lookahead_m(f))),
            down("lookahead_dist", half_window_m),
        ),
        CODE,
        PURSUIT,
    ),
    Rule(
        "pursuit-check-beyond-window",
        lambda f: _projection_m(f) > half_window_m(f),
        lambda f: (
            f"the collision check goes {_projection_m(f):.1f} m ahead, but the local "
            f"costmap reaches only {half_window_m(f):.1f} m from the robot"
        ),
        {S.TOO_SLOW: 1.0, S.COLLISION: 0.3, S.FALSE_ABORT: 0.3},
        (
            up("local_costmap.width", lambda f: whole_m(2.0 * _projection_m(f))),
            down("max_linear_vel"),
        ),
        "navigation2#2332",
        RPP,
    ),
    Rule(
        "rpp-late-approach",
        lambda f: (
            f.number("controller.approach_velocity_scaling_dist", 0.6) < 0.99 * gentle_approach_m(f)
        ),
        lambda f: (
            "approach_velocity_scaling_dist is "
            f"{f.controller('approach_velocity_scaling_dist')} m. By a rule of thumb the robot "
            f"needs {gentle_approach_m(f):.2f} m to slow down gently from {f.speed_mps:g} m/s"
        ),
        {S.GOAL_OVERSHOOT: 0.9, S.GOAL_OSCILLATION: 0.8},
        (
            up("approach_velocity_scaling_dist", gentle_approach_m),
            down("max_linear_vel"),
        ),
        f"{CODE}; navigation2#3081",
        PURSUIT,
    ),
    Rule(
        "rpp-approach-below-drives",
        lambda f: f.number("controller.min_approach_linear_velocity", 0.05) < 0.03,
        lambda f: (
            "min_approach_linear_velocity is "
            f"{f.controller('min_approach_linear_velocity')} m/s: most motors do not move "
            "the robot at such a speed"
        ),
        {S.STALL_BEFORE_GOAL: 1.0, S.GOAL_NOT_REACHED: 0.7},
        (up("min_approach_linear_velocity", 0.05),),
        CODE,
        PURSUIT,
    ),
    Rule(
        "rpp-arrives-fast",
        lambda f: (
            f.number("controller.min_approach_linear_velocity", 0.05)
            > max(0.5 * f.number("goal_checker.xy_goal_tolerance", 0.25), 0.12)
        ),
        lambda f: (
            "min_approach_linear_velocity is "
            f"{f.controller('min_approach_linear_velocity')} m/s: the robot soon crosses "
            f"xy_goal_tolerance ({f['goal_checker.xy_goal_tolerance']} m) and drives past"
        ),
        {S.GOAL_OVERSHOOT: 0.6, S.GOAL_OSCILLATION: 0.6},
        (down("min_approach_linear_velocity", 0.05),),
        CODE,
        PURSUIT,
        is_certain=False,
    ),
    # The distance is the inscribed radius and, beyond it, -ln(cost / 252) over this factor.
    _other_decay(
        "rpp-slower-decay-than-costmap",
        lambda own, costmap: own < costmap - 0.01,
        "takes obstacles for farther away than they are, and slows down too late beside them",
        {S.NEAR_MISS: 0.8, S.COLLISION: 0.4},
    ),
    _other_decay(
        "rpp-steeper-decay-than-costmap",
        lambda own, costmap: own > costmap + 0.01,
        "takes obstacles for nearer than they are, and slows down far from them",
        {S.TOO_SLOW: 0.8, S.DOOR_STOP: 0.2},
    ),
    Rule(
        "rpp-slows-from-afar",
        lambda f: (
            f.controller("use_cost_regulated_linear_velocity_scaling") is True
            and f.number("controller.cost_scaling_dist", 0.6)
            > 1.25 * f.number("local_costmap.inflation_radius", 0.55)
        ),
        lambda f: (
            f"cost_scaling_dist is {f.controller('cost_scaling_dist')} m, more than "
            f"inflation_radius ({f['local_costmap.inflation_radius']} m), beyond which cells have "
            "no cost"
        ),
        {S.TOO_SLOW: 0.6},
        (
            down("cost_scaling_dist", lambda f: f.number("local_costmap.inflation_radius")),
            up(
                "local_costmap.inflation_radius", lambda f: f.number("controller.cost_scaling_dist")
            ),
        ),
        f"{CODE}, README",
        PURSUIT,
    ),
    Rule(
        "rpp-slows-in-wide-bends",
        lambda f: (
            f.controller("use_regulated_linear_velocity_scaling") is True
            and f.number("controller.regulated_linear_scaling_min_radius", 0.9) > 1.3
        ),
        lambda f: (
            "regulated_linear_scaling_min_radius is "
            f"{f.controller('regulated_linear_scaling_min_radius')} m: the robot slows down "
            "in every bend tighter than this, which is nearly every bend"
        ),
        {S.TOO_SLOW: 1.0, S.STOP_START_JERK: 0.5},
        (down("regulated_linear_scaling_min_radius", 0.9),),
        CODE,
        PURSUIT,
    ),
    Rule(
        "rpp-bends-at-full-speed",
        lambda f: (
            f.controller("use_regulated_linear_velocity_scaling") is False and f.speed_mps > 0.4
        ),
        lambda f: (
            "use_regulated_linear_velocity_scaling is off: the robot takes bends at full speed"
        ),
        {S.CORNER_CUTTING: 0.8, S.COLLISION: 0.3},
        (put("use_regulated_linear_velocity_scaling", True),),
        CODE,
        RPP,
    ),
    Rule(
        "rpp-carrot-jumps",
        lambda f: f.controller("use_interpolation") is False,
        lambda f: "use_interpolation is off: the carrot jumps from pose to pose of the path",
        {S.WOBBLE_STRAIGHT: 0.8, S.STOP_START_JERK: 0.5},
        (put("use_interpolation", True),),
        CODE,
        PURSUIT,
    ),
    Rule(
        "rpp-least-speed-in-bends",
        lambda f: (
            f.number("controller.regulated_linear_scaling_min_speed", 0.25)
            > 0.8 * f.speed_mps
            > 0.0
        ),
        lambda f: (
            "regulated_linear_scaling_min_speed is "
            f"{f.controller('regulated_linear_scaling_min_speed')} m/s and the full speed "
            f"{f.speed_mps:g} m/s: the robot hardly slows down in bends or near walls"
        ),
        {S.CORNER_CUTTING: 0.6, S.NEAR_MISS: 0.3},
        (down("regulated_linear_scaling_min_speed"),),
        CODE,
        RPP,
        is_certain=False,
    ),
)
