"""A scenario on one floor: a world, a task in it, and the planner's knowledge of it.

A scenario without floors is a FloorScenario, and so is each floor of a mission.
"""

from __future__ import annotations

from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Literal, NamedTuple, Self

from pydantic import Field, field_validator

from drake_navbench.inputs.map_world import occupied_boxes
from drake_navbench.inputs.moving_obstacles import MovingObstacles
from drake_navbench.inputs.named_files import NamedFiles
from drake_navbench.inputs.people import WalkingPeople
from drake_navbench.inputs.recorded_people import RecordedPeople, load_recording
from drake_navbench.inputs.scenario_plan import GridPlan, Plan
from drake_navbench.inputs.scenario_world import WorldDescription, require_one_of_each
from drake_navbench.inputs.world import World
from drake_navbench.navigation.costmaps.filter_masks import (
    FilterDescription,
    FilterMask,
    Lattice,
    load_filter_mask,
)
from drake_navbench.navigation.costmaps.map_file import OccupancyMap, load_map
from drake_navbench.typed_files.quantities import (
    Duration,
    Pose,
)
from drake_navbench.typed_files.typed_yaml import QuietModel

SCENARIO_FILES = NamedFiles(kind="scenario", package="drake_navbench.scenarios")
# The margin by which drawn masks reach beyond everything else, m.
MASK_MARGIN_M = 2.0
MASK_RESOLUTION_M = 0.05


class GivenMaps(NamedTuple):
    """The map of a scenario and the masks of its filters, in place of those of its files.

    masks: None: they are read from their files.
    """

    grid: OccupancyMap | None
    masks: tuple[FilterMask, ...] | None = None


class FloorScenario(QuietModel):
    """One world with a task in it."""

    description: str = Field(
        min_length=1, description="Description of the scenario in one line, for --list."
    )
    world: WorldDescription = Field(default_factory=WorldDescription)
    start: Pose = Field(
        (0.0, 0.0, 0.0), description="Start pose in the world frame: x [m], y [m], yaw [rad]."
    )
    goal: Pose = Field(
        (0.0, 0.0, 0.0),
        description="Goal pose in the world frame: x [m], y [m], yaw [rad]; required without "
        "a mission.",
    )
    filters: list[FilterDescription] = Field(
        default_factory=list,
        description="Areas of keepout, of limited speed or with a binary state.",
    )
    plan: Plan = Field(default_factory=lambda: GridPlan(type="planner"))
    waypoints: list[Pose] = Field(
        default_factory=list,
        description="Goals to reach in order before `goal`; in navigate_through_poses poses to "
        "pass.",
    )
    navigation_mode: Literal["follow_path", "navigate_to_pose", "navigate_through_poses"] = Field(
        "follow_path",
        description="follow_path: plan once, abort when the controller fails. "
        "navigate_to_pose: Nav2's default behaviour tree, with replanning and "
        "recoveries, to each goal. navigate_through_poses: likewise, with one plan through all "
        "waypoints to the goal, at which alone the robot stops.",
    )
    timeout_s: Duration = Field(
        120.0, gt=0.0, description="Time after which the trial ends as timed_out [s]."
    )
    name: str = Field("", description="Name of the file; set by the loader.")
    directory: str = Field("", exclude=True, description="Folder of the file; set by the loader.")
    _maps: GivenMaps | None = None

    @field_validator("filters")
    @classmethod
    def _check_one_of_each(cls, filters: list[FilterDescription]) -> list[FilterDescription]:
        return require_one_of_each(filters)

    @property
    def goals(self) -> tuple[Pose, ...]:
        """The goals in the world: waypoints, and then the goal."""
        return (*self.waypoints, self.goal)

    def with_maps(
        self, grid: OccupancyMap | None, masks: tuple[FilterMask, ...] | None = None
    ) -> Self:
        """Returns the scenario with a map, and masks, that have been read already."""
        other = self.model_copy()
        other._maps = GivenMaps(grid, masks)
        return other

    @cached_property
    def map(self) -> OccupancyMap | None:
        """The map; raises InputError where it cannot be read."""
        if self._maps is not None:
            return self._maps.grid
        return None if self.world.map is None else load_map(self._beside(self.world.map))

    @cached_property
    def filter_masks(self) -> tuple[FilterMask, ...]:
        """The masks of the filters; raises InputError where one is wrong."""
        if self._maps is not None and self._maps.masks is not None:
            return self._maps.masks
        return tuple(
            load_filter_mask(
                entry,
                file=None if entry.mask is None else self._beside(entry.mask),
                bounds=self._bounds,
                lattice=self._lattice,
            )
            for entry in self.filters
        )

    @property
    def files(self) -> list[Path]:
        """The scenario's map and mask files, with their images, and the recording."""
        grids = [self.map, *(mask.grid for mask in self.filter_masks)]
        found = [path for grid in grids if grid is not None for path in grid.files]
        return found if self._recording is None else [*found, self._recording]

    @property
    def _recording(self) -> Path | None:
        """The file of recorded people."""
        people = self.world.people
        if people is None or people.recording is None:
            return None
        return self._beside(people.recording.file)

    def _beside(self, name: str) -> Path:
        """Returns a file that the scenario names: beside its own, or one of the package."""
        return SCENARIO_FILES.beside(self.directory, name)

    @cached_property
    def file_hashes(self) -> dict[str, str]:
        """The SHA-256 of each of the `files`, by path."""
        return {str(path): sha256(path.read_bytes()).hexdigest() for path in self.files}

    @property
    def _lattice(self) -> Lattice:
        """The lattice of drawn masks: the map's, or one with the start in the centre of a cell."""
        if self.map is not None:
            return Lattice(self.map.origin_x, self.map.origin_y, self.map.resolution)
        half = 0.5 * MASK_RESOLUTION_M
        return Lattice(self.start[0] - half, self.start[1] - half, MASK_RESOLUTION_M)

    @property
    def _bounds(self) -> tuple[float, float, float, float]:
        """min_x, min_y, max_x, max_y m of poses, map and obstacles."""
        points = [pose[:2] for pose in (self.start, *self.goals)]
        if self.map is not None:
            points += [self.map.bounds[:2], self.map.bounds[2:]]
        return World(tuple(self.world.obstacles)).bounds(points, MASK_MARGIN_M)

    @cached_property
    def true_world(self) -> World:
        """Everything that is in the world."""
        standing = self.map if self.world.map_stands else None
        walls = occupied_boxes(standing) if standing is not None else ()
        moving = MovingObstacles(tuple(self.world.moving_obstacles))
        recorded = self._recorded_people
        people = WalkingPeople(self.world.people) if recorded is None else recorded
        return World(tuple(self.world.obstacles), walls, moving, people)

    @cached_property
    def _recorded_people(self) -> RecordedPeople | None:
        """The people of the recording; raises InputError where the file cannot be read."""
        people, path = self.world.people, self._recording
        if people is None or people.recording is None or path is None:
            return None
        return load_recording(path, people.recording, self.timeout_s)

    @cached_property
    def known_world(self) -> World:
        """The shapes that the planner's map shows, besides the map itself."""
        return World(tuple(o for o in self.world.obstacles if o.known_to_planner))
