"""Hooks of mkdocs.yml: the Markdown of docs/, written for GitHub, as the site shows it."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

import yaml

REPOSITORY = Path(__file__).parents[1]
REDIRECTS = REPOSITORY / "docs" / "site" / "redirects.yaml"
# studies/site_replays.py writes them.
REPLAYS = REPOSITORY / "build" / "replays"
GALLERY, INTERFACE = "gallery.md", "api.md"
# Weights in the search; others have 1. Docstrings and the notebook name everything and explain
# little; who asks for a robot is to find the page where each of its files has its command.
WEIGHTS = {INTERFACE: 0.2, "tutorial.ipynb": 0.3, "your_robot.md": 4.0}
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


def with_replays(markdown: str, names: set[str]) -> str:
    """Returns the gallery's page with the replay of each named section below its picture."""
    # The link as HTML: mkdocs knows no page of that name.
    frame = (
        '\n\n<iframe class="replay" src="replays/{0}.html" loading="lazy" '
        'title="Replay of {0}"></iframe>\n\n'
        '<p><a href="replays/{0}.html" target="_blank">The replay alone</a></p>'
    )
    for name in sorted(names):
        picture = f"![{name}](images/gallery/{name}.svg)"
        markdown = markdown.replace(picture, picture + frame.format(name))
    return markdown


def with_redirects(html: str, page: str, redirects: dict[str, str]) -> str:
    """Returns a page's HTML that leads from headings which it no longer has to those of today.

    redirects: new places by old ones, each as `page.md#anchor`.
    """
    own = {
        old.partition("#")[2]: _address(new)
        for old, new in redirects.items()
        if old.partition("#")[0] == page
    }
    if not own:
        return html
    script = (
        f"<script>const moved = {json.dumps(own)}[location.hash.slice(1)];"
        "if (moved) location.replace(moved);</script>"
    )
    return html.replace("</head>", f"{script}</head>", 1)


def _address(place: str) -> str:
    """Returns the address of `page.md#anchor` in the site."""
    page, mark, anchor = place.partition("#")
    return page.replace("README.md", "index.html").replace(".md", ".html") + mark + anchor


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
    if page.file.src_path in WEIGHTS:
        page.meta["search"] = {"boost": WEIGHTS[page.file.src_path]}
    if page.file.src_path == GALLERY:
        replays = {path.stem for path in REPLAYS.glob("*.html")}
        markdown = as_grid(with_replays(markdown, replays))
    if page.file.src_path == INTERFACE:
        markdown = with_docstrings(markdown)
    return with_lists_apart(markdown)


def on_post_page(output: str, *, page: Any, **_others: Any) -> str:
    """Called by mkdocs for each page; returns its HTML without scripts of other hosts."""
    redirects = yaml.safe_load(REDIRECTS.read_text(encoding="utf-8"))
    return with_redirects(FOREIGN_SCRIPT.sub("", output), page.file.src_path, redirects)


def on_post_build(*, config: Any, **_others: Any) -> None:
    """Called by mkdocs at the end; copies the replays into the site."""
    if REPLAYS.is_dir():
        shutil.copytree(REPLAYS, Path(config.site_dir) / "replays", dirs_exist_ok=True)
