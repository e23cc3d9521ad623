"""Finds the files of a robot's repository: model, Nav2 files, maps, worlds, the likeliest first."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence, Set
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.body import (
    base_of,
    plain_name,
    wheel_joints,
    wheels_of,
)
from drake_navbench.inputs.descriptions.clearpath_robot import is_clearpath
from drake_navbench.inputs.descriptions.gazebo_drive import has_drive, is_controlled, names_drive
from drake_navbench.inputs.descriptions.gazebo_sensors import LIDARS
from drake_navbench.inputs.descriptions.model import Model
from drake_navbench.inputs.descriptions.model_source import MODEL_SUFFIXES, read_source
from drake_navbench.inputs.descriptions.ros_packages import PACKAGE_FILE, files_below
from drake_navbench.inputs.descriptions.world import is_world, read_world
from drake_navbench.inputs.descriptions.xacro_macro import lacking, robot_macro
from drake_navbench.inputs.goal_file import could_be_goals, read_goal_file
from drake_navbench.inputs.launch_files import LaunchFiles, read_launch_files
from drake_navbench.inputs.move_base import is_of_move_base
from drake_navbench.inputs.package_files import (
    GOALS,
    MAP,
    NAV2,
    NODES,
    ROBOT,
    WORLD,
    PackageFiles,
    is_map_of,
    is_mask,
)
from drake_navbench.inputs.unreadable_files import require_folders, unreadable_files
from drake_navbench.typed_files.input_file import LFS_POINTER, read_head, read_head_text

# At most so many models are read to find one that drives, and so many worlds to find one that is
# readable; otherwise the first by name is taken.
MAX_TRIED = 12
# From so many parts on, all files are equally likely to be the robot.
MAX_INCLUDES = 5
WHOLE_ROBOT = re.compile(r"<robot\b[^>]*\bname\s*=|<model\b[^>]*\bname\s*=")
MACROS = re.compile(r"<xacro:macro\b.*?</xacro:macro>|<!--.*?-->", re.DOTALL)
BUILDS = re.compile(r"<link\b|<xacro:(?!arg|property|if|unless|macro)\w+")
REMARKS = re.compile(r"(?:^|\s)#[^\n]*")
NAV2_MARKS = re.compile(r"controller_server\b[\s\S]*ros__parameters|FollowPath")
NODE = re.compile(
    rf"^[ \t]*[\"']?(?:[\w*/]*/)?({'|'.join(sorted(NODES))})[\"']?[ \t]*:", re.MULTILINE
)
# The name of a frame behind namespaces, which a launch file may put in: <robot>/base_link.
BASE_FRAME = re.compile(r"^[^#\n]*robot_base_frame\s*:\s*[\"']?(?:[^\s\"'#]*/)?(\w+)", re.MULTILINE)
MAP_MARKS = re.compile(r"^\s*image\s*:\s*(\S+)", re.MULTILINE)
# Words in names of files that are parts, or not the wanted file.
PARTS = re.compile(
    r"(?<!with_)(?:macro|sensor|camera|lidar|laser|wheel(?!chair|ed)|inertia|material|ros2_control|"
    r"gazebo|gripper|common|properties|plugin|example|mesh|depth|rplidar|realsense|tower|"
    r"(?<![a-z])(?:arm|imu|oak|stand(?!ard)|test))",
)
# Words in names of files that another one has replaced.
REPLACED = re.compile(r"backup|\bbak\b|(^|[_.-])(old|copy|orig(inal)?|deprecated)([_.-]|$)")
EMPTY_WORLDS = re.compile(r"empty|default")
OF_NAVIGATION = re.compile(r"nav2|navigation|(?:^|[_.-])nav(?:[_.-]|$)")
SEPARATE = re.compile(r"slam|mapper|keep_?out|speed_|collision_monitor|localization|amcl")
# The files by which colcon builds a package, each beside its package.xml.
BUILT_BY = ("CMakeLists.txt", "setup.py")
# A package that lies beside the others of Nav2's sources.
OF_NAV2 = "nav2_costmap_2d"
# Words of a name that any whole Nav2 file may have.
NAV2_WORDS = {"nav2", "navigation", "navigation2", "nav", "param", "params", "parameters", "config"}


def find_package_files(roots: Sequence[Path]) -> PackageFiles:
    """Returns the models, Nav2 files, maps and worlds below folders; raises InputError."""
    roots = tuple(dict.fromkeys(roots))
    require_folders(roots)
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
                *(rank(f)[0], root_of(f), _is_in_copy_of_nav2(f), _is_replaced(f)),
                *(rank(f), _is_loose(f), len(f.parts), str(f)),
            )
        )
        return tuple(chosen)

    nav2 = [file for file in files if _is_nav2(file)]
    maps = [file for file in files if _is_map(file)]
    worlds = [file for file in files if _is_gazebo_world(file)]
    launches = read_launch_files(files).without_overridden(nav2, [*maps, *worlds])
    robots = [file for file in files if _is_robot(file)]
    repeated = {name for name, count in Counter(f.name for f in robots).items() if count > 1}
    launched = launches.launched([*maps, *worlds])
    started = [world for world in worlds if world in launched and launches.folders(world) >= 0]

    def map_rank(file: Path) -> tuple[object, ...]:
        is_of_started = any(is_map_of(world, Path(file.name)) for world in started)
        return (is_mask(file), file not in launched, not is_of_started)

    launched_nav2 = {file for file in launches.launched(nav2) if launches.folders(file) >= 0}
    found = {
        ROBOT: ranked(robots.__contains__, lambda f: _robot_rank(f, words, launches, repeated)),
        MAP: ranked(maps.__contains__, map_rank),
        WORLD: ranked(worlds.__contains__, lambda f: (_is_empty(f), f not in launched)),
        GOALS: ranked(_is_goal_file, lambda f: (f not in launched,)),
    }
    places = (*found[MAP], *found[WORLD])

    def nav2_rank(file: Path) -> tuple[object, ...]:
        named = launches.folders(file, places)
        is_separate = SEPARATE.search(file.name.lower()) is not None
        is_unnamed = file not in launched_nav2
        return (
            *(is_separate and is_unnamed, _lacks_nav2(file), named < 0, is_separate),
            *(is_unnamed, _more(file, words), -named),
        )

    found[NAV2] = ranked(nav2.__contains__, nav2_rank)
    found[ROBOT] = _driving_first(found[ROBOT], roots, _base_frames(found[NAV2]), launches)
    nodes = {file: _nav2_nodes(file) for file in ranked(_has_parameters, nav2_rank)}
    lacking_picture = tuple(file for file in files if _is_map(file, has_picture=False))
    of_move_base = tuple(file for file in files if is_of_move_base(file))
    return PackageFiles(
        *(roots, found, launches, lacking_picture, of_move_base),
        nodes={file: given for file, given in nodes.items() if given},
        unreadable=unreadable_files(roots, files),
    )


def _is_replaced(file: Path) -> bool:
    return REPLACED.search(file.name.lower()) is not None


def _is_loose(file: Path) -> bool:
    """Tells whether a file lies in no package that is built, such as a template of one."""
    return not any(
        (folder / PACKAGE_FILE).is_file() and any((folder / one).is_file() for one in BUILT_BY)
        for folder in file.parents
    )


def _is_in_copy_of_nav2(file: Path) -> bool:
    """Tells whether a file is in a copy of Nav2's own sources, whose examples are of TurtleBots."""
    return any((folder / OF_NAV2 / PACKAGE_FILE).is_file() for folder in file.parents)


def _is_robot(file: Path) -> bool:
    if is_clearpath(file):
        return True
    if file.suffix not in MODEL_SUFFIXES:
        return False
    text = read_head_text(file)
    macro = robot_macro(text, file) if file.suffix == ".xacro" and "<link" in text else None
    if macro is not None and not lacking(text, macro):
        return True
    if not WHOLE_ROBOT.search(text):
        return False
    if file.suffix not in (".urdf", ".xacro", ".gazebo"):
        return names_drive(text)
    is_plain = file.suffix == ".urdf" and "<link" in text
    return is_plain or BUILDS.search(MACROS.sub("", text)) is not None


def _robot_rank(
    file: Path, words: set[str], launches: LaunchFiles, repeated: Set[str]
) -> tuple[object, ...]:
    """Returns a sorting key of a model file, smaller for a file that is more likely the robot.

    Likely: a file that a launch file names with a folder, that is named like its folder, or that
    includes many others. Unlikely: one of a part, or a world with a robot in it; of `repeated`
    names, one whose own folder no launch file names, as an argument's default.
    """
    is_launched = launches.folders(file) > 0
    is_another = file.name in repeated and not launches.has_word(file.parent.name)
    name = file.name.lower().removesuffix(".gazebo")
    stem = name.partition(".")[0]
    kinds = {".sdf": 2, ".urdf": 1}
    named = stem in words or stem.removesuffix("_robot") in words or stem == "robot"
    includes = min(read_head_text(file).count("<xacro:include"), MAX_INCLUDES)
    likely = 2 if _is_gazebo_world(file) else int(PARTS.search(name) is not None)
    return (
        *(likely, not is_launched, is_another, not named),
        *(-includes, kinds.get(file.suffix, 0)),
    )


def _driving_first(
    files: Sequence[Path], roots: Sequence[Path], frames: Set[str], launches: LaunchFiles
) -> tuple[Path, ...]:
    """Returns models, beginning with the likeliest that drives.

    Candidates are the models in one folder, and those that include the best so far; those of its
    package while it has neither lidar nor drive's plugin, and all while it has no link of `frames`,
    the base frames of a Nav2 file. Such a link counts most, then a lidar, then a plugin; of two
    alike models the one that includes the other is better. One with a plugin that a launch file
    names gives way to none that no launch file names, but for one that includes it; nor does one
    that cannot be read give way to its parts, or to a robot that merely stands in a world.
    """
    best: Path | None = None
    unread: list[Path] = []
    most = (False, False, False)
    # A file of the same name for another robot would fail as this one did.
    tried: set[str] = set()
    for file in files:
        if file.name in tried or (best is not None and not _may_replace(file, best, most)):
            continue
        if best is not None and most[2] and _is_launched_alone(best, file, launches):
            continue
        is_launched = launches.folders(file) > 0
        is_part = any(_includes(whole, file) for whole in unread)
        if is_part or (unread and not is_launched and _is_gazebo_world(file)):
            continue
        tried.add(file.name)
        if len(tried) > MAX_TRIED:
            break
        model = _readable(file, roots)
        if model is None:
            unread += [file] if is_launched else []
            continue
        value = _value(model, frames)
        drives = value[2] or _has_wheels(model)
        is_more = best is None or value > most or (value == most and _includes(file, best))
        if drives and is_more:
            best, most = file, value
        if all(most):
            break
    if best is not None and best.suffix == ".urdf" and not any(most[1:]):
        best = _simulated(best, files, roots, frames)
    return tuple(files) if best is None else (best, *(other for other in files if other != best))


def _simulated(urdf: Path, files: Sequence[Path], roots: Sequence[Path], frames: Set[str]) -> Path:
    """Returns the SDF model with lidar and drive of a bare URDF's robot, else the URDF.

    It is in the URDF's package and has its wheels: SDF models beside a URDF are often of other
    robots.
    """
    bare = _readable(urdf, roots)
    beside = [f for f in files if f.suffix == ".sdf" and _package_of(f) == _package_of(urdf)]
    for file in beside[:MAX_TRIED]:
        model = _readable(file, roots)
        if model is None or bare is None or not all(_value(model, frames)):
            continue
        if _wheel_places(model) == _wheel_places(bare):
            return file
    return urdf


def _readable(file: Path, roots: Sequence[Path]) -> Model | None:
    """Returns the model in a file; None where it cannot be read."""
    try:
        return read_source(file, folders=[root.absolute() for root in roots]).model
    except InputError:
        return None


def _value(model: Model, frames: Set[str]) -> tuple[bool, bool, bool]:
    """Tells whether a model has a link of `frames`, a lidar, and a plugin that drives it."""
    links = {plain_name(name) for name in model.links}
    has_lidar = any(sensor.kind in LIDARS for sensor in model.sensors)
    drives = has_drive(model) or (is_controlled(model) and _has_wheels(model))
    return not frames or not links.isdisjoint(frames), has_lidar, drives


def _has_wheels(model: Model) -> bool:
    return len(wheel_joints(model, base_of(model))) >= 2


def _wheel_places(model: Model) -> list[tuple[int, int]]:
    """Returns x and y of a model's wheels in its base frame, in whole centimetres."""
    places = (wheel.position for wheel in wheels_of(model, base_of(model)))
    return sorted((round(100 * float(x)), round(100 * float(y))) for x, y, _ in places)


def _may_replace(file: Path, best: Path, value: tuple[bool, bool, bool]) -> bool:
    """Tells whether a model is a candidate beside the best so far, given the latter's value."""
    has_frame, *senses_or_drives = value
    if _is_replaced(file) and not _is_replaced(best):
        return False
    if file.parent == best.parent or not has_frame or _includes(file, best):
        return True
    is_alike = file.suffix != ".sdf" and _package_of(file) == _package_of(best)
    return is_alike and not any(senses_or_drives)


def _is_launched_alone(best: Path, file: Path, launches: LaunchFiles) -> bool:
    """Tells whether a launch file names the best model, and none names one that lacks it."""
    is_named = launches.folders(file) >= 0 or _includes(file, best)
    return launches.folders(best) > 0 and not is_named


def _package_of(file: Path) -> Path:
    packages = [folder for folder in file.parents if (folder / PACKAGE_FILE).is_file()]
    return packages[0] if packages else file.parent


def _base_frames(nav2: Sequence[Path]) -> set[str]:
    """Returns the base frames that the likeliest Nav2 file names."""
    frames = BASE_FRAME.findall(read_head_text(nav2[0])) if nav2 else []
    return {plain_name(frame) for frame in frames}


def _includes(file: Path, part: Path) -> bool:
    named = re.findall(r"<xacro:include[^>]*filename\s*=\s*[\"']([^\"']+)", read_head_text(file))
    return any(name.rpartition("/")[2] == part.name for name in named)


def _has_parameters(file: Path) -> bool:
    return file.suffix in (".yaml", ".yml") and "ros__parameters" in _without_remarks(file)


def _is_nav2(file: Path) -> bool:
    return _has_parameters(file) and NAV2_MARKS.search(_without_remarks(file)) is not None


def _nav2_nodes(file: Path) -> frozenset[str]:
    """Returns the nodes of Nav2 to which a parameter file gives values; none for a replaced one."""
    is_old = _is_replaced(file) or _is_in_copy_of_nav2(file)
    return frozenset(() if is_old else NODE.findall(_without_remarks(file)))


def _without_remarks(file: Path) -> str:
    return REMARKS.sub("", read_head_text(file))


def _lacks_nav2(file: Path) -> bool:
    return OF_NAVIGATION.search(file.name.lower()) is None


def _more(file: Path, words: set[str]) -> int:
    """Returns the count of the words in a Nav2 file's name but the usual ones and its folder's."""
    return len({*re.split(r"[^a-z0-9]+", file.stem.lower())} - NAV2_WORDS - words)


def _is_empty(file: Path) -> bool:
    return EMPTY_WORLDS.search(file.stem) is not None


def _is_map(file: Path, *, has_picture: bool = True) -> bool:
    """Tells whether a file is a map's, and its picture is there or, for False, is not."""
    if file.suffix not in (".yaml", ".yml"):
        return False
    text = read_head_text(file)
    named = MAP_MARKS.search(text)
    if named is None or "resolution" not in text or "origin" not in text:
        return False
    image = Path(named[1].strip("\"'"))
    places = [file.parent / name for name in (image, image.name)]
    found = next((place for place in places if place.is_file()), None)
    is_there = found is not None and read_head(found, len(LFS_POINTER)) != LFS_POINTER
    return has_picture == is_there


def _is_goal_file(file: Path) -> bool:
    """Tells whether a file is named like one of goals, and has at least two places."""
    if not could_be_goals(file):
        return False
    try:
        return len(read_goal_file(file).places) > 1
    except InputError:
        return False


def _is_gazebo_world(file: Path) -> bool:
    return is_world(file) and "<world" in read_head_text(file)


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
