"""Makes a release of the tag at HEAD: `make release`. Leaves wheel and sdist in dist/.

Refuses where the tree has changes, no tag vX.Y.Z is at HEAD, or pyproject.toml, __init__.py,
CITATION.cff or CHANGELOG.md speak of another version. Builds both from a copy of the commit, looks
into them, and installs each into an empty environment, where commands are run.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import venv
import zipfile
from collections.abc import Sequence
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
TAG = re.compile(r"v(\d+\.\d+\.\d+)$")
# A file of each kind without which an installation would not drive.
IN_THE_WHEEL = (
    "drake_navbench/__main__.py",
    "drake_navbench/controllers/rpp/presets/rpp.yaml",
    "drake_navbench/scenarios/empty.yaml",
    "drake_navbench/analysis/templates/report.html",
)
IN_THE_SDIST = ("pyproject.toml", "README.md", "LICENSE", "docs/package.md", "scenarios/empty.yaml")
TRIED = (("--version",), ("list",), ("run", "empty", "--controllers", "rpp", "--trials", "1"))


class Refused(Exception):
    """A release that is not to be made; its message is the reason."""


def version_of_tag(repository: Path) -> str:
    """Returns the version of the tag at HEAD; raises Refused where there is none or changes."""
    changed = _said("git", "-C", repository, "status", "--porcelain")
    if changed:
        raise Refused(f"the tree has changes: {changed.splitlines()[0].strip()}; commit them")
    tags = _said("git", "-C", repository, "tag", "--points-at", "HEAD").split()
    versions = [found[1] for tag in tags if (found := TAG.match(tag))]
    if len(versions) != 1:
        raise Refused(f"expected one tag vX.Y.Z at HEAD, got {', '.join(tags) or 'none'}")
    return versions[0]


def wrong_versions(repository: Path, version: str) -> list[str]:
    """Returns a line for each file that speaks of another version."""
    project = tomllib.loads((repository / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    told = {
        "pyproject.toml": project["version"],
        "drake_navbench/processes/version.py": _found(
            repository / "drake_navbench" / "processes" / "version.py", r'^__version__ = "(.*)"$'
        ),
        "CITATION.cff": _found(repository / "CITATION.cff", r"^version: (.*)$"),
        "CHANGELOG.md": _found(repository / "CHANGELOG.md", r"^## (.*)$").split(" ")[0],
    }
    return [
        f"{name}: version {found or 'missing'}, expected {version}"
        for name, found in told.items()
        if found != version
    ]


def lacking(archive: Path, version: str) -> list[str]:
    """Returns the files that a wheel or sdist must have and lacks."""
    if archive.suffix == ".whl":
        names, wanted = zipfile.ZipFile(archive).namelist(), list(IN_THE_WHEEL)
        wanted.append(f"drake_navbench-{version}.dist-info/METADATA")
    else:
        with tarfile.open(archive) as packed:
            names = [name.partition("/")[2] for name in packed.getnames()]
        wanted = list(IN_THE_SDIST)
    return [name for name in wanted if name not in names]


def build(repository: Path, folder: Path) -> list[Path]:
    """Returns wheel and sdist of the commit at HEAD, built in an environment of their own."""
    source = folder / "source"
    source.mkdir()
    packed = folder / "source.tar"
    _said("git", "-C", repository, "archive", "--output", packed, "HEAD")
    with tarfile.open(packed) as archive:
        archive.extractall(source, filter="data")
    python = _environment(folder / "building")
    _said(python, "-m", "pip", "install", "--quiet", "build")
    out = folder / "dist"
    _said(python, "-m", "build", "--outdir", out, source)
    return sorted(out.iterdir())


def install_and_try(archive: Path, folder: Path) -> None:
    """Installs an archive into an empty environment and runs commands of it in an empty folder."""
    python = _environment(folder / f"trying_{archive.name}")
    _said(python, "-m", "pip", "install", "--quiet", archive)
    empty = folder / f"in_{archive.name}"
    empty.mkdir()
    for arguments in TRIED:
        _said(python, "-m", "drake_navbench", *arguments, folder=empty)
        print(f"{archive.name}: drake-navbench {' '.join(arguments)}: done")


def _environment(folder: Path) -> Path:
    venv.create(folder, with_pip=True)
    return folder / "bin" / "python"


def _found(path: Path, pattern: str) -> str:
    found = re.search(pattern, path.read_text(encoding="utf-8"), re.M)
    return found[1] if found else ""


def _said(*command: object, folder: Path | None = None) -> str:
    words: Sequence[str] = [str(word) for word in command]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["nothing printed"]
        raise Refused(f"{' '.join(words[:6])}: exit status {done.returncode}: {last[0]}")
    return done.stdout


def release(repository: Path = REPOSITORY) -> int:
    """Makes the release; returns the exit status, 2 where it is refused."""
    try:
        version = version_of_tag(repository)
        wrong = wrong_versions(repository, version)
        if wrong:
            raise Refused("; ".join(wrong))
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            archives = build(repository, folder)
            for archive in archives:
                if missing := lacking(archive, version):
                    raise Refused(f"{archive.name}: lacks {', '.join(missing)}")
                install_and_try(archive, folder)
            out = repository / "dist"
            out.mkdir(exist_ok=True)
            for archive in archives:
                (out / archive.name).write_bytes(archive.read_bytes())
    except Refused as reason:
        print(f"no release: {reason}", file=sys.stderr)
        return 2
    print(f"version {version} in {out}: {', '.join(archive.name for archive in archives)}")
    return 0


if __name__ == "__main__":
    sys.exit(release())
