"""What is searched: the file of unknowns, and settings, which are values for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import Field

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.identification.layouts import layout_of
from drake_navbench.identification.targets import Cell, Targets
from drake_navbench.inputs.presets import Preset, load_preset
from drake_navbench.inputs.robot import Robot, load_robot, merged, overridden
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.parameter_names import flattened, nested
from drake_navbench.tuning.search_space import (
    Dimension,
    SearchSpace,
    parse_dimension,
    search_space,
)
from drake_navbench.typed_files.typed_yaml import FrozenModel, read_yaml, validate

SHIPPED = Path(__file__).parent / "unknowns.yaml"
WALL_NOISE = "wall_noise_ratio"
NOISE = ("xy_std_m", "yaw_std_rad")
BASE, LAYOUTS, OWN = "base", "layouts", "own"

Values = Mapping[str, Any]


class ControllerUnknowns(FrozenModel):
    """Of a published controller."""

    preset: str = Field(description="What the parameters are laid over.")
    blind: str = Field(description="What stands for it where nothing of its column may be used.")
    parameters: dict[str, str] = Field(default_factory=dict, description="LOW:HIGH by parameter.")


class UnknownsFile(FrozenModel):
    """The contents of a file of unknowns."""

    base: dict[str, str] = Field(default_factory=dict, description="LOW:HIGH by field.")
    layouts: dict[str, dict[str, str]] = Field(
        default_factory=dict, description="LOW:HIGH by dimension, by scenario."
    )
    controllers: dict[str, ControllerUnknowns] = Field(min_length=1)


@dataclass(frozen=True)
class Settings:
    """Values for unknowns; what is not given is as it is shipped.

    base: by field of the robot. layouts: by dimension, by scenario. own: by parameter, by
    controller. presets: what stands for a controller in place of its preset.
    """

    base: Values = field(default_factory=dict)
    layouts: Mapping[str, Values] = field(default_factory=dict)
    own: Mapping[str, Values] = field(default_factory=dict)
    presets: Mapping[str, str] = field(default_factory=dict)

    def with_block(self, block: Block, values: Values) -> Settings:
        """Returns settings with other values in one block."""
        if block.kind == BASE:
            return replace(self, base=dict(values))
        if block.kind == LAYOUTS:
            return replace(self, layouts={**self.layouts, block.name: dict(values)})
        return replace(self, own={**self.own, block.name: dict(values)})

    def of_block(self, block: Block) -> Values:
        """Returns the values in a block, none where it is as it is shipped."""
        if block.kind == BASE:
            return self.base
        return (self.layouts if block.kind == LAYOUTS else self.own).get(block.name, {})

    def as_data(self) -> dict[str, Any]:
        """Returns it as plain values."""
        return {
            "base": dict(self.base),
            "layouts": {name: dict(values) for name, values in self.layouts.items()},
            "own": {name: dict(values) for name, values in self.own.items()},
            "presets": dict(self.presets),
        }


@dataclass(frozen=True)
class Block:
    """Unknowns that are searched together: the base's, a scenario's or a controller's own.

    kind: the field of `Settings` that they are in. name: whose; of the base 'base'. shipped: the
    values that nothing was found better than so far.
    """

    kind: str
    name: str
    dimensions: tuple[Dimension, ...]
    shipped: Values

    @property
    def title(self) -> str:
        """As it is called on the page."""
        return f"layout of {self.name}" if self.kind == LAYOUTS else self.name

    def is_told_by(self, cell: Cell) -> bool:
        """Whether a cell counts in its search."""
        if self.kind == LAYOUTS:
            return cell.scenario == self.name
        return self.kind == BASE or cell.controller == self.name


@dataclass(frozen=True)
class Unknowns:
    """Everything that is searched, checked.

    base: None where nothing of it is searched; likewise, of the others only those are there of
    which something is. presets: by name, all that may be driven. spaces: what is searched of each
    controller's own.
    """

    file: UnknownsFile
    robot_name: str
    robot: Robot
    base: Block | None
    layouts: Mapping[str, Block]
    own: Mapping[str, Block]
    presets: Mapping[str, Preset]
    spaces: Mapping[str, SearchSpace]

    @property
    def blocks(self) -> list[Block]:
        """In the order in which they are searched."""
        return [*self.layouts.values(), *([self.base] if self.base else []), *self.own.values()]

    def preset(self, controller: str, settings: Settings) -> Preset:
        """Returns what stands for a controller; raises InputError where its values clash."""
        other = settings.presets.get(controller)
        if other is not None:
            return self.presets[other]
        preset = self.presets[self.file.controllers[controller].preset]
        values = settings.own.get(controller)
        return self.spaces[controller].candidate(values) if values else preset

    def scenario(self, scenario: Scenario, settings: Settings, layout: Scenario) -> Scenario:
        """Returns a scenario with the base of some settings; layout: with their dimensions."""
        values = dict(settings.base)
        wall_noise = values.pop(WALL_NOISE, None)
        overrides = nested(values.items(), "base")
        own = scenario.robot_overrides
        if scenario.is_impossible and wall_noise is not None:
            robot = overridden(self.robot, overrides, "base")
            noise = robot.model_dump(mode="json")["localization"]
            told = {name: wall_noise * noise[name] for name in NOISE}
            own = merged(own, {"localization": told})
        return layout.model_copy(update={"robot_overrides": merged(overrides, own)})


def load_unknowns(path: Path | None, targets: Targets, robot: str) -> Unknowns:
    """Reads a file of unknowns, the shipped one where none is named; raises InputError.

    Of it counts what the targets have scenarios and controllers for.
    """
    source = str(path or SHIPPED.name)
    content = validate(UnknownsFile, read_yaml(path or SHIPPED), source)
    for name in targets.controllers:
        if name not in content.controllers:
            hint = nearest_name_hint(name, content.controllers)
            raise InputError(f"{source}: controllers: {name!r} of the tables is missing{hint}")
    told = {name: content.controllers[name] for name in targets.controllers}
    presets = {
        preset: load_preset(preset)
        for entry in told.values()
        for preset in (entry.preset, entry.blind)
    }
    spaces = {
        name: search_space(
            presets[entry.preset], [f"{key}={text}" for key, text in entry.parameters.items()]
        )
        for name, entry in told.items()
        if entry.parameters
    }
    loaded = load_robot(robot)
    layouts = {
        name: _layout_block(name, content.layouts[name], source)
        for name in targets.scenarios
        if content.layouts.get(name)
    }
    base = _base_block(content.base, loaded, source) if content.base else None
    own = {name: _own_block(name, space) for name, space in spaces.items()}
    return Unknowns(content, robot, loaded, base, layouts, own, presets, spaces)


def _own_block(name: str, space: SearchSpace) -> Block:
    now = dict(flattened(space.baseline.parameters.model_dump(mode="json")))
    shipped = {entry.name: now.get(entry.name) for entry in space.dimensions}
    return Block(OWN, name, space.dimensions, shipped)


def _layout_block(name: str, told: Mapping[str, str], source: str) -> Block:
    load_scenario(name)
    layout = layout_of(name)
    for key in told:
        if key not in layout.shipped:
            hint = nearest_name_hint(key, layout.shipped)
            raise InputError(f"{source}: layouts.{name}: {key!r} is not a dimension{hint}")
    dimensions = tuple(
        parse_dimension(f"{key}={text}", layout.shipped) for key, text in told.items()
    )
    return Block(LAYOUTS, name, dimensions, {key: layout.shipped[key] for key in told})


def _base_block(told: Mapping[str, str], robot: Robot, source: str) -> Block:
    # The restricted scenarios are shipped without noise.
    now = dict(flattened(robot.model_dump(mode="json"))) | {WALL_NOISE: 0.0}
    dimensions = tuple(parse_dimension(f"{key}={text}", now) for key, text in told.items())
    for entry in dimensions:
        if entry.name == WALL_NOISE:
            continue
        for value in entry.choices or (entry.low, entry.high):
            overridden(robot, nested([(entry.name, value)], source), f"{source}: base")
    return Block(BASE, BASE, dimensions, {key: now.get(key) for key in told})
