"""What is asked of a tuning, and how much of it may be asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from drake_navbench.campaign.request import MAX_TRIALS
from drake_navbench.errors import InputError
from drake_navbench.studies.tuning.study import Sampler


@dataclass(frozen=True)
class TuningRequest:
    """The arguments of a search; `command` is the one that the files name as their maker.

    fresh: trials a scenario of the front on fresh seeds, and in each held-out scenario.
    """

    preset: str
    scenarios: tuple[str, ...]
    objectives: tuple[str, ...]
    held_out: tuple[str, ...]
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


def require_scenarios_and_bounds(request: TuningRequest) -> None:
    """Raises InputError where no scenario is named, one is named twice, or a count is too large."""
    if not request.scenarios:
        raise InputError("--scenarios: expected at least one")
    doubled = sorted(set(request.scenarios) & set(request.held_out))
    if doubled:
        raise InputError(f"--held-out {doubled[0]}: is searched in; expected another scenario")
    counts = {
        "--pairs": request.most_pairs,
        "--fresh": request.fresh,
        "--configurations": request.configurations,
    }
    for option, count in counts.items():
        if count > MAX_TRIALS:
            raise InputError(f"{option}: got {count}, expected at most {MAX_TRIALS}")
