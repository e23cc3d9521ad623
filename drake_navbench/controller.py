"""The interface of a controller: its observation, its decision, its errors, its registration.

A controller is a pure object. It is built once a trial from its typed parameters and a
`ControllerSetup`; `initial_memory()` and `step(observation, memory)` do the rest. Everything that
evolves is in its memory, which lives in the Drake Context. docs/controllers.md is a walk-through.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import (
    Any,
    ClassVar,
    Final,
    NamedTuple,
    Protocol,
    Self,
    runtime_checkable,
)

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from drake_navbench.errors import NavbenchError
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.noise import NO_NOISE, NoiseKey
from drake_navbench.kernels.read_only import read_only
from drake_navbench.kernels.settings_record import settings_record
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.releases import (
    NEWEST_RELEASE,
    RELEASE_FIELD,
    ReadBy,
    Release,
    read_by,
    release_in,
)
from drake_navbench.typed_files.usual_values import unusual_values

CONTROLLERS = PluginKind(
    noun="controller",
    group="drake_navbench.controllers",
    members=("Parameters", "nav2_plugin", "initial_memory", "step"),
)

# In the parameters of an original: the robot's outline, as Nav2 writes it in one text.
ROBOT_OUTLINE: Final = "<the robot's outline>"
NO_PLAN = read_only(np.empty((0, 3)))


@dataclass(frozen=True, slots=True)
class SpeedLimit:
    """A limit as Nav2's speed filter sends it: m/s, or a percentage of the nominal speed."""

    value: float
    is_percentage: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class ControllerSetup:
    """The facts of a whole trial that a Nav2 controller knows when it is configured.

    control_period_s: time between two calls of `step`, s.
    footprint: (K, 2) padded outline in the base frame, m.
    inscribed_radius_m, circumscribed_radius_m: radii of that outline about the base origin, m.
    footprint_is_circle: the robot was given by a radius, so checks may use the centre alone.
    max_linear_velocity_mps, max_angular_velocity_radps, max_lateral_velocity_mps: what the base can
        do; the last is 0 for a base that cannot move sideways.
    min_turning_radius_m: least turning radius of a car-like base, m; 0 for one that turns in place.
    response_time_constant_s, max_linear_acceleration_mps2, max_angular_acceleration_radps2: how the
        base answers a command; the limits are inf where it has none.
    costmap_resolution_m, costmap_size_m: cell edge and side length of the local costmap, m.
    inflation_radius_m, inflation_cost_scaling_factor: parameters of the local costmap's inflation
    layer.
    tracks_unknown_space: whether the local costmap has unknown cells.
    wants_diagnostics: whether `Decision.diagnostics` should carry arrays for replay and report.
    """

    control_period_s: float
    footprint: Array
    inscribed_radius_m: float
    circumscribed_radius_m: float
    footprint_is_circle: bool = False
    max_linear_velocity_mps: float = 0.5
    max_angular_velocity_radps: float = 2.0
    max_lateral_velocity_mps: float = 0.0
    min_turning_radius_m: float = 0.0
    response_time_constant_s: float = 0.1
    max_linear_acceleration_mps2: float = 2.5
    max_angular_acceleration_radps2: float = 3.0
    costmap_resolution_m: float = 0.05
    costmap_size_m: float = 6.0
    inflation_radius_m: float = 0.9
    inflation_cost_scaling_factor: float = 3.0
    tracks_unknown_space: bool = False
    wants_diagnostics: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """The inputs of a Nav2 controller in one cycle; all poses in the odometry frame. Read-only.

    time_s: start of the cycle, s.
    pose: (3,) estimated x m, y m, yaw rad.
    twist: (2,) measured v m/s, w rad/s, small values set to zero by the controller server.
    vy_mps: measured velocity to the left, m/s, small values set to zero; 0 where the base cannot
        move sideways.
    plan: (M, 3) x m, y m, yaw rad: the global plan as Nav2's path handler cut it for this cycle
        (passed poses dropped, ends after the prune distance or where it leaves the costmap).
    plan_id: changes when the navigator hands out a new global plan.
    costmap: the local costmap.
    goal: (3,) last pose of the whole global plan.
    goal_xy_tolerance_m, goal_yaw_tolerance_rad: tolerances of the goal checker.
    goal_xy_reached: the result of the goal checker's isGoalXYReached for this pose.
    speed_limit: None where there is no limit.
    noise_key: names this cycle's random numbers.
    cancel_requested: the navigator wants the controller to come to rest.
    global_plan: (N, 3) x m, y m, yaw rad: the whole plan that `plan` was cut from.
    """

    time_s: float
    pose: Array
    twist: Array
    plan: Array
    plan_id: int
    costmap: Costmap
    goal: Array
    goal_xy_tolerance_m: float = 0.25
    goal_yaw_tolerance_rad: float = 0.25
    goal_xy_reached: bool = False
    speed_limit: SpeedLimit | None = None
    noise_key: NoiseKey = NO_NOISE
    cancel_requested: bool = False
    global_plan: Array = field(default_factory=lambda: NO_PLAN)
    vy_mps: float = 0.0

    @property
    def whole_plan(self) -> Array:
        """(N, 3) the plan for a controller that cuts it itself: `global_plan`, else `plan`."""
        return self.global_plan if len(self.global_plan) else self.plan


class Decision(NamedTuple):
    """The result of a controller's cycle.

    command: (2,) v m/s, w rad/s; for a base that moves sideways it may be (3,), with vy m/s, the
        velocity to the left.
    memory: handed to the next `step`; never changed in place.
    diagnostics: numbers, strings and flags are logged every cycle. Arrays only where
        `ControllerSetup.wants_diagnostics`; the replay draws the keys `predicted_trajectory`
        (N, 3), `sampled_trajectories` (K, N, 3) with `sampled_costs` (K,), `carrot` (2,),
        `stop_trajectory` (N, 3), a verified way to rest, and `group_trajectories` (K, N, 3).
    """

    command: Array
    memory: Any = None
    diagnostics: Mapping[str, Any] = MappingProxyType({})


class ControllerError(NavbenchError):
    """Base of the errors that a controller may raise; `code` is Nav2's FollowPath error code.

    details: numbers that tell why, kept in the trial's log (such as rejections per critic).
    memory: the memory for the next `step` if the failed cycle changed it; None keeps the old one.
    """

    code: ClassVar[int] = 100

    def __init__(
        self, message: str, *, details: Mapping[str, Any] | None = None, memory: Any = None
    ) -> None:
        super().__init__(message)
        self.details = dict(details or {})
        self.memory = memory


class ControllerTFError(ControllerError):
    """A pose could not be transformed."""

    code = 102


class InvalidPath(ControllerError):
    """The plan is empty, or nothing of it is left."""

    code = 103


class NoValidControl(ControllerError):
    """There is no admissible command this cycle; the server may be patient."""

    code = 106


class CollisionAhead(NoValidControl):
    """The command that the controller wants would collide."""

    @classmethod
    def on_arc(cls, index: int, period_s: float, v: float, w: float, memory: Any) -> CollisionAhead:
        """Returns the error of a command v m/s, w rad/s, whose pose number `index` collides."""
        # At rest the period is infinite, and the collision is at the present pose.
        time_s = index * period_s if index > 0 else 0.0
        return cls(
            f"collision ahead in {time_s:.2f} s with v {v:.3f} m/s, w {w:.3f} rad/s",
            details={"time_to_collision_s": time_s, "v_mps": v, "w_radps": w},
            memory=memory,
        )


class AskedSpeeds(NamedTuple):
    """The speeds at which a controller's parameters need the base to drive; None: no demand.

    The accelerations are those that the controller counts on when it looks ahead.
    """

    max_linear_mps: float | None = None
    min_linear_mps: float | None = None
    max_angular_radps: float | None = None
    max_lateral_mps: float | None = None
    linear_acceleration_mps2: float | None = None
    angular_acceleration_radps2: float | None = None


class ControllerParameters(BaseModel):
    """Base of every parameter model: unknown names refused, values checked, frozen.

    WITHOUT_EFFECT: dotted names, also of whole blocks, that are accepted and change nothing. The
        user gets a warning for each one in a file.
    PATH_HANDLER_NAMES: parameters that the plugins read in earlier releases of Nav2, and that the
        path handler reads now, with the same meaning.
    PLUGIN_NAMES: dotted names whose values are plugin types of further controllers.
    READ_BY: by dotted name, the releases of Nav2 that read a parameter. Every release reads a
        parameter that is not in it. Only for models with a field `nav2_release`.
    SLIDERS: by dotted name, the range of a slider with which `run --live` changes a number during
        a trial; the controller's memory must not depend on that number. A critic's slider is shown
        only where the critic is used.
    STOOD_IN_FOR: by dotted name of a parameter that makes Nav2 behave differently from this
        controller, a sentence on what stands in for that behaviour.
    READ_WITH: by the name of a block, the setting without which Nav2 does not read the block, such
        as `motion_model: Ackermann`.
    """

    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset()
    PATH_HANDLER_NAMES: ClassVar[frozenset[str]] = frozenset()
    PLUGIN_NAMES: ClassVar[tuple[str, ...]] = ()
    READ_BY: ClassVar[Mapping[str, ReadBy]] = MappingProxyType({})
    STOOD_IN_FOR: ClassVar[Mapping[str, str]] = MappingProxyType({})
    READ_WITH: ClassVar[Mapping[str, str]] = MappingProxyType({})
    SLIDERS: ClassVar[Mapping[str, tuple[float, float]]] = MappingProxyType({})

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def is_without_effect(cls, name: str, values: Mapping[str, Any] | None = None) -> bool:
        """Returns whether a parameter, given by its dotted name, changes nothing.

        That is so if the release in `values` does not read it, or if WITHOUT_EFFECT contains it or
        a block that contains it. values: all given values; a model that contains others uses them
        to choose the inner model.
        """
        if not cls.is_read(name, release_in(values)):
            return True
        return any(name == idle or name.startswith(f"{idle}.") for idle in cls.WITHOUT_EFFECT)

    @classmethod
    def is_read(cls, name: str, release: Release | None) -> bool:
        """Returns whether a release of Nav2 reads a parameter, given by its dotted name.

        Without a release every parameter is read.
        """
        if release is None:
            return True
        parts = name.split(".")
        # An entry about a block holds for all parameters in it.
        places = [".".join(parts[:count]) for count in range(1, len(parts) + 1)]
        return all(release in read_by(cls, place).releases for place in places)

    @classmethod
    def doubts(cls, values: Mapping[str, Any]) -> Mapping[str, str]:
        """Returns probably mistaken values: dotted name -> the effect of the value."""
        return unusual_values(cls, values)

    def as_read(self) -> Self:
        """Returns these parameters; those that their release does not read have their defaults."""
        release = getattr(self, RELEASE_FIELD, NEWEST_RELEASE)
        fields = type(self).model_fields
        unread = [name for name in fields if not self.is_read(name, release)]
        return self.model_copy(update={name: fields[name].get_default() for name in unread})

    def as_record(self, **facts: Any) -> NDArray[np.void]:
        """Returns the parameters that are numbers or flags as the record that a kernel takes.

        facts: further fields, such as values of the setup and the release; one with the name of a
        parameter replaces it.
        """
        fields = type(self).model_fields.items()
        names = [name for name, field in fields if field.annotation in (bool, int, float)]
        return settings_record({name: getattr(self, name) for name in names} | facts)

    @classmethod
    def keys_not_read(cls, values: Mapping[str, Any]) -> list[str]:
        """Returns the dotted names in `values`, nested, that Nav2 would not look at.

        Examples are the block of a critic that is not listed, and parameters that the release does
        not read.
        """
        release = release_in(values)
        return [name for name in _dotted_names(values) if not cls.is_read(name, release)]

    @classmethod
    def for_original(cls, values: Mapping[str, Any], release: str) -> dict[str, Any]:
        """Returns the given values, nested, in the form that Nav2's original reads in a release.

        By default these are the given values without the port's own `nav2_release`; a controller
        whose parameters have other names or forms in a release overrides this. ROBOT_OUTLINE in the
        result stands for the robot's outline, which is filled in later.
        """
        return {name: value for name, value in values.items() if name != RELEASE_FIELD}

    @classmethod
    def path_handler_fields(cls, given: Mapping[str, Any]) -> dict[str, str]:
        """Returns the path handler's field that each of PATH_HANDLER_NAMES in `given` stands for.

        The result is empty if the controller itself reads one of these parameters in the release of
        `given`, as some do up to Kilted. given: values by dotted names.
        """
        own = cls.PATH_HANDLER_NAMES & cls.READ_BY.keys()
        if any(cls.is_read(name, release_in(given)) for name in own):
            return {}
        return {name: name for name in given if name in cls.PATH_HANDLER_NAMES}

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the speeds, by direction, at which the base must be able to drive and turn."""
        return AskedSpeeds()

    def files_read(self) -> Mapping[str, Path]:
        """Returns the files that the controller reads or runs, by the names that logs give them.

        A trial is a function of their contents, too: digests are kept in logs and manifests.
        """
        return {}

    def turns_in_place(self) -> bool:
        """Returns whether the controller may command a turn in place, which no car can follow."""
        return True

    def looks_for_motion(self) -> bool:
        """Returns whether the controller detects moving obstacles in successive local costmaps."""
        return False


def _dotted_names(values: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """Yields the names of values and of the blocks that they are in."""
    for name, value in values.items():
        yield prefix + name
        if isinstance(value, Mapping):
            yield from _dotted_names(value, f"{prefix}{name}.")


@runtime_checkable
class Controller(Protocol):
    """A controller plugin. The class is what an entry point names.

    Parameters: its parameter model, with Nav2's names, types and defaults.
    nav2_plugin: Nav2's plugin type, by which a Nav2 parameter file selects this controller. Where
    that type selects another controller, a port names its original as `original_plugin`.
    """

    Parameters: ClassVar[type[ControllerParameters]]
    nav2_plugin: ClassVar[str | None]

    def __init__(self, parameters: Any, setup: ControllerSetup) -> None: ...

    def initial_memory(self) -> Any:
        """Returns the memory that the first `step` of a goal gets."""
        ...

    def step(self, observation: Observation, memory: Any) -> Decision:
        """Returns the command of one cycle; raises a ControllerError where there is none.

        Pure: same observation and memory, same decision; neither is changed.
        """
        ...


@runtime_checkable
class GracefulController(Protocol):
    """A controller that slows down by itself before it is cancelled, as Nav2's Controller::cancel.

    A controller without `is_at_rest` is cancelled at once, and the server commands a stop.
    """

    def is_at_rest(self, memory: Any) -> bool:
        """Returns whether a cancelled controller is at rest; until then it is called each cycle."""
        ...


@runtime_checkable
class PlanCuttingController(Protocol):
    """A controller that may cut `Observation.global_plan` itself, as those of Nav2 until Kilted.

    cuts_plan: whether it cuts the plan. If so, it gets the whole plan where the path handler has
    none left.
    """

    @property
    def cuts_plan(self) -> bool: ...


@runtime_checkable
class RememberingController(Protocol):
    """A controller that keeps something from one task to the next, as some of Nav2's do.

    A controller without `next_memory` begins every task with `initial_memory`.
    """

    def next_memory(self, memory: Any) -> Any:
        """Returns the memory at the start of a task; memory: that at the end of the last one."""
        ...


def memory_of_next_task(controller: Controller, memory: Any) -> Any:
    """Returns the memory at the start of a task.

    memory: at the end of the task before; None at the first one.
    """
    if memory is None or not isinstance(controller, RememberingController):
        return controller.initial_memory()
    return controller.next_memory(memory)


@runtime_checkable
class ClosableController(Protocol):
    """A controller that owns a resource which must be released, such as a process.

    `close` is called once for each object, after its trial or after its check.
    """

    def close(self) -> None:
        """Releases the resource."""
        ...
