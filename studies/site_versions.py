"""Versions of the site: `python studies/site_versions.py` builds one of each tag and of today.

build/versions/ then holds a folder for each tag v* with an mkdocs.yml, the folder `latest` of the
present pages, and versions.json, from which the pages' version menu is made. Tags that are there
already are not built again.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
FOLDER = REPOSITORY / "build" / "versions"
MKDOCS = REPOSITORY / ".venv-site" / "bin" / "mkdocs"
LATEST = "latest"
FRONT = (
    '<!doctype html><meta charset="utf-8"><title>drake_navbench</title>'
    f'<meta http-equiv="refresh" content="0; url={LATEST}/index.html">'
    "<ul>{}</ul>\n"
)


def tags() -> list[str]:
    """Returns the tags v* whose trees hold a site, newest first."""
    named = _git("tag", "--list", "v*", "--sort=-version:refname").split()
    return [tag for tag in named if _git("ls-tree", "--name-only", tag, "mkdocs.yml")]


def build(tree: Path, version: str) -> None:
    """Builds the site of a tree into the folder of its version, which appears whole or not."""
    subprocess.run(["make", "--quiet", "-C", str(tree), "package-links"], check=True)
    begun = FOLDER / f".{version}"
    subprocess.run(
        [MKDOCS, "build", "--strict", "--site-dir", begun],
        cwd=tree,
        env=os.environ | {"SITE_VERSIONS": "mike", "NO_MKDOCS_2_WARNING": "1"},
        check=True,
    )
    shutil.rmtree(FOLDER / version, ignore_errors=True)
    begun.rename(FOLDER / version)


def build_tag(tag: str) -> None:
    """Builds the site of a tag, from its tree alone."""
    with tempfile.TemporaryDirectory() as folder:
        packed = subprocess.run(
            ["git", "-C", str(REPOSITORY), "archive", tag], stdout=subprocess.PIPE, check=True
        )
        subprocess.run(["tar", "-x", "-C", folder], input=packed.stdout, check=True)
        build(Path(folder), tag)


def main() -> int:
    """Builds what is missing; returns the exit status."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    if not MKDOCS.is_file():
        print("expected .venv-site; `make site-versions` makes it", file=sys.stderr)
        return 2
    built = tags()
    for tag in built:
        if not (FOLDER / tag).is_dir():
            build_tag(tag)
    build(REPOSITORY, LATEST)
    versions = [LATEST, *built]
    listed = [{"version": name, "title": name, "aliases": []} for name in versions]
    (FOLDER / "versions.json").write_text(json.dumps(listed), encoding="utf-8")
    links = "".join(f'<li><a href="{name}/index.html">{name}</a></li>' for name in versions)
    (FOLDER / "index.html").write_text(FRONT.format(links), encoding="utf-8")
    return 0


def _git(*arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(REPOSITORY), *arguments], capture_output=True, text=True, check=True
    )
    return done.stdout


if __name__ == "__main__":
    sys.exit(main())
