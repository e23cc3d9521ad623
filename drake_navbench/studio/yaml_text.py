"""A YAML file's text with changed content: comments, order, quotes and blanks of the rest stay."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import SequenceMatcher
from functools import lru_cache
from io import StringIO
from typing import Any

from drake_navbench.errors import InputError
from drake_navbench.typed_files.typed_yaml import parse_yaml

# The indents of a new file, as in scenario files.
MAPPING_INDENT, SEQUENCE_INDENT, DASH_OFFSET = 2, 4, 2
# The width at which lines would be broken: no line is broken that the user has not broken.
WIDTH = 1_000_000
# A block with more characters than this on one line is written on several lines.
LONGEST_LINE = 96
NOT_INSTALLED = "studio: needs ruamel.yaml; install it with: pip install 'drake-navbench[studio]'"


def require_studio_libraries() -> None:
    """Raises InputError where the extra `studio` is not installed."""
    try:
        import ruamel.yaml  # noqa: F401
    except ImportError as error:
        raise InputError(NOT_INSTALLED) from error


def updated_text(text: str, data: Mapping[str, Any], source: str) -> str:
    """Returns a YAML file's text with this content.

    text: the present one, '' for a new file. source: the file's name, for errors. Raises InputError
    if the text cannot get this content without another change.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.comments import CommentedMap

    if text and parse_yaml(text, source) == data:
        return text
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = WIDTH
    sequence, dash = _indents(text)
    yaml.indent(mapping=MAPPING_INDENT, sequence=sequence, offset=dash)
    tree = yaml.load(text) if text else CommentedMap()
    _change_mapping(tree, data)
    out = StringIO()
    yaml.dump(tree, out)
    if parse_yaml(out.getvalue(), source) != data:
        raise InputError(f"{source}: cannot be saved without changing more than was drawn")
    return out.getvalue()


@lru_cache(maxsize=4)
def _indents(text: str) -> tuple[int, int]:
    """Returns the indents of entries and of dashes in lists, as used in the text."""
    from ruamel.yaml.util import load_yaml_guess_indent

    _, sequence, dash = load_yaml_guess_indent(text) if text else (None, None, None)
    if sequence is None or dash is None:
        return SEQUENCE_INDENT, DASH_OFFSET
    return sequence, dash


def _change_mapping(tree: Any, data: Mapping[str, Any]) -> None:
    for name in [name for name in tree if name not in data]:
        del tree[name]
    for name, value in data.items():
        if name not in tree:
            tree[name] = _node(value)
        else:
            _change_entry(tree, name, value)


def _change_entry(tree: Any, place: Any, value: Any) -> None:
    """Changes an entry of a mapping or list; equal values stay as they are written."""
    before = tree[place]
    if _is_same(before, value):
        return
    if isinstance(before, dict) and isinstance(value, dict):
        _change_mapping(before, value)
    elif isinstance(before, list) and isinstance(value, list):
        _change_list(before, value)
    else:
        tree[place] = _node(value)


def _change_list(tree: Any, values: list[Any]) -> None:
    """Changes a list; equal entries stay as they are written, at whatever place they are now."""
    if not tree and not _is_flat(values):
        tree.fa.set_block_style()
    old, new = [repr(_plain(item)) for item in tree], [repr(_plain(item)) for item in values]
    for kind, a, b, c, d in reversed(SequenceMatcher(None, old, new, False).get_opcodes()):
        if kind == "equal":
            continue
        shared = min(b - a, d - c)
        for index in range(b - 1, a + shared - 1, -1):
            del tree[index]
        for index in range(shared):
            _change_entry(tree, a + index, values[c + index])
        for index in range(shared, d - c):
            tree.insert(a + index, _node(values[c + index]))


def _is_same(before: Any, value: Any) -> bool:
    return repr(_plain(before)) == repr(_plain(value))


def _plain(value: Any) -> Any:
    """Returns a value of ruamel.yaml as a plain Python value."""
    if isinstance(value, dict):
        return {str(name): _plain(entry) for name, entry in sorted(value.items())}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    for kind in (bool, int, float, str):
        if isinstance(value, kind):
            return kind(value)
    return value


def _node(value: Any) -> Any:
    """Returns a value for writing: points and short blocks on one line, all others on several."""
    from ruamel.yaml.comments import CommentedMap, CommentedSeq
    from ruamel.yaml.scalarstring import SingleQuotedScalarString

    if isinstance(value, dict):
        block = CommentedMap({name: _node(entry) for name, entry in value.items()})
        inner = [entry for entry in value.values() if isinstance(entry, dict | list)]
        if (
            value
            and all(entry and _is_flat(entry) for entry in inner)
            and len(str(value)) < LONGEST_LINE
        ):
            block.fa.set_flow_style()
        return block
    if isinstance(value, list | tuple):
        entries = CommentedSeq([_node(entry) for entry in value])
        if _is_flat(value):
            entries.fa.set_flow_style()
        return entries
    if isinstance(value, str) and not _is_read_as_text(value):
        return SingleQuotedScalarString(value)
    return value


def _is_read_as_text(value: str) -> bool:
    """Tells whether the loader of scenarios reads a text without quotes as this text.

    It takes words such as 'yes' or '1e3' for flags and numbers, which ruamel.yaml takes for texts.
    """
    try:
        return bool(parse_yaml(f"text: {value}", "") == {"text": value})
    except InputError:
        # Of these ruamel.yaml knows, too, that they need quotes.
        return True


def _is_flat(value: Any) -> bool:
    """Returns whether a list is a point, or a list of points, without blocks in it."""
    if isinstance(value, list | tuple):
        return all(_is_flat(entry) for entry in value)
    return not isinstance(value, dict)
