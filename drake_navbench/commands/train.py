"""Trains a policy: `drake-navbench train WEIGHTS.npz`."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import (
    PERCENT,
    CommandParser,
    exit_status_of,
    positive_number,
    whole_number,
)
from drake_navbench.errors import InputError
from drake_navbench.processes.workers import BLAS_THREAD_VARIABLES

if TYPE_CHECKING:
    from drake_navbench.studies.gymnasium.training import Progress

DEFAULT_STEPS = 400_000
EVALUATION_EPISODES = 200
STEPS_BETWEEN_LINES = 20_000


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench train",
        description="Trains the policy of the controller `learned` in the Gymnasium "
        "environment, then measures how often it reaches the goal in new tasks.",
    )
    add = parser.add_argument
    add("weights", type=Path, metavar="WEIGHTS.npz", help="file to write the network into")
    add(
        "--steps",
        type=positive_number,
        default=DEFAULT_STEPS,
        help=f"of training ({DEFAULT_STEPS})",
    )
    add("--seed", type=whole_number, default=0, help="seed of the whole training (0)")
    add(
        "--evaluate",
        action="store_true",
        help="train nothing; measure how well the weights in the file drive",
    )
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command; returns the exit status."""
    arguments = build_parser().parse_args(argv)
    return exit_status_of(lambda: _train(arguments))


def _train(arguments: argparse.Namespace) -> None:
    for variable in BLAS_THREAD_VARIABLES:
        # Of matrices so small threads would only wait for each other.
        os.environ.setdefault(variable, "1")
    try:
        import gymnasium  # noqa: F401
    except ImportError as error:
        raise InputError("gymnasium is not installed; pip install 'drake-navbench[gym]'") from error
    from drake_navbench.studies.gymnasium.training import (
        TrainingSettings,
        success_rate_of_file,
        train_into_file,
    )

    settings = TrainingSettings(steps=arguments.steps, seed=arguments.seed)
    if not arguments.evaluate:
        _require_writable(arguments.weights)
        train_into_file(settings, arguments.weights, on_progress=_print_progress)
    rate = success_rate_of_file(settings, arguments.weights, EVALUATION_EPISODES)
    print(
        f"{arguments.weights}: the goal is reached in {PERCENT * rate:.1f}% of "
        f"{EVALUATION_EPISODES} new tasks"
    )


def _require_writable(path: Path) -> None:
    """Raises InputError before a long training where its end could not be written."""
    if path.suffix != ".npz":
        raise InputError(f"{path}: expected a name that ends in .npz")
    if not os.access(path.absolute().parent, os.W_OK):
        raise InputError(f"{path}: its folder does not exist, or cannot be written")


def _print_progress(progress: Progress) -> None:
    before = progress.steps - progress.steps_in_update
    if before // STEPS_BETWEEN_LINES == progress.steps // STEPS_BETWEEN_LINES:
        return
    reached, touched = PERCENT * progress.success, PERCENT * progress.contact
    print(
        f"{progress.steps:>8} steps, {progress.elapsed_s:4.0f} s: of the last episodes "
        f"{reached:.0f}% reached the goal, {touched:.0f}% touched something, "
        f"mean return {progress.mean_return:.2f}",
        flush=True,
    )
