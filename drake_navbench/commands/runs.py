"""The results folders as a list: `drake-navbench runs`; rename, tag and delete them."""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path

from drake_navbench.commands.command_line import CommandParser, Options, command
from drake_navbench.errors import InputError, nearest_name_hint, printable, writing

DEFAULT_FOLDER = Path("results")

EPILOG = """\
examples:
  drake-navbench runs                        every run of results/, newest last
  drake-navbench runs --tag NAME baseline    tag a run
  drake-navbench runs --rename OLD NEW       give its folder another name
  drake-navbench runs --delete NAME          delete it, all of its trials

exit status: 0 done, 2 wrong input
"""


def build_parser() -> argparse.ArgumentParser:
    """Returns the parser of the command line."""
    parser = CommandParser(
        prog="drake-navbench runs",
        usage="%(prog)s [FOLDER] [OPTIONS]",
        description="Lists the results folders in a folder, or renames, tags or deletes one.",
        epilog=EPILOG,
    )
    option = Options(parser)
    option(
        "folder",
        "folder that holds the results folders (results)",
        Path,
        DEFAULT_FOLDER,
        metavar="FOLDER",
        nargs="?",
    )
    only = Options(parser.add_mutually_exclusive_group())
    only("--rename OLD NEW", "rename a run's folder")
    only("--tag NAME TAG", "add a tag to a run")
    only("--untag NAME TAG", "remove a tag from a run")
    only("--delete NAME", "delete a run with all of its trials")
    option("--only TAG", "list only the runs with this tag")
    return parser


def _runs(arguments: argparse.Namespace) -> None:
    folder: Path = arguments.folder
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; a run makes results/<time>")
    if arguments.rename:
        _rename(folder, *arguments.rename)
    elif arguments.delete:
        _delete(folder, arguments.delete)
    elif arguments.tag or arguments.untag:
        name, tag = arguments.tag or arguments.untag
        _set_tag(_found(folder, name), tag, is_there=bool(arguments.tag))
    else:
        _print(folder, arguments.only)


def _print(folder: Path, only: str | None) -> None:
    from drake_navbench.logs.run_list import run_folders, run_of

    runs = [run_of(path) for path in run_folders(folder)]
    shown = [run for run in runs if only is None or only in run.tags]
    if not shown:
        told = f" with the tag {only!r}" if only is not None else ""
        print(f"{folder}: no runs{told}")
    for run in sorted(shown, key=lambda run: run.created_s):
        tags = f" [{', '.join(run.tags)}]" if run.tags else ""
        print(printable(f"{run.name}{tags}  {run.created}"))
        print(printable(f"  {run.what}"))
        if run.verdict:
            print(printable(f"  {run.verdict}"))


def _found(folder: Path, name: str) -> Path:
    """Returns the results folder of a name; raises InputError where there is none."""
    from drake_navbench.logs.run_list import run_folders

    names = [path.name for path in run_folders(folder)]
    if name not in names:
        raise InputError(f"{folder}: no run {name!r}{nearest_name_hint(name, names)}")
    return folder / name


def _rename(folder: Path, old: str, new: str) -> None:
    from drake_navbench.logs.results import only_run_in

    path = _found(folder, old)
    if new != Path(new).name or new.startswith(".") or not new.isprintable() or not new.strip():
        raise InputError(f"--rename {old} {new!r}: expected the name of a folder, without a path")
    with only_run_in(path), writing(folder / new):
        if (folder / new).exists():
            raise InputError(f"--rename {old} {new}: {folder / new} exists already")
        path.rename(folder / new)
    print(folder / new)


def _delete(folder: Path, name: str) -> None:
    from drake_navbench.logs.results import only_run_in

    path = _found(folder, name)
    if path.is_symlink():
        raise InputError(f"--delete {name}: {path} is a link; delete what it leads to")
    # Not while a run writes into the folder; a link in it is removed, not its target.
    with only_run_in(path), writing(path):
        shutil.rmtree(path)
    print(f"deleted {path}")


def _set_tag(path: Path, tag: str, *, is_there: bool) -> None:
    from drake_navbench.logs.run_list import tags_of, tags_path
    from drake_navbench.typed_files.output_file import write_text

    if not tag.strip() or not tag.isprintable() or "," in tag:
        raise InputError(f"{path.name}: got the tag {tag!r}, expected a word without a comma")
    others = [own for own in tags_of(path) if own != tag]
    if not is_there and len(others) == len(tags_of(path)):
        raise InputError(f"{path.name}: has no tag {tag!r}")
    tags = [*others, tag] if is_there else others
    write_text(tags_path(path), json.dumps(tags) + "\n")
    print(printable(f"{path.name}: {', '.join(tags) or 'no tags'}"))


main = command(build_parser, _runs)
