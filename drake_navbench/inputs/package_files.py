"""Files of a robot's repository: model, Nav2 files, maps, worlds, the likeliest first."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.body import base_of, wheel_joints
from drake_navbench.inputs.descriptions.clearpath_robot import is_clearpath, platform_of
from drake_navbench.inputs.descriptions.gazebo_drive import has_drive
from drake_navbench.inputs.descriptions.gazebo_sensors import LIDARS
from drake_navbench.inputs.descriptions.model_source import read_source
from drake_navbench.inputs.descriptions.ros_packages import files_below
from drake_navbench.inputs.descriptions.world import is_world, read_world
from drake_navbench.inputs.descriptions.xacro_macro import lacking, robot_macro
from drake_navbench.inputs.launch_files import LaunchFiles, read_launch_files
from drake_navbench.typed_files.assignments import assignments
from drake_navbench.typed_files.input_file import MEGABYTE

# The names of the kinds on the command line.
ROBOT, NAV2, MAP, WORLD = "robot", "nav2", "map", "world"
KINDS = (ROBOT, NAV2, MAP, WORLD)
HEAD_BYTES = MEGABYTE
MAX_LISTED = 12
MAX_NAMED = 3
# At most so many models are read to find one that drives, and so many worlds to find one that is
# readable; otherwise the first by name is taken.
MAX_TRIED = 12
# From so many parts on, all files are equally likely to be the robot.
MAX_INCLUDES = 5
WHOLE_ROBOT = re.compile(r"<robot\b[^>]*\bname\s*=|<model\b[^>]*\bname\s*=")
MACROS = re.compile(r"<xacro:macro\b.*?</xacro:macro>|<!--.*?-->", re.DOTALL)
BUILDS = re.compile(r"<link\b|<xacro:(?!arg|property|if|unless|macro)\w+")
NAV2_MARKS = re.compile(r"controller_server\b[\s\S]*ros__parameters|FollowPath")
MAP_MARKS = re.compile(r"^\s*image\s*:\s*(\S+)", re.MULTILINE)
# Words in names of files that are parts, or not the wanted file.
PARTS = re.compile(
    r"macro|sensor|camera|lidar|laser|wheel|inertia|material|ros2_control|gazebo|arm|gripper|imu|"
    r"common|properties|plugin|test|example|mesh|depth|rplidar|realsense|oak|tower|stand",
)
# Words in names of files that another one has replaced.
REPLACED = re.compile(r"backup|\bbak\b|(^|[_.-])(old|copy|orig(inal)?|deprecated)([_.-]|$)")
MASKS = re.compile(r"keepout|speed|limit|mask|filter")
EMPTY_WORLDS = re.compile(r"empty|default")
SEPARATE = re.compile(r"slam|mapper|keepout|speed_|collision_monitor|localization|amcl")
# Words of a name that any whole Nav2 file may have.
NAV2_WORDS = {"nav2", "navigation", "navigation2", "nav", "param", "params", "parameters", "config"}


@dataclass(frozen=True)
class PackageFiles:
    """files: of each kind, the likeliest first. roots: the folders that were looked through.

    launches: their launch files. without_picture: map files that name a picture that is not there.
    """

    roots: tuple[Path, ...]
    files: Mapping[str, tuple[Path, ...]] = field(default_factory=dict)
    launches: LaunchFiles = field(default_factory=LaunchFiles)
    without_picture: tuple[Path, ...] = ()

    def chosen(self, kind: str, pick: int | None) -> Path | None:
        """Returns a kind's file by its number in the list, counted from 1; None without one.

        pick: the number, 0 for none, None for the first. Raises InputError for a number too large.
        """
        found = self.files[kind]
        if pick is None:
            return found[0] if found else None
        if pick == 0:
            return None
        if pick > len(found):
            raise InputError(f"--pick {kind}={pick}: there are {len(found)}, numbered from 1")
        return found[pick - 1]

    def fitting(self, kind: str, robot: Path | None) -> Path | None:
        """Returns the first file of a kind with the robot's name in its path, else the first."""
        found = self.files[kind]
        name = "" if robot is None else _name_of(robot)
        own = [file for file in found if name and name in self._short(file).as_posix().lower()]
        return next(iter((*own, *found)), None)

    def picked(self, texts: Sequence[str]) -> dict[str, Path | None]:
        """Returns the file of each kind by `--pick kind=N`, else the likeliest; None without one.

        The Nav2 file that is not picked is one with the robot's name; map and world that are not
        picked are those that a launch file starts with the Nav2 file. Raises InputError.
        """
        picks = read_picks(texts)
        files = {kind: self.chosen(kind, picks.get(kind)) for kind in KINDS}
        if NAV2 not in picks:
            files[NAV2] = self.fitting(NAV2, files[ROBOT])
        for kind in (MAP, WORLD):
            together = self._started_with(files[NAV2], kind)
            if together is not None and kind not in picks:
                files[kind] = together[0]
        return files

    def _started_with(self, nav2: Path | None, kind: str) -> tuple[Path, Path] | None:
        return None if nav2 is None else self.launches.started_with(nav2, self.files[kind])

    def options(self, picked: Mapping[str, Path | None], nav2: str) -> dict[str, object]:
        """Returns the values of --robot, --map and the option `nav2` that the files give."""
        robot, map_file, nav2_file = picked[ROBOT], picked[MAP], picked[NAV2]
        values: dict[str, object] = {} if robot is None else {"robot": str(robot)}
        values |= {} if map_file is None else {"map": map_file}
        return values | ({} if nav2_file is None else {nav2: [nav2_file]})

    def require_robot(self, robot: str, default: str) -> None:
        """Raises InputError if `robot` is the command line's default: no robot was found."""
        if robot == default:
            where = ", ".join(map(str, self.roots))
            raise InputError(
                f"--package {where}: no robot that drives in .xacro, .urdf or model.sdf; expected "
                "one, or --robot"
            )

    def lines(self, picked: Mapping[str, Path | None]) -> list[str]:
        """Returns the list of files found, the chosen ones marked, and how to choose another.

        picked: the chosen file of each kind that is listed, or None.
        """
        told = []
        for kind in picked:
            found = self.files[kind]
            if not found:
                told.append(f"{kind}: none found{self._lacking_picture(kind)}")
                continue
            how = f", another by --pick {kind}=N" if len(found) > 1 else ""
            told.append(f"{kind}: {len(found)} found{how}")
            for number, file in enumerate(found[:MAX_LISTED], start=1):
                mark = "*" if file == picked[kind] else " "
                how = self._launched(file, kind, picked) if mark == "*" else ""
                told.append(f"  {mark} {number:2} {self._short(file)}{how}")
            if len(found) > MAX_LISTED:
                told.append(f"       and {len(found) - MAX_LISTED} more")
        return told

    def _launched(self, file: Path, kind: str, picked: Mapping[str, Path | None]) -> str:
        together = self._started_with(picked.get(NAV2), kind) if kind in (MAP, WORLD) else None
        return f" (as in {together[1].name})" if together and together[0] == file else ""

    def _lacking_picture(self, kind: str) -> str:
        if kind != MAP or not self.without_picture:
            return ""
        named = ", ".join(str(self._short(file)) for file in self.without_picture[:MAX_NAMED])
        return f"; the picture that {named} names is not there"

    def _short(self, file: Path) -> Path:
        root = next(root for root in self.roots if file.is_relative_to(root))
        return file.relative_to(root)


def find_package_files(roots: Sequence[Path]) -> PackageFiles:
    """Returns the models, Nav2 files, maps and worlds below folders; raises InputError."""
    for root in roots:
        if not root.is_dir():
            raise InputError(f"--package {root}: expected the folder of a robot's packages")
    files = [file for root in roots for file in files_below(root)]
    words = {word for root in roots for word in re.split(r"[^a-z0-9]+", root.name.lower()) if word}

    def root_of(file: Path) -> int:
        return next(index for index, root in enumerate(roots) if file.is_relative_to(root))

    def ranked(
        is_one: Callable[[Path], bool], rank: Callable[[Path], tuple[object, ...]]
    ) -> tuple[Path, ...]:
        chosen = [file for file in files if is_one(file)]
        chosen.sort(
            key=lambda f: (
                *(rank(f)[0], root_of(f), bool(REPLACED.search(f.name.lower()))),
                *(rank(f), len(f.parts), str(f)),
            )
        )
        return tuple(chosen)

    launches = read_launch_files(files)
    found = {
        ROBOT: ranked(_is_robot, lambda file: _robot_rank(file, words)),
        MAP: ranked(_is_map, lambda f: (_is_mask(f), not launches.name(f))),
        WORLD: ranked(_is_gazebo_world, lambda f: (_is_empty(f), not launches.name(f))),
    }
    places = (*found[MAP], *found[WORLD])

    def nav2_rank(file: Path) -> tuple[object, ...]:
        return *_nav2_rank(file), not (places and launches.name(file, places)), _more(file, words)

    found[NAV2] = ranked(_is_nav2, nav2_rank)
    found[ROBOT] = _driving_first(found[ROBOT], roots)
    lacking_picture = tuple(file for file in files if _is_map(file, has_picture=False))
    return PackageFiles(tuple(roots), found, launches, lacking_picture)


def _head(file: Path) -> str:
    try:
        with file.open(encoding="utf-8", errors="replace") as opened:
            return opened.read(HEAD_BYTES)
    except OSError:
        return ""


def _is_robot(file: Path) -> bool:
    if is_clearpath(file):
        return True
    if file.suffix not in (".urdf", ".xacro") and file.name != "model.sdf":
        return False
    text = _head(file)
    macro = robot_macro(text, file) if file.suffix == ".xacro" and "<link" in text else None
    if macro is not None and not lacking(text, macro):
        return True
    if "<world" in text or not WHOLE_ROBOT.search(text):
        return False
    if file.name == "model.sdf":
        return re.search(r"diff_drive|diff-drive|DiffDrive|planar_move|mecanum", text) is not None
    is_plain = file.suffix == ".urdf" and "<link" in text
    return is_plain or BUILDS.search(MACROS.sub("", text)) is not None


def _robot_rank(file: Path, words: set[str]) -> tuple[bool, bool, int, int]:
    """Returns a sorting key of a model file, smaller for a file that is more likely the robot.

    Likely: a file named like its folder, or that includes many others. Unlikely: one of a part.
    """
    name = file.name.lower()
    stem = name.partition(".")[0]
    kinds = {".sdf": 2, ".urdf": 1}
    named = stem in words or stem.removesuffix("_robot") in words or stem == "robot"
    includes = min(_head(file).count("<xacro:include"), MAX_INCLUDES)
    return PARTS.search(name) is not None, not named, -includes, kinds.get(file.suffix, 0)


def _driving_first(files: Sequence[Path], roots: Sequence[Path]) -> tuple[Path, ...]:
    """Returns models, beginning with the likeliest that drives.

    Candidates are the models in one folder, and those that include the best so far. A lidar counts
    more than a drive's plugin; of two alike models the one that includes the other is better.
    """
    best: Path | None = None
    most = (False, False)
    # A file of the same name for another robot would fail as this one did.
    tried: set[str] = set()
    for file in files:
        is_other = best is not None and file.parent != best.parent
        if file.name in tried or (best is not None and is_other and not _includes(file, best)):
            continue
        tried.add(file.name)
        if len(tried) > MAX_TRIED:
            break
        try:
            model = read_source(file, folders=[root.absolute() for root in roots]).model
        except InputError:
            continue
        is_driven = has_drive(model)
        value = (any(sensor.kind in LIDARS for sensor in model.sensors), is_driven)
        drives = is_driven or len(wheel_joints(model, base_of(model))) >= 2
        is_more = best is None or value > most or (value == most and _includes(file, best))
        if drives and is_more:
            best, most = file, value
        if most == (True, True):
            break
    return tuple(files) if best is None else (best, *(other for other in files if other != best))


def _includes(file: Path, part: Path) -> bool:
    named = re.findall(r"<xacro:include[^>]*filename\s*=\s*[\"']([^\"']+)", _head(file))
    return any(name.rpartition("/")[2] == part.name for name in named)


def _is_nav2(file: Path) -> bool:
    if file.suffix not in (".yaml", ".yml"):
        return False
    text = _head(file)
    return "ros__parameters" in text and NAV2_MARKS.search(text) is not None


def _nav2_rank(file: Path) -> tuple[bool, bool]:
    name = file.name.lower()
    return SEPARATE.search(name) is not None, "nav2" not in name and "navigation" not in name


def _more(file: Path, words: set[str]) -> int:
    """Returns the count of the words in a Nav2 file's name but the usual ones and its folder's."""
    return len({*re.split(r"[^a-z0-9]+", file.stem.lower())} - NAV2_WORDS - words)


def _name_of(robot: Path) -> str:
    """Returns a robot's name, small: of its platform, its model's folder or its file."""
    if is_clearpath(robot):
        return platform_of(robot)
    named = robot.parent.name if robot.name == "model.sdf" else robot.name.partition(".")[0]
    return named.lower()


def _is_mask(file: Path) -> bool:
    return MASKS.search(file.name.lower()) is not None


def _is_empty(file: Path) -> bool:
    return EMPTY_WORLDS.search(file.stem) is not None


def _is_map(file: Path, *, has_picture: bool = True) -> bool:
    """Tells whether a file is a map's, and its picture is there or, for False, is not."""
    if file.suffix not in (".yaml", ".yml"):
        return False
    text = _head(file)
    named = MAP_MARKS.search(text)
    if named is None or "resolution" not in text or "origin" not in text:
        return False
    image = Path(named[1].strip("\"'"))
    return has_picture == any((file.parent / name).is_file() for name in (image, image.name))


def _is_gazebo_world(file: Path) -> bool:
    return is_world(file) and "<world" in _head(file)


def readable_world(worlds: Sequence[Path], roots: Sequence[Path]) -> tuple[Path, list[str]]:
    """Returns the first of a repository's worlds that can be read, and a line on each before it.

    Where none can be read, it is the first, without a line: its own error says why.
    """
    left_out: list[str] = []
    for world in worlds[:MAX_TRIED]:
        try:
            read_world(world, [root.absolute() for root in roots])
        except InputError as error:
            left_out.append(f"left out, the next world is taken: {error}")
        else:
            return world, left_out
    return worlds[0], []


def read_picks(texts: Sequence[str]) -> dict[str, int]:
    """Returns the numbers of `--pick kind=N`; raises InputError for any other text."""
    form = f"one of {', '.join(f'{name}=N' for name in KINDS)}, or {ROBOT}=none"
    picks = assignments(texts, "--pick", form)
    for kind, number in picks.items():
        if kind not in KINDS or not (number.isdecimal() or number == "none"):
            raise InputError(f"--pick {f'{kind}={number}'!r}: expected {form}")
    return {kind: 0 if number == "none" else int(number) for kind, number in picks.items()}
