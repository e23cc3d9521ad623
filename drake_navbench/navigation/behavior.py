"""The contract of behaviours: the server's parameters, the surroundings, a cycle's outcome."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol

from pydantic import Field

from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.footprint import footprint_cost
from drake_navbench.kernels.grid import LETHAL, OFF_MAP, Costmap, cost_at
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import PluginBlocks, PluginParameters
from drake_navbench.plugins.releases import ReadBy, Release, before
from drake_navbench.typed_files.quantities import (
    Acceleration,
    AngularAcceleration,
    AngularSpeed,
    Duration,
    Frequency,
    Speed,
)
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import not_negative, with_sign

RAMP = ReadBy(
    frozenset({Release.HUMBLE, Release.KILTED, Release.LYRICAL}), before(Release.KILTED, None)
)


class DriveLimits(FrozenModel):
    """Parameters of a behaviour that drives straight.

    Without either limit it drives at the goal's speed all the way, as Nav2 does in iron and jazzy,
    and in humble where they are not given.
    """

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        # Humble has these parameters, and 0 means none; Iron and Jazzy lack them; Kilted has them
        # again.
        "acceleration_limit": RAMP,
        "deceleration_limit": RAMP,
        "minimum_speed": RAMP._replace(defaults=before(Release.KILTED, 0.0)),
    }

    acceleration_limit: Annotated[Acceleration | None, with_sign(+1)] = Field(
        2.5,
        ge=0.0,
        description="Largest acceleration of the behaviours' commands [m/s^2]; null: no limit.",
    )
    deceleration_limit: Annotated[Acceleration | None, with_sign(-1)] = Field(
        -2.5,
        le=0.0,
        description="Largest deceleration of the behaviours' commands [m/s^2]; null: no limit.",
    )
    minimum_speed: Annotated[Speed, not_negative("as 0")] = Field(
        0.10, description="Slowest speed [m/s]."
    )


BEHAVIORS = PluginKind(
    noun="behavior",
    group="drake_navbench.behaviors",
    members=("Parameters", "invalid_input_code", "start", "step"),
    guide="docs/plugins.md",
    parameters=PluginParameters,
)
"""The behaviours that are not built in."""


class BehaviorServerParameters(PluginBlocks):
    """Parameters of nav2_behaviors' behaviour server and its plugins.

    A block under another name, with `plugin`, is a behaviour that is not built in.
    """

    PLUGINS: ClassVar[PluginKind] = BEHAVIORS

    cycle_frequency: Frequency = Field(
        10.0, gt=0.0, description="Rate of the behaviours' control cycles [Hz]."
    )
    simulate_ahead_time: Annotated[Duration, not_negative("no collision is predicted")] = Field(
        2.0, description="Time ahead for which collisions are predicted [s]."
    )
    max_rotational_vel: AngularSpeed = Field(
        1.0, ge=0.0, description="Fastest spin [rad/s]; at 0 the robot does not spin."
    )
    min_rotational_vel: Annotated[AngularSpeed, not_negative("as 0")] = Field(
        0.4, description="Slowest spin [rad/s]."
    )
    rotational_acc_lim: AngularAcceleration = Field(
        3.2, ge=0.0, description="Largest angular deceleration of a spin [rad/s^2]."
    )
    backup: DriveLimits = Field(default_factory=DriveLimits)
    drive_on_heading: DriveLimits = Field(default_factory=DriveLimits)


class Surroundings(NamedTuple):
    """The surroundings against which a behaviour checks its way.

    costmap: the local one, None where there is none yet. footprint: (K, 2) padded, m.
    """

    costmap: Costmap | None
    footprint: Array

    def is_free(self, x: float, y: float, yaw: float) -> bool:
        """Tells whether the outline at a pose is free; unknown cells count as touched."""
        if self.costmap is None:
            return False
        grid = self.costmap.grid
        if cost_at(grid, x, y) == OFF_MAP:
            return False
        return footprint_cost(grid, self.footprint, x, y, yaw, True) < LETHAL


class Step(NamedTuple):
    """The outcome of one cycle.

    state: handed to the next one. command: (v m/s, w rad/s), None where the behaviour publishes
    nothing. is_done: it succeeded. error_code, reason: where it failed.
    """

    state: Any
    command: tuple[float, float] | None = None
    is_done: bool = False
    error_code: int = 0
    reason: str = ""

    @property
    def is_final(self) -> bool:
        """Whether the behaviour has ended."""
        return self.is_done or self.error_code != 0


class Behavior(Protocol):
    """A behaviour of the behaviour server, such as Spin or Wait.

    Built-in behaviours are made from the server's parameters, others from the server's and their
    own `Parameters`. invalid_input_code: error code for arguments that make no sense, for which
    `start` raises ValueError.
    """

    invalid_input_code: ClassVar[int]

    def start(self, arguments: Mapping[str, float], pose: Array, time_s: float) -> Any:
        """Returns the state at the start; raises ValueError for arguments that make no sense."""
        ...

    def step(self, state: Any, pose: Array, time_s: float, surroundings: Surroundings) -> Step:
        """Returns the command of one cycle at pose (3,) m, m, rad."""
        ...
