"""How the HTML pages of a results folder are rendered."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined

from drake_navbench.analysis.colors import controller_color

PERCENT = 100.0


def page_environment() -> Environment:
    """Returns the environment of the templates: text is escaped, a missing value is an error."""
    environment = Environment(
        loader=PackageLoader("drake_navbench.analysis", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals.update(color=controller_color)
    return environment


def relative_change(ratio: float) -> str:
    """Returns a signed share in percent, with one decimal below 1% and no sign where it is 0."""
    percent = PERCENT * ratio
    text = f"{percent:+.0f}" if abs(percent) >= 1.0 else f"{percent:+.1f}"
    return f"{text}%" if float(text) != 0.0 else "0%"
