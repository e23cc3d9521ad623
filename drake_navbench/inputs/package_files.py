"""The files found in a robot's repository, and the choice of one of each kind."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.clearpath_robot import is_clearpath, platform_of
from drake_navbench.inputs.launch_files import OF_MAPS, OF_MODELS, OF_NAV2, LaunchFiles
from drake_navbench.typed_files.assignments import assignments

# The names of the kinds on the command line.
ROBOT, NAV2, MAP, WORLD, GOALS = "robot", "nav2", "map", "world", "goals"
KINDS = (ROBOT, NAV2, MAP, WORLD, GOALS)
MAX_LISTED = 12
MAX_NAMED = 3
# Names of files that tell nothing of which robot it is.
ANY_ROBOT = ("robot", "model", "base", "main")
MASKS = re.compile(r"keep_?out|speed|limit|mask|filter")
CONTROLLERS = "controller_server"
# The nodes without which no robot navigates, and those that a Nav2 file may leave out.
NEEDED = frozenset(
    {"planner_server", "local_costmap", "global_costmap", "behavior_server", "bt_navigator"}
)
NODES = NEEDED | {
    *(CONTROLLERS, "smoother_server", "velocity_smoother", "collision_monitor"),
    "waypoint_follower",
}


@dataclass(frozen=True)
class PackageFiles:
    """files: of each kind, the likeliest first. roots: the folders that were looked through.

    launches: their launch files. without_picture: map files that name a picture that is not there.
    of_move_base: parameter files of ROS 1, which are not read. nodes: of Nav2 that a parameter file
    has, by file, the likeliest file first. unreadable: why a file that may be one of the robot's
    cannot be read.
    """

    roots: tuple[Path, ...]
    files: Mapping[str, tuple[Path, ...]] = field(default_factory=dict)
    launches: LaunchFiles = field(default_factory=LaunchFiles)
    without_picture: tuple[Path, ...] = ()
    of_move_base: tuple[Path, ...] = ()
    nodes: Mapping[Path, frozenset[str]] = field(default_factory=dict)
    unreadable: Mapping[Path, str] = field(default_factory=dict)

    def chosen(self, kind: str, pick: int | None) -> Path | None:
        """Returns a kind's file by its number in the list, counted from 1; None without one.

        pick: the number, 0 for none, None for the first, but for no goals. Raises InputError for a
        number too large.
        """
        found = self.files[kind]
        if pick is None and kind == GOALS:
            return None
        if pick is None:
            return found[0] if found else None
        if pick == 0:
            return None
        if pick > len(found):
            raise InputError(
                f"--pick {kind}={pick}: expected a number of the list, 1 to {len(found)}, or none"
            )
        return found[pick - 1]

    def fitting(self, kind: str, robot: Path | None) -> Path | None:
        """Returns the file of a kind that belongs to a robot, else the first.

        It has the robot's name in its path or, of several robots, a launch file names both, or its
        path shares the most words with the robot's that no other robot's path has.
        """
        found = self.files[kind]
        if robot is None or not found:
            return next(iter(found), None)
        own = [file for file in found if self._names(file, _name_of(robot))]
        others = [file for file in self.files[ROBOT] if file.parent != robot.parent]
        if not others or (own and _name_of(robot) not in ANY_ROBOT):
            return next(iter((*own, *found)))
        together = self.launches.started_with(robot, found)
        words = self._words(robot) - {word for file in others for word in self._words(file)}
        own = [together[0]] if together else self._launched_like(found)
        return max(own, key=lambda file: len(words & self._words(file)))

    def _launched_like(self, found: Sequence[Path]) -> list[Path]:
        """Returns the files that a launch file names, if it names the first one, else all."""
        launched = [file for file in found if self.launches.folders(file) >= 0]
        return launched if found[0] in launched else [*found]

    def halves(self, nav2: Path) -> dict[Path, frozenset[str]]:
        """Returns the files that bring nodes that a Nav2 file lacks, and these nodes, in order.

        A launch file names them beside it. Where no launch file names the Nav2 file, they are the
        only ones in its folder that have a node without which no robot navigates.
        """
        missing = NODES - self.nodes.get(nav2, NODES)
        is_launched = self.launches.folders(nav2) >= 0
        # A launch file means the nearest of several files with one name.
        near = sorted(self.nodes, key=lambda file: _shared_parts(file, nav2), reverse=True)
        others = {file: self.nodes[file] for file in near if CONTROLLERS not in self.nodes[file]}
        found: dict[Path, frozenset[str]] = {}
        for file, nodes in others.items():
            brought = nodes & missing
            if is_launched and self.launches.started_with(nav2, [file]) is None:
                continue
            if not is_launched:
                beside = [n for f, n in others.items() if f != file and f.parent == nav2.parent]
                brought &= NEEDED.difference(*beside) if file.parent == nav2.parent else set()
            if brought:
                found[file] = brought
                missing -= brought
        return found

    def not_of_others(self, kind: str, robot: Path | None) -> list[Path]:
        """Returns the files of a kind but those that are another robot's, by the names in paths."""
        if robot is None:
            return [*self.files[kind]]
        own = _name_of(robot)
        others = {_name_of(file) for file in self.files[ROBOT]} - {own, *ANY_ROBOT}
        return [
            file
            for file in self.files[kind]
            if self._names(file, own) or not any(self._names(file, other) for other in others)
        ]

    def picked(self, texts: Sequence[str]) -> dict[str, Path | None]:
        """Returns the file of each kind by `--pick kind=N`, else the likeliest; None without one.

        The Nav2 file that is not picked is the robot's; map and world that are not
        picked are those that a launch file starts with the Nav2 file. If it starts a world and none
        of several maps, no map is taken but one of the world's name. Raises InputError.
        """
        picks = read_picks(texts)
        files = {kind: self.chosen(kind, picks.get(kind)) for kind in KINDS}
        if NAV2 not in picks:
            files[NAV2] = self.fitting(NAV2, files[ROBOT])
        for kind in (MAP, WORLD):
            together = self._started_with(files, kind)
            if together is not None and kind not in picks:
                files[kind] = together[0]
            elif kind == MAP and kind not in picks:
                files[kind] = self._map_beside_world(files)
        return files

    def _map_beside_world(self, files: Mapping[str, Path | None]) -> Path | None:
        """Returns the map of a Nav2 file whose launch file names no map, but perhaps a world."""
        together = self._started_with(files, WORLD)
        if together is None or len(self.files[MAP]) < 2:
            return files[MAP]
        alike = [file for file in self.files[MAP] if is_map_of(together[0], self._short(file))]
        return next(iter(alike), None)

    def _started_with(
        self, taken: Mapping[str, Path | None], kind: str
    ) -> tuple[Path, Path] | None:
        """Returns the map or world that a launch file starts with the Nav2 file taken; no mask.

        A launch file that adds a mask often names no map.
        """
        nav2 = taken.get(NAV2)
        if nav2 is None:
            return None
        places = [file for file in self.files[kind] if kind != MAP or not is_mask(file)]
        places, robot = places or [*self.files[kind]], taken.get(ROBOT)
        together = self.launches.started_with(nav2, places, robot)
        if together is None and kind == MAP:
            return self.launches.started_with(nav2, places, robot, is_through=True)
        return together

    def options(self, picked: Mapping[str, Path | None], nav2: str) -> dict[str, object]:
        """Returns the values of --robot, --map and the option `nav2` that the files give."""
        robot, map_file, nav2_file = picked[ROBOT], picked[MAP], picked[NAV2]
        values: dict[str, object] = {} if robot is None else {"robot": str(robot)}
        values |= {} if map_file is None else {"map": map_file}
        if nav2_file is not None:
            values[nav2] = [*self.halves(nav2_file), nav2_file]
        return values

    def require_robot(self, robot: str | None, default: str | None) -> None:
        """Raises InputError if `robot` is the command line's default: no robot was found."""
        if robot == default:
            where = ", ".join(map(str, self.roots))
            raise InputError(
                f"--package {where}: no robot that drives in .xacro, .urdf, .sdf, .world or "
                ".model; expected one, or --robot NAME, such as jackal (`drake-navbench list`)"
                + "".join(f"; {line}" for line in self._unreadable_told()[:1])
            )

    def lines(self, picked: Mapping[str, Path | None]) -> list[str]:
        """Returns the list of files found, the chosen ones marked, and how to choose another.

        picked: the chosen file of each kind that is listed, or None.
        """
        told = []
        for kind in picked:
            found = self.files[kind]
            if not found and kind == GOALS:
                continue
            if not found:
                told.append(f"{kind}: none found{self._instead(kind)}")
                told += self._not_there(kind, picked) if kind == MAP else []
                continue
            how = f", another by --pick {kind}=N" if len(found) > 1 else ""
            how = f", used by --pick {kind}=N" if kind == GOALS else how
            told.append(f"{kind}: {len(found)} found{how}")
            for number, file in enumerate(found, start=1):
                mark = "*" if file == picked[kind] else " "
                if number > MAX_LISTED and mark == " ":
                    continue
                how = self._launched(file, kind, picked) if mark == "*" else ""
                told.append(f"  {mark} {number:2} {self._short(file)}{how}")
                if kind == NAV2 and mark == "*":
                    told += self._halves_told(file)
            is_beyond = picked[kind] in found[MAX_LISTED:]
            if len(found) > MAX_LISTED + is_beyond:
                told.append(f"       and {len(found) - MAX_LISTED - is_beyond} more")
            told += self._launched_without_picture() if kind == MAP else []
            told += self._not_there(kind, picked) if kind in (MAP, ROBOT, NAV2) else []
        return told + self._unreadable_told()

    def _unreadable_told(self) -> list[str]:
        """Returns a line on each of the first files that cannot be read, and the others' number."""
        first = [*self.unreadable.items()][:MAX_NAMED]
        told = [f"not read: {self._short(file)}: {why}" for file, why in first]
        more = len(self.unreadable) - len(first)
        return told + ([f"not read: {more} more such files"] if more else [])

    def _not_there(self, kind: str, picked: Mapping[str, Path | None]) -> list[str]:
        """Returns a line on each file of a kind that launch files name and that is not there.

        None where they start the one that is taken.
        """
        nav2, taken = picked.get(NAV2), picked.get(kind)
        if kind == MAP:
            is_started = taken is not None and self._launched(taken, kind, picked) != ""
            known = {file.name for file in (*self.files[MAP], *self.without_picture)}
            named = {} if nav2 is None else self.launches.not_there(OF_MAPS, known, nav2)
        else:
            is_started = taken is None or self.launches.folders(taken) >= 0
            known = {file.name for file in (*self.files[kind], *self.nodes)}
            named = self.launches.not_there(OF_NAV2 if kind == NAV2 else OF_MODELS, known)
        return [
            f"       not there: {name}, which {launch.name} names"
            for name, launch in [*named.items()][:MAX_NAMED]
            if not is_started
        ]

    def _launched_without_picture(self) -> list[str]:
        """Returns a line on each map that a launch file names and whose picture is not there."""
        launched = [file for file in self.without_picture if self.launches.folders(file) >= 0]
        return [
            f"       not read: {self._short(file)}, which a launch file names: its picture is not "
            "there"
            for file in launched[:MAX_NAMED]
        ]

    def _halves_told(self, nav2: Path) -> list[str]:
        """Returns a line on each file that is merged with a Nav2 file, which overrides it."""
        return [
            f"  *  + {self._short(file)}: {', '.join(sorted(nodes))}"
            for file, nodes in self.halves(nav2).items()
        ]

    def _launched(self, file: Path, kind: str, picked: Mapping[str, Path | None]) -> str:
        together = self._started_with(picked, kind) if kind in (MAP, WORLD) else None
        if together and together[0] == file:
            return f" (as in {together[1].name})"
        if kind != WORLD or self.launches.starting([file]):
            return ""
        started = self.launches.starting(self.files[WORLD])
        return f" ({started[1].name} starts {started[0].name})" if started else ""

    def _names(self, file: Path, robot: str) -> bool:
        """Tells whether a file's path has a robot's name in it, between other words."""
        whole = rf"(?<![a-z0-9]){re.escape(robot)}(?![a-z0-9])"
        return re.search(whole, self._short(file).as_posix().lower()) is not None

    def _words(self, file: Path) -> set[str]:
        return _words_of(self._short(file).as_posix())

    def _instead(self, kind: str) -> str:
        """Returns a line on files of a kind that are there and cannot be used; '' for none."""
        files = {MAP: self.without_picture, NAV2: self.of_move_base}.get(kind, ())
        if not files:
            return ""
        named = ", ".join(str(self._short(file)) for file in files[:MAX_NAMED])
        if kind == MAP:
            why = "perhaps by upper and lower case, or a pointer of Git LFS"
            return f"; the picture that {named} names is not there, {why}"
        more = f" and {len(files) - MAX_NAMED} more" if len(files) > MAX_NAMED else ""
        return f"; not read, as of ROS 1's move_base: {named}{more}"

    def _short(self, file: Path) -> Path:
        root = next(root for root in self.roots if file.is_relative_to(root))
        return file.relative_to(root)


def _shared_parts(file: Path, other: Path) -> int:
    """Returns the number of folders that two files have in common from the root."""
    pairs = zip(file.parent.parts, other.parent.parts, strict=False)
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], pairs))


def _words_of(text: str) -> set[str]:
    return set(re.findall(r"[a-z0-9]+", text.lower()))


def is_map_of(world: Path, map_file: Path) -> bool:
    """Tells whether a map is called like a world: its path has all words of the world's name."""
    named = _words_of(world.stem) - {WORLD, MAP}
    return bool(named) and named <= _words_of(map_file.as_posix())


def is_mask(file: Path) -> bool:
    """Tells whether a map is a mask of a costmap filter, by its name."""
    return MASKS.search(file.name.lower()) is not None


def _name_of(robot: Path) -> str:
    """Returns a robot's name, small: of its platform, its model's folder or its file."""
    if is_clearpath(robot):
        return platform_of(robot)
    named = robot.parent.name if robot.name == "model.sdf" else robot.name.partition(".")[0]
    return named.lower()


def read_picks(texts: Sequence[str]) -> dict[str, int]:
    """Returns the numbers of `--pick kind=N`; raises InputError for any other text."""
    form = f"one of {', '.join(f'{name}=N' for name in KINDS)}, or {ROBOT}=none"
    picks = assignments(texts, "--pick", form)
    for kind, number in picks.items():
        if kind not in KINDS or not (number.isdecimal() or number == "none"):
            raise InputError(f"--pick {f'{kind}={number}'!r}: expected {form}")
    return {kind: 0 if number == "none" else int(number) for kind, number in picks.items()}
