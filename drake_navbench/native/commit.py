"""The commit of a checkout, by git, without any settings of the checkout itself.

A repository's own settings name programs that git runs (`core.fsmonitor`, filters, hooks). So git
sees a repository of ours instead, which borrows the checkout's objects, references and index and
none of its settings.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path

PATIENCE_S = 10.0
# The entries of .git that decide the checked-out commit, and how files differ from it.
OF_REPOSITORY = ("objects", "refs", "packed-refs")
# Names of commits are longer where the repository's own settings say so.
SETTINGS = "[core]\n\trepositoryformatversion = 0\n\tbare = false\n"
LONGER_SETTINGS = (
    "[core]\n\trepositoryformatversion = 1\n\tbare = false\n[extensions]\n\tobjectFormat = sha256\n"
)
NAME_DIGITS = 12
# Submodules have settings of their own, and are ignored.
CHANGES = ("--porcelain", "--untracked-files=no", "--ignore-submodules=all")
MAX_POINTER_BYTES = 4096


def commit_of(root: Path) -> str:
    """Returns the commit of a checkout, with a plus where files differ; '' where none is known."""
    try:
        worktree, repository = _git_folders(root / ".git")
        with tempfile.TemporaryDirectory() as folder:
            own = Path(folder)
            # Git would follow a link in place of this file as a reference.
            (own / "HEAD").write_text(_pointer(worktree / "HEAD") + "\n")
            (own / "index").symlink_to(worktree / "index")
            for name in OF_REPOSITORY:
                (own / name).symlink_to(repository / name)
            for settings in (SETTINGS, LONGER_SETTINGS):
                (own / "config").write_text(settings)
                commit = _said(own, root, "rev-parse", "--verify", "--quiet", "HEAD^{commit}")
                if commit:
                    break
            else:
                return ""
            changes = _said(own, root, "status", *CHANGES)
    except (OSError, ValueError, subprocess.TimeoutExpired):
        return ""
    return commit[:NAME_DIGITS] + ("" if changes == "" else "+")


def _git_folders(path: Path) -> tuple[Path, Path]:
    """Returns the folders of a worktree and of its repository, which is often the same one."""
    if path.is_file():
        path = path.parent / _pointer(path, "gitdir: ")
    path = path.resolve(strict=True)
    common = path / "commondir"
    return path, (path / _pointer(common)).resolve(strict=True) if common.is_file() else path


def _pointer(path: Path, prefix: str = "") -> str:
    if not path.is_file():
        raise ValueError(f"{path}: no file")
    with path.open(encoding="utf-8") as file:
        text = file.read(MAX_POINTER_BYTES)
    if not text.startswith(prefix):
        raise ValueError(f"{path}: expected {prefix!r}")
    return text.removeprefix(prefix).strip()


def _said(own: Path, root: Path, *words: str) -> str | None:
    """Runs git on our repository with the checkout's files; returns its output, None on failure."""
    environment = {name: text for name, text in os.environ.items() if not name.startswith("GIT_")}
    environment |= {
        "GIT_CONFIG_GLOBAL": os.devnull,
        "GIT_CONFIG_NOSYSTEM": "1",
        "GIT_OPTIONAL_LOCKS": "0",
    }
    done = subprocess.run(
        ["git", f"--git-dir={own}", f"--work-tree={root}", *words],
        capture_output=True,
        text=True,
        errors="replace",
        timeout=PATIENCE_S,
        check=False,
        env=environment,
        cwd=own,
    )
    return done.stdout.strip() if done.returncode == 0 else None
