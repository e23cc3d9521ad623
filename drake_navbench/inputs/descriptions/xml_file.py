"""XML of unknown origin: of limited size and depth, without entities, prefixes left out."""

from __future__ import annotations

import re
from typing import Any
from xml.etree import ElementTree

from drake_navbench.errors import InputError, as_line

# No model nests deeper; functions walk through elements by recursion.
MAX_XML_DEPTH = 200
MAX_ELEMENTS = 2_000_000
ENTITY = re.compile(rb"<!ENTITY", re.IGNORECASE)
# A prefix that no declaration binds, such as `drake:`; parsers stop at it.
PREFIXED = re.compile(rb"<(/?)([A-Za-z_][\w.-]*):([A-Za-z_])")
PREFIXED_ATTRIBUTE = re.compile(rb"(\s)([A-Za-z_][\w.-]*):([A-Za-z_][\w.-]*\s*=\s*[\"'])")
LATE_DECLARATION = re.compile(rb"<\?xml\s[^>]*\?>")
# Gazebo takes a comment with `--` in it, such as a plan drawn with dashes; XML does not.
COMMENT = re.compile(rb"<!--(.*?)-->", re.DOTALL)
# Expat's code for content after the first element, which Gazebo ignores.
JUNK_AFTER_ROOT = 9
ENCODING = re.compile(rb"<\?xml[^>]*encoding\s*=\s*[\"'](?!utf-8)", re.IGNORECASE)


def read_xml(content: bytes, source: str) -> ElementTree.Element:
    """Returns the root element of a text; tags and attributes without prefixes.

    Raises InputError, one line, where the text is not XML, declares entities or nests too deeply.
    """
    if ENTITY.search(content):
        raise InputError(f"{source}: declares XML entities; expected none")
    content = without_late_declaration(content)
    if not ENCODING.search(content[:200]):
        # Names in comments of some files are not UTF-8.
        content = content.decode(errors="replace").encode()
    content = COMMENT.sub(lambda found: b"<!--%b-->" % found[1].replace(b"-", b"="), content)
    content = PREFIXED.sub(rb"<\1\2.\3", content)
    content = PREFIXED_ATTRIBUTE.sub(rb"\1\2.\3", content)
    parser: Any = ElementTree.XMLPullParser(["start", "end"])
    depth = count = 0
    root: ElementTree.Element | None = None
    try:
        for start in range(0, len(content), 65536):
            parser.feed(content[start : start + 65536])
            for event, element in parser.read_events():
                if root is None:
                    root = element
                depth += 1 if event == "start" else -1
                count += event == "start"
                if depth > MAX_XML_DEPTH or count > MAX_ELEMENTS:
                    raise InputError(f"{source}: nests too deeply or is too long for a model")
        parser.close()
        for _ in parser.read_events():
            pass
    except (ElementTree.ParseError, ValueError) as error:
        if root is not None and getattr(error, "code", None) == JUNK_AFTER_ROOT:
            return root
        raise InputError(f"{source}: is not XML: {as_line(str(error))}") from error
    if root is None:
        raise InputError(f"{source}: is not XML: it is empty")
    return root


def without_late_declaration(content: bytes) -> bytes:
    """Returns a text without an XML declaration behind a blank line or a comment, as is common."""
    content = content.lstrip()
    return content[:1] + LATE_DECLARATION.sub(b"", content[1:], count=1)


def text_of(element: ElementTree.Element | None, path: str) -> str | None:
    """Returns the text below an element at a path; None where there is none."""
    found = None if element is None else element.find(path)
    return None if found is None or found.text is None else found.text.strip()
