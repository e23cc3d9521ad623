"""The pages about the fields of a robot file, made from the model that reads it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from drake_navbench.inputs.robot import ROBOT_FILES, Robot, load_robot
from drake_navbench.logs.text_tables import markdown_table

INTRODUCTION = """\
# Fields of a robot file

Look up here what you may write into a robot file, the YAML file behind `--robot my_robot.yaml`. The
shortest one that drives:

```yaml
description: My robot
robot_radius: 0.2
```

Only `description` and an outline are needed: `robot_radius`, `footprint`, or a `model`, which also
gives the mass. A URDF, SDF or xacro can take the file's place
([how](your_robot.md#a-robot-as-it-lies-in-its-repository)). With `--nav2 FILE` you write only
[what no Nav2 file contains](nav2_files.md#what-is-taken).

Example: `range_max_m` (`12.0`) below `lidar` is written `lidar: {range_max_m: 8.0}`, or for a sweep
`--sweep lidar.range_max_m=4,8`. Default in round brackets, unit in square ones; `NAME`: a name of
your choice. A row `type: ...` begins the fields of that kind; rows above it apply to all.
`schemas/robot.json` holds every field with its limits for editors."""
NAVIGATION_INTRODUCTION = """\
# Fields of a robot file: navigation

The fields of the block `navigation` of a [robot file](robots.md), under Nav2's names ([how they
work](navigation.md)). Example: `inflation_radius` (`0.55`) of the local costmap's inflation layer:

```yaml
navigation:
  local_costmap:
    inflation_layer: {inflation_radius: 0.9}
```

- "As in Nav2": see Nav2's configuration guide. Such fields of a block share a row: `a.b`: `c`
  (`1`), `d` (`2`) are `a.b.c` and `a.b.d`.
- "Ours: ...; Nav2: ...": the default does the first, the other value the second.
- A row `type: ...` or `plugin: ...` begins the fields of that kind; rows above apply to all.
- "Fields of X", "as in X: ...": these rows of X apply."""
# What the page of robots says of the block that has a page of its own.
NAVIGATION_LINK = "The navigation stack around the controller: [its fields](robot_navigation.md)."
# Fields that the loader sets.
NOT_IN_FILES = ("directory",)
# This block has a page of its own, with a heading for each block within.
DEEPER = "navigation"
# From this number of rows on, equal rows of two blocks are shown once.
WORTH_SHARING = 3
# Numbers with more characters are rounded.
LONG = 10
# Fields in DEEPER with Nav2's names are listed without their meaning, unless the meaning has one of
# these words, which tell a difference from Nav2 or a field of ours.
TELLS_MORE = re.compile(
    r"\b(Ours|Nav2|here|null|No effect|no effect|scenario|robot's|Kilted|Humble|Ceres|IPOPT"
    r"|no map|Layers|Filters|For)\b"
)
# A block of DEEPER in which every field is shown: attributes of several trees under one name.
ALL_SHOWN = "behavior_tree"
AS_IN_NAV2 = "As in Nav2."
TITLES = ("field (default)", "meaning")

Row = tuple[str, str, str]
Field = Mapping[str, Any]
Kinds = Mapping[str, Field]


class Shown(NamedTuple):
    """A block that the page shows already: a name to refer to it, and all its rows."""

    name: str
    rows: frozenset[Row]


def robots_page() -> str:
    """Returns the page of robots: the built-in ones, then every field but those of DEEPER."""
    page = Page(Robot.model_json_schema())
    robots = ((f"`{name}`", load_robot(name).description) for name in ROBOT_FILES.names)
    lines = [
        *INTRODUCTION.splitlines(),
        "",
        "## Built-in robots",
        "",
        *markdown_table(("robot", "what it is"), robots),
        "",
        "## Outline, mass, model",
        "",
        *_table(page.rows_without_blocks()),
        *page.sections(page.schema, ""),
    ]
    return "\n".join([*lines, ""])


def navigation_page() -> str:
    """Returns the page of the fields of DEEPER."""
    page = Page(Robot.model_json_schema())
    lines = [*NAVIGATION_INTRODUCTION.splitlines(), *page.sections_of_navigation()]
    return "\n".join([*lines, ""])


def _table(rows: Iterable[Row]) -> list[str]:
    """Returns a table of fields with one row for all parameters of Nav2's AMCL."""
    return _grouped_table(
        rows,
        lambda place, _: place.startswith("`amcl.") and not place.endswith(("_m`", "_rad`")),
    )


def _short_table(rows: Iterable[Row]) -> list[str]:
    """Returns a table of fields with one row for those of a block that mean the same as in Nav2."""
    return _grouped_table(rows, lambda _, meaning: not TELLS_MORE.search(meaning))


def _grouped_table(rows: Iterable[Row], is_grouped: Callable[[str, str], bool]) -> list[str]:
    """Returns a table in which the fields of one kind and block share the row of the first.

    is_grouped: whether a field with this place and meaning shares a row with others.
    """
    short: list[tuple[str, str]] = []
    group_rows: dict[str, int] = {}
    for place, default, meaning in rows:
        if place.startswith(("`plugin:", "`type:")):
            group_rows.clear()
        elif default and is_grouped(place, meaning):
            block, _, name = place.strip("`").rpartition(".")
            shown = f"`{name}` ({default})"
            if block in group_rows:
                before, _ = short[group_rows[block]]
                short[group_rows[block]] = (f"{before}, {shown}", AS_IN_NAV2)
            else:
                group_rows[block] = len(short)
                short.append((f"`{block}`: {shown}" if block else shown, AS_IN_NAV2))
            continue
        short.append((f"{place} ({default})" if default else place, meaning))
    return markdown_table(TITLES, short)


class Page:
    """The tables of the page; where two blocks have the same rows, the second names the first."""

    def __init__(self, schema: Field):
        self.schema = schema
        self._shown: list[Shown] = []

    def rows_without_blocks(self) -> Iterator[Row]:
        """Yields a row for each field of the file itself that is no block."""
        for name, field in self.schema["properties"].items():
            if name not in NOT_IN_FILES and not self._kinds(field):
                yield _row(name, name, field, self.schema)

    def sections(self, part: Field, prefix: str) -> Iterator[str]:
        """Yields the lines of a section for each block; a link in that of DEEPER."""
        for name, field in part["properties"].items():
            kinds = self._kinds(field)
            if not kinds:
                continue
            if name == DEEPER:
                yield from ("", f"## `{name}`", "", NAVIGATION_LINK)
                continue
            yield from ("", f"## `{prefix}{name}`", "", _meaning(field, kinds))
            rows = list(self._rows_of_block(field, f"{prefix}{name}", "", ()))
            if rows[0][0] == "``":
                yield from ("", rows.pop(0)[2])
            is_nav2s = prefix == f"{DEEPER}." and name != ALL_SHOWN
            yield from ("", *(_short_table(rows) if is_nav2s else _table(rows)))

    def sections_of_navigation(self) -> Iterator[str]:
        """Yields the lines of a section for each block within DEEPER."""
        (navigation,) = self._kinds(self.schema["properties"][DEEPER]).values()
        yield from self.sections(navigation, f"{DEEPER}.")

    def _rows_of_block(
        self, field: Field, whole: str, prefix: str, above: tuple[str, ...]
    ) -> Iterator[Row]:
        """Yields the rows of all kinds of a block, then those of each.

        whole: the block's name in the page; prefix: of names in the table, such as `amcl.`; above:
        references of the blocks around it.
        """
        prefix += "NAME." if _is_named(field) else ""
        kinds = self._kinds(field, above)
        rows = {r: self._all_rows(kind, prefix, (*above, r)) for r, kind in kinds.items()}
        shared = frozenset.intersection(*rows.values()) if len(kinds) > 1 else frozenset()
        first = next(iter(kinds))
        rest = rows[first] - shared
        yield from self._new_rows(kinds[first], whole, prefix, (*above, first), rest)
        for reference, kind in kinds.items():
            own = _unprefixed(rows[reference] - shared, prefix)
            choice = _choice(kind) if len(kinds) > 1 else ""
            known = self._known(own)
            common = _prefixed(known.rows & own if known else frozenset(), prefix)
            told = self._told(kind, prefix, (*above, reference), known, common) if known else ""
            if choice:
                is_default = reference == first and not _must_be_chosen(kind)
                yield f"`{choice}`", "default" if is_default else "", told
            elif told:
                yield f"`{prefix.removesuffix('.').removesuffix('.NAME')}`", "", told
            yield from self._new_rows(kind, whole, prefix, (*above, reference), shared | common)
            self._shown.append(Shown(choice or whole, own))

    def _told(
        self,
        kind: Field,
        prefix: str,
        above: tuple[str, ...],
        known: Shown,
        common: frozenset[Row],
    ) -> str:
        """Returns a sentence with the fields that are as in the block `known`; '' for none."""
        if len(known.rows) == len(common):
            return f"Fields of `{known.name}`."
        names = [
            f"`{name}`"
            for name, field in _fields(kind)
            if self._rows_of_field(name, field, kind, prefix, above) <= common
        ]
        return f"As in `{known.name}`: {', '.join(names)}." if names else ""

    def _new_rows(
        self,
        part: Field,
        whole: str,
        prefix: str,
        above: tuple[str, ...],
        known: frozenset[Row],
    ) -> Iterator[Row]:
        """Yields the rows of one kind's fields, without fields all of whose rows are known."""
        for name, field in _fields(part):
            if self._rows_of_field(name, field, part, prefix, above) <= known:
                continue
            kinds = self._kinds(field, above)
            place, default, meaning = _row(f"{prefix}{name}", name, field, part, kinds)
            rows = (
                list(self._rows_of_block(field, f"{whole}.{name}", f"{prefix}{name}.", above))
                if kinds
                else []
            )
            # A reference to another block stands in the block's own row.
            told = rows.pop(0)[2] if rows and rows[0][0] == place else ""
            yield place, default, f"{meaning} {told}".rstrip()
            yield from rows

    def _all_rows(self, part: Field, prefix: str, above: tuple[str, ...]) -> frozenset[Row]:
        fields = (
            self._rows_of_field(name, field, part, prefix, above) for name, field in _fields(part)
        )
        return frozenset().union(*fields)

    def _rows_of_field(
        self, name: str, field: Field, part: Field, prefix: str, above: tuple[str, ...]
    ) -> frozenset[Row]:
        kinds = self._kinds(field, above)
        rows = {_row(f"{prefix}{name}", name, field, part, kinds)}
        inner = f"{prefix}{name}." + ("NAME." if _is_named(field) else "")
        for reference, kind in kinds.items():
            rows |= self._all_rows(kind, inner, (*above, reference))
        return frozenset(rows)

    def _known(self, rows: frozenset[Row]) -> Shown | None:
        """Returns the block shown before that has most of these rows; None for few of them."""
        best = max(self._shown, key=lambda one: len(one.rows & rows), default=None)
        return best if best and len(best.rows & rows) >= WORTH_SHARING else None

    def _kinds(self, field: Field, above: tuple[str, ...] = ()) -> dict[str, Field]:
        """Returns the blocks that a field may hold, by reference; none within itself."""
        kinds = {reference: self._resolved(reference) for reference in _references(field)}
        return {r: kind for r, kind in kinds.items() if r not in above and "properties" in kind}

    def _resolved(self, reference: str) -> Field:
        definition: Field = self.schema["$defs"][reference.rpartition("/")[2]]
        return definition


def _prefixed(rows: frozenset[Row], prefix: str) -> frozenset[Row]:
    return frozenset((f"`{prefix}{name[1:]}", *rest) for name, *rest in rows)


def _unprefixed(rows: frozenset[Row], prefix: str) -> frozenset[Row]:
    return frozenset((f"`{name[1 + len(prefix) :]}", *rest) for name, *rest in rows)


def _fields(part: Field) -> Iterator[tuple[str, Field]]:
    """Yields the fields of one kind of a block, without the field that chooses the kind."""
    chosen = _choice(part)
    for name, field in part.get("properties", {}).items():
        if not chosen.startswith(f"{name}:"):
            yield name, field


def _row(place: str, name: str, field: Field, part: Field, kinds: Kinds | None = None) -> Row:
    if kinds:
        return f"`{place}`", _block_default(field, kinds), _meaning(field, kinds)
    needed = name in part.get("required", ())
    default = "needed" if needed else f"`{_shown_value(field.get('default'))}`"
    return f"`{place}`", default, _meaning(field, {})


def _must_be_chosen(kind: Field) -> bool:
    """Whether a file has to name the kind of a block."""
    return bool({"plugin", "type"} & set(kind.get("required", ())))


def _choice(block: Field) -> str:
    """Returns `type: KIND` or `plugin: TYPE`, by which a file chooses a block; '' without one."""
    for name in ("plugin", "type"):
        field = block.get("properties", {}).get(name, {})
        choice = field.get("const", field.get("default"))
        if choice is not None and ("const" in field or name == "plugin"):
            return f"{name}: {choice}"
    return ""


def _references(field: Field) -> list[str]:
    """Returns the blocks that a field may hold, by their references in the schema."""
    found = [field, *field.get("anyOf", ()), *field.get("oneOf", ()), *field.get("allOf", ())]
    additional = field.get("additionalProperties")
    found += [additional] if isinstance(additional, Mapping) else []
    nested = [inner for entry in found for inner in (*entry.get("oneOf", ()), entry)]
    return list(dict.fromkeys(entry["$ref"] for entry in nested if "$ref" in entry))


def _is_named(field: Field) -> bool:
    """Whether a field is a mapping from names of the user's choice to blocks."""
    return isinstance(field.get("additionalProperties"), Mapping)


def _meaning(field: Field, kinds: Kinds) -> str:
    """Returns a field's own description, else the first line of its block's."""
    own = str(field.get("description", ""))
    text = own or next((str(k.get("description", "")).split("\n")[0] for k in kinds.values()), "")
    told = " ".join(text.split())
    return told if not told or told.endswith(".") else f"{told}."


def _block_default(field: Field, kinds: Kinds) -> str:
    if field.get("default", ...) is None:
        return "none"
    choice = _choice(next(iter(kinds.values()))) if len(kinds) == 1 else ""
    return f"`{choice}`" if choice else ""


def _shown_value(value: Any) -> str:
    """Returns a default as YAML and JSON write it; long numbers with six digits."""
    if isinstance(value, list):
        return f"[{', '.join(map(_shown_value, value))}]"
    if isinstance(value, float) and len(repr(value)) > LONG:
        return f"{value:.6g}"
    return json.dumps(value)
