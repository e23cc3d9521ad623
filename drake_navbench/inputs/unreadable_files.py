"""Files of a repository that cannot be read, and roots that are no folder, with the remedy."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.inputs.descriptions.model_source import MODEL_SUFFIXES
from drake_navbench.inputs.descriptions.ros_packages import broken_links_below
from drake_navbench.typed_files.input_file import (
    ARCHIVES,
    LFS_POINTER,
    NOT_UTF_8,
    POINTER,
    UTF_16,
    broken_link,
    read_head,
)

# An address to clone from; a path has one slash of its two.
URL = re.compile(r"https?:/|git@|ssh:/")
SUFFIXES = (*MODEL_SUFFIXES, ".yaml", ".yml", ".pgm")


def require_folders(roots: Sequence[Path]) -> None:
    """Raises InputError for a root of `--package` that is no folder."""
    for root in roots:
        if not root.is_dir():
            raise InputError(f"--package {root}: {_no_folder(root)}")


def _no_folder(root: Path) -> str:
    """Returns the fault of a root that is no folder, with the remedy."""
    expected = "expected the folder of a robot's packages"
    if URL.match(str(root)):
        return f"{expected}; clone the repository and give its folder"
    if read_head(root, 4).startswith(ARCHIVES):
        return f"is an archive; {expected}: unpack it and give its folder"
    return expected


def unreadable_files(roots: Sequence[Path], files: Sequence[Path]) -> dict[Path, str]:
    """Returns the files that could be a robot's, a Nav2 file or of a map, but cannot be read."""
    found = {
        link: broken_link(link)
        for root in roots
        for link in broken_links_below(root)
        if link.suffix in SUFFIXES
    }
    for file in files:
        head = read_head(file, len(LFS_POINTER)) if file.suffix in SUFFIXES else b""
        if head == LFS_POINTER:
            found[file] = POINTER
        elif head.startswith(UTF_16):
            found[file] = NOT_UTF_8
    return found
