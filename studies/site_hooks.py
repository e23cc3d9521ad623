"""Hooks of mkdocs.yml: the Markdown of docs/, written for GitHub, as the site shows it."""

from __future__ import annotations

import re
from typing import Any

GALLERY, INTERFACE = "gallery.md", "api.md"
NAME = re.compile(r"^\| `(drake_navbench[\w.]+)` \|", re.M)
HEADING = re.compile(r"^(?=## )", re.M)
FENCE = re.compile(r"^\s*(```|~~~)")
ITEM = re.compile(r"^([-*]|\d+\.) ")
# Scripts that notebooks load from other hosts: MathJax, RequireJS, Mermaid. No cell needs them.
FOREIGN_SCRIPT = re.compile(
    r'<script[^>]*\bsrc="https?://[^"]*"[^>]*>\s*</script>'
    r'|<script[^>]*>(?:(?!</script>).)*\bimport\("https?://(?:(?!</script>).)*</script>',
    re.DOTALL,
)


def as_grid(markdown: str) -> str:
    """Returns the gallery's page with each section as a cell of a grid."""
    head, *sections = HEADING.split(markdown)
    cells = "".join(f"<section markdown>\n\n{section}\n</section>\n\n" for section in sections)
    return f'{head}<div class="gallery" markdown>\n\n{cells}</div>\n'


def with_docstrings(markdown: str) -> str:
    """Returns the page of the Python interface with the docstrings of its names below."""
    names = NAME.findall(markdown)
    return markdown + "\n## Reference\n\n" + "".join(f"::: {name}\n\n" for name in names)


def with_lists_apart(markdown: str) -> str:
    """Returns a page with an empty line before each list, without which the site shows none."""
    lines: list[str] = []
    is_code = False
    for line in markdown.split("\n"):
        is_code ^= bool(FENCE.match(line))
        before = lines[-1] if lines else ""
        follows_text = before and not before.startswith(" ") and not ITEM.match(before)
        if not is_code and ITEM.match(line) and follows_text:
            lines.append("")
        lines.append(line)
    return "\n".join(lines)


def on_page_markdown(markdown: str, *, page: Any, **_others: Any) -> str:
    """Called by mkdocs for each page; returns its Markdown as the site shows it."""
    if page.file.src_path == GALLERY:
        markdown = as_grid(markdown)
    if page.file.src_path == INTERFACE:
        markdown = with_docstrings(markdown)
    return with_lists_apart(markdown)


def on_post_page(output: str, **_others: Any) -> str:
    """Called by mkdocs for each page; returns its HTML without scripts of other hosts."""
    return FOREIGN_SCRIPT.sub("", output)
