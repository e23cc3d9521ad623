"""The page of `show`: pictures one below the other, in one file that needs no other file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drake_navbench.analysis.html import inline_svg, page_environment
from drake_navbench.logs.results import write_text


def write_show_page(path: Path, titles: Sequence[str], figures: Sequence[Path]) -> None:
    """Writes a page with these figures, SVG files, under their titles."""
    template = page_environment().get_template("show.html")
    shown = [(title, inline_svg(file)) for title, file in zip(titles, figures, strict=True)]
    write_text(path, template.render(figures=shown))
