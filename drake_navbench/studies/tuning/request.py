"""The request for a tuning study, and the limits of its size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from drake_navbench.analysis.numbers import counted
from drake_navbench.campaign.request import MAX_TRIALS
from drake_navbench.errors import InputError
from drake_navbench.inputs.goal_file import read_goal_file
from drake_navbench.inputs.goal_tasks import given_tasks
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.tuning.judgement import least_pairs
from drake_navbench.studies.tuning.study import Sampler
from drake_navbench.trial.goal_sampling import sample_tasks

HELD_OUT = "held_out"
# The seed of the held-out tasks, relative to the study's.
SEED_OF_OTHER_TASKS = 4


@dataclass(frozen=True)
class TuningRequest:
    """The arguments of a search; `command`: the command line that the written files name.

    preset: name of the baseline's preset; '' if the baseline is the controller `plugin` of the Nav2
    file `nav2`. fresh: trials of the front in each scenario on fresh seeds, and in each held-out
    scenario; more in deciding scenarios where fewer cannot decide. map_file, goals: a map, and the
    number of tasks drawn on it for the search, or a file of places between which they lead;
    `deciding_pairs` further tasks are drawn and held out. added_range_std_m: noise that the search
    adds to a lidar without any on these tasks, 0 for none.
    """

    preset: str
    scenarios: tuple[str | Scenario, ...]
    objectives: tuple[str, ...]
    held_out: tuple[str | Scenario, ...]
    parameters: tuple[str, ...]
    configurations: int
    most_pairs: int
    most_front_points: int
    fresh: int
    seed: int
    robot: str
    sampler: Sampler
    jobs: int
    out: Path
    command: str
    search_only: bool = False
    nav2: Path | None = None
    plugin: str | None = None
    map_file: Path | None = None
    goals: int | Path = 0
    added_range_std_m: float = 0.0

    @property
    def deciding(self) -> tuple[str | Scenario, ...]:
        """The scenarios that decide who beats the baseline."""
        return self.held_out or self.scenarios

    @property
    def deciding_pairs(self) -> int:
        """The pairs in each deciding scenario: `fresh`, or as many as can decide.

        For tasks on a map it is the number of tasks.
        """
        places = 1 if self.goals else len(self.deciding)
        least = least_pairs(self.most_front_points, places, len(self.objectives))
        return max(self.fresh, least)

    def trials_in(self, scenarios: Sequence[str | Scenario]) -> int:
        """Returns the trials of each scenario that judge the front; a task on a map has one."""
        if self.goals:
            return 1
        return self.deciding_pairs if scenarios == self.deciding else self.fresh

    @property
    def place(self) -> str:
        """The scenarios, or the map, in which the study drives, for messages."""
        if self.map_file is not None:
            return f"{counted(len(self.scenarios), 'task')} on {self.map_file.name}"
        return ", ".join(names_of(self.scenarios))

    def with_tasks(self, robot: Robot) -> TuningRequest:
        """Returns the request with its tasks on its map, where a robot's outline has room."""
        if self.map_file is None:
            return self
        if isinstance(self.goals, Path):
            own = given_tasks(read_goal_file(self.goals), self.map_file, [robot])
        else:
            own = sample_tasks(self.map_file, robot, self.goals, seed=self.seed)
        drawn = sample_tasks(
            self.map_file, robot, self.deciding_pairs, seed=self.seed + SEED_OF_OTHER_TASKS
        )
        other = [task.model_copy(update={"name": f"{task.name}_{HELD_OUT}"}) for task in drawn]
        return replace(self, scenarios=tuple(own), held_out=tuple(other))


def names_of(scenarios: Sequence[str | Scenario]) -> tuple[str, ...]:
    """Returns the names of scenarios."""
    return tuple(s if isinstance(s, str) else s.name for s in scenarios)


def require_scenarios_and_bounds(request: TuningRequest) -> None:
    """Raises InputError for no scenario, one named twice, or too large a number."""
    if bool(request.preset) == (request.nav2 is not None):
        raise InputError("expected either PRESET or --nav2 FILE")
    if (request.map_file is None) != (not request.goals):
        raise InputError("--map: expected --goals with it, and --goals only with --map")
    if request.map_file is not None and request.nav2 is None:
        raise InputError("--map: expected --nav2 FILE with it; a preset takes --scenarios")
    if not request.scenarios and request.map_file is None:
        raise InputError("--scenarios: expected at least one, or --map FILE with --goals")
    if request.scenarios and request.map_file is not None:
        raise InputError("--scenarios: expected none beside --map")
    doubled = sorted(set(names_of(request.scenarios)) & set(names_of(request.held_out)))
    if doubled:
        raise InputError(
            f"--held-out {doubled[0]}: is a scenario of the search as well; expected another one"
        )
    counts = {
        "--pairs": request.most_pairs,
        "--fresh": request.fresh,
        "--configurations": request.configurations,
    }
    for option, count in counts.items():
        if count > MAX_TRIALS:
            raise InputError(f"{option}: got {count}, expected at most {MAX_TRIALS}")
