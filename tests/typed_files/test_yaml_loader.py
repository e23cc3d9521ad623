"""A YAML text becomes plain values or one line that names the place, whatever is in it."""

import time
import tracemalloc

import pytest

from drake_navbench.errors import InputError
from drake_navbench.typed_files.typed_yaml import parse_yaml
from drake_navbench.typed_files.yaml_loader import MAX_DEPTH, MAX_NODES, dump_yaml, load_yaml


def refusal(text: str) -> str:
    with pytest.raises(InputError) as caught:
        parse_yaml(text, "task.yaml")
    (line,) = str(caught.value).splitlines()
    return line


NO_VALUES = {
    "a day that does not exist": (
        "description: 2024-02-30",
        "line 1: '2024-02-30' is no !!timestamp: day is out of range for month",
    ),
    "a number without digits": ("a: 1\nb: 0x_", "line 2: '0x_' is no !!int"),
    "a date as key": ("a: 1\n2024-02-28: 3", "line 2: key '2024-02-28': expected text, got date"),
    "a list as key": ("? [1, 2]\n: 3", "line 1: key a list: expected text, got list"),
    "a key given twice": ("a: 1\na: 2\n", "line 2: key 'a' is given twice"),
    "lists without end": ("a: " + 5000 * "[", "line 1: nested too deeply, expected at most 100"),
    "a list in itself": ("goal: &a [*a]", "line 1: a value that contains itself"),
    "a mapping in itself": ("world: &a {map: *a}", "line 1: a value that contains itself"),
    "text tagged as a time": ("a: !!timestamp soon", "line 1: 'soon' is no !!timestamp"),
    "text tagged as a flag": ("a: !!bool maybe", "line 1: 'maybe' is no !!bool"),
    "nothing tagged as a number": ('a: !!int ""', "line 1: '' is no !!int"),
    "text tagged as a mapping": ("a: !!map x", "line 1: 'x' is no !!map"),
    "a list tagged as a mapping": ("!!map [1]", "line 1: a list is no !!map"),
    "a mapping tagged as a number": ("a: !!float {}", "line 1: expected a scalar node"),
    "a set": ("a: !!set {b}", "line 1: tag !!set is not supported"),
    "code": ("a: !!python/object:os.system x", "line 1: tag !!python/object:os.system is not"),
    "a merge": ("<<: {a: 1}", "line 1: tag !!merge is not supported"),
    "a number of a million digits": ("a: " + 1_000_000 * "7", "is too long for !!int"),
    "a clock time of a million parts": ("a: " + 1_000_000 * "1:" + "1", "is too long for !!int"),
    "an alias of nothing": ("a: *b", "line 1: found undefined alias"),
    "a NUL": ("a: 1\nb: \0", "task.yaml, line 2: control characters are not allowed"),
    "two documents": ("a: 1\n---\na: 2", "expected a single document in the stream, but found"),
    "an empty text": ("", "task.yaml: expected a mapping of fields to values, got nothing"),
    "half a character": ("a: \ud800", "task.yaml: surrogates not allowed"),
}


@pytest.mark.parametrize("case", NO_VALUES)
def test_what_is_no_value_is_refused_in_one_line(case):
    text, expected = NO_VALUES[case]
    line = refusal(text)
    assert line.startswith("task.yaml")
    assert expected in line
    assert len(line) < 200


def test_aliases_count_with_all_that_they_stand_for():
    # 10 lists of 10 of the one before: 10^9 values in 300 bytes.
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    for level in range(1, 9):
        aliases = ", ".join([f"*a{level - 1}"] * 10)
        lines.append(f"a{level}: &a{level} [{aliases}]")
    tracemalloc.start()
    try:
        assert refusal("\n".join(lines)) == (
            f"task.yaml, line 5: too much: expected at most {MAX_NODES} values, aliases followed"
        )
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak_bytes < 1e6


def test_values_up_to_the_limit_are_read_and_one_more_is_refused():
    # The mapping, its key and the list count, too.
    fits = MAX_NODES - 3
    assert len(parse_yaml(f"a: [{'1,' * fits}]", "task.yaml")["a"]) == fits
    assert "too much" in refusal(f"a: [{'1,' * (fits + 1)}]")


def test_levels_up_to_the_limit_are_read_and_one_more_is_refused():
    def nested(depth: int) -> str:
        return f"a: {'[' * (depth - 1)}{']' * (depth - 1)}"

    assert parse_yaml(nested(MAX_DEPTH), "task.yaml")
    assert "nested too deeply" in refusal(nested(MAX_DEPTH + 1))


def test_the_time_for_keys_grows_with_their_number_alone():
    def time_s(count: int) -> float:
        text = "\n".join(f"k{number}: 1" for number in range(count))
        started = time.process_time()
        parse_yaml(text, "task.yaml")
        return time.process_time() - started

    # Ten times as many took 100 times as long.
    assert time_s(20_000) < 30.0 * time_s(2000)


def test_an_alias_of_a_plain_value_stands_for_it():
    assert parse_yaml("a: &speed 0.3\nb: [*speed, *speed]", "task.yaml")["b"] == [0.3, 0.3]


@pytest.mark.parametrize(
    ("text", "value"),
    # YAML 1.1 takes all but the last two for text.
    [("5e-2", 0.05), ("1E3", 1000.0), ("-.5", -0.5), ("1.0e5", 1e5), ("5.", 5.0), ("7", 7)],
)
def test_a_number_is_one_in_every_spelling_of_yaml_1_2(text, value):
    found = load_yaml(text)
    assert found == value
    assert type(found) is type(value)


def test_text_that_looks_like_a_number_is_text_again_when_it_is_read():
    values = {"commit": "1234e567", "name": "-.5", "speed_mps": 1e-05, "count": 3}
    assert load_yaml(dump_yaml(values)) == values
