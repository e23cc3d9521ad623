"""The journal of a study: one file that is only ever appended to, line by line.

A full disk or a killed process may leave a last line that is not whole. It is dropped when the
study is opened again, under the lock for appending, so that no line that another process is just
writing is taken for an incomplete one.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_navbench.errors import InputError, one_line, writing
from drake_navbench.studies.tuning.task import TuningTask, require_same_task

if TYPE_CHECKING:
    from optuna.study import Study

JOURNAL = "study.journal"
STUDY = "tuning"
TASK = "task"
NEWLINE = b"\n"
# The errors that Optuna and conversions raise where a journal's lines are not as written.
BROKEN = (AssertionError, AttributeError, LookupError, TypeError, ValueError)


def open_study(folder: Path, task: TuningTask, tell: Callable[[str], None]) -> Study:
    """Returns the study in a folder, a new one where there is none.

    tell: gets a line for the user if an incomplete last line was dropped. Raises InputError where
    the folder has a study of another version or task, or cannot be read or written.
    """
    optuna = import_optuna()
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend, JournalFileSymlinkLock

    path = folder / JOURNAL
    with appending(path):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lock = JournalFileSymlinkLock(str(path))
            backend = JournalFileBackend(str(path), lock_obj=lock)
            _mend(path, lock, tell)
            study = optuna.create_study(
                study_name=STUDY,
                storage=JournalStorage(backend),
                directions=["minimize"] * len(task.objectives),
                load_if_exists=True,
            )
            begun = study.user_attrs.get(TASK)
        except BROKEN as error:
            raise InputError(f"{path}: not the journal of a study: {one_line(error)}") from error
        if begun is None:
            study.set_user_attr(TASK, task.model_dump(mode="json"))
    if begun is not None:
        if not isinstance(begun, dict):
            raise InputError(f"{path}: not the journal of a study: its task is no mapping")
        require_same_task(task, begun, str(path))
    return study


@contextmanager
def appending(path: Path) -> Iterator[None]:
    """Turns errors in the block, such as of a full disk, into one line; path: the journal's.

    Optuna's lock is a file, too: where it cannot be made, releasing it raises RuntimeError.
    """
    with writing(path):
        try:
            yield
        except RuntimeError as error:
            if isinstance(error.__context__, OSError):
                raise error.__context__ from None
            raise


def _mend(path: Path, lock: Any, tell: Callable[[str], None]) -> None:
    """Drops an incomplete last line of a journal, and tells the user."""
    with path.open("rb") as file:
        if _is_whole(file):
            return
    lock.acquire()
    try:
        dropped = _end_last_line(path)
    finally:
        lock.release()
    if dropped:
        tell(
            f"{path}: its last line was not whole ({dropped} bytes without an end) and is dropped; "
            "the study goes on from the line before it"
        )


def _end_last_line(path: Path) -> int:
    """Makes a journal end with a whole line; returns the number of dropped bytes."""
    with path.open("r+b") as file:
        if _is_whole(file):
            return 0
        file.seek(0)
        content = file.read()
        end = content.rfind(NEWLINE) + len(NEWLINE)
        if _is_entry(content[end:]):
            # Only the line's end is missing.
            file.write(NEWLINE)
            return 0
        file.truncate(end)
        return len(content) - end


def _is_whole(file: Any) -> bool:
    if file.seek(0, os.SEEK_END) == 0:
        return True
    file.seek(-len(NEWLINE), os.SEEK_END)
    return bool(file.read() == NEWLINE)


def _is_entry(line: bytes) -> bool:
    try:
        return isinstance(json.loads(line), dict)
    except ValueError:
        return False


def import_optuna() -> Any:
    """Returns the package optuna, made quiet; raises InputError where it is not installed."""
    try:
        import optuna
    except ImportError as error:
        raise InputError("optuna is not installed; pip install 'drake-navbench[tune]'") from error
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna
