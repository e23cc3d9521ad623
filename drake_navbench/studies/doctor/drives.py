"""A log as the detectors see it: arrays over time, and how the task ended."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

Array = NDArray[np.float64]
# Slower than this counts as standing, m/s and rad/s.
STANDS_MPS, STANDS_RADPS = 0.02, 0.06


class Drive(NamedTuple):
    """A log on an even clock, for detectors: arrays over time, and the outcome.

    recovers: whether a navigator with recoveries drove. zone_share: share of the speed that the
    slowest zone of the scenario's speed filters lets drive. half_width_m: of the robot's outline;
    nan where it is not known, as in a recording.
    """

    time_s: Array
    xy_m: Array
    yaw_rad: Array
    v_mps: Array
    w_radps: Array
    command_v_mps: Array
    clearance_m: Array
    goal: Array
    plan_m: Array
    outcome: Outcome
    asked_mps: float
    tolerance_m: float
    cycle_ms: Array
    period_ms: float
    is_impossible: bool
    reason: str = ""
    recovers: bool = False
    zone_share: float = 1.0
    half_width_m: float = math.nan

    @property
    def is_refused(self) -> bool:
        """Whether the controller found no command that it may give, and the task ended by it."""
        words = ("collision ahead", "no valid", "no legal")
        return self.outcome is Outcome.ABORTED and any(w in self.reason.lower() for w in words)

    @property
    def has_goal(self) -> bool:
        """Whether a goal is known; of many recordings none is."""
        return bool(np.isfinite(self.goal[0]))

    @property
    def to_goal_m(self) -> Array:
        """The distance to the goal's position, m."""
        return np.asarray(np.hypot(*(self.xy_m - self.goal[:2]).T))

    @property
    def step_s(self) -> float:
        """The time between two samples, s."""
        return float(np.median(np.diff(self.time_s))) if len(self.time_s) > 1 else 0.05


def drive_of(log: TrialLog) -> Drive:
    """Returns the detectors' arrays of a log, on an even clock."""
    samples, info = log.samples, log.info
    navigation = info.get("robot", {}).get("navigation", {})
    scenario = info["scenario"]
    plan = log.first_plans[-1].poses[:, :2] if log.first_plans else np.empty((0, 2))
    if len(log.plans) > 1:
        # Plans that change say nothing of a path that should have been kept.
        plan = np.empty((0, 2))
    rate = navigation.get("controller_server", {}).get("controller_frequency", 20.0)
    goal = np.array(scenario["goal"], dtype=float)
    outcome = log.outcome
    if "goal" in info.get("missing", {}):
        # Of a recording without a goal the pieces before and after the drive say nothing.
        goal = np.array([np.inf, np.inf, np.nan])
        outcome = Outcome.SUCCEEDED if outcome is Outcome.TIMED_OUT else outcome
        samples = samples[_is_driven(samples)]

    def column(name: str) -> Array:
        return samples[name].to_numpy(dtype=float)

    return Drive(
        column("time_s"),
        np.column_stack([column("x_m"), column("y_m")]),
        np.unwrap(column("yaw_rad")),
        column("v_mps"),
        column("w_radps"),
        column("command_v_mps"),
        column("clearance_m"),
        goal,
        np.asarray(plan, dtype=float),
        outcome,
        _asked_mps(info, column("command_v_mps")),
        float(navigation.get("goal_checker", {}).get("xy_goal_tolerance", 0.25)),
        column("compute_time_ms") * _board_scale(info),
        1000.0 / max(float(rate), 0.1),
        scenario.get("expected_outcome") == "aborted",
        str(info.get("reason", "")),
        scenario.get("navigation_mode") != "follow_path",
        _zone_share(scenario.get("filters", ())),
        _half_width_m(info.get("robot", {})),
    )


def _zone_share(filters: Iterable[Mapping[str, Any]]) -> float:
    """Returns the least share of the speed that zones in percent allow; 1 without such zones."""
    shares = [
        float(area["value"]) / 100.0
        for one in filters
        if one.get("type") == "speed_percent"
        for area in one.get("areas", ())
    ]
    return min([share for share in shares if share > 0.0], default=1.0)


def _half_width_m(robot: Mapping[str, Any]) -> float:
    """Returns the half width of a robot's outline to both sides of its base, m; nan without one."""
    outline = robot.get("collision_outline") or robot.get("footprint")
    if outline:
        return max(abs(float(y)) for _, y in outline)
    radius = robot.get("robot_radius")
    return math.nan if radius is None else float(radius)


def _is_driven(samples: pd.DataFrame) -> Array:
    """Tells which samples lie between the first and the last motion."""
    moves = (samples["v_mps"].abs() > STANDS_MPS) | (samples["w_radps"].abs() > STANDS_RADPS)
    at = np.flatnonzero(moves)
    index = np.arange(len(samples))
    first, last = (at[0], at[-1]) if len(at) else (0, -1)
    return np.asarray((index >= first) & (index <= last))


def _board_scale(info: Mapping[str, Any]) -> float:
    """Returns the factor by which the board's file lengthens the measured time of a cycle."""
    timing = info.get("robot", {}).get("timing", {})
    is_scaled = timing.get("compute_time") == "scaled"
    return float(timing.get("compute_time_scale", 1.0)) if is_scaled else 1.0


def _asked_mps(info: Mapping[str, Any], commands: Array) -> float:
    """Returns the speed that the controller asks for, else the highest that it commanded, m/s."""
    parameters = info.get("parameters", {})
    parameters = parameters.get("primary_controller", parameters)
    names = ("vx_max", "max_linear_vel", "max_vel_x", "v_linear_max", "desired_linear_vel")
    found = [parameters[name] for name in names if isinstance(parameters.get(name), int | float)]
    if found:
        return float(found[0])
    known = commands[np.isfinite(commands)]
    return float(np.quantile(known, 0.95)) if len(known) else 0.0
