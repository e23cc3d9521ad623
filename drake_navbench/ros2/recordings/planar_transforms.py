"""Transforms of a recording, in the plane: where one frame lies in another at given times.

Poses are (..., 3) x m, y m, yaw rad. What moves is interpolated between its stamps and held beyond
them; heights, roll and pitch of a moving frame are left out.
`kernels.poses` has the same for one pose, which the trial composes by the rounding of its kernels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from drake_navbench.kernels.arrays import Array

# More frames above each other must be a loop.
MAX_DEPTH = 64


def composed(first: Array, second: Array) -> Array:
    """Returns X_AC = X_AB X_BC; first: X_AB, second: X_BC, each (N, 3) or (3,): m, m, rad."""
    cos_yaw, sin_yaw = np.cos(first[..., 2]), np.sin(first[..., 2])
    x = first[..., 0] + (second[..., 0] * cos_yaw - second[..., 1] * sin_yaw)
    y = first[..., 1] + (second[..., 0] * sin_yaw + second[..., 1] * cos_yaw)
    return np.stack([x, y, first[..., 2] + second[..., 2]], axis=-1)


def inverted(pose: Array) -> Array:
    """Returns X_BA, the inverse of pose X_AB."""
    cos_yaw, sin_yaw = np.cos(pose[..., 2]), np.sin(pose[..., 2])
    x, y = -pose[..., 0], -pose[..., 1]
    return np.stack([x * cos_yaw + y * sin_yaw, y * cos_yaw - x * sin_yaw, -pose[..., 2]], axis=-1)


class Track(NamedTuple):
    """A pose over time. time_s: (N,) rising. pose: (N, 3) x m, y m, yaw rad unwrapped."""

    time_s: Array
    pose: Array

    def at(self, time_s: Array) -> Array:
        """Returns the poses at some times, (M, 3)."""
        return np.column_stack([np.interp(time_s, self.time_s, column) for column in self.pose.T])


class Mounting(NamedTuple):
    """The fixed pose X_PF of a frame F in its parent P. rotation: (3, 3). translation: (3,) m."""

    rotation: Array
    translation: Array

    def then(self, other: Mounting) -> Mounting:
        """Returns X_AC = X_AB X_BC, where this mounting is X_AB and `other` is X_BC."""
        return Mounting(
            self.rotation @ other.rotation, self.translation + self.rotation @ other.translation
        )

    @property
    def pose(self) -> Array:
        """The pose in the plane."""
        yaw = np.arctan2(self.rotation[1, 0], self.rotation[0, 0])
        return np.array([self.translation[0], self.translation[1], yaw])


IN_PLACE = Mounting(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class TransformTree:
    """All frames of a recording. moving, fixed: child frame -> (parent frame, pose X_PC)."""

    moving: Mapping[str, tuple[str, Track]] = field(default_factory=dict)
    fixed: Mapping[str, tuple[str, Mounting]] = field(default_factory=dict)

    def parent_of(self, frame: str) -> str | None:
        """Returns the parent of a frame, None of a root."""
        if frame in self.moving:
            return self.moving[frame][0]
        return self.fixed[frame][0] if frame in self.fixed else None

    def ancestors(self, frame: str) -> list[str]:
        """Returns a frame, its parent, and so on up to a root."""
        chain = [frame]
        while (parent := self.parent_of(chain[-1])) is not None and len(chain) < MAX_DEPTH:
            chain.append(parent)
        return chain

    def poses(self, ancestor: str, frame: str, time_s: Array) -> Array | None:
        """Returns the poses of `frame` in `ancestor` at these times, (N, 3): m, m, rad.

        None where `ancestor` is not one of the frame's ancestors.
        """
        chain = self.ancestors(frame)
        if ancestor not in chain:
            return None
        pose = np.zeros((len(time_s), 3))
        for child in chain[: chain.index(ancestor)]:
            if child in self.moving:
                step = self.moving[child][1].at(time_s)
            else:
                step = np.broadcast_to(self.fixed[child][1].pose, pose.shape)
            pose = composed(step, pose)
        return pose

    def mounting(self, ancestor: str, frame: str) -> Mounting | None:
        """Returns the fixed pose of `frame` in `ancestor`.

        Both may also be fixed to a common ancestor. None where a joint between them moves, or where
        they have no common ancestor.
        """
        up, base = self._fixed_chain(frame), self._fixed_chain(ancestor)
        common = next((name for name in up if name in base), None)
        if common is None:
            return None
        in_common, base_in_common = up[common], base[common]
        inverse = base_in_common.rotation.T
        back = Mounting(inverse, -inverse @ base_in_common.translation)
        return back.then(in_common)

    def _fixed_chain(self, frame: str) -> dict[str, Mounting]:
        """Returns ancestor -> fixed pose in it, from the frame itself up to a moving joint."""
        chain = {frame: IN_PLACE}
        place = IN_PLACE
        while frame in self.fixed and frame not in self.moving and len(chain) < MAX_DEPTH:
            parent, mounting = self.fixed[frame]
            place = mounting.then(place)
            chain[parent] = place
            frame = parent
        return chain
