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
# How many numbers they hold; a pose has 7 with a quaternion, and none where it is empty.
COUNTS = {"xyz": (3,), "rpy": (3,), "scale": (3,), "pose": (0, 6, 7)}
BOX_SIDES = (3,)
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


def _remarks(element: ElementTree.Element, parent: str = "") -> Iterator[str]:
    if element.tag == UNREAD:
        return
    texts = [(f"{name}=", name, element.get(name)) for name in ATTRIBUTES]
    if element.tag in ELEMENTS and len(element) == 0:
        texts.append(("", element.tag, element.text))
    if element.tag == "mass":
        texts.append(("value=", "mass", element.get("value")))
    for shown, name, text in texts:
        if text is None:
            continue
        words = text.replace(",", " ").split()
        is_box = name == "size" and "box" in (element.tag, parent)
        counts = BOX_SIDES if is_box else COUNTS.get(name, (len(words),))
        if len(words) not in counts:
            yield (
                f"<{element.tag}> {shown}{text.strip()!r}: expected {max(counts[:2])} numbers, "
                f"found {len(words)}; 0 is taken for others"
            )
        elif "," in text:
            yield f"<{element.tag}> {shown}{text.strip()!r}: expected no commas; read as spaces"
        if not all(_is_number(word) for word in words):
            yield (
                f"<{element.tag}> {shown}{text.strip()!r}: expected numbers of at most "
                f"{FARTHEST_M:g}; 0 is taken for others"
            )
        elif name in LENGTHS and any(float(word) < 0.0 for word in words):
            yield f"<{element.tag}> {shown}{text.strip()!r}: expected no length below 0"
    for child in element:
        yield from _remarks(child, element.tag)


def _is_number(word: str) -> bool:
    try:
        return abs(float(word)) <= FARTHEST_M
    except ValueError:
        return False
