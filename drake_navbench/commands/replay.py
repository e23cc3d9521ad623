"""Renders one trial: `drake-navbench replay LOG`."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_navbench.commands.command_line import CommandParser, Options, command
from drake_navbench.errors import InputError, one_line

if TYPE_CHECKING:
    from drake_navbench.logs.log import TrialLog
    from drake_navbench.trial.why import Why


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench replay",
        description="Draws the replay of one trial from its log: a page that plays offline.",
        epilog="exit status: 0 done, 2 wrong input",
    )
    option = Options(parser)
    option(
        "log",
        "log of a trial, trials/*/*/trial_*.parquet, or a results folder: its trial with the worst "
        "outcome, of several the one with the smallest clearance",
        Path,
        metavar="LOG|DIR",
    )
    option(
        "--beside LOG",
        "another trial of the same scenario, of another column, drawn on the same page",
        Path,
    )
    option(
        "--why",
        "show beside the scene why the controller decided as it did, in every control cycle; the "
        "trial is driven again",
    )
    option("--out FILE", "file for the page (beside the log, where the next report finds it)", Path)
    option(
        "--model SDF",
        "model that shows the robot (a built-in robot's own model, otherwise its outline)",
        Path,
    )
    return parser


def _replay(arguments: argparse.Namespace) -> None:
    from drake_navbench.typed_files.output_file import HTML, require_replaceable

    log = arguments.log
    if log.is_dir():
        from drake_navbench.analysis.worst_trial import worst_trial

        log = worst_trial(log)
    suffix = ".html" if arguments.beside is None else ".beside.html"
    path = arguments.out or log.with_suffix(suffix)
    for source in (log, arguments.beside, arguments.model):
        if source is not None and path.resolve() == source.resolve():
            raise InputError(f"--out {path}: would replace what is drawn; expected another file")
    require_replaceable("--out", path, HTML)
    render(log, path, arguments.model, arguments.beside, tells_why=arguments.why)
    print(path)


def render(
    log_path: Path,
    path: Path,
    model: Path | None,
    beside: Path | None = None,
    *,
    tells_why: bool = False,
) -> None:
    """Writes the replay of a log, or of two on one page; tells_why: with the reasons of decisions.

    Raises InputError where a log has no sample, there is no such model, or the two logs are of the
    same column or of different scenarios.
    """
    from drake_navbench.analysis.replay import write_race_replay, write_trial_replay
    from drake_navbench.logs.log import TrialLog
    from drake_navbench.typed_files.output_file import write_whole

    paths = [log_path] if beside is None else [log_path, beside]
    logs = [TrialLog.read(entry) for entry in paths]
    log = logs[0]
    for entry, own in zip(paths, logs, strict=True):
        if own.samples.empty:
            raise InputError(
                f"{entry}: the trial ended before its first sample, so there is nothing to show"
            )
    if beside is not None:
        _require_a_race(log, logs[1], beside)
    if model is not None and not model.is_file():
        raise InputError(f"--model {model}: no such file")
    reasons = None
    if tells_why:
        reasons = {
            own.info["controller"]: _decisions(own, entry)
            for entry, own in zip(paths, logs, strict=True)
        }
    shown = model or _built_in_model(log.info["robot"].get("model"))
    looks: dict[str, Any] = {
        "model": shown,
        "columns": _columns_beside(log_path),
        "reasons": reasons,
    }
    draw = (
        partial(write_trial_replay, log, **looks)
        if beside is None
        else partial(write_race_replay, logs, **looks)
    )
    with _drawing(log_path, shown):
        write_whole(path, draw)


def _columns_beside(log_path: Path) -> list[str]:
    """Returns the columns of a log's results folder, whose colours a replay takes; [] without."""
    from drake_navbench.logs.results import ResultsFolder

    # The log may lie anywhere.
    with suppress(InputError, IndexError):
        return list(ResultsFolder(log_path.absolute().parents[3]).read_manifest()["controllers"])
    return []


@contextmanager
def _drawing(log_path: Path, model: Path | None) -> Iterator[None]:
    """Turns errors of a log's content, or of a model that Drake cannot parse, into InputError."""
    from pydantic import ValidationError

    try:
        yield
    except ValidationError as error:
        fault = error.errors()[0]
        place = ".".join(map(str, fault["loc"]))
        raise InputError(
            f"{log_path}: scenario or robot in the log: {place}: {fault['msg']}"
        ) from error
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        # The header has the right version but other content.
        raise InputError(f"{log_path}: scenario or robot in the log: {one_line(error)}") from error
    except RuntimeError as error:
        # Drake raises this for a model that it cannot parse.
        raise InputError(f"{model or log_path}: cannot be drawn: {error}") from error


def _decisions(log: TrialLog, path: Path) -> Sequence[Why]:
    """Returns why the controller of a trial decided as it did, for every cycle."""
    from drake_navbench.campaign.logged_trial import logged_trial
    from drake_navbench.trial.why import require_explainable, whole_why

    try:
        require_explainable(log)
        return whole_why(logged_trial(log, path), log).decisions
    except InputError as error:
        raise InputError(f"--why: {path}: {error}") from error


def _require_a_race(log: TrialLog, other: TrialLog, path: Path) -> None:
    """Raises InputError where two trials do not share a scenario, or share a column."""
    names = [entry.info["scenario"]["name"] for entry in (log, other)]
    if names[0] != names[1]:
        raise InputError(f"--beside {path}: scenario {names[1]}, expected {names[0]}")
    if log.info["controller"] == other.info["controller"]:
        raise InputError(
            f"--beside {path}: both are of the column {log.info['controller']!r}; expected another"
        )


def _built_in_model(name: object) -> Path | None:
    """Returns a built-in robot's model by its name, as a log does not tell the robot's folder."""
    from drake_navbench.inputs.robot import ROBOT_FILES

    if not isinstance(name, str) or not name:
        return None
    # A log may come from anybody: a name in it is not used as a path.
    path = ROBOT_FILES.folder / name
    return path if path.name == name and path.is_file() else None


main = command(build_parser, _replay)
