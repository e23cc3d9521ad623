"""A package with a controller and no headers, which a compiler has read in a moment.

Its host is linked, never run: the controller is a name alone.
"""

from __future__ import annotations

from pathlib import Path

SOURCE = """\
#define PLUGINLIB_EXPORT_CLASS(kind, base)
PLUGINLIB_EXPORT_CLASS({name}::Controller, nav2_core::Controller)
"""


def add_plain_package(checkout: Path, name: str = "plain") -> Path:
    """Adds the package to a checkout; returns the path of its only source."""
    folder = checkout / name
    (folder / "src").mkdir(parents=True)
    (folder / "package.xml").write_text(
        f"<package><name>{name}</name><version>1.0.0</version></package>"
    )
    source = folder / "src" / f"{name}.cpp"
    source.write_text(SOURCE.format(name=name))
    return source
