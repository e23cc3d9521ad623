"""docs/plugins_of_nav2.md: every plugin that Nav2 ships, and what stands for it here."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pydantic import Field

from drake_navbench.logs.text_tables import markdown_table
from drake_navbench.plugins.releases import NEWEST_RELEASE, Release
from drake_navbench.typed_files.typed_yaml import FrozenModel, read_yaml, validate

DATA_FILE = "nav2_plugins.yaml"
HEADING = """\
# The plugins of Nav2

Is a plugin of your Nav2 file here, and does it behave as Nav2's? For your file ask

```
drake-navbench run --nav2 FILE --check
```

These tables hold every plugin of Humble to Lyrical.

- **releases**: the Nav2 releases that ship the plugin.
- **here**: its counterpart ("–": none; "same name": Nav2's, with or without prefix).
- **rules of**: the releases whose behaviour the counterpart has; of several, your file's release
  decides.
- **how equal**: the largest difference from Nav2's C++, both given the same input (commands in m/s
  and rad/s, positions in m); empty: the counterpart follows Nav2's source and its tests.

`make docs` makes the page of [nav2_plugins.yaml](nav2_plugins.yaml).
"""


class ShippedPlugin(FrozenModel):
    """A plugin of Nav2.

    since, until: first and last release that ships it; but: releases in between that do not. ours:
    its name here, None where it does not exist here; beside: a similar plugin here, which its type
    does not choose; release: the release whose rules ours follows; equal: how closely ours was
    found to agree; remark: on a plugin that does not exist here.
    """

    type: str
    since: Release = Release.HUMBLE
    until: Release = NEWEST_RELEASE
    but: list[Release] = Field(default_factory=list)
    ours: str | None = None
    beside: str | None = None
    release: str | None = None
    equal: str | None = None
    remark: str | None = None

    @property
    def releases(self) -> list[Release]:
        """The releases that ship the plugin, the oldest first."""
        span = [release for release in Release if self.since <= release <= self.until]
        return [release for release in span if release not in self.but]


class PluginSort(FrozenModel):
    """All plugins of one kind."""

    kind: str
    note: str | None = None
    plugins: list[ShippedPlugin]


class ShippedPlugins(FrozenModel):
    """The contents of nav2_plugins.yaml."""

    kinds: list[PluginSort]


def read_plugins(path: Path) -> ShippedPlugins:
    """Returns the content of the data file; raises InputError where it is not valid."""
    return validate(ShippedPlugins, read_yaml(path), str(path))


def plugin_page(shipped: ShippedPlugins) -> str:
    """Returns the page as Markdown."""
    every = [plugin for sort in shipped.kinds for plugin in sort.plugins]
    have = sum(plugin.ours is not None for plugin in every)
    lines = [HEADING, f"Of {len(every)} plugins {have} have a counterpart here.", ""]
    for sort in shipped.kinds:
        lines += [f"## {sort.kind}", ""]
        lines += [sort.note, ""] if sort.note else []
        titles = ("in Nav2", "releases", "here", "rules of", "how equal")
        lines += [*markdown_table(titles, _rows(sort)), ""]
    return "\n".join(lines)


def _rows(sort: PluginSort) -> Iterator[tuple[str, ...]]:
    """Yields a row for all plugins of a kind about which the same is to be said."""
    alike: dict[tuple[str, ...], list[ShippedPlugin]] = {}
    for plugin in sort.plugins:
        equal = plugin.equal or plugin.remark or ""
        said = (_span(plugin.releases), plugin.release or "", equal, _naming(plugin))
        alike.setdefault(said, []).append(plugin)
    for (span, release, equal, naming), plugins in alike.items():
        own = [name for plugin in plugins for name in (plugin.ours, plugin.beside) if name]
        here = naming or _listed(own)
        yield _listed([plugin.type for plugin in plugins]), span, here, release, equal


def _naming(plugin: ShippedPlugin) -> str:
    """Returns in words how a plugin is called here; '' where its names are to be listed."""
    if plugin.ours is None:
        return "–"
    bare = plugin.type.rpartition("::")[2]
    same = (plugin.type, bare, bare.removesuffix("Critic"))
    return "same name" if plugin.ours in same and not plugin.beside else ""


def _listed(names: list[str]) -> str:
    """Returns names, each once."""
    return ", ".join(f"`{name}`" for name in dict.fromkeys(names))


def _span(releases: list[Release]) -> str:
    """Returns a list of releases in few words, such as a span."""
    if releases == list(Release):
        return "all"
    if releases == list(Release)[-len(releases) :]:
        return releases[0] if len(releases) == 1 else f"from {releases[0]}"
    return ", ".join(releases)
