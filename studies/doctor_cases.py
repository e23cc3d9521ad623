"""The doctor's public cases: complaints with a known cure, in two halves, and their files.

    python studies/doctor_cases.py draw LIST      splits a list of cases into the two halves
    python studies/doctor_cases.py files FOLDER [CLONES]
                                                  fetches the Nav2 files of all cases from git
    drake-navbench doctor --score studies/doctor_cases/test.yaml --files FOLDER

No file of others is kept with the project: a case names the repository, the commit that cured the
complaint and the paths (and the repository of the file, where it is not the link's), and `files`
reads the state before that commit. CLONES is a folder of clones, OWNER+NAME each; what is missing
there is cloned from GitHub.

The halves are drawn by a seed. All cases of one owner stay together, because the files of one owner
resemble each other: in random order each owner goes to the half that has fewer cases so far. The
lists of fresh cases, of other owners, are not drawn.
"""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import yaml

HERE = Path(__file__).parent / "doctor_cases"
HALVES = (HERE / "development.yaml", HERE / "test.yaml")
FRESH = tuple(sorted(HERE.glob("fresh*.yaml")))
SEED = 43


def draw(source: Path) -> None:
    """Writes the cases of a list into the two halves."""
    listed = yaml.safe_load(source.read_text(encoding="utf-8"))
    by_owner: dict[str, list[dict[str, Any]]] = {}
    for case in listed["known"]:
        by_owner.setdefault(case["link"].partition("/")[0], []).append(case)
    halves: tuple[list[dict[str, Any]], ...] = ([], [])
    owners = sorted(by_owner)
    for number in np.random.default_rng(SEED).permutation(len(owners)):
        min(halves, key=len).extend(by_owner[owners[number]])
    for path, cases in zip(HALVES, halves, strict=True):
        content = {"about": listed["about"], "known": sorted(cases, key=lambda case: case["id"])}
        text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=100)
        path.write_text(text, encoding="utf-8")
        print(f"{path.name}: {len(cases)} cases")


def fill(folder: Path, clones: Path) -> None:
    """Writes each case's files into a folder: ID.yaml, or ID_1.yaml, ID_2.yaml."""
    folder.mkdir(parents=True, exist_ok=True)
    for path in (*HALVES, *FRESH):
        for case in yaml.safe_load(path.read_text(encoding="utf-8"))["known"]:
            if "file" in case:
                _write_files(case, folder, clones)


def _write_files(case: dict[str, Any], folder: Path, clones: Path) -> None:
    linked = case["link"].partition("@")[0].partition("#")[0]
    repository = case["file"].get("repository", linked)
    clone = _clone_of(repository, clones)
    paths = case["file"]["paths"]
    for number, path in enumerate(paths, 1):
        name = case["id"] if len(paths) == 1 else f"{case['id']}_{number}"
        state = f"{case['file']['commit']}^:{path}"
        shown = subprocess.run(["git", "-C", clone, "show", state], capture_output=True)
        if shown.returncode:
            print(f"{case['id']}: no {state} in {repository}")
            continue
        (folder / f"{name}.yaml").write_bytes(shown.stdout)


def _clone_of(repository: str, clones: Path) -> Path:
    clone = clones / repository.replace("/", "+")
    bare = clone / "repo"
    if not clone.exists():
        url = f"https://github.com/{repository}"
        subprocess.run(["git", "clone", "--bare", "--quiet", url, clone], check=True)
    return bare if bare.exists() else clone


def main() -> None:
    """Draws the halves of a list, or fetches the files of the cases."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = parser.add_subparsers(dest="step", required=True)
    step = steps.add_parser("draw", help="split a list of cases into two halves")
    step.add_argument("list", type=Path)
    step = steps.add_parser("files", help="fetch the Nav2 files of all cases from git")
    step.add_argument("folder", type=Path, help="folder to write the files into")
    step.add_argument("clones", type=Path, nargs="?", help="folder of clones (FOLDER/clones)")
    arguments = parser.parse_args()
    if arguments.step == "draw":
        draw(arguments.list)
    else:
        fill(arguments.folder, arguments.clones or arguments.folder / "clones")


if __name__ == "__main__":
    main()
