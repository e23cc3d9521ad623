"""Turns YAML text into plain values, and back, within limits of time and memory.

Numbers are those of YAML 1.2, as yaml-cpp and ROS read them: `5e-2`, `1E3` and `+.5` are numbers,
which PyYAML, by YAML 1.1, takes for text.

An alias in YAML repeats the node that it names, so that a few lines can stand for more values than
memory holds. The limit counts the values after this expansion. Tags other than those of plain
values are refused.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import yaml

MAX_NODES = 100_000
MAX_DEPTH = 100
TOO_DEEP = f"nested too deeply, expected at most {MAX_DEPTH} levels"
# PyYAML's words for a fault, from 6.0.4 on.
TOO_DEEP_FOR_YAML = "maximum nesting depth"
# No number or date is longer; the time to read some of them grows with the square of the length.
MAX_NUMBER_LENGTH = 100
TAG_PREFIX = "tag:yaml.org,2002:"
# A number with or without a point and an exponent; 010 and 0x1F are whole numbers of other bases.
DECIMAL = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
PLAIN_TAGS = frozenset(
    TAG_PREFIX + kind for kind in ("null", "bool", "int", "float", "timestamp", "str", "seq", "map")
)
MERGE_TAG = f"{TAG_PREFIX}merge"
SHOWN_LENGTH = 60

# The loader on libyaml reads 16 MB in a second, the other loader in half a minute.
_FastestLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def load_yaml(text: str) -> Any:
    """Returns the value that a YAML text stands for.

    Raises yaml.YAMLError, with the line where it is known, where the text is no YAML, exceeds a
    limit, gives a key twice, or where a value does not fit its tag.
    """
    require_limits(text)
    return yaml.load(text, Loader=_PlainLoader)


def dump_yaml(data: Any, **options: Any) -> str:
    """Returns values as YAML that `load_yaml` reads back; text that looks like a number has quotes.

    options: those of `yaml.dump`.
    """
    text: str = yaml.dump(data, Dumper=_PlainDumper, **options)
    return text


def made(construct: Callable[[], Any], node: yaml.Node) -> Any:
    """Returns the value that a loader constructs from a node.

    Raises yaml.YAMLError where the node looks like a date or a number but is none, or where its tag
    does not fit its text. PyYAML itself raises various exceptions in these cases.
    """
    try:
        return construct()
    except yaml.YAMLError:
        raise
    except (ValueError, LookupError, AttributeError, TypeError) as error:
        reason = f": {error}" if isinstance(error, ValueError) else ""
        raise _fault(f"{_shown(node)} is no {_short_tag(node)}{reason}", node) from error


def line_of(text: str, location: Sequence[int | str]) -> int | None:
    """Returns the line of a value in a valid text; for a missing value, its block's line.

    location: the names and indices that lead to the value.
    """
    line = None
    node = yaml.compose(text, Loader=_FastestLoader)
    for part in location:
        found = _nodes_below(node).get(part)
        if found is None:
            break
        line, node = found
    return line


def _nodes_below(node: yaml.Node | None) -> dict[int | str, tuple[int, yaml.Node]]:
    """Returns the entries of a mapping or a sequence with their lines."""
    if isinstance(node, yaml.MappingNode):
        return {key.value: (key.start_mark.line + 1, value) for key, value in node.value}
    if isinstance(node, yaml.SequenceNode):
        return {i: (entry.start_mark.line + 1, entry) for i, entry in enumerate(node.value)}
    return {}


def require_limits(text: str) -> None:
    """Raises yaml.YAMLError where the values would be too many or nested too deeply.

    Looks at the events of the parser alone, before any value is made.
    """
    count = 0
    # The open collections: their anchors, and the counts of values before them.
    open_anchors: list[tuple[str | None, int]] = []
    sizes: dict[str | None, int] = {}
    for event in _events(text):
        if isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_anchors.pop()
            if anchor is not None:
                sizes[anchor] = count - before
            continue
        if not isinstance(event, yaml.NodeEvent):
            continue
        if isinstance(event, yaml.AliasEvent):
            if any(anchor == event.anchor for anchor, _ in open_anchors):
                raise _fault("a value that contains itself", event)
            # An alias without an anchor is refused by the loader.
            count += sizes.get(event.anchor, 0)
        else:
            count += 1
        if isinstance(event, yaml.CollectionStartEvent):
            open_anchors.append((event.anchor, count - 1))
            if len(open_anchors) > MAX_DEPTH:
                raise _fault(TOO_DEEP, event)
        elif isinstance(event, yaml.ScalarEvent) and event.anchor is not None:
            sizes[event.anchor] = 1
        if count > MAX_NODES:
            raise _fault(f"too much: expected at most {MAX_NODES} values, aliases followed", event)


def _events(text: str) -> Iterator[yaml.Event]:
    """Yields the events of the parser; raises yaml.YAMLError where the text is no YAML."""
    try:
        yield from yaml.parse(text, Loader=_FastestLoader)
    except yaml.MarkedYAMLError as error:
        if TOO_DEEP_FOR_YAML not in (error.problem or ""):
            raise
        # The parser is recursive; the check comes before it yields an event of such a level.
        raise yaml.MarkedYAMLError(problem=TOO_DEEP, problem_mark=error.problem_mark) from error


class MergesByDefinition:
    """A loader that merges mappings as YAML's definition has it; PyYAML 6.0.4 does not.

    If several mappings in the list of a merge key have a key, the first one's value counts; a
    mapping's own keys override all merged ones.
    """

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Puts the entries of merged mappings in front of a mapping's own ones."""
        own, merged = [], []
        for key, value in node.value:
            if key.tag != MERGE_TAG:
                own.append((key, value))
                continue
            sources = value.value if isinstance(value, yaml.SequenceNode) else [value]
            for source in reversed(sources):
                if not isinstance(source, yaml.MappingNode):
                    text = "expected a mapping or list of mappings for merging"
                    raise _fault(f"{text}, got {_shown(source)}", source)
                self.flatten_mapping(source)
                merged += source.value
        node.value = merged + own


class _PlainLoader(MergesByDefinition, _FastestLoader):
    """Makes plain values; refuses a key given twice, where YAML would let the last one win."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        if node.tag not in PLAIN_TAGS:
            raise _fault(f"tag {_short_tag(node)} is not supported", node)
        is_text = node.tag == f"{TAG_PREFIX}str"
        if not is_text and len(node.value) > MAX_NUMBER_LENGTH and _is_scalar(node):
            raise _fault(f"{_shown(node)} is too long for {_short_tag(node)}", node)
        return made(partial(super().construct_object, node, deep), node)

    def construct_mapping(self, node: yaml.Node, deep: bool = False) -> dict[Any, Any]:
        if not isinstance(node, yaml.MappingNode):
            raise _fault(f"{_shown(node)} is no {_short_tag(node)}", node)
        seen = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str | int | float | None):
                kind = type(key).__name__
                raise _fault(f"key {_shown(key_node)}: expected text, got {kind}", key_node)
            if key in seen:
                raise _fault(f"key {_shown(key_node)} is given twice", key_node)
            seen.add(key)
        return super().construct_mapping(node, deep)


class _PlainDumper(yaml.SafeDumper):
    """Quotes every text that the loader would take for a number."""


for _side in (_PlainLoader, _PlainDumper):
    # Whole numbers, which PyYAML's own rules find before, stay whole.
    _side.add_implicit_resolver(
        f"{TAG_PREFIX}float", re.compile(f"{DECIMAL}$"), list("-+.0123456789")
    )


def _fault(text: str, place: yaml.Node | yaml.Event) -> yaml.MarkedYAMLError:
    mark: Any = place.start_mark  # It is of one of two classes, with or without libyaml.
    return yaml.constructor.ConstructorError(None, None, text, mark)


def _is_scalar(node: yaml.Node) -> bool:
    return isinstance(node, yaml.ScalarNode)


def _short_tag(node: yaml.Node) -> str:
    return node.tag.replace(TAG_PREFIX, "!!", 1)


def _shown(node: yaml.Node) -> str:
    """Returns a value as text, shortened; for a list or a mapping its kind alone."""
    if not _is_scalar(node):
        return "a list" if isinstance(node, yaml.SequenceNode) else "a mapping"
    is_cut = len(node.value) > SHOWN_LENGTH
    return f"{node.value[:SHOWN_LENGTH]!r}{'...' if is_cut else ''}"
