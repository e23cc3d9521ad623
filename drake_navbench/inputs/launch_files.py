"""Launch files of a repository, and the files that they start together: a Nav2 file, its map."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from drake_navbench.inputs.descriptions.launch_text import launch_text, without_remarks
from drake_navbench.inputs.descriptions.launched_value import is_launch_file, set_variables

# Names of files, folders and packages, without the slashes between them.
WORD = re.compile(r"[\w.-]+")
# A name that is made of a beginning, a value and an end: 'robot_' + model + '.urdf'.
# Nav2's argument for its parameter file, by which one launch file overrides another's default.
PARAMS_FILE = "params_file"
# Words in names of launch files that start no controller server.
LOCALIZATION = re.compile("localization|slam|amcl")
# A map, a model and a Nav2 file as launch files name them, after their folder.
OF_MAPS = re.compile(r"maps?/(\w[\w.-]*\.ya?ml)")
OF_MODELS = re.compile(r"(?:urdf|xacro|description|robots?|models?)/(\w[\w.-]*\.(?:urdf|xacro))")
BEGINNING, END = re.compile(r"\w[\w.-]*[_-]$"), re.compile(r"[_.-][\w.-]*\.\w+$|\.\w+$")
OF_NAV2 = re.compile(r"(?:config|params?)/([\w.-]*nav(?:2|igation)[\w.-]*\.ya?ml)")


@dataclass(frozen=True)
class LaunchFiles:
    """words: of each launch file, outside of its remarks, and `a/b` for two that follow another."""

    words: tuple[tuple[Path, frozenset[str]], ...] = ()

    def folders(self, file: Path, beside: Sequence[Path] = ()) -> int:
        """Returns the number of a file's folders that a launch file names with it; -1: none does.

        beside: files of which the launch file has to name one; empty for no such condition.
        """
        partners = {other.name for other in beside}
        return max(
            (
                len(words & {*file.parent.parts})
                for _, words in self.words
                if _names(words, file.name) and (not partners or not partners.isdisjoint(words))
            ),
            default=-1,
        )

    def has_word(self, word: str) -> bool:
        """Tells whether any launch file has a word."""
        return any(word in words for _, words in self.words)

    def launched(self, files: Sequence[Path]) -> set[Path]:
        """Returns the files, of `files`, that a launch file names.

        Of several with the same name, they are the ones of whose folders it names the most.
        """
        folders = {file: self.folders(file) for file in files}
        most: dict[str, int] = {}
        for file, count in folders.items():
            most[file.name] = max(count, most.get(file.name, 0))
        return {file for file, count in folders.items() if count == most[file.name]}

    def started_with(
        self,
        file: Path,
        others: Sequence[Path],
        robot: Path | None = None,
        *,
        is_through: bool = False,
    ) -> tuple[Path, Path] | None:
        """Returns the one of `others` that a launch file names beside `file`, and that launch file.

        Of several launch files, it is the one that names `robot`, of these one not of localization
        alone, of these one that includes another of them, of these the one that names the most of
        the file's folders; of several others with the same name, the one whose folder it names
        before it, else whose folders it names, of these the one with the fewest others. None where
        no launch file names both. is_through: whether a launch file that another one includes may
        name `file` in its place.
        """
        naming = [
            (launch, words, named)
            for launch, words in (self._with_included if is_through else self.words)
            if (named := [other for other in others if other.name in words])
            and _names(words, file.name)
        ]
        if not naming:
            return None

        def rank(launch: Path, words: frozenset[str]) -> tuple[bool, bool, bool, int]:
            is_robots = robot is not None and _names(words, robot.name)
            is_whole = LOCALIZATION.search(launch.name) is None
            is_outer = any(other.name in words for other, *_ in naming if other.name != launch.name)
            return is_robots, is_whole, is_outer, len(words & {*file.parent.parts})

        launch, words, named = max(naming, key=lambda found: rank(*found[:2]))

        def told(other: Path) -> tuple[bool, int, int]:
            is_in_folder = f"{other.parent.name}/{other.name}" in words
            return is_in_folder, len(words & {*other.parts}), -len(other.parts)

        return max(named, key=told), launch

    def not_there(
        self, form: re.Pattern[str], known: Collection[str], beside: Path | None = None
    ) -> dict[str, Path]:
        """Returns the files that launch files name but that are not there, with a launch file each.

        form: OF_MAPS, OF_MODELS or OF_NAV2. known: names of files that there are. beside: a file
        that the launch files name, too, if any names it.
        """
        naming = [
            (launch, words)
            for launch, words in self.words
            if beside is not None and _names(words, beside.name)
        ]
        found: dict[str, Path] = {}
        for launch, words in naming or self.words:
            for named in sorted(said[1] for said in map(form.fullmatch, words) if said):
                if named not in known:
                    found.setdefault(named, launch)
        return found

    @property
    def _with_included(self) -> list[tuple[Path, frozenset[str]]]:
        """Each launch file's words with those of the launch files that it includes by name."""
        inner = {launch.name: words for launch, words in self.words}
        return [
            (launch, words.union(*(inner[name] for name in inner.keys() & words - {launch.name})))
            for launch, words in self.words
        ]

    def without_overridden(self, files: Sequence[Path], places: Sequence[Path]) -> LaunchFiles:
        """Returns the launch files without the Nav2 files that they name as a default nobody uses.

        files: the Nav2 files. `navigation_launch.py` has a default `params_file`; if each launch
        file that names it passes another one, or is overridden itself, the default is not used. Nor
        is that of `localization_launch.py`, which starts no controller. One that names a map or
        world, of `places`, is started alone, too, and keeps its default.
        """
        of_places = {file.name for file in places}
        passed = {
            launch: _nav2_files(launch, words, files)
            for launch, words in self.words
            if PARAMS_FILE in words
        }
        users = {
            launch: [user for user, words in self.words if user != launch and launch.name in words]
            for launch, own in passed.items()
            if own and of_places.isdisjoint(dict(self.words)[launch])
        }
        unused: set[Path] = set()
        for _ in users:
            unused |= {
                launch
                for launch, those in users.items()
                if (those or LOCALIZATION.search(launch.name))
                and all(
                    user in unused or passed.get(user, set()) - passed[launch] for user in those
                )
            }
        names = {file.name for file in files}
        return LaunchFiles(
            tuple((file, words - names if file in unused else words) for file, words in self.words)
        )

    def starting(self, files: Sequence[Path]) -> tuple[Path, Path] | None:
        """Returns the first file that a launch file names, and that launch file; None without."""
        pairs = ((f, launch) for f in files for launch, words in self.words if f.name in words)
        return next(pairs, None)


def read_launch_files(files: Sequence[Path]) -> LaunchFiles:
    """Returns the words of the launch files among `files`; an unreadable one has none.

    The value of an environment variable that any of them sets is a word of all that name it.
    """
    chosen = [file for file in files if is_launch_file(file)]
    variables = [*set_variables(chosen)]
    read = {file: _words_in(file) for file in chosen}
    return LaunchFiles(
        tuple(
            (file, words.union(value for name, value, _ in variables if name in words))
            for file, words in read.items()
        )
    )


def _names(words: frozenset[str], name: str) -> bool:
    """Tells whether a launch file's words name a file, whole or as a beginning, value and end.

    The value is one of its words, too, such as an argument's default.
    """
    if name in words:
        return True
    return any(
        name[:first] in words and name[first:last] in words and name[last:] in words
        for first in range(2, len(name))
        if BEGINNING.match(name[:first])
        for last in range(first + 2, len(name))
        if END.match(name[last:])
    )


def _nav2_files(launch: Path, words: frozenset[str], files: Sequence[Path]) -> set[Path]:
    """Returns the Nav2 files that a launch file names; those of other repositories by name alone.

    Of several with one name it is the one of whose folders the launch file names the most, then the
    one that lies nearest to it.
    """
    found: dict[str, Path] = {
        word: Path(word)
        for word in words
        if word.endswith((".yaml", ".yml")) and "nav2" in word and "/" not in word
    }
    for file in sorted(
        (file for file in files if file.name in words),
        key=lambda file: (len(words & {*file.parts}), len({*launch.parts} & {*file.parts})),
    ):
        found[file.name] = file
    return set(found.values())


def _words_in(file: Path) -> frozenset[str]:
    """Returns the words of a launch file as it is, and with the values of its variables put in."""
    found: set[str] = set()
    for text in (without_remarks(file), launch_text(file)):
        words = WORD.findall(text)
        found.update(words, (f"{a}/{b}" for a, b in pairwise(words)))
    return frozenset(found)
