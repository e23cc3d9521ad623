"""The texts of a model or world that should be numbers and are not; 0 is read in their place."""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.etree import ElementTree

from drake_navbench.inputs.descriptions.poses import FARTHEST_M

# Attributes of URDF, and elements of SDF, that hold numbers.
ATTRIBUTES = ("xyz", "rpy", "size", "radius", "length", "scale")
ELEMENTS = ("pose", "size", "radius", "length", "scale", "mass")
LENGTHS = ("size", "radius", "length")
# What plugins hold is read elsewhere.
UNREAD = "plugin"
MOST_TOLD = 5


def number_remarks(root: ElementTree.Element) -> list[str]:
    """Returns a remark on each kind of text that should be numbers, in the order of the file."""
    told = list(dict.fromkeys(_remarks(root)))
    more = [f"{len(told) - MOST_TOLD} more texts are no numbers"] if len(told) > MOST_TOLD else []
    return told[:MOST_TOLD] + more


def is_far(text: str | None) -> bool:
    """Tells whether a pose lies beyond all bounds."""
    for word in (text or "").replace(",", " ").split()[:3]:
        try:
            if FARTHEST_M < abs(float(word)) < math.inf:
                return True
        except ValueError:
            continue
    return False


def _remarks(element: ElementTree.Element) -> Iterator[str]:
    if element.tag == UNREAD:
        return
    texts = [(f"{name}=", name, element.get(name)) for name in ATTRIBUTES]
    if element.tag in ELEMENTS and len(element) == 0:
        texts.append(("", element.tag, element.text))
    for shown, name, text in texts:
        words = (text or "").replace(",", " ").split()
        if not all(_is_number(word) for word in words):
            yield (
                f"<{element.tag}> {shown}{(text or '').strip()!r}: expected numbers of at most "
                f"{FARTHEST_M:g}; 0 is taken for others"
            )
        elif name in LENGTHS and any(float(word) < 0.0 for word in words):
            yield f"<{element.tag}> {shown}{(text or '').strip()!r}: expected no length below 0"
    for child in element:
        yield from _remarks(child)


def _is_number(word: str) -> bool:
    try:
        return abs(float(word)) <= FARTHEST_M
    except ValueError:
        return False
