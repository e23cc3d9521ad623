"""Prints the requirements of an extra of pyproject.toml, one a line: `python .ci/extra.py site`."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

PROJECT = Path(__file__).parents[1] / "pyproject.toml"

if __name__ == "__main__":
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    print(*project["optional-dependencies"][sys.argv[1]], sep="\n")
