"""Known cases: complaints of users whose cure is known, given to the doctor, and its score.

A case gives a symptom, a release, a controller, what is told of the robot, and a whole file or
named values. The doctor sees these alone. The cure that the case tells is read for the score only.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict

from drake_navbench.errors import InputError
from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.alike import Told
from drake_navbench.studies.doctor.causes import OUTSIDE, RELEASE, Cause, Direction
from drake_navbench.studies.doctor.complaints import symptoms_called
from drake_navbench.studies.doctor.facts import CONTROLLER, Facts, kinds_of
from drake_navbench.studies.doctor.file_places import OF_SOURCES
from drake_navbench.studies.doctor.left_out import readable_setup
from drake_navbench.studies.doctor.partial_files import (
    OTHER_NAMES,
    facts_of_values,
    is_old,
    kind_in,
)
from drake_navbench.studies.doctor.reading import Suspicion, suspicions_of
from drake_navbench.studies.doctor.suspects import suspects_of
from drake_navbench.typed_files.typed_yaml import read_yaml, validate

TOP = 3
# Words for a thing outside of the file, in the cure of a case -> the doctor's name for it.
OUTSIDE_WORDS = {
    "compute": r"compute|cpu|build|computer|processor",
    "imu_frame": r"imu",
    "frames": r"\btf\b|frame",
    "sensor_frame": r"sensor|lidar|laser|urdf",
    "odometry": r"odom|encoder|wheel",
    "localization": r"locali[sz]ation|amcl|map",
    "clock": r"clock|sim_time|time sync",
    "lag": r"\blag|delay|latency",
    "deadband": r"deadband|stiction|minimum speed",
}
# The parameters of an obstacle layer's sources that a cure names with the source.
OF_A_SOURCE = frozenset(name.replace("_", "") for name in (*OF_SOURCES, "topic"))
# Other names of the same parameters.
SAME = {
    "height": "width",
}


class Case(BaseModel):
    """A known case. culprits: by parameter, the direction of the cure."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    id: str
    link: str = ""
    release: str = ""
    controller: str = ""
    robot: str = ""
    symptom_class: str
    symptom: str = ""
    parameters: dict[str, Any] = {}
    culprits: dict[str, Any] = {}
    reproducible: str = ""

    @property
    def words(self) -> str:
        """The complaint and the robot in the user's words."""
        return f"{self.symptom}; {self.robot}"

    @property
    def is_reproducible(self) -> bool:
        """Whether the case gives a whole or a partial file."""
        return not self.reproducible.startswith("no")


class Scored(NamedTuple):
    """A case with the doctor's answer. rank: of the first hit, from 1; None without one.

    has_file: whether the doctor saw the whole file. skipped: why the doctor could not read it.
    why: what keeps a cure from the first rank.
    """

    case: Case
    causes: tuple[Suspicion, ...]
    rank: int | None
    has_file: bool
    skipped: str = ""
    why: str = ""


def read_cases(path: Path) -> list[Case]:
    """Returns the cases of a file; raises InputError."""
    data = read_yaml(path)
    entries = data.get("known") or data.get("cases") if isinstance(data, dict) else data
    if not isinstance(entries, list):
        raise InputError(f"{path}: expected a list of cases below `known`")
    return [
        validate(Case, entry, f"{path}, case {number}") for number, entry in enumerate(entries, 1)
    ]


def files_of(case: Case, folder: Path | None) -> list[Path]:
    """Returns the Nav2 files of a case: ID.yaml, or ID_1.yaml, ID_2.yaml, merged in their order."""
    if folder is None:
        return []
    return sorted({*folder.glob(f"{case.id}.yaml"), *folder.glob(f"{case.id}_*.yaml")})


def score_case(case: Case, folder: Path | None) -> Scored:
    """Returns the doctor's answer to a case; a case whose symptom is unknown counts as missed."""
    files = files_of(case, folder)
    try:
        facts = facts_of_case(case, folder)
        symptom = symptoms_called(case.symptom_class)[0]
    except InputError as error:
        return Scored(case, (), None, bool(files), str(error))
    found = suspicions_of(facts, symptom, Told(case.words))
    hits = (rank for rank, entry in enumerate(found, 1) if is_hit(entry.cause, case, facts))
    rank = next(hits, None)
    why = _why_not_first(rank, found, case, facts)
    return Scored(case, tuple(found[:TOP]), rank, bool(files), why=why)


def _why_not_first(rank: int | None, found: Sequence[Suspicion], case: Case, facts: Facts) -> str:
    """Returns the reason why no cure has the first rank; '' where one has it."""
    if rank == 1:
        return ""
    if rank is not None:
        return f"the cure is cause {rank} of {len(found)}: others are likelier by their scores"
    for place, entry in enumerate(found, 1):
        if has_place(entry.cause, case, facts):
            return f"the doctor has the parameter as cause {place}, but in the other direction"
    return f"the cure is none of the {len(found)} causes that the doctor knows for this symptom"


def facts_of_case(case: Case, folder: Path | None) -> Facts:
    """Returns the facts of a case's files in a folder, or of the values that it names."""
    files = files_of(case, folder)
    if not files:
        return facts_of_values(case.controller, case.release, case.parameters)
    release = next((r for r in Release if r in case.release.lower()), None)
    found = readable_setup(files, "wheelchair", release=release)
    presets = found.setup.presets
    own = [p for p in presets if kinds_of(p)[-1] == kind_in(case.controller)]
    facts = found.facts(next(iter(own or presets), None))
    return replace(facts, told={"release": "old"}) if is_old(case.release) else facts


def is_hit(cause: Cause, case: Case, facts: Facts) -> bool:
    """Tells whether a cause is one of a case's culprits, in the direction of its cure."""
    return any(_is_culprit(cause, name, cure, facts) for name, cure in case.culprits.items())


def has_place(cause: Cause, case: Case, facts: Facts) -> bool:
    """Tells whether a cause is one of a case's culprits, in whatever direction."""
    return any(_same_place(cause.place, name) for name in case.culprits)


def _is_culprit(cause: Cause, name: str, cure: Any, facts: Facts) -> bool:
    plain = name.strip().lower()
    if cause.place == RELEASE:
        return plain in ("release", "software", "upgrade")
    first, _, thing = cause.place.partition(".")
    if first == OUTSIDE:
        pattern = OUTSIDE_WORDS.get(thing, thing)
        is_parameter = "." in plain or "_" in plain.partition(" ")[0]
        return not is_parameter and bool(re.search(pattern, plain))
    if plain in ("release", "software", "upgrade"):
        return False
    if cause.direction is Direction.ADD:
        is_plugin = plain == "plugin" and first == CONTROLLER
        return is_plugin or (plain == first and "add" in str(cure))
    return _same_place(cause.place, name) and _same_direction(cause, cure, facts)


def _same_place(place: str, name: str) -> bool:
    """Tells whether a culprit's name, perhaps with its node or critic, is a place's."""
    own = [_plain(part) for part in place.split(".")]
    today = OTHER_NAMES.get(name, name).replace("<", "").replace(">", "")
    theirs = [_plain(part) for part in today.split(".")]
    if theirs[-1] != own[-1]:
        return False
    qualifier = theirs[-2] if len(theirs) > 1 else ""
    known = {*own[:-1], "followpath", "controller", "polygon"}
    # The name of a source stands between that of its layer and the parameter.
    is_source = own[-1] in OF_A_SOURCE and any(part.endswith("layer") for part in theirs)
    is_costmap = own[0] in ("localcostmap", "globalcostmap") and (
        qualifier.endswith("layer") or is_source
    )
    is_monitor = own[0] == "collisionmonitor"
    if not qualifier:
        # A bare name may mean a parameter of the costmaps or checkers as well as the controller's.
        return len(own) < 3 or "*" in place
    return qualifier in known or is_costmap or is_monitor


def _plain(name: str) -> str:
    lowered = SAME.get(name.strip(), OTHER_NAMES.get(name.strip(), name.strip())).lower()
    return re.sub(r"[^a-z0-9*]", "", lowered)


def _same_direction(cause: Cause, cure: Any, facts: Facts) -> bool:
    text = str(cure).strip().lower()
    if re.match(r"up\b|above|more|higher|larger|increase|raise", text):
        return cause.direction is Direction.UP
    if re.match(r"down\b|below|less|lower|smaller|decrease|within|reduce", text):
        return cause.direction is Direction.DOWN
    number = _number(text)
    if number is not None and cause.is_number:
        value = facts[cause.place]
        value = value[0] if isinstance(value, list | tuple) and value else value
        if isinstance(value, int | float) and not isinstance(value, bool):
            return (number > value) == (cause.direction is Direction.UP)
        return (cause.direction is Direction.DOWN) == (number == 0.0)
    if cause.direction is not Direction.SET:
        return text in ("set", "change", "tune")
    # A plugin may be named with its package or without it.
    wanted = str(cause.to).rpartition("::")[2].lower()
    return cause.to is None or wanted in text or text in ("set", "add")


def _number(text: str) -> float | None:
    found = re.match(r"=?\s*(-?\d+\.?\d*)", text)
    return float(found[1]) if found else None


class Score(NamedTuple):
    """The number of cases with a hit as the first cause, and among the first three."""

    name: str
    cases: int
    first: int
    among_three: int

    @property
    def text(self) -> str:
        """The score as one line of a table."""
        if not self.cases:
            return f"| {self.name} | 0 | | | | |"
        first, three = (100 * count / self.cases for count in (self.first, self.among_three))
        shares = f"{first:.0f}% | {three:.0f}%"
        return f"| {self.name} | {self.cases} | {self.first} | {self.among_three} | {shares} |"


def score_of(name: str, scored: Sequence[Scored]) -> Score:
    """Returns the score of some cases."""
    ranks = [entry.rank for entry in scored]
    first = sum(rank == 1 for rank in ranks)
    return Score(name, len(ranks), first, sum(rank is not None and rank <= TOP for rank in ranks))


def scores_without_skill(cases: Sequence[Case]) -> list[Score]:
    """Returns the scores, on the same cases, of methods that do not read the file.

    Three: the culprits that most other cases of the symptom have; a value that the case names,
    with a coin for its direction; and the doctor's table of suspects, by its weights alone.
    """
    frequent = [Scored(case, (), _rank_of_frequent(case, cases), False) for case in cases]
    of_one, of_three = (round(sum(_share_named(c, count) for c in cases)) for count in (1, TOP))
    table = [Scored(case, (), _rank_in_table(case), False) for case in cases]
    return [
        score_of("no skill: the most frequent culprit of the other cases", frequent),
        Score("no skill: a named value, a coin for its direction", len(cases), of_one, of_three),
        score_of("the doctor's table alone, without file and words", table),
    ]


def _rank_of_frequent(case: Case, cases: Sequence[Case]) -> int | None:
    """Returns the rank of a case's first culprit among the commonest culprits of other cases."""
    counts: Counter[tuple[str, str]] = Counter()
    for other in cases:
        if other.id != case.id and other.symptom_class == case.symptom_class:
            counts.update(plain_culprits(other))
    own = set(plain_culprits(case))
    ranked = [culprit for culprit, _ in counts.most_common()]
    return next((rank for rank, culprit in enumerate(ranked, 1) if culprit in own), None)


def plain_culprits(case: Case) -> list[tuple[str, str]]:
    """Returns the culprits' parameters without node or critic, and the first word of each cure."""
    return [
        (_plain(name.split(".")[-1]), str(cure).split(" ")[0])
        for name, cure in case.culprits.items()
    ]


def _rank_in_table(case: Case) -> int | None:
    try:
        symptom = symptoms_called(case.symptom_class)[0]
        facts = facts_of_values(case.controller, case.release, {})
    except InputError:
        return None
    own = sorted(suspects_of(symptom, facts.kinds), key=lambda suspect: -suspect.weight)
    hits = (rank for rank, suspect in enumerate(own, 1) if is_hit(suspect.cause, case, facts))
    return next(hits, None)


def _share_named(case: Case, count: int = 1) -> float:
    """Returns the chance that one of `count` named values, turned at random, is a culprit."""
    names = list(case.parameters)
    if not names:
        return 0.0
    bare = {_plain(name.split(".")[-1]) for name in case.culprits}
    right = sum(_plain(name.split(".")[-1]) in bare for name in names)
    missed = 1.0
    for drawn in range(min(count, len(names))):
        wrong = len(names) - right - drawn
        missed *= max(wrong, 0) / (len(names) - drawn) + 0.5 * right / len(names)
    return max(0.0, 1.0 - min(missed, 1.0))


def clusters(scored: Sequence[Scored], owner: str) -> list[Scored]:
    """Returns the cases that do not come from an owner's repository."""
    return [entry for entry in scored if owner.lower() not in entry.case.link.lower()]


def most_frequent_owner(cases: Sequence[Case]) -> str:
    """Returns the owner with the most cases; Nav2's own threads are of many users."""
    owners = Counter(case.link.partition("/")[0] for case in cases)
    owners.pop("ros-navigation", None)
    return owners.most_common(1)[0][0] if owners else ""
