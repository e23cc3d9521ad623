"""Ways to damage what a loader reads: a document's values, its text, a file's bytes."""

from __future__ import annotations

import copy
from functools import reduce
from operator import getitem
from typing import Any

import yaml
from hypothesis import strategies as st

# Numbers at which something may break, besides those that hypothesis finds itself.
ODD_NUMBERS = st.sampled_from(
    [0, -1, 1, 2**31, 2**63, 10**30, 0.0, -0.0, 1e-300, 1e-9, 1e7, 1e15, 1e308, float("inf")]
)
ODD_TEXTS = st.sampled_from(
    ["", "..", "/dev/zero", "\x1b[31m", "a\x00b", "[bold]", "<script>", "none", "0x", "x" * 2000]
)
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | ODD_NUMBERS
    | ODD_TEXTS
    | st.text(max_size=20)
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=8,
)
MARKS = ["&a ", "*a", "<<: ", "? ", "- ", ": ", "|\n", ">\n", "%YAML 9\n", "---\n", "...\n"]
TAGS = ["!!int ", "!!timestamp soon", "!!map x", "!!python/name:os.system "]
ODD_VALUES = ["1:1:1", "2024-02-30", ".nan", "1e400"]
FRAGMENTS = st.sampled_from([*"[]{}'\"#\t\n\x00", *MARKS, *TAGS, *ODD_VALUES])


def places_in(document: Any, path: tuple = ()) -> list[tuple]:
    """Returns the path of every value inside a nest of mappings and lists."""
    found = [path] if path else []
    entries = document.items() if isinstance(document, dict) else ()
    entries = enumerate(document) if isinstance(document, list) else entries
    for key, value in entries:
        found += places_in(value, (*path, key))
    return found


@st.composite
def damaged(draw: st.DrawFn, document: dict[str, Any]) -> dict[str, Any]:
    """Draws a document with a few values replaced, removed, moved or added."""
    document = copy.deepcopy(document)
    for _ in range(draw(st.integers(1, 3))):
        places = places_in(document)
        if not places:
            break
        *above, last = draw(st.sampled_from(places))
        parent = reduce(getitem, above, document)
        kind = draw(st.sampled_from(["replace", "replace", "remove", "add", "nest"]))
        if kind == "remove":
            parent.pop(last)
            continue
        value = draw(VALUES)
        if kind == "nest":
            value = {draw(st.text(max_size=8)): value, "type": draw(SCALARS)}
        if kind == "add":
            last = draw(st.text(max_size=12) | ODD_TEXTS)
        if kind == "add" and isinstance(parent, list):
            parent.append(value)
        else:
            parent[last] = value
    return document


@st.composite
def damaged_text(draw: st.DrawFn, text: str) -> str:
    """Draws a text with fragments of YAML put in, pieces cut out or doubled."""
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.integers(0, 30)))
        kind = draw(st.sampled_from(["insert", "cut", "double"]))
        if kind == "insert":
            text = text[:start] + draw(FRAGMENTS | st.text(max_size=5)) + text[start:]
        elif kind == "cut":
            text = text[:start] + text[end:]
        else:
            text = text[:end] + text[start:]
    return text


@st.composite
def damaged_bytes(draw: st.DrawFn, content: bytes) -> bytes:
    """Draws bytes with some changed, cut out or put in, or the end missing."""
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(content)))
        kind = draw(st.sampled_from(["change", "cut", "insert", "end"]))
        piece = draw(st.binary(min_size=1, max_size=8))
        if kind == "change":
            content = content[:start] + piece + content[start + len(piece) :]
        elif kind == "cut":
            content = content[:start] + content[start + draw(st.integers(0, 100)) :]
        elif kind == "insert":
            content = content[:start] + piece + content[start:]
        else:
            content = content[:start]
    return content


def as_text(document: dict[str, Any]) -> str:
    """Returns a document as YAML."""
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True)
