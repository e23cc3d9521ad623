"""Reads the parameters of one Nav2 node into our models, and notes how each one is used."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Collection, Iterable, Mapping
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from drake_navbench.errors import InputError, printable
from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.nav2.parameters import PARAMETERS_KEY, Node
from drake_navbench.nav2.substitutions import missing_value
from drake_navbench.plugins.releases import NEWEST_RELEASE, Release, read_by
from drake_navbench.typed_files.name_lists import name_lists
from drake_navbench.typed_files.usual_values import as_taken, doubt_about

# The parameters without a meaning here, by the node that has them.
WITHOUT_MEANING = name_lists(__package__, "without_meaning.yaml")
MAX_SHOWN = 60
# Parameters of a source of obstacles by their names until Foxy, and today's.
RENAMED = {"obstacle_range": "obstacle_max_range", "raytrace_range": "raytrace_max_range"}
RENAMING = "no effect: since Galactic it is called"
# The share of equal letters from which one name counts as a slip of the other.
LIKE_A_SLIP = 0.8
# The share of equal letters that each of its words needs, where both have equally many.
LIKE_A_WORD = 0.6

Rows = dict[tuple[str, str], CheckRow]
"""Rows by node and parameter."""


class Offer(NamedTuple):
    """A parameter that a node reads: the field of a typed model, the file's value, the default.

    default: the release's. given: None where the file gives none.
    """

    model: type[BaseModel]
    field: str
    default: Any
    given: Any


class NodeReader:
    """Reads a node's parameters one after another; each read one becomes a row of the check.

    rows: the check's rows by node and parameter, to which the reader adds; a later row replaces an
    earlier one of the same place. release: Nav2's, whose parameters and defaults count. offers: by
    name, the parameters of typed models that the node reads or would read.
    """

    def __init__(self, node: Node, rows: Rows, release: Release = NEWEST_RELEASE) -> None:
        self._node = node
        self._rows = rows
        self._release = release
        self._seen: set[str] = set()
        self._known: set[str] = set()
        self.offers: dict[str, Offer] = {}

    @property
    def node(self) -> Node:
        """The node."""
        return self._node

    @property
    def release(self) -> Release:
        """The release of Nav2."""
        return self._release

    def note(self, status: Status, name: str, remark: str = "") -> None:
        """Adds a row about a parameter, a block or, where the name is '', the whole node."""
        self._seen.add(name)
        parameter = self._node.parameters.get(name)
        self._add(CheckRow(status, self._name, name, remark, parameter and parameter.line))

    def note_block(self, status: Status, block: str, remark: str) -> None:
        """Adds one row about a whole block; its parameters get no rows of their own."""
        names = [name for name in self._node.parameters if name.startswith(f"{block}.")]
        self._seen.update(names)
        for name in names:
            self._rows.pop((self._name, name), None)
        lines = [self._node.parameters[name].line for name in names]
        self._add(CheckRow(status, self._name, block, remark, min(lines, default=None)))

    @property
    def _name(self) -> str:
        return self._node.name.lstrip("/")

    def _add(self, row: CheckRow) -> None:
        self._rows.pop((row.node, row.parameter), None)
        self._rows[row.node, row.parameter] = row

    def given(self, name: str) -> bool:
        """Returns whether the file gives a parameter."""
        self._known.add(name)
        return name in self._node.parameters

    def gives(self, model: type[BaseModel], field: str, name: str) -> bool:
        """Returns whether the file gives a field of a model that the release reads.

        name: name of the field in the file. Notes it where the release does not read it.
        """
        if not self.given(name):
            return False
        if self._release in read_by(model, field).releases:
            return True
        self.note(Status.UNREAD, name, f"{self._release} does not read it")
        return False

    def value(self, name: str, default: Any = None) -> Any:
        """Returns a parameter, or `default` where the file gives none; notes it as used."""
        if not self.given(name):
            return default
        missing = missing_value(self._node.get(name))
        if missing is not None:
            raise self.fault(name, f"{missing} has no value; expected --set {missing}=value")
        if name not in self._seen:
            self.note(Status.USED, name)
        return self._node.get(name)

    def number(self, name: str, default: float) -> float:
        """Returns a parameter that must be a number."""
        found = self.value(name, default)
        if isinstance(found, bool) or not isinstance(found, int | float):
            raise self.fault(name, f"expected a number, got {printable(repr(found), MAX_SHOWN)}")
        return found

    def text(self, name: str, default: str = "") -> str:
        """Returns a parameter that must be text."""
        found = self.value(name, default)
        if not isinstance(found, str):
            raise self.fault(name, f"expected text, got {printable(repr(found), MAX_SHOWN)}")
        return found

    def flag(self, name: str, default: bool) -> bool:
        """Returns a parameter that must be true or false."""
        found = self.value(name, default)
        if not isinstance(found, bool):
            raise self.fault(
                name, f"expected true or false, got {printable(repr(found), MAX_SHOWN)}"
            )
        return found

    def names(self, name: str, default: Iterable[str]) -> list[str]:
        """Returns a list of plugin names; raises InputError for other values or repeated names."""
        found = self.value(name, list(default))
        if isinstance(found, str):
            found = [found]
        if not isinstance(found, list) or not all(isinstance(entry, str) for entry in found):
            raise self.fault(
                name, f"expected a list of names, got {printable(repr(found), MAX_SHOWN)}"
            )
        for entry in found:
            if found.count(entry) > 1:
                raise self.fault(name, f"{entry!r} is listed twice, expected once")
        return found

    def plugin_type(self, plugin: str, default: str | None, listed_in: str) -> str:
        """Returns the type of a plugin, its parts joined by '::' as from jazzy on."""
        name = f"{plugin}.plugin"
        found = self.value(name, default)
        if found is None:
            raise self.fault(listed_in, f"{plugin!r} is listed, but {name} is missing")
        if not isinstance(found, str):
            raise self.fault(
                name, f"expected a plugin type, got {printable(repr(found), MAX_SHOWN)}"
            )
        return found.replace("/", "::")

    def fault(self, name: str, text: str) -> InputError:
        """Returns the error of a parameter as one line that names file, line and parameter.

        name: name of a parameter, or of an entry below one; the error names the parameter.
        """
        while name not in self._node.parameters and "." in name:
            name = name.rpartition(".")[0]
        return InputError(f"{self._node.where(name)}: {text}")

    def block(
        self,
        model: type[BaseModel],
        prefix: str = "",
        *,
        names: Iterable[str] | None = None,
        defaults: Mapping[str, Any] | None = None,
    ) -> dict[str, Any]:
        """Returns the given values for the fields of a model, checked by it.

        Where Nav2's defaults differ from the model's they are added: those of the release, and
        `defaults`. prefix: beginning of the parameters' names, with its dot. names: the fields that
        Nav2 has; by default all. Raises InputError where a value is wrong.
        """
        values: dict[str, Any] = {}
        for field in names if names is not None else model.model_fields:
            their_name = prefix + field
            nested = _nested_model(model, field)
            if nested is not None:
                below = self.block(nested, f"{their_name}.")
                if below:
                    values[field] = below
                continue
            readers = read_by(model, field)
            of_nav2 = {**(defaults or {})}
            if self._release in readers.defaults:
                of_nav2[field] = readers.defaults[self._release]
            if self.gives(model, field, their_name):
                values[field] = self._taken(model.model_fields[field], their_name)
            elif field in of_nav2:
                values[field] = of_nav2[field]
            if self._release in readers.releases:
                own = model.model_fields[field].get_default(call_default_factory=True)
                given = self._node.get(their_name)
                self.offers[their_name] = Offer(model, field, of_nav2.get(field, own), given)
        return self.checked(model, values, prefix, is_partial=names is not None)

    def _taken(self, field: FieldInfo, name: str) -> Any:
        """Returns a given parameter as Nav2 takes it; notes a change, and an unusual value."""
        given = self.value(name)
        taken = as_taken(field, given)
        doubt = doubt_about(field, taken)
        if doubt:
            self.note(Status.DOUBTFUL, name, doubt)
        elif taken != given:
            self.note(Status.OTHER_FORM, name, f"{taken:g}, as in Nav2, in place of {given:g}")
        return taken

    def checked(
        self,
        model: type[BaseModel],
        values: dict[str, Any],
        prefix: str = "",
        *,
        is_partial: bool = False,
    ) -> dict[str, Any]:
        """Returns the values as validated by a model; whole floats become integers for it.

        is_partial: whether further fields will be added, so that missing ones are no error.
        """
        while True:
            try:
                model.model_validate_json(json.dumps(values, default=str), strict=True)
            except ValidationError as error:
                faults = error.errors(include_url=False, include_context=False)
            else:
                return values
            faults = [f for f in faults if not (is_partial and f["type"] == "missing")]
            if not faults:
                return values
            fault = faults[0]
            location = [str(part) for part in fault["loc"] if part != fault["input"]]
            # A fault that several fields cause together is reported for the first of them.
            field = location[0] if location else next(iter(values), "")
            name = prefix + ".".join([field, *location[1:]])
            whole = fault["input"]
            wants_integer = fault["type"].startswith("int") and len(location) == 1
            if wants_integer and isinstance(whole, float) and whole.is_integer():
                values = {**values, field: int(whole)}
                self.note(Status.OTHER_FORM, name, f"{whole:g}, where Nav2 takes integers only")
                continue
            message = fault["msg"].removeprefix("Value error, ")
            shown = f", got {printable(repr(whole), MAX_SHOWN)}" if location else ""
            raise self.fault(name, message[:1].lower() + message[1:] + shown)

    def finish(self, without_meaning: Collection[str] = ()) -> None:
        """Notes all unused parameters, as without meaning if listed, else as not read by Nav2.

        without_meaning: names of parameters or blocks, or '*.name' for a name in any block.
        """
        idle = {*WITHOUT_MEANING["every_node"], *without_meaning}
        blocks = {name.partition(".")[0] for name in {*self._known, *idle} if "." in name}
        for name in self._node.parameters:
            # `Nav2Setup` notes a node that stands within these parameters once.
            if name in self._seen or f".{PARAMETERS_KEY}." in name:
                continue
            parts = name.split(".")
            if len(parts) > 1 and parts[0] not in blocks | idle:
                self.note_block(
                    Status.UNREAD, parts[0], "no list of plugins or sources has this name"
                )
                continue
            starts = {".".join(parts[:count]) for count in range(1, len(parts) + 1)}
            if starts & idle or f"*.{parts[-1]}" in idle:
                self.note(Status.NO_MEANING, name)
            else:
                self.note(Status.UNREAD, name, self._misspelt(name, idle))

    def _misspelt(self, name: str, idle: Collection[str]) -> str:
        known = {*self._known, *(entry for entry in idle if "*" not in entry)}
        block, _, last = name.rpartition(".")
        if last in RENAMED and f"{block}.{RENAMED[last]}" in known:
            return f"{RENAMING} {RENAMED[last]}"
        elsewhere = [entry for entry in sorted(known) if entry.endswith(f".{name}")]
        if elsewhere:
            return f"unknown; did you mean {elsewhere[0]!r}?"
        return f"unknown{similar_name_hint(name, known)}"


def similar_name_hint(name: str, known: Iterable[str]) -> str:
    """Returns '; did you mean X?' for a known name that differs by a slip only, else ''.

    Both names have equally many parts; `min_vel_x` is no slip of `max_vel_x`, and
    `max_deceleration` none of `cancel_deceleration`.
    """
    alike = [n for n in known if n.count(".") == name.count(".") and n != name]
    for close in difflib.get_close_matches(name, sorted(alike), n=3, cutoff=LIKE_A_SLIP):
        last, close_last = name.rpartition(".")[2], close.rpartition(".")[2]
        words, others = last.split("_"), close_last.split("_")
        pairs = zip(words, others, strict=True) if len(words) == len(others) else ()
        if _likeness(last, close_last) >= LIKE_A_SLIP and all(
            _likeness(*pair) >= LIKE_A_WORD for pair in pairs
        ):
            return f"; did you mean {close!r}?"
    return ""


def _likeness(one: str, other: str) -> float:
    return difflib.SequenceMatcher(None, one, other).ratio()


def similar_plugin_hint(plugin_type: str, known: Iterable[str]) -> str:
    """Returns '; did you mean X?' for a type that differs by a slip in its class, else ''."""
    for close in difflib.get_close_matches(plugin_type, sorted(known), n=1, cutoff=LIKE_A_SLIP):
        named, own = (re.split("[/:]+", kind)[-1] for kind in (plugin_type, close))
        if _likeness(named, own) > LIKE_A_SLIP:
            return f"; did you mean {close!r}?"
    return ""


def _nested_model(model: type[BaseModel], field: str) -> type[BaseModel] | None:
    annotation: Any = model.model_fields[field].annotation
    is_model = isinstance(annotation, type) and issubclass(annotation, BaseModel)
    return annotation if is_model else None
