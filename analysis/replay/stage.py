"""The Meshcat scene of one page and its animation."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat, MeshcatAnimation, MeshcatParams, Rgba
from pydrake.math import RigidTransform
from pydrake.perception import PointCloud

from drake_navbench.analysis.replay.flat_meshes import FlatMesh
from drake_navbench.kernels.arrays import Array

Event = TypeVar("Event")

FRAMES_PER_SECOND = 20
# The beginning of Drake's warning about a texture that no longer exists.
LATE_TEXTURE = "Unknown CAS key"


class Stage:
    """Draws into one Meshcat scene; frames of the animation are counted from the logs' time 0.

    Paths are Meshcat's: hiding a path hides everything below it.

    meshcat: the scene to draw into; None: a new one.
    """

    def __init__(self, meshcat: Meshcat | None = None) -> None:
        self.meshcat = make_meshcat() if meshcat is None else meshcat
        self.animation = MeshcatAnimation(FRAMES_PER_SECOND)

    def flat_mesh(self, path: str, mesh: FlatMesh, rgba: Rgba) -> bool:
        """Draws a flat mesh; returns False where it is empty and nothing was drawn."""
        if mesh.faces.size:
            self.meshcat.SetTriangleMesh(path, mesh.vertices, mesh.faces, rgba)
        return mesh.faces.size > 0

    def points(
        self, path: str, points: Array, *, height_m: float, size_m: float, rgba: Rgba
    ) -> bool:
        """Draws points (N, 2) m; returns False, and draws nothing, if there are none."""
        if len(points):
            cloud = PointCloud(len(points))
            cloud.mutable_xyzs()[:] = np.column_stack([points, np.full(len(points), height_m)]).T
            self.meshcat.SetObject(path, cloud, size_m, rgba)
        return len(points) > 0

    def pose(self, path: str, pose: RigidTransform, frame: int | None = None) -> None:
        """Sets the pose of the object at a path, for all times or at one frame.

        Between two frames with a pose the object moves smoothly.
        """
        if frame is None:
            self.meshcat.SetTransform(path, pose)
        else:
            self.animation.SetTransform(frame, path, pose)

    def show_from(self, path: str, frame: int, *, is_shown: bool) -> None:
        """Shows or hides the object at a path from a frame on."""
        self.animation.SetProperty(frame, path, "visible", is_shown)

    def take_turns(self, shown: Sequence[tuple[float, str | None]]) -> None:
        """Shows each path from its time until the time of the next entry; None shows nothing."""
        frames = [frame_of(time_s) for time_s, _ in shown]
        for index, (_, path) in enumerate(shown):
            if path is None:
                continue
            if frames[index] > 0:
                self.animation.SetProperty(0, path, "visible", False)
            self.animation.SetProperty(frames[index], path, "visible", True)
            if index + 1 < len(shown):
                self.animation.SetProperty(frames[index + 1], path, "visible", False)

    def html(self) -> str:
        """Returns the scene with its animation as a page that needs no other file."""
        self.meshcat.SetAnimation(self.animation)
        return self.meshcat.StaticHtml()


def make_meshcat() -> Meshcat:
    """Returns a Meshcat whose server accepts connections from this machine alone.

    Drake's message with the server's address is suppressed: a page in a file needs no server, and
    the live page prints its own address.
    """
    with _without_drake_notices():
        return Meshcat(MeshcatParams(host="localhost", show_stats_plot=False))


def frame_of(time_s: float) -> int:
    """Returns the number of the frame that shows a time."""
    return round(time_s * FRAMES_PER_SECOND)


def frames_until(end_time_s: float, stride: int) -> tuple[NDArray[np.int64], Array]:
    """Returns every `stride`-th frame up to the last one, and the frames' times, s."""
    last = frame_of(end_time_s)
    frames = np.unique(np.append(np.arange(0, last + 1, stride), last))
    return frames, np.minimum(frames / FRAMES_PER_SECOND, end_time_s)


def spaced_in_time(
    events: Iterable[tuple[float, Event]], period_s: float
) -> list[tuple[float, Event]]:
    """Returns the first event, and each one at least `period_s` after the last kept one."""
    kept: list[tuple[float, Event]] = []
    for time_s, event in events:
        # Half a frame of slack: a clock's rounding must not skip an event that is due.
        if not kept or time_s - kept[-1][0] >= period_s - 0.5 / FRAMES_PER_SECOND:
            kept.append((time_s, event))
    return kept


@contextmanager
def without_late_texture_warnings() -> Iterator[None]:
    """Suppresses Meshcat's warnings about textures that a page asks for after they were replaced.

    A live costmap is a new texture several times a second; the page then shows the next one.
    """
    logger = logging.getLogger("drake")

    def is_told(record: logging.LogRecord) -> bool:
        return LATE_TEXTURE not in record.getMessage()

    logger.addFilter(is_told)
    try:
        yield
    finally:
        logger.removeFilter(is_told)


@contextmanager
def _without_drake_notices() -> Iterator[None]:
    """Keeps Meshcat from printing its server's address."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.WARNING)
    try:
        yield
    finally:
        logger.setLevel(level)
