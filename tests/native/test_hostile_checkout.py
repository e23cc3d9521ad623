"""A checkout that means harm: building it runs nothing of its own and writes in the cache alone."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from drake_navbench.errors import InputError
from drake_navbench.native.checkout import read_checkout
from drake_navbench.native.commit import NAME_DIGITS, commit_of
from drake_navbench.native.compiler import find_compiler
from drake_navbench.native.headers import (
    cpp_text,
    made_headers,
    message_header,
    plugin_names_header,
)
from drake_navbench.native.package_options import options_in


def _git(folder: Path, *words: str) -> str:
    environment = os.environ | {"GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_NOSYSTEM": "1"}
    names = ["-c", "user.name=a", "-c", "user.email=a@b"]
    done = subprocess.run(
        ["git", "-C", str(folder), *names, *words],
        check=True,
        capture_output=True,
        text=True,
        env=environment,
    )
    return done.stdout.strip()


@pytest.fixture
def repository(copied) -> Path:
    """A copy of the tiny checkout that git knows."""
    if shutil.which("git") is None:
        pytest.skip("no git")
    _git(copied, "init", "-q")
    _git(copied, "add", ".")
    _git(copied, "commit", "-q", "-m", "one")
    return copied


def test_the_commit_is_told_with_a_plus_where_files_differ(repository):
    commit = _git(repository, "rev-parse", "HEAD")[:NAME_DIGITS]
    assert commit_of(repository) == commit
    (repository / "new.txt").write_text("no file of the repository")
    assert commit_of(repository) == commit
    (repository / "tiny_controller" / "plugins.xml").write_text("<library/>")
    assert commit_of(repository) == f"{commit}+"
    _git(repository, "worktree", "add", "-q", "--detach", str(repository.parent / "tree"))
    assert commit_of(repository.parent / "tree") == commit


def test_packed_references_and_longer_names_are_read(repository, tmp_path):
    commit = _git(repository, "rev-parse", "HEAD")[:NAME_DIGITS]
    _git(repository, "pack-refs", "--all")
    assert commit_of(repository) == commit
    other = tmp_path / "longer"
    other.mkdir()
    _git(other, "init", "-q", "--object-format=sha256")
    _git(other, "commit", "-q", "--allow-empty", "-m", "one")
    assert commit_of(other) == _git(other, "rev-parse", "HEAD")[:NAME_DIGITS]


def test_without_a_repository_there_is_no_commit(copied, tmp_path):
    assert commit_of(copied) == ""
    (copied / ".git").write_text("gitdir: nowhere")
    assert commit_of(copied) == ""
    (copied / ".git").unlink()
    (copied / ".git").mkdir()
    (copied / ".git" / "HEAD").symlink_to("/dev/zero")
    assert commit_of(copied) == ""


def test_programs_that_a_repository_names_are_not_run(repository, tmp_path):
    witness = tmp_path / "was_run"
    program = tmp_path / "program"
    program.write_text(f"#!/bin/sh\ntouch {witness}\ncat\n")
    program.chmod(0o755)
    for name in ("core.fsmonitor", "filter.own.clean", "filter.own.process", "core.pager"):
        _git(repository, "config", name, str(program))
    for hook in ("post-index-change", "fsmonitor-watchman", "reference-transaction"):
        shutil.copy(program, repository / ".git" / "hooks" / hook)
    (repository / ".gitattributes").write_text("* filter=own\n")
    # Of the same length, so that git has to look inside.
    source = repository / "tiny_controller" / "src" / "tiny_controller.cpp"
    source.write_text(source.read_text().replace("throw 42", "throw 43"))
    assert read_checkout(repository).commit.endswith("+")
    assert not witness.exists()


def test_no_header_is_made_outside_the_folder_of_those_that_are(copied):
    header = copied / "tiny_controller" / "include" / "tiny_controller" / "tiny_controller.hpp"
    names = ("rclcpp/../../../outside.hpp", "rclcpp/..", "../rclcpp/a.hpp", "/rclcpp/a.hpp")
    lines = "".join(f'#include "{name}"\n' for name in (*names, "rclcpp/inside.hpp"))
    header.write_text(header.read_text() + lines)
    made = made_headers(read_checkout(copied).packages)
    assert "rclcpp/inside.hpp" in made
    assert not made.keys() & {*names}


def test_a_package_whose_name_leads_elsewhere_is_one_line(copied):
    path = copied / "tiny_msgs" / "package.xml"
    path.write_text(path.read_text().replace("<name>tiny_msgs", "<name>../../tiny_msgs"))
    with pytest.raises(InputError, match=r"package.xml: name: got '../../tiny_msgs', expected"):
        read_checkout(copied)


def test_names_and_texts_stay_texts_in_cpp(copied, builds, tmp_path):
    assert cpp_text('a"b\\c\n') == '"a\\042b\\134c\\012"'
    assert cpp_text("tiny::Controller") == '"tiny::Controller"'
    hostile = 'x", "y"}}; int injected = 1; //\\'
    plugins = copied / "tiny_controller" / "plugins.xml"
    attribute = hostile.replace('"', "&quot;")
    plugins.write_text(f'<library><class name="{attribute}" type="tiny::Controller"/></library>')
    text = plugin_names_header(read_checkout(copied).packages.values())
    assert hostile not in text
    message = tmp_path / "Text.msg"
    message.write_text('string NAME=say "it" \\ twice\nstring word \'a"b\'\n')
    struct = message_header("tiny_msgs", message)
    assert r'std::string NAME = "say \042it\042 \134 twice";' in struct
    assert r'std::string word{"a\042b"};' in struct
    check = f"{text}static_assert(drake_navbench::kPluginNames.size() == 1);\n"
    assert find_compiler()._output(["-std=c++17", "-fsyntax-only"], check) is not None


def test_of_a_package_only_options_that_change_code_are_taken():
    others = (
        "-fdump-tree-all",
        "-fcallgraph-info=su",
        "-fplugin=evil",
        "-fmodule-mapper=|run",
        "-fprofile-dir=/tmp",
        "-fstack-usage",
        "-fsyntax-only",
        "-mdump-tune-features",
    )
    code = ("-O3", "-mfma", "-mno-avx512f", "-march=x86-64-v3", "-finline-limit=10000000")
    code += ("-ffp-contract=fast", "-ffast-math", "-fno-math-errno", "-funroll-loops")
    found = options_in(f"add_compile_options({' '.join((*others, *code))})")
    assert found.of_code == code
    assert found.others == others
