"""A leaderboard: `drake-navbench leaderboard seal|reveal|enter|build`."""

from __future__ import annotations

import argparse
from pathlib import Path

from drake_navbench.commands.command_line import (
    CommandParser,
    Options,
    command,
    positive_number,
)

EPILOG = """\
a suite is a YAML file with name, version, scenarios, trials, robot, and seeds
unless it is sealed

example:
  drake-navbench leaderboard seal suite.yaml --secret ~/suite_seeds.yaml
  drake-navbench leaderboard reveal suite.yaml --secret ~/suite_seeds.yaml
  drake-navbench run doorway --controllers rpp --trials 8 --seed SEED \\
      --out results/rpp
  drake-navbench leaderboard enter results/rpp --suite suite.yaml
  drake-navbench leaderboard build results/rpp --suite suite.yaml --out board

exit status: 0 done, 2 wrong input, such as an entry that is refused,
130 interrupted
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench leaderboard",
        description="Ranks the controllers of many results folders that drive one suite.",
        epilog=EPILOG,
    )
    steps = parser.add_subparsers(dest="step", required=True, metavar="STEP")

    seal = "draw the seeds and publish only their salted hash"
    option = Options(steps.add_parser("seal", help=seal))
    option("suite", "suite file without seeds", Path, metavar="SUITE")
    secret = "new file for salt and seeds, outside the suite's repository"
    option("--secret FILE", secret, Path, required=True)
    option("--seeds N", "number of seeds (1)", positive_number, 1)

    reveal = "publish salt and seeds, after a check against the hash"
    option = Options(steps.add_parser("reveal", help=reveal))
    option("suite", "suite file that is sealed", Path, metavar="SUITE")
    secret = "file that `seal` wrote (default: check seeds that are already published)"
    option("--secret FILE", secret, Path)

    enter = "check a results folder and record its suite in it"
    option = Options(steps.add_parser("enter", help=enter))
    option("results", "results folders", Path, nargs="+", metavar="RESULTS")
    option("--suite FILE", "suite file", Path, required=True)

    build = "draw the replays and write the page of all entries"
    option = Options(steps.add_parser("build", help=build))
    option("results", "results folders that were entered", Path, nargs="+", metavar="RESULTS")
    option("--suite FILE", "suite file", Path, required=True)
    option("--out DIR", "new folder for the page", Path, required=True)
    return parser


def _seal(arguments: argparse.Namespace) -> None:
    from drake_navbench.analysis.leaderboard.suite import seal

    sealed = seal(arguments.suite, arguments.secret, count=arguments.seeds)
    print(f"{arguments.suite}: sealed {sealed.count} of SHA-256 {sealed.sha256}")
    print(f"{arguments.secret}: keep it to yourself until `reveal`")


def _reveal(arguments: argparse.Namespace) -> None:
    from drake_navbench.analysis.leaderboard.suite import reveal

    suite = reveal(arguments.suite, arguments.secret)
    seeds = ", ".join(map(str, suite.known_seeds))
    print(f"{arguments.suite}: seeds {seeds} are those that were sealed")


def _enter(arguments: argparse.Namespace) -> None:
    from drake_navbench.analysis.leaderboard.entries import enter
    from drake_navbench.analysis.leaderboard.suite import read_open_suite
    from drake_navbench.campaign.campaign import trial_seed

    suite = read_open_suite(arguments.suite)
    for path in arguments.results:
        enter(path, suite, seed_of=trial_seed)
        print(f"{path}: entered for {suite.name} version {suite.version}")


def _build(arguments: argparse.Namespace) -> None:
    from drake_navbench.analysis.leaderboard.entries import read_entries
    from drake_navbench.analysis.leaderboard.page import write_leaderboard
    from drake_navbench.analysis.leaderboard.suite import read_open_suite
    from drake_navbench.campaign.campaign import trial_seed
    from drake_navbench.commands.replay import render

    suite = read_open_suite(arguments.suite)
    entries = read_entries(arguments.results, suite, seed_of=trial_seed)
    page = write_leaderboard(
        entries, suite, arguments.out, render=lambda log, path: render(log, path, None)
    )
    print(page)


STEPS = {"seal": _seal, "reveal": _reveal, "enter": _enter, "build": _build}
main = command(
    build_parser,
    lambda arguments: STEPS[arguments.step](arguments),
    interrupted="interrupted; the same command goes on",
)
