"""The interface of a critic, a class that judges trajectories of DWB.

Nav2's TrajectoryCritic, with its mutable state taken out into a memory. A critic of your own is a
subclass of `Critic`, installed under the entry point group `drake_navbench.dwb_critics`:

    class KeepLeft(Critic):
        reasons = ("Trajectory ends right of the start.",)

        def score(self, scene, memory):
            dx, dy = (scene.end_poses[:, :2] - scene.pose[:2]).T
            left_m = np.cos(scene.pose[2]) * dy - np.sin(scene.pose[2]) * dx
            return Verdict(np.abs(left_m), np.where(left_m < 0.0, 1, 0))

and then named in a parameter file: `critics: [KeepLeft, PathDist]`, `KeepLeft: {scale: 2.0}`.
docs/controllers.md goes through it step by step.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import ControllerSetup
from drake_navbench.controllers.dwb.critics.parameters import CriticParameters
from drake_navbench.kernels.arrays import Array

if TYPE_CHECKING:
    from drake_navbench.controllers.dwb.parameters import DynamicWindowApproachParameters
    from drake_navbench.controllers.dwb.scene import Scene, Situation


class Verdict(NamedTuple):
    """A critic's judgement of the K trajectories of a window.

    scores: (K,) raw scores, lower is better; not read where a rule is broken.
    violations: (K,) integers: 0 where legal, else i for the critic's i-th reason, counted from 1;
        None where all are legal.
    """

    scores: Array
    violations: NDArray[np.uint8] | None = None

    @classmethod
    def blank(cls, count: int) -> Verdict:
        """Returns a verdict of undefined content for a kernel to write to."""
        return cls(np.empty(count), np.empty(count, dtype=np.uint8))


class Critic(ABC):
    """Judges every trajectory of the window in one call; its memory holds the state between calls.

    Called per cycle: `prepare`, `scale`, `score` (unless the scale is 0), `debrief`.

    A subclass finds its own block in `self._parameters`, the whole namespace in
    `self._controller_parameters` and the trial's settings, footprint included, in `self._setup`.

    Parameters: its parameter model.
    reasons: texts for the rules a trajectory may break, by which Nav2 counts illegal ones.
    """

    Parameters: ClassVar[type[CriticParameters]] = CriticParameters
    reasons: ClassVar[tuple[str, ...]] = ("Trajectory is illegal.",)

    def __init__(
        self,
        parameters: Any,
        controller_parameters: DynamicWindowApproachParameters,
        *,
        setup: ControllerSetup,
    ) -> None:
        self._parameters = parameters
        self._controller_parameters = controller_parameters
        self._setup = setup

    def initial_memory(self) -> Any:
        """Returns the memory at the start of a trial; it must be immutable."""
        return None

    def reset(self, memory: Any) -> Any:
        """Returns the memory after a new global plan has come."""
        return memory

    def prepare(self, situation: Situation, memory: Any) -> Any:
        """Returns the memory with which this cycle's trajectories are judged."""
        return memory

    def scale(self, situation: Situation, memory: Any) -> float:
        """Returns the weight of the raw score in this cycle; 0 leaves the critic out."""
        return self._parameters.scale

    @abstractmethod
    def score(self, scene: Scene, memory: Any) -> Verdict:
        """Returns raw score and legality of every trajectory of `scene.trajectories`."""

    def debrief(self, situation: Situation, command: Array, memory: Any) -> Any:
        """Returns the memory after `command` (vx, vy m/s, wz rad/s) was chosen; zeros if none."""
        return memory
