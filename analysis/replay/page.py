"""The page around a Meshcat scene: a legend that shows and hides, charts, cameras, a player."""

from __future__ import annotations

import html
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from string import Template
from typing import Any

from drake_navbench.analysis.html import breakable

MESHCAT_TITLE = "<title>Drake MeshCat</title>"
OVERLAY = "overlay"
# Without this line a telephone shows the page as wide as a desktop's, in tiny letters.
VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'


@dataclass(frozen=True)
class LegendRow:
    """One line of the legend.

    paths: the Meshcat paths that its check box shows and hides. color: '#rrggbb'. detail: text
    after the name. is_failure: whether the detail is about a failed trial. is_of_chosen: whether,
    of the paths (one a robot), only the chosen robot's is shown. robot: the robot's number in the
    page, for a robot's line.
    """

    name: str
    color: str
    paths: Sequence[str]
    detail: str = ""
    is_failure: bool = False
    is_of_chosen: bool = False
    robot: int | None = None

    def markup(self) -> str:
        """Returns the row's HTML."""
        paths = html.escape(json.dumps(list(self.paths)))
        emphasis = " failed" if self.is_failure else ""
        of_chosen = ' data-of-chosen="yes"' if self.is_of_chosen else ""
        return (
            f'  <div class="row"><label><input type="checkbox" checked data-paths="{paths}"'
            f"{of_chosen}>"
            f'<span class="swatch" style="background: {self.color}"></span>'
            f'<span class="text"><span class="name">{breakable(self.name)}</span> '
            f'<span class="detail{emphasis}">{html.escape(self.detail)}</span></span></label>'
            f"{self._buttons()}</div>"
        )

    def _buttons(self) -> str:
        if self.robot is None:
            return ""
        buttons = (
            '<button type="button" class="choose" aria-pressed="false" '
            'title="its costmap, its charts; the camera follows it">choose</button>'
        )
        if self.is_failure:
            buttons += (
                f'<button type="button" class="jump" data-robot="{self.robot}" '
                'title="a second before the end">failure</button>'
            )
        return buttons


def assemble(
    scene_html: str,
    *,
    title: str,
    subtitle: str,
    sections: Sequence[Sequence[LegendRow]],
    notes: Sequence[str] = (),
    data: Mapping[str, Any],
) -> str:
    """Returns Meshcat's static page with title, legend (one block a section), charts and player.

    data: `bounds` of the course [x0, x1, y0, y1] m, `aspect` of the window for which the camera is
    aimed, and `robots`: for each its `name`, `color`, Meshcat paths `group` and `robot`, the
    entries of `strip.strip_of`, and the `reasons` of its decisions; `compute_top_ms`: where the
    axis of compute times ends; `floors`: of each the `name` and the place `x`, `y` m of its label.
    notes: sentences below the legend, such as how to get missing layers.
    """
    blocks = ["\n".join(row.markup() for row in section) for section in sections if section]
    # A script element must not contain the text that ends it.
    plain = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    overlay = Template(_text(".html")).substitute(
        style=_text(".css"),
        script=_text(".js"),
        data=plain,
        title=html.escape(title),
        subtitle=html.escape(subtitle),
        rows="\n  <hr>\n".join(blocks),
        notes="\n".join(f'  <p class="note">{html.escape(note)}</p>' for note in notes),
    )
    page = scene_html.replace(MESHCAT_TITLE, f"{VIEWPORT}<title>{html.escape(title)}</title>", 1)
    body, end, rest = page.rpartition("</body>")
    return body + overlay + end + rest


def _text(suffix: str) -> str:
    return files(__package__).joinpath(f"{OVERLAY}{suffix}").read_text(encoding="utf-8")
