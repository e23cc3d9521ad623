"""The columns of harmony's ablations: its settings, and the functions that each one replaces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Any, NamedTuple
from unittest import mock

from harmony_judgement import OURS

from drake_navbench.controllers.harmony import controller, planner, way_finder
from drake_navbench.controllers.harmony.interior_point import Solution
from drake_navbench.controllers.harmony.terms import TERMS, plan_cost
from drake_navbench.inputs.timing import TimingSettings


def _as_guessed(scene: Any, guess: Any, settings: Any) -> Solution:
    return Solution(guess, plan_cost(scene, guess), 0.0, 0, True)


def _once(self: Any, scene: Any, way: Any, guess: Any, is_warm: bool, window: int) -> Any:
    # A cold start counts as solved, so that no second one follows.
    found = IMPROVED(self, scene, way, guess, is_warm, window)
    return found if is_warm else found._replace(solved=True)


def _anew(self: Any, scene: Any, start: Any, way: Any, *, driven: Any, elapsed_s: float) -> Any:
    return CANDIDATE(self, scene, start, way, driven=None, elapsed_s=elapsed_s)


def _without_pursuit(self: Any, *scene: Any) -> Any:
    *last_plan, _, stop = GUESSES(self, *scene)
    return [*last_plan, stop]


def _without_stop(self: Any, *scene: Any) -> Any:
    return GUESSES(self, *scene)[:-1]


def _told(share: float) -> Any:
    def response_of(setup: Any) -> Any:
        true = RESPONSE_OF(setup)
        return true._replace(time_constant_s=true.time_constant_s / (1.0 + share))

    return response_of


IMPROVED, CANDIDATE = planner.Planner._improved, planner.Planner.candidate
GUESSES, RESPONSE_OF = planner.Planner._guesses, controller.response_of


class Part(NamedTuple):
    """A column of the ablation: the settings of harmony, and what is replaced in its modules.

    against: the column that it is compared with. watched: functions and what they are replaced by;
    while they return nothing else than that would, a trial is the same without the part.
    """

    settings: str = ""
    replaced: tuple[tuple[Any, str, Any], ...] = ()
    against: str = OURS
    watched: tuple[tuple[Any, str, Any], ...] = ()

    @contextmanager
    def off(self) -> Iterator[None]:
        """Replaces for a while."""
        with ExitStack() as stack:
            for owner, name, value in self.replaced:
                stack.enter_context(mock.patch.object(owner, name, value))
            yield


def _seldom(owner: Any, name: str, value: Any) -> Part:
    """Returns a part that is one function, which seldom returns something else than `value`."""
    return Part("", ((owner, name, value),), watched=((owner, name, value),))


WRONG = (controller, "response_of", _told(0.3))
NO_WAY_PAST = (way_finder.WayFinder, "_new_detour", lambda *_: None)
PARTS: Mapping[str, Part] = {
    OURS: Part(),
    "program": Part("", ((planner, "solve", _as_guessed),)),
    "second start of the program": _seldom(planner.Planner, "_improved", _once),
    "last plan as a guess": Part("", ((planner.Planner, "candidate", _anew),)),
    "stop as a guess": Part("", ((planner.Planner, "_guesses", _without_stop),)),
    "ways past obstacles": _seldom(*NO_WAY_PAST),
    "ways past that keep off": _seldom(way_finder.WayFinder, "_has_room_along", lambda *_: True),
    "ways past that keep to the plan": Part(
        "", ((way_finder, "Keeping", lambda *_: way_finder.AMPLE),), watched=(NO_WAY_PAST,)
    ),
    "notice of plans that get nowhere": _seldom(controller, "is_trapped", lambda *_: False),
    "backing up": _seldom(way_finder.WayFinder, "_backed_up", lambda self, way, *_, **__: way),
    "target behind the obstacle": _seldom(way_finder, "around", lambda way: way),
    "slow before giving up": _seldom(way_finder, "up_to_blocked", lambda way, _: way),
    "gatekeeper": _seldom(controller.Harmony, "_accepts", lambda *_: True),
    "rest behind the goal": Part("", ((way_finder, "DRIVES_ON_SHARE", 0.0),)),
    "loose alignment": Part("", ((planner, "LOOSE_ALIGNMENT_SHARE", 1.0),)),
    "keeping off in turns": Part("", ((controller, "SWEEP_RATIO", 0.0),)),
    "learning, response known": Part(":response_error=0.0"),
    "pursuit as a guess": Part("", ((planner.Planner, "_guesses", _without_pursuit),)),
}
WEIGHTS = {f"weights.{name}": Part(f":weights.{name}=0.0") for name in TERMS}
LATE = TimingSettings(command_latency_s=0.2)
ON_OTHER_ROBOTS: Mapping[str, Part] = {
    "late": Part(),
    "late, delay prediction": Part(
        "", ((controller.Harmony, "_latency_s", lambda *_: 0.0),), "late"
    ),
    "told wrong": Part("", (WRONG,)),
    "told wrong, learning": Part(":response_error=0.0", (WRONG,), "told wrong"),
}
ROBOT_FAMILIES = ("box_on_path", "clutter", "doorway", "s_curve")
# Deleted since its rows were driven; they can still be judged.
GONE: Mapping[str, Part] = {"plan so far and gentle stop": Part()}
COLUMNS = {**PARTS, **GONE, **ON_OTHER_ROBOTS, **WEIGHTS}
# The parts that harmony_ablations.csv shows without worth, and that harmony_set.py puts back.
SET = (
    *("stop as a guess", "backing up", "ways past that keep off", "slow before giving up"),
    "notice of plans that get nowhere",
)


@contextmanager
def without(names: tuple[str, ...]) -> Iterator[None]:
    """Takes several parts out together, for a while."""
    with ExitStack() as stack:
        for name in names:
            stack.enter_context(PARTS[name].off())
        yield


@contextmanager
def watching() -> Iterator[set[str]]:
    """Yields a set that gets the names of the parts whose watched functions make a difference."""
    found: set[str] = set()
    with ExitStack() as stack:
        for name, part in COLUMNS.items():
            for owner, attribute, value in part.watched:
                watched = _watched(getattr(owner, attribute), value, found, name)
                stack.enter_context(mock.patch.object(owner, attribute, watched))
        yield found


def _watched(original: Any, value: Any, found: set[str], name: str) -> Any:
    def watched(*arguments: Any, **named: Any) -> Any:
        result = original(*arguments, **named)
        if value is _once:
            # A cold start that is solved, and a warm one, are the same.
            other = result if arguments[4] or result.solved else None
        else:
            other = value(*arguments, **named)
        is_same = result is other or (isinstance(other, bool) and bool(result) == other)
        if not is_same:
            found.add(name)
        return result

    return watched
