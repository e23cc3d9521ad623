"""Published figures: each has its command on its page, and is older when its code changed later."""

from __future__ import annotations

import subprocess
from importlib import import_module
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]


@pytest.fixture
def ages(monkeypatch):
    monkeypatch.syspath_prepend(str(REPOSITORY / "studies"))
    return import_module("figure_ages")


def test_every_figure_has_its_command_on_its_page_and_code_that_is_there(ages):
    for figure in ages.figures():
        assert figure.command in (REPOSITORY / figure.page).read_text(encoding="utf-8"), figure
        for path in (*figure.made, *figure.code):
            assert (REPOSITORY / path).exists(), path


def test_every_picture_of_the_pages_is_listed(ages):
    made = {path for figure in ages.figures() for path in figure.made}
    shown = {f"docs/images/{path.name}" for path in (REPOSITORY / "docs/images").iterdir()}
    assert shown - made == set()


@pytest.fixture
def commit(tmp_path):
    """A function that writes a file into a repository in tmp_path and commits it."""
    subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)
    told = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]

    def write(name, text):
        (tmp_path / name).write_text(text)
        subprocess.run([*told, "add", name], check=True)
        subprocess.run([*told, "commit", "-q", "-m", f"{name} {text}"], check=True)
        head = [*told, "rev-parse", "HEAD"]
        return subprocess.run(head, check=True, capture_output=True, text=True).stdout.strip()

    return write


def test_a_figure_is_older_once_its_code_changes(ages, commit, tmp_path):
    figure = ages.Figure("page.md", "make it", (), ("code.py",))
    commit("code.py", "speed = 1")
    commit("page.md", "of 1")
    assert ages.changed_since(figure, tmp_path) == []
    commit("code.py", "# In m/s.\nspeed = 1")
    assert ages.changed_since(figure, tmp_path) == []
    commit("code.py", "speed = 2")
    assert ages.changed_since(figure, tmp_path) == ["code.py"]
    commit("page.md", "of 2")
    assert ages.changed_since(figure, tmp_path) == []


def test_other_words_or_another_section_make_no_figure_newer(ages, commit, tmp_path):
    figure = ages.Figure("page.md", "make it", (), ("code.py",), section="## Result")
    commit("code.py", "speed = 1")
    commit("page.md", "# Page\n## Result\nof 1.5 m\n## More\n3\n")
    commit("code.py", "speed = 2")
    commit("page.md", "# Page\n## Result\n1.5 m, as found\n## More\n4\n")
    assert ages.changed_since(figure, tmp_path) == ["code.py"]
    commit("page.md", "# Page\n## Result\n1.6 m, as found\n## More\n4\n")
    assert ages.changed_since(figure, tmp_path) == []


def test_a_page_that_loses_numbers_makes_no_figure_newer(ages, commit, tmp_path):
    figure = ages.Figure("page.md", "make it", (), ("code.py",))
    commit("code.py", "speed = 1")
    commit("page.md", "1.5 m, 2.5 m/s")
    commit("code.py", "speed = 2")
    commit("page.md", "1.5 m")
    assert ages.changed_since(figure, tmp_path) == ["code.py"]


def test_a_picture_is_as_new_as_its_file_or_as_when_it_came_out_the_same_again(
    ages, commit, tmp_path
):
    figure = ages.Figure("page.md", "make it", ("picture.svg",), ("code.py",))
    commit("code.py", "speed = 1")
    commit("picture.svg", "<svg/>")
    head = commit("code.py", "speed = 2")
    commit("page.md", "a new picture 2")
    assert ages.changed_since(figure, tmp_path) == ["code.py"]
    assert ages.changed_since(figure._replace(again=head), tmp_path) == []


def test_a_section_that_is_named_is_on_its_page(ages):
    for figure in ages.figures():
        if figure.section:
            text = (REPOSITORY / figure.page).read_text(encoding="utf-8")
            assert ages.numbers_of(text, figure.section), figure


def test_sentences_of_a_file_do_not_make_a_figure_older(ages):
    told = 'def f(x):\n    """Says it."""\n    raise ValueError(f"{x} is wrong")\n'
    retold = 'def f(x):\n    raise ValueError(f"expected more than {x}")\n'
    assert ages.without_words(told.replace('    """Says it."""\n', "")) == ages.without_words(
        retold
    )
    assert ages.without_words("a = 1") != ages.without_words("a = 2")
