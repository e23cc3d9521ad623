"""The moving bodies of the world besides the robot: moving obstacles and people."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.geometry import (
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)

from drake_navbench.inputs.people import NOBODY, TRUNK_RADIUS_M, Crowd, scanned_discs
from drake_navbench.inputs.recorded_people import RecordedPeople
from drake_navbench.inputs.world import World
from drake_navbench.inputs.world_geometry import (
    MOVING_COLOR,
    PERSON_COLOR,
    PERSON_HEIGHT_M,
    body_of,
    moving_shape,
)
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.depth_casting import Solids
from drake_navbench.kernels.moving_bodies import FAR_AWAY_M
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.social_force import nearest_point
from drake_navbench.kernels.swept_contact import covers
from drake_navbench.kernels.walking import STATE_SIZE as PERSON_SIZE
from drake_navbench.kernels.walking import VX, VY, WALKED, YAW, people_after
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import POSE_SIZE, STATE_SIZE, declare_object_output
from drake_navbench.trial.systems.walking_people import PEOPLE_PERIOD_S, walk_of


class MovingWorld(LeafSystem):
    """Moves obstacles on given ways, at every instant, and people by a model or as recorded.

    Input `state` [x m, y m, yaw rad, v m/s, w rad/s, vy m/s] of the robot, which only people react
    to; without people it need not be connected. Output `poses` [x m, y m, yaw rad] of each body in
    the world frame: things, then people, in the order of the scenario file. Output `outlines`:
    edges (E, 4) and circles (D, 3) of all, m, as they touch. Output `scanned`: the same as a
    scanner sees them at its height, without things that end below it, people as legs or trunks.
    Output `solids`: all as upright Solids for depth sensors, people as trunks down to the floor.
    Output `people`: the poses of the people alone. Output `geometry_pose` places all in SceneGraph.

    People choose a velocity once a period, from the states at that time, and keep it until the
    next. So their ways are straight in between, and each person's position is exact at every
    instant. Discrete state: the time of their choice, s, and then the people (see
    `kernels.walking`). Recorded people choose nothing, and are FAR_AWAY_M while they are not in the
    world.

    footprint: (K, 2) of the robot, base frame, m. scan_height_m: height of the scanner's plane.
    """

    def __init__(
        self, world: World, scene_graph: SceneGraph, *, footprint: Array, scan_height_m: float
    ) -> None:
        super().__init__()
        self._things, self._people = world.moving, world.people
        everybody = world.people
        self._recorded = everybody if isinstance(everybody, RecordedPeople) else None
        self._walkers = NOBODY if isinstance(everybody, RecordedPeople) else everybody
        self._walk = walk_of(world, footprint)
        self._standing = (world.segments, world.circles)
        self._footprint, self._scan_height_m = footprint, scan_height_m
        self._seen_things = world.moving.seen_at(scan_height_m)
        self.person_count = len(world.people)
        self.body_count = len(world.moving) + self.person_count
        self.source_id = scene_graph.RegisterSource("moving_world")
        self._frame_ids = self._register(scene_graph)
        self._state_port = self.DeclareVectorInputPort("state", STATE_SIZE)
        crowd = self._walkers.crowd(seed=0)
        self.crowd_parameter = self.DeclareAbstractParameter(AbstractValue.Make(crowd))
        depends = {self.time_ticket()}
        if len(self._walkers):
            self._chosen = self.DeclareDiscreteState([0.0, *crowd.state.ravel()])
            self.DeclarePeriodicDiscreteUpdateEvent(
                PEOPLE_PERIOD_S, 0.0, weakly_bound(self._on_period)
            )
            depends.add(self.discrete_state_ticket(self._chosen))
        self.DeclareVectorOutputPort(
            "poses",
            POSE_SIZE * self.body_count,
            weakly_bound(self._calc_poses),
            prerequisites_of_calc=depends,
        )
        self.DeclareVectorOutputPort(
            "people",
            POSE_SIZE * len(world.people),
            weakly_bound(self._calc_people),
            prerequisites_of_calc=depends,
        )
        declare_object_output(self, "outlines", self._outlines, depends)
        declare_object_output(self, "scanned", self._scanned, depends)
        declare_object_output(self, "solids", self._solids, depends)
        self._geometry_pose_port = self.DeclareAbstractOutputPort(
            "geometry_pose",
            lambda: AbstractValue.Make(FramePoseVector()),
            weakly_bound(self._calc_geometry_pose),
            prerequisites_of_calc=depends,
        )

    def get_geometry_pose_output_port(self) -> OutputPort:
        """Returns the port for SceneGraph's source pose port."""
        return self._geometry_pose_port

    def set_seed(self, context: Context, seed: int, start_pose: Array | None = None) -> None:
        """Puts the people at their start of the trial with this seed.

        start_pose: (3,) of the robot. People do not start on it, nor on obstacles.
        """
        edges, circles = self._placed_things(context)
        edges = np.vstack([self._standing[0], edges])
        circles = np.vstack([self._standing[1], circles])
        if start_pose is not None:
            outline = place_outline(self._footprint, start_pose)
            edges = np.vstack([edges, np.hstack([outline, np.roll(outline, -1, axis=0)])])

        def is_free(place: Array, radius_m: float) -> bool:
            x, y = place
            distance_m = nearest_point(x, y, edges, circles)[2]
            return bool(distance_m > radius_m and not covers(edges, circles, x, y))

        crowd = self._walkers.crowd(seed, is_free)
        context.get_mutable_abstract_parameter(self.crowd_parameter).set_value(crowd)
        if len(self._walkers):
            own = context.get_mutable_discrete_state(self._chosen)
            own.SetFromVector([context.get_time(), *crowd.state.ravel()])

    def people_at(self, context: Context) -> Array:
        """Returns (P, 8) all people's states at a context's time; see `kernels.walking`."""
        if self._recorded is not None:
            return self._recorded.people_at(context.get_time())
        if not len(self._walkers):
            return np.empty((0, PERSON_SIZE))
        held = context.get_discrete_state(self._chosen).value()
        people = held[1:].reshape(-1, PERSON_SIZE)
        return people_after(people, context.get_time() - held[0])

    def _people_there(self, context: Context) -> Array:
        """Returns (Q, 8) the states of the people who are in the world."""
        people = self.people_at(context)
        return people if self._recorded is None else people[people[:, 0] < FAR_AWAY_M]

    def poses(self, context: Context) -> Array:
        """Returns (B, 3) x m, y m, yaw rad of every body."""
        people = self.people_at(context)[:, : YAW + 1]
        return np.vstack([self._things.tracks.poses_at(context.get_time()), people])

    def _on_period(self, context: Context, discrete_state: DiscreteValues) -> None:
        assert self._walk is not None
        time_s = context.get_time()
        held = context.get_discrete_state(self._chosen).value()
        crowd: Crowd = context.get_abstract_parameter(self.crowd_parameter).get_value()
        people = self._walk.step(
            np.ascontiguousarray(held[1:].reshape(-1, PERSON_SIZE)),
            crowd,
            time_s,
            self._state_port.Eval(context),
            time_s - held[0],
        )
        after = np.concatenate([[time_s], people.ravel()])
        discrete_state.get_mutable_vector(self._chosen).SetFromVector(after)

    def _calc_poses(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.poses(context).ravel())

    def _calc_people(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(self.people_at(context)[:, : YAW + 1].ravel())

    def _outlines(self, context: Context) -> tuple[Array, Array]:
        edges, circles = self._placed_things(context)
        people = self.people_at(context)[:, :2]
        return edges, np.vstack([circles, np.column_stack([people, self._people.radii_m])])

    def _scanned(self, context: Context) -> tuple[Array, Array]:
        edges, circles = self._seen_things.placed(self._things.tracks.poses_at(context.get_time()))
        people = self._people_there(context)
        speeds_mps = np.hypot(people[:, VX], people[:, VY])
        discs = scanned_discs(
            people[:, : YAW + 1], people[:, WALKED], speeds_mps, self._scan_height_m
        )
        return edges, np.vstack([circles, discs])

    def _solids(self, context: Context) -> Solids:
        edges, circles = self._placed_things(context)
        people = self._people_there(context)[:, :2]
        trunks = np.column_stack([people, np.full(len(people), TRUNK_RADIUS_M)])
        heights_m = self._things.heights_m
        boxes, starts = np.unique(self._things.bodies.edges[:, 0], return_index=True)
        of_discs = heights_m[self._things.bodies.discs[:, 0].astype(int)]
        return Solids(
            edges,
            np.append(starts, len(edges)),
            np.zeros(len(boxes)),
            heights_m[boxes.astype(int)],
            np.vstack([circles, trunks]),
            np.zeros(len(circles) + len(trunks)),
            np.concatenate([of_discs, np.full(len(people), PERSON_HEIGHT_M)]),
        )

    def _placed_things(self, context: Context) -> tuple[Array, Array]:
        return self._things.bodies.placed(self._things.tracks.poses_at(context.get_time()))

    def _calc_geometry_pose(self, context: Context, output: AbstractValue) -> None:
        placed = output.get_mutable_value()
        for frame_id, (x, y, yaw) in zip(self._frame_ids, self.poses(context), strict=True):
            rotation = RotationMatrix.MakeZRotation(yaw)
            placed.set_value(frame_id, RigidTransform(rotation, [x, y, 0.0]))

    def _register(self, scene_graph: SceneGraph) -> list[FrameId]:
        shapes = [(*moving_shape(thing), MOVING_COLOR) for thing in self._things.things]
        shapes += [(*body_of(radius_m), PERSON_COLOR) for radius_m in self._people.radii_m]
        frame_ids = []
        for index, (pose, shape, color) in enumerate(shapes):
            frame_ids.append(
                scene_graph.RegisterFrame(self.source_id, GeometryFrame(f"moving_{index}"))
            )
            instance = GeometryInstance(pose, shape, f"moving_{index}")
            geometry_id = scene_graph.RegisterGeometry(self.source_id, frame_ids[-1], instance)
            scene_graph.AssignRole(
                self.source_id, geometry_id, MakePhongIllustrationProperties(color)
            )
        return frame_ids
