"""Prints a shell's completion script for the commands: `drake-navbench completion bash`.

Write it to the file from which the shell reads such scripts:
`drake-navbench completion bash > ~/.local/share/bash-completion/completions/drake-navbench`.
"""

from __future__ import annotations

import argparse

from drake_navbench.commands.command_line import CommandParser, command, print_text

PROGRAM = "drake-navbench"
SHELLS = ("bash", "zsh", "tcsh")


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench completion",
        description=f"Prints the script by which a shell completes the arguments of {PROGRAM}.",
    )
    parser.add_argument("shell", choices=SHELLS)
    return parser


def whole_parser() -> argparse.ArgumentParser:
    """Returns one parser of all commands, which is never asked to parse anything."""
    from drake_navbench.commands.main import COMMANDS, module_of

    parser = argparse.ArgumentParser(prog=PROGRAM)
    commands = parser.add_subparsers()
    for name, about in COMMANDS.items():
        own = module_of(name).build_parser()
        commands.add_parser(name, help=about, parents=[own], add_help=False)
    return parser


def _complete(arguments: argparse.Namespace) -> None:
    import shtab

    print_text(f"{shtab.complete(whole_parser(), arguments.shell)}\n")


main = command(build_parser, _complete)
