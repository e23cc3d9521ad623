"""How the HTML pages of a results folder are rendered."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined

from drake_navbench.analysis.colors import controller_color


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
