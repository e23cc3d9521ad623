"""Pages: links lead somewhere, every page is found, commands parse, Python blocks run as "
"written."""

from __future__ import annotations

import ast
import importlib
import re
import shlex
import subprocess
import sys
import textwrap
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from drake_navbench.commands.main import COMMANDS, module_of

REPOSITORY = Path(__file__).parents[1]
DOCS = REPOSITORY / "docs"
# The front page of the package, which is read elsewhere.
APART = {DOCS / "package.md"}
PAGES = sorted({*DOCS.glob("*.md"), *REPOSITORY.glob("*.md")} - APART)
START = REPOSITORY / "README.md"
FENCED = re.compile(r"^( *)```(\w*)\n(.*?)^\1```", re.M | re.S)
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.+)$", re.M)
# What stands for a word of the user's, or is put in by the shell: <time>, $(command); SEED.
PLACEHOLDER = re.compile(r"<[\w ./]+>|\$\([^)]*\)")


def without_code(text):
    """Returns a page without its code blocks and code in lines."""
    return re.sub(r"`[^`\n]*`", "", FENCED.sub("", text))


def anchors_of(text):
    """Returns the anchors that GitHub makes of a page's headings."""
    found = []
    for heading in HEADING.findall(FENCED.sub("", text)):
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "")
        slug = re.sub(r"[^\w\- ]", "", words.strip().lower()).replace(" ", "-")
        found.append(slug if slug not in found else f"{slug}-{found.count(slug)}")
    return set(found)


def links_of(page):
    """Returns (target file, anchor) of each link of a page to a file or to a place in it."""
    found = []
    for target in LINK.findall(without_code(page.read_text(encoding="utf-8"))):
        if re.match(r"\w+:", target):
            continue
        path, _, anchor = target.partition("#")
        found.append(((page.parent / path).resolve() if path else page, anchor))
    return found


def dead_links(page):
    """Returns the links of a page that lead to no file, or to no anchor of one."""
    dead = []
    for target, anchor in links_of(page):
        if not target.exists():
            dead.append(target.name)
        elif anchor and anchor not in anchors_of(target.read_text(encoding="utf-8")):
            dead.append(f"{target.name}#{anchor}")
    return dead


def links_out_of(page):
    """Returns the names of files beyond a page's folder that it links."""
    folder = page.parent.resolve()
    return [target.name for target, _ in links_of(page) if not target.is_relative_to(folder)]


def reached_from(start):
    """Returns every page that links lead to from a first one."""
    reached, left = set(), [start]
    while left:
        page = left.pop()
        if page not in reached:
            reached.add(page)
            left += [
                target for target, _ in links_of(page) if target.suffix == ".md" and target.exists()
            ]
    return reached


def words_of(command):
    """Returns the words of a command as a shell would pass them, placeholders filled in."""
    return shlex.split(PLACEHOLDER.sub("NAME", command).replace("--seed SEED", "--seed 7"))


def commands_of(text):
    """Returns the commands of a page's shell blocks, each as its words; continued lines are one."""
    found = []
    for _, language, code in FENCED.findall(text):
        if language not in ("", "sh", "bash", "shell"):
            continue
        for line in re.sub(r"\\\n\s*", " ", code).splitlines():
            if line.strip().startswith("drake-navbench "):
                command = re.split(r"\s[|>&;]+\s|\s2>", line.partition(" #")[0])[0]
                found.append(words_of(command))
    inline = re.findall(r"`(drake-navbench [^`\n]*)`", FENCED.sub("", text))
    found += [words_of(line) for line in inline if "..." not in line]
    return found


def fault_of(command):
    """Returns why a parser refuses a command; None where it takes it."""
    _, name, *arguments = command
    if name.isupper() or "--help" in arguments or "--version" in command:
        return None
    if name not in COMMANDS:
        return f"no command {name}"
    module = module_of(name)
    if not hasattr(module, "build_parser"):
        return shlex.join(command) if arguments and name == "list" else None
    try:
        module.build_parser().parse_args(arguments)
    except SystemExit:
        return shlex.join(command)
    return None


def python_blocks(text):
    """Returns the Python blocks of a page, without what a prompt shows."""
    return [
        textwrap.dedent(code) for _, language, code in FENCED.findall(text) if language == "python"
    ]


def unknown_imports(code):
    """Returns the names that a block imports from drake_navbench and that are not there."""
    unknown = []
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("drake_navbench"):
            module = import_module(node.module)
            unknown += [
                f"{node.module}.{a.name}" for a in node.names if not hasattr(module, a.name)
            ]
    return unknown


@pytest.fixture
def planted(tmp_path):
    """Returns a page with a dead link, an anchor that is not there, and two that are."""
    page = tmp_path / "page.md"
    page.write_text("# A page: `x`\n[a](gone.md) [b](#not-there) [c](#a-page-x) [d](other.md)\n")
    (tmp_path / "other.md").write_text("# Other\n")
    (tmp_path / "alone.md").write_text("# Alone\n")
    return page


def test_a_dead_link_and_an_anchor_that_is_not_there_are_found(planted):
    assert dead_links(planted) == ["gone.md", "page.md#not-there"]


def test_a_page_that_nothing_links_is_found(planted):
    reached = {page.name for page in reached_from(planted)}
    assert reached == {"page.md", "other.md"}


def test_a_command_that_does_not_parse_is_found(capsys):
    page = "```\ndrake-navbench run empty --controler rpp   # wrong\ndrake-navbench drive\n```\n"
    assert [fault_of(command) for command in commands_of(page)] == [
        "drake-navbench run empty --controler rpp",
        "no command drive",
    ]
    capsys.readouterr()


def test_a_python_block_that_imports_nothing_real_is_found():
    assert unknown_imports("from drake_navbench import run_trial, run_trail") == [
        "drake_navbench.run_trail"
    ]
    with pytest.raises(SyntaxError):
        unknown_imports("def f(:")


def cells_of(line):
    return len(re.findall(r"(?<!\\)\|", line)) - 1


def uneven_rows(text):
    """Returns the lines of tables that have more or fewer cells than the rule below the heading."""
    lines = FENCED.sub("", text).splitlines()
    for number, rule in enumerate(lines):
        if not re.fullmatch(r"\|(\s*:?-+:?\s*\|)+", rule.strip()):
            continue
        table = [lines[number - 1]]
        for line in lines[number + 1 :]:
            if not line.strip().startswith("|"):
                break
            table.append(line)
        yield from (line for line in table if cells_of(line) != cells_of(rule))


def test_an_uneven_table_is_found():
    text = "| a | b |\n|---|---|\n| 1 | 2 |\n| \\| | 2 |\n| 3 |\n\n| c |\n| more |\n|---|---|\n"
    assert list(uneven_rows(text)) == ["| 3 |", "| more |"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_of_a_page_lead_somewhere(page):
    assert dead_links(page) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_row_of_a_table_has_as_many_cells_as_its_heading(page):
    assert list(uneven_rows(page.read_text(encoding="utf-8"))) == []


def test_pages_of_the_site_link_only_what_the_site_holds(planted):
    """mkdocs refuses a link out of docs/."""
    planted.write_text("[a](../elsewhere.md) [b](other.md)")
    assert links_out_of(planted) == ["elsewhere.md"]
    assert [page.name for page in PAGES if page.parent == DOCS and links_out_of(page)] == []


def test_every_page_is_reached_from_the_readme():
    assert {page.name for page in PAGES} - {page.name for page in reached_from(START)} == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_of_a_page_are_understood(page, capsys):
    commands = commands_of(page.read_text(encoding="utf-8"))
    assert [fault for fault in map(fault_of, commands) if fault] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_python_blocks_of_a_page_compile_and_import(page):
    for code in python_blocks(page.read_text(encoding="utf-8")):
        compile(code, page.name, "exec")
        assert unknown_imports(code) == []


INTERFACE = re.findall(
    r"^\| `(drake_navbench[\w.]+)` \|", (DOCS / "api.md").read_text(encoding="utf-8"), re.M
)


@pytest.mark.parametrize("name", INTERFACE)
def test_every_name_of_the_python_interface_can_be_imported(name):
    module, _, attribute = name.rpartition(".")
    assert hasattr(importlib.import_module(module), attribute)


def test_the_python_interface_holds_every_name_that_the_pages_and_examples_import():
    assert len(INTERFACE) == len(set(INTERFACE))
    examples = [
        path.read_text(encoding="utf-8") for path in (REPOSITORY / "examples").rglob("*.py")
    ]
    blocks = [code for page in PAGES for code in python_blocks(page.read_text(encoding="utf-8"))]
    imported = {
        f"{node.module}.{alias.name}"
        for code in (*examples, *blocks)
        for node in ast.walk(ast.parse(code))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("drake_navbench")
        for alias in node.names
    }
    assert imported - set(INTERFACE) == set()


class SiteLoader(yaml.SafeLoader):
    """A loader that lets the tags of mkdocs pass."""


SiteLoader.add_constructor("!ENV", lambda loader, node: None)
SiteLoader.add_multi_constructor("!!python", lambda loader, suffix, node: None)
SiteLoader.add_multi_constructor("tag:yaml.org,2002:python", lambda loader, suffix, node: None)
SITE = yaml.load((REPOSITORY / "mkdocs.yml").read_text(encoding="utf-8"), SiteLoader)


def test_every_page_is_in_the_navigation_of_the_site_two_clicks_away():
    named = []
    for section in SITE["nav"]:
        ((_, pages),) = section.items()
        for page in pages:
            named.append(page if isinstance(page, str) else next(iter(page.values())))
    assert all(isinstance(name, str) for name in named), "a third click"
    pages = [*DOCS.glob("*.*"), *DOCS.glob("questions/*.md")]
    shown = {
        path.relative_to(DOCS).as_posix() for path in pages if path.suffix in (".md", ".ipynb")
    }
    assert sorted(named) == sorted(shown - {"package.md"})


def test_a_dead_link_fails_the_build_of_the_site():
    """mkdocs counts warnings only where it shows them: --quiet would undo --strict."""
    (build,) = re.findall(r"mkdocs build.*", (REPOSITORY / "Makefile").read_text(encoding="utf-8"))
    assert build == "mkdocs build --strict"
    assert SITE["validation"]["anchors"] == SITE["validation"]["links"]["not_found"] == "warn"


def test_the_site_loads_nothing_from_other_hosts(monkeypatch):
    assert SITE["theme"]["font"] is False
    monkeypatch.syspath_prepend(str(REPOSITORY / "studies"))
    hooks = import_module("site_hooks")
    page = (
        '<script src="https://host/a.js"></script><script src="b.js"></script>'
        '<script type="module">await import("https://host/c.js")</script>'
    )
    shown = SimpleNamespace(file=SimpleNamespace(src_path="ci.md"))
    assert hooks.on_post_page(page, page=shown) == '<script src="b.js"></script>'
    sys.modules.pop("site_hooks")


def test_a_section_of_the_gallery_shows_its_replay_below_its_picture(monkeypatch):
    monkeypatch.syspath_prepend(str(REPOSITORY / "studies"))
    hooks = import_module("site_hooks")
    gallery = "![a](images/gallery/a.svg)\n![b](images/gallery/b.svg)\n"
    shown = hooks.with_replays(gallery, {"a"}).split("\n")
    assert shown[0] == "![a](images/gallery/a.svg)"
    assert shown[2].startswith('<iframe class="replay" src="replays/a.html" loading="lazy"')
    assert shown[-2] == "![b](images/gallery/b.svg)"
    sys.modules.pop("site_hooks")


def test_old_headings_lead_to_those_of_today():
    moved = yaml.safe_load((DOCS / "site/redirects.yaml").read_text(encoding="utf-8"))
    for old, new in moved.items():
        page, _, anchor = old.partition("#")
        assert anchor not in anchors_of((DOCS / page).read_text(encoding="utf-8")), old
        page, _, anchor = new.partition("#")
        assert not anchor or anchor in anchors_of((DOCS / page).read_text(encoding="utf-8")), new


@pytest.mark.long
def test_every_heading_that_a_page_ever_had_is_there_or_leads_on():
    moved = set(yaml.safe_load((DOCS / "site/redirects.yaml").read_text(encoding="utf-8")))
    for page in sorted(path.name for path in DOCS.glob("*.md")):
        was = set()
        for commit in git("log", "--format=%h", "--", f"docs/{page}").split():
            was |= anchors_of(git("show", f"{commit}:docs/{page}"))
        today = anchors_of((DOCS / page).read_text(encoding="utf-8"))
        assert {f"{page}#{anchor}" for anchor in was - today} - moved == set()


def git(*arguments):
    """Returns the answer of git about this repository; empty for a file that a commit lacks."""
    done = subprocess.run(
        ["git", "-C", REPOSITORY, *arguments], capture_output=True, text=True, check=False
    )
    return done.stdout


def test_the_site_sets_lists_apart_but_not_in_code(monkeypatch):
    monkeypatch.syspath_prepend(str(REPOSITORY / "studies"))
    hooks = import_module("site_hooks")
    assert hooks.with_lists_apart("**a**\n- b\n- c\n```\nx\n- y\n```") == (
        "**a**\n\n- b\n- c\n```\nx\n- y\n```"
    )
    sys.modules.pop("site_hooks")
