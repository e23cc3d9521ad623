"""A saved file is what one would have written by hand: all that was not drawn stays."""

from __future__ import annotations

from difflib import unified_diff
from pathlib import Path

import pytest

from drake_navbench.inputs.scenario import SCENARIO_FILES
from drake_navbench.studio import drawing
from drake_navbench.studio.yaml_text import updated_text
from drake_navbench.typed_files.typed_yaml import parse_yaml

TEXT = """\
# Of the ward, measured in May.
description: 'A ward'  # quoted
world:
  obstacles:
    # The counter.
    - {type: box, min: [1.0, 2.0], max: [1.50, 4.0]}   # worn
    - type: wall
      start: [3.0, -2.0]
      end: [3.0, 2.0]
start: [0.0, 0.0, 0.0]
goal: [5, 0, 0]
"""


def changed_lines(before: str, after: str) -> list[str]:
    lines = unified_diff(before.splitlines(), after.splitlines(), n=0, lineterm="")
    return [line for line in list(lines)[2:] if not line.startswith("@@")]


def test_a_text_without_a_change_stays_to_the_last_byte():
    odd = "goal:   [5, 0, 0]\n\n\n# end"
    assert updated_text(odd, parse_yaml(odd, "x"), "x") == odd


@pytest.mark.parametrize("name", SCENARIO_FILES.names)
def test_in_every_built_in_scenario_a_moved_goal_changes_one_line(name):
    text = SCENARIO_FILES.find(name).read_text(encoding="utf-8")
    content = parse_yaml(text, name)
    field = ("goal",) if "goal" in content else ("timeout_s",)
    value = [8.5, 0.5, 0.0] if field == ("goal",) else 77.0
    after = updated_text(text, drawing.with_entry(content, field, value), name)
    added = [line for line in changed_lines(text, after) if line.startswith("+")]
    assert added == [f"+{field[0]}: {value}"]


def test_a_new_wall_is_one_line_and_comments_stay():
    content = parse_yaml(TEXT, "x")
    wall = drawing.wall((0.0, 1.0), (2.0, 1.0))
    after = updated_text(TEXT, drawing.with_added(content, ("world", "obstacles"), wall), "x")
    assert changed_lines(TEXT, after) == ["+    - {type: wall, start: [0.0, 1.0], end: [2.0, 1.0]}"]


def test_a_moved_wall_changes_its_own_lines_alone():
    content = parse_yaml(TEXT, "x")
    place = ("world", "obstacles", 1)
    moved = drawing.moved(drawing.entry_at(content, place), (0.5, 0.0))
    after = updated_text(TEXT, drawing.with_entry(content, place, moved), "x")
    assert changed_lines(TEXT, after) == [
        "-      start: [3.0, -2.0]",
        "-      end: [3.0, 2.0]",
        "+      start: [3.5, -2.0]",
        "+      end: [3.5, 2.0]",
    ]


def test_a_deleted_box_goes_alone():
    content = parse_yaml(TEXT, "x")
    after = updated_text(TEXT, drawing.without(content, ("world", "obstacles", 0)), "x")
    assert parse_yaml(after, "x")["world"]["obstacles"] == content["world"]["obstacles"][1:]
    assert "# Of the ward, measured in May." in after


def test_a_new_file_has_points_on_one_line():
    content = drawing.with_added(
        drawing.EMPTY_FLOOR, ("world", "obstacles"), drawing.box((0, 1), (2, 3))
    )
    assert updated_text("", content, "x") == (
        "description: A floor drawn in the studio\n"
        "world:\n"
        "  obstacles:\n"
        "    - {type: box, min: [0, 1], max: [2, 3]}\n"
        "start: [0.0, 0.0, 0.0]\n"
        "goal: [5.0, 0.0, 0.0]\n"
    )


def test_a_number_that_yaml_1_2_reads_otherwise_is_written_so_that_all_read_the_same():
    """The loader reads 010 as eight, YAML 1.2 as ten."""
    text = "goal: [1, 0, 0]\ntimeout_s: 010\n"
    content = drawing.with_entry(parse_yaml(text, "x"), ("goal",), [2, 0, 0])
    assert updated_text(text, content, "x") == "goal: [2, 0, 0]\ntimeout_s: 8\n"


def test_the_extra_is_asked_for_in_one_line(monkeypatch, tmp_path: Path, capsys):
    from drake_navbench.commands import studio

    monkeypatch.setitem(__import__("sys").modules, "ruamel.yaml", None)
    assert studio.main([str(tmp_path)]) == 2
    assert capsys.readouterr().err.splitlines() == [
        "studio: needs ruamel.yaml; install it with: pip install 'drake-navbench[studio]'"
    ]


@pytest.mark.parametrize("words", ["yes", "1e3", "012", "0x10", "null", "a: b", "it's"])
def test_words_that_look_like_another_value_are_saved_as_text(words):
    assert parse_yaml(updated_text("a: 1\n", {"a": words}, "own"), "own") == {"a": words}
