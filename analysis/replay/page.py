"""The page around a Meshcat scene: a legend that shows and hides, and a player."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template

MESHCAT_TITLE = "<title>Drake MeshCat</title>"
OVERLAY_FILE = "overlay.html"


@dataclass(frozen=True)
class LegendRow:
    """One line of the legend.

    paths: what its check box shows and hides. color: '#rrggbb'. detail: said after the name.
    is_failure: the detail tells of a failed trial.
    """

    name: str
    color: str
    paths: Sequence[str]
    detail: str = ""
    is_failure: bool = False

    def markup(self) -> str:
        """Returns the row's HTML."""
        paths = html.escape(json.dumps(list(self.paths)))
        emphasis = " failed" if self.is_failure else ""
        return (
            f'  <label><input type="checkbox" checked data-paths="{paths}">'
            f'<span class="swatch" style="background: {self.color}"></span>'
            f'<span class="name">{html.escape(self.name)}</span>'
            f'<span class="detail{emphasis}">{html.escape(self.detail)}</span></label>'
        )


def assemble(
    scene_html: str, *, title: str, subtitle: str, sections: Sequence[Sequence[LegendRow]]
) -> str:
    """Returns Meshcat's static page with title, legend (one block a section) and player."""
    template = Template(files(__package__).joinpath(OVERLAY_FILE).read_text(encoding="utf-8"))
    blocks = ["\n".join(row.markup() for row in section) for section in sections if section]
    overlay = template.substitute(
        title=html.escape(title), subtitle=html.escape(subtitle), rows="\n  <hr>\n".join(blocks)
    )
    page = scene_html.replace(MESHCAT_TITLE, f"<title>{html.escape(title)}</title>", 1)
    body, end, rest = page.rpartition("</body>")
    return body + overlay + end + rest
