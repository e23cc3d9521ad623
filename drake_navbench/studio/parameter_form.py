"""The form of a column's parameters: sliders with numbers, switches, choices and texts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from bokeh.models import Checkbox, Column, NumericInput, Row, Select, Slider, TextInput
from markupsafe import Markup

from drake_navbench.errors import InputError
from drake_navbench.studio import style
from drake_navbench.studio.parameter_fields import ParameterField
from drake_navbench.studio.style import html, styled
from drake_navbench.typed_files.typed_yaml import parse_yaml
from drake_navbench.typed_files.yaml_loader import dump_yaml

# At most this many fields are shown at once; the search finds the others.
MAX_SHOWN = 25

Changed = Callable[[ParameterField, Any], None]


class ParameterForm:
    """A column of inputs.

    on_change: is given the field and its new value. on_fault: is given a line.
    """

    def __init__(self, on_change: Changed, on_fault: Callable[[str], None]) -> None:
        self._on_change, self._on_fault = on_change, on_fault
        self._fields: Sequence[ParameterField] = ()
        self._changes: Mapping[str, Any] = {}
        self._source = ""
        self._search = TextInput(placeholder="find a parameter", sizing_mode="stretch_width")
        self._search.on_change("value_input", self._find)
        self._node = Select(
            title="Parameters of", visible=False, sizing_mode="stretch_width", name="node"
        )
        self._node.on_change("value", self._find)
        self._inputs = Column(sizing_mode="stretch_width", spacing=10)
        self._count = html()
        self.root = Column(
            styled(self._node),
            styled(self._search),
            self._count,
            self._inputs,
            sizing_mode="stretch_width",
        )

    def show(
        self, fields: Sequence[ParameterField], changes: Mapping[str, Any], source: str
    ) -> None:
        """Shows fields with their values; changes: by a field's key; source: 'file' or 'preset'."""
        self._fields, self._changes, self._source = fields, changes, source
        nodes = [node for node in dict.fromkeys(field.node for field in fields) if node]
        self._node.update(
            options=[("", "the controller"), *((node, node) for node in nodes)],
            value=self._node.value if self._node.value in nodes else "",
            visible=bool(nodes),
        )
        self._find("", "", "")

    def _find(self, _name: str, _old: str, _new: str) -> None:
        words = (self._search.value_input or "").lower().split()
        of_node = [field for field in self._fields if field.node == self._node.value]
        found = [
            field
            for field in of_node
            if all(word in f"{field.name} {field.description}".lower() for word in words)
        ]
        shown = sorted(found, key=lambda field: field.key not in self._changes)[:MAX_SHOWN]
        more = "; the search finds the others" if len(shown) < len(found) else ""
        self._count.text = f"{len(shown)} of {len(of_node)} parameters{more}"
        self._inputs.children = [self._row(field) for field in shown]

    def _row(self, field: ParameterField) -> Any:
        value = self._changes.get(field.key, field.value)
        told = [f"default {_value_text(field.default)}"]
        if field.given is not None:
            told.append(f"{self._source} {_value_text(field.given)}")
        if field.kind in ("number", "whole"):
            told.append(f"slider {field.low:g} to {field.high:g}")
        unit = f" [{field.unit}]" if field.unit else ""
        text = html(
            Markup('<b>{}</b>{} <span class="soft">{}</span><p class="soft">{}</p>').format(
                field.given_name, unit, ", ".join(told), field.description
            )
        )
        return Column(text, self._input(field, value), sizing_mode="stretch_width", name=field.name)

    def _input(self, field: ParameterField, value: Any) -> Any:
        if field.kind == "flag":
            flag = Checkbox(label="on", active=bool(value))
            flag.on_change("active", partial(self._set, field))
            return styled(flag)
        if field.kind == "choice":
            choice = Select(options=list(field.choices), value=str(value), width=220)
            choice.on_change("value", partial(self._set_choice, field))
            return styled(choice)
        if field.kind in ("number", "whole"):
            return self._number(field, value)
        entry = TextInput(value=_value_text(value), sizing_mode="stretch_width")
        entry.on_change("value", partial(self._set_text, field))
        return styled(entry)

    def _number(self, field: ParameterField, value: float) -> Row:
        slider = Slider(
            start=min(field.low, value),
            end=max(field.high, value),
            step=field.step,
            value=value,
            show_value=False,
            bar_color=style.NOW,
            sizing_mode="stretch_width",
            name=f"slider {field.name}",
        )
        mode = "int" if field.kind == "whole" else "float"
        entry = NumericInput(value=value, mode=mode, width=86, name=f"number {field.name}")
        slider.js_link("value", entry, "value")
        entry.on_change("value", partial(self._set_number, field, slider))
        return Row(*styled(slider, entry), sizing_mode="stretch_width", spacing=8)

    def _set(self, field: ParameterField, _name: str, _old: Any, value: Any) -> None:
        self._on_change(field, value)

    def _set_choice(self, field: ParameterField, _name: str, _old: str, text: str) -> None:
        # Choices may be numbers, which a list of texts cannot tell.
        self._on_change(field, int(text) if isinstance(field.value, int) else text)

    def _set_number(
        self, field: ParameterField, slider: Slider, _name: str, _old: Any, value: float | None
    ) -> None:
        if value is None:
            self._on_fault(f"{field.name}: expected a number")
            return
        # Steps of a slider are sums of binary fractions: 0.1 + 0.2 is 0.30000000000000004.
        value = int(value) if field.kind == "whole" else float(f"{value:.9g}")
        slider.update(start=min(slider.start, value), end=max(slider.end, value), value=value)
        self._on_change(field, value)

    def _set_text(self, field: ParameterField, _name: str, _old: str, text: str) -> None:
        try:
            self._on_change(field, parse_yaml(f"value: {text}", field.name)["value"])
        except InputError as error:
            self._on_fault(str(error))


def _value_text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list):
        return dump_yaml(value, default_flow_style=True, width=100_000).strip()
    return (
        "none" if value is None else str(value).lower() if isinstance(value, bool) else str(value)
    )
