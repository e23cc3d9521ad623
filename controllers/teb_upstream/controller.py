"""The original TEB as a controller: one cycle from observation to command."""

from __future__ import annotations

import math
from typing import Any, ClassVar, NamedTuple

import numpy as np

from drake_navbench.controller import (
    ControllerSetup,
    Decision,
    InvalidPath,
    NoValidControl,
    Observation,
)
from drake_navbench.controllers.teb_upstream.band import band_command
from drake_navbench.controllers.teb_upstream.feasibility import is_feasible
from drake_navbench.controllers.teb_upstream.local_plan import (
    LocalPlan,
    cut_local_plan,
    lethal_points,
)
from drake_navbench.controllers.teb_upstream.memory import (
    PlannerState,
    TebUpstreamMemory,
    Trajectory,
)
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.controllers.teb_upstream.planner import (
    NO_POINTS,
    Planned,
    Scene,
    Settings,
    TebPlanner,
)
from drake_navbench.controllers.teb_upstream.reasons import explained
from drake_navbench.controllers.teb_upstream.recovery import update_preference
from drake_navbench.controllers.teb_upstream.robot_models import RobotModel, circles, outline
from drake_navbench.explanation import Explanation
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.read_only import read_only

# The driver of a car limits the steering at this share of min_turning_radius.
TURNING_RADIUS_RATIO = 0.95


class Cycle(NamedTuple):
    """The outcome of one cycle.

    remembered: (2,) the command as the original sends it; see `TebUpstreamMemory.last_command`.
    memory: the memory for the next cycle, but with this cycle's `planner` and `last_command`.
    """

    scene: Scene
    settings: Settings
    planner: PlannerState
    best: Trajectory
    command: Array
    remembered: Array
    memory: TebUpstreamMemory


class UpstreamTimedElasticBand:
    """teb_local_planner::TebLocalPlannerROS (ros2-master): penalties instead of constraints.

    docs/teb_upstream.md describes it and its differences.
    """

    Parameters: ClassVar[type[TebUpstreamParameters]] = TebUpstreamParameters
    # A Nav2 parameter file with this plugin selects `teb`.
    nav2_plugin: ClassVar[str | None] = None
    original_plugin: ClassVar[str] = "teb_local_planner::TebLocalPlannerROS"

    def __init__(self, parameters: TebUpstreamParameters, setup: ControllerSetup) -> None:
        self._parameters = parameters
        self._setup = setup
        self._planner = TebPlanner(parameters, robot_model(parameters, setup))
        self._history_length = round(
            parameters.oscillation_filter_duration / setup.control_period_s
        )

    @property
    def cuts_plan(self) -> bool:
        """True: the controller cuts the whole plan itself, as Nav2's do in Humble."""
        return True

    def initial_memory(self) -> TebUpstreamMemory:
        """Returns the memory of a controller that has no band yet."""
        return TebUpstreamMemory(PlannerState(), np.zeros(2), np.empty((0, 2)))

    def next_memory(self, memory: TebUpstreamMemory) -> TebUpstreamMemory:
        """Returns the memory at the start of a task that follows another: all but its plan.

        Nav2's server does not reset the original, which goes on from its bands where the new goal
        is near the old one.
        """
        return memory._replace(plan_id=None)

    def step(self, observation: Observation, memory: TebUpstreamMemory) -> Decision:
        """Returns the displacement to a pose of the best band over its time.

        Raises InvalidPath for an empty plan, NoValidControl where no band was found, none is free
        of collision, or it diverged; then the next cycle starts from the global plan.
        """
        cycle = self._cycle(observation, memory)
        command = cycle.command
        command.flags.writeable = False
        memory = cycle.memory._replace(planner=cycle.planner, last_command=cycle.remembered)
        return Decision(command, memory, self._diagnostics(cycle.planner, cycle.best))

    def explain(self, observation: Observation, memory: TebUpstreamMemory) -> Explanation:
        """Returns the penalties of the driven band and of the best other one."""
        try:
            cycle = self._cycle(observation, memory)
        except (InvalidPath, NoValidControl) as failure:
            return Explanation(None, f"TEB stops: {failure}.", (), ())
        bands = [cycle.best]
        others = [b for b in cycle.planner.trajectories if b.number != cycle.best.number]
        bands += sorted(others, key=lambda band: band.cost)[:1]
        found = [self._planner.penalties(band, cycle.scene, cycle.settings) for band in bands]
        return explained(cycle.command, bands, found)

    def _cycle(self, observation: Observation, memory: TebUpstreamMemory) -> Cycle:
        """Returns a cycle's band and command; raises InvalidPath and NoValidControl."""
        whole = observation.whole_plan
        if len(whole) == 0:
            raise InvalidPath("plan: got no poses, expected at least one")
        if not np.isfinite(whole).all():
            raise InvalidPath("plan: got coordinates that are not finite, expected numbers")
        parameters = self._parameters
        begin = memory.plan_begin if observation.plan_id == memory.plan_id else 0
        plan = cut_local_plan(observation, parameters, begin)
        memory = memory._replace(plan_id=observation.plan_id, plan_begin=plan.begin)
        settings = self._planner.settings(observation.speed_limit)
        memory = update_preference(
            memory,
            settings.parameters,
            time_s=observation.time_s,
            turn_rate=float(observation.twist[1]),
            length=self._history_length,
        )
        try:
            scene = self._scene(observation, plan, memory.preferred_turn)
            planned = self._planner.plan(memory.planner, scene, settings)
            planner, best = self._feasible(planned, observation)
            command, remembered = self._command(best, settings.parameters)
        except NoValidControl as error:
            cleared = memory.planner._replace(trajectories=(), best=-1)
            error.memory = memory._replace(planner=cleared, last_command=np.zeros(2))
            raise
        return Cycle(scene, settings, planner, best, command, remembered, memory)

    def _scene(self, observation: Observation, plan: LocalPlan, preferred_turn: float) -> Scene:
        parameters = self._parameters
        obstacles = NO_POINTS
        if parameters.include_costmap_obstacles:
            obstacles = lethal_points(
                observation.costmap.grid,
                read_only(observation.pose),
                parameters.costmap_obstacles_behind_robot_dist,
            )
        chance = observation.noise_key.generator()
        return Scene(
            plan=plan.poses,
            twist=read_only(observation.twist),
            obstacles=obstacles,
            via_points=plan.via_points,
            samples=chance.random((parameters.roadmap_graph_samples, 2)),
            lots=chance.random(parameters.max_number_classes),
            goal_tolerance_m=observation.goal_xy_tolerance_m,
            time_s=observation.time_s,
            preferred_turn=preferred_turn,
        )

    def _feasible(
        self, planned: Planned, observation: Observation
    ) -> tuple[PlannerState, Trajectory]:
        """Returns the best band whose next poses are free.

        Where the band that was driven so far fails, no other is taken: the next cycle might change
        back.
        """
        parameters, setup = self._parameters, self._setup
        best = planned.best
        if (
            best is not None
            and parameters.divergence_detection_enable
            and best.chi_squared > parameters.divergence_detection_max_chi_squared
        ):
            raise NoValidControl(f"the band diverged: cost {best.chi_squared:g}")
        while best is not None:
            if is_feasible(
                observation.costmap,
                setup.footprint,
                best.poses,
                last_index=parameters.feasibility_check_no_poses,
                distance_m=parameters.feasibility_check_lookahead_distance,
                inscribed_radius_m=setup.inscribed_radius_m,
                angular_resolution=parameters.min_resolution_collision_check_angular,
            ):
                return planned.state, best
            if best.number == planned.previous:
                break
            planned = self._planner.select(planned.without_best(), observation.time_s)
            best = planned.best
        raise NoValidControl("no band is free of collision")

    def _command(self, band: Trajectory, parameters: TebUpstreamParameters) -> tuple[Array, Array]:
        """Returns the command (2,) v m/s, w rad/s within the limits, and (2,) as remembered."""
        is_valid, speed, rate = band_command(
            band.poses, band.time_steps, parameters.control_look_ahead_poses, parameters.dt_ref
        )
        if not is_valid or not math.isfinite(speed) or not math.isfinite(rate):
            raise NoValidControl("the band gives no command")
        speed, rate = saturated(speed, rate, parameters)
        remembered = np.array([speed, rate])
        if parameters.cmd_angle_instead_rotvel:
            angle = steering_angle(
                speed,
                rate,
                parameters.wheelbase,
                TURNING_RADIUS_RATIO * parameters.min_turning_radius,
            )
            remembered[1] = angle
            rate = speed * math.tan(angle) / parameters.wheelbase
        remembered.flags.writeable = False
        return np.array([speed, rate]), remembered

    def _diagnostics(self, planner: PlannerState, best: Trajectory) -> dict[str, Any]:
        shown: dict[str, Any] = {
            "band_cost": best.cost,
            "band_count": len(planner.trajectories),
            "pose_count": len(best.poses),
            "duration_s": best.duration_s,
            "preferred_turn": best.preferred_turn,
        }
        if self._setup.wants_diagnostics:
            shown["predicted_trajectory"] = best.poses
        return shown


def robot_model(parameters: TebUpstreamParameters, setup: ControllerSetup) -> RobotModel:
    """Returns the robot's shape for the optimiser."""
    model = parameters.footprint_model
    discs = model.circles()
    if discs is not None:
        return circles(discs)
    corners = model.outline(setup.footprint)
    if model.type == "polygon":
        # The original reads the corners of a polygon in single precision.
        corners = corners.astype(np.float32).astype(np.float64)
    return outline(corners)


def saturated(speed: float, rate: float, limits: TebUpstreamParameters) -> tuple[float, float]:
    """Returns the command within the limits; a reverse limit of 0 cuts no reverse speed."""
    speed_ratio = rate_ratio = 1.0
    if speed > limits.max_vel_x:
        speed_ratio = limits.max_vel_x / speed
    if 0.0 < limits.max_vel_x_backwards < -speed:
        speed_ratio = -limits.max_vel_x_backwards / speed
    if abs(rate) > limits.max_vel_theta:
        rate_ratio = limits.max_vel_theta / abs(rate)
    return speed * speed_ratio, rate * rate_ratio


def steering_angle(speed: float, rate: float, wheelbase: float, least_radius: float) -> float:
    """Returns the angle (rad) of a car's front wheels for a twist; least_radius in m."""
    if speed == 0.0 or rate == 0.0:
        return 0.0
    radius = speed / rate
    if abs(radius) < least_radius:
        radius = math.copysign(least_radius, radius)
    return math.atan(wheelbase / radius)
