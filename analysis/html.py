"""Renders the HTML pages of a results folder."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

from jinja2 import BytecodeCache, Environment, PackageLoader, StrictUndefined
from jinja2.bccache import Bucket
from markupsafe import Markup, escape

from drake_navbench.analysis.colors import controller_color
from drake_navbench.kernels.percent import PERCENT
from drake_navbench.typed_files.output_file import write_text

NAME_JOINT = re.compile(r"([:_=/-])(?=.)")
# A figure's text stands between tags; numbers in it stay unchanged.
TAG = re.compile(r"<[^>]*>")
# Coordinates in points: a hundredth is finer than any screen or printer shows.
LONG_DECIMALS = re.compile(r"(\.\d\d)\d+")


class _CompiledOnce(BytecodeCache):
    """Keeps compiled templates, so that a process compiles each template once."""

    def __init__(self) -> None:
        self._codes: dict[tuple[str, str], Any] = {}

    def load_bytecode(self, bucket: Bucket) -> None:
        bucket.code = self._codes.get((bucket.key, bucket.checksum))

    def dump_bytecode(self, bucket: Bucket) -> None:
        self._codes[bucket.key, bucket.checksum] = bucket.code


COMPILED = _CompiledOnce()


def page_environment(columns: Iterable[str] = ()) -> Environment:
    """Returns the environment of the templates: text is escaped, a missing value is an error.

    columns: all columns that the page names, so that `color` gives each its own colour.
    """
    environment = Environment(
        loader=PackageLoader("drake_navbench.analysis", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        bytecode_cache=COMPILED,
    )
    environment.filters["breakable"] = breakable
    environment.globals.update(color=partial(controller_color, beside=tuple(columns)))
    return environment


def breakable(name: str) -> Markup:
    """Returns a name as HTML that may break behind : _ = / and -, rather than within a word."""
    return Markup(NAME_JOINT.sub(r"\1<wbr>", str(escape(name))))


def relative_change(ratio: float) -> str:
    """Returns a signed share in percent, with one decimal below 1% and no sign where it is 0."""
    percent = PERCENT * ratio
    text = f"{percent:+.0f}" if abs(percent) >= 1.0 else f"{percent:+.1f}"
    return f"{text}%" if float(text) != 0.0 else "0%"


def inline_svg(path: Path) -> str:
    """Returns a figure as a data URL, so that the page needs no other file."""
    svg = TAG.sub(_shortened, path.read_text(encoding="utf-8"))
    # In a data URL only these characters of an SVG have a meaning; base64 would be a third longer.
    for special in "%#\n":
        svg = svg.replace(special, " " if special == "\n" else quote(special))
    return f"data:image/svg+xml,{svg}"


def _shortened(tag: re.Match[str]) -> str:
    return LONG_DECIMALS.sub(r"\1", tag.group())


def script_json(value: Any) -> Markup:
    """Returns a value as JSON that is safe within a script element."""
    text = json.dumps(value, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace("&", "\\u0026"))


def write_show_page(path: Path, titles: Sequence[str], figures: Sequence[Path]) -> None:
    """Writes a page with these figures, SVG files, under their titles."""
    template = page_environment().get_template("show.html")
    shown = [(title, inline_svg(file)) for title, file in zip(titles, figures, strict=True)]
    write_text(path, template.render(figures=shown))
