"""Planted faults: does the doctor find one parameter that was spoilt in a sound Nav2 file?

    python studies/planted_faults.py draw     planted_faults.yaml: 60 faults, drawn by a seed
    python studies/planted_faults.py read     the first look at each, nothing driven
    python studies/planted_faults.py read 2027 2028 2029    at 180 others, drawn by these seeds
    python studies/planted_faults_page.py     docs/doctor_planted_faults.md

The files: RPP, DWB, MPPI, TEB and Graceful with the built-in presets' parameters, the same servers
and costmaps, for the TurtleBot 4. The draw knows nothing of the doctor's rules: twelve times a
controller, any number or switch of the file is taken with equal chances, a number times 1/4, 2/5,
5/2 or 4, a switch turned round. What the file's reader refuses is drawn again.

The score's rules, written before anything was read or driven:

- *read, first*: of the findings that the sound file has not, the first one's first cure is the
  spoilt parameter, in the direction back. *named*: any cure of any of them is.
- *no skill*: the parameter that is farthest from the release's default, as a ratio, towards it
  (a switch that differs counts as a factor of 2); and a parameter by chance with a coin for its
  direction, as an expected value.

What is driven, and its rules, is in `harmful_faults.py`.
"""

from __future__ import annotations

import argparse
import copy
import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
from sound_files import HERE, PLUGIN, PRESETS, candidates, patient_of, sound_file

from drake_navbench.errors import InputError
from drake_navbench.studies.doctor.causes import Direction
from drake_navbench.studies.doctor.facts import ALIASES, Facts
from drake_navbench.studies.doctor.reading import findings_of

DRAWN = HERE / "planted_faults.yaml"
SEED, FAULTS_EACH = 2026, 12
FACTORS = (0.25, 0.4, 2.5, 4.0)


class Fault(NamedTuple):
    """A planted fault. place: node and parameter, 'controller_server: FollowPath.wz_std'."""

    controller: str
    place: str
    sound: Any
    spoilt: Any

    @property
    def name(self) -> str:
        """A name for files: 'mppi_controller_server_FollowPath_wz_std'."""
        node, _, parameter = self.place.partition(": ")
        return f"{self.controller}_{node.partition('/')[0]}_{parameter.replace('.', '_')}"

    @property
    def back(self) -> Direction:
        """The direction of the cure."""
        if isinstance(self.sound, bool):
            return Direction.SET
        return Direction.DOWN if self.spoilt > self.sound else Direction.UP


def spoilt_file(fault: Fault, sound: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Returns a sound file with a fault."""
    # Both costmaps have the same layers; only one of them is spoilt.
    file = {node: copy.deepcopy(dict(block)) for node, block in sound.items()}
    node, _, name = fault.place.partition(": ")
    *blocks, last = name.split(".")
    inner = file[node]
    for block in blocks:
        inner = inner[block]
    inner[last] = fault.spoilt
    return file


def draw(seed: int = SEED) -> list[Fault]:
    """Returns the faults, by the seed."""
    generator = np.random.default_rng(seed)
    found: list[Fault] = []
    for controller in PRESETS:
        choices = candidates(sound_file(controller))
        order = [int(i) for i in generator.permutation(len(choices))]
        own: list[Fault] = []
        for index in order:
            if len(own) == FAULTS_EACH:
                break
            place, value = choices[index]
            factor = float(generator.choice(FACTORS))
            fault = Fault(controller, place, value, spoilt_value(value, factor))
            if fault.spoilt != value and _is_read(fault):
                own.append(fault)
        found += own
    return found


def spoilt_value(value: Any, factor: float) -> Any:
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return max(round(value * factor), 1)
    return float(f"{value * factor:.4g}")


def _is_read(fault: Fault) -> bool:
    with tempfile.TemporaryDirectory() as folder:
        try:
            patient_of(spoilt_file(fault, sound_file(fault.controller)), Path(folder)).facts()
        except InputError:
            return False
    return True


def read_score(faults: list[Fault]) -> list[dict[str, Any]]:
    """Returns the answer of the first look to each fault, beside those of methods without skill."""
    rows = []
    for fault in faults:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            file = sound_file(fault.controller)
            sound = {f.rule.name for f in findings_of(patient_of(file, folder).facts())}
            facts = patient_of(spoilt_file(fault, file), folder).facts()
            new = [f for f in findings_of(facts) if f.rule.name not in sound]
        firsts = [f.cures[0] for f in new[:1]]
        rows.append({
            "name": fault.name,
            "first": any(is_back(c.place, c.direction, fault, facts) for c in firsts),
            "named": any(
                is_back(c.place, c.direction, fault, facts) for f in new for c in f.cures
            ),
            "findings": len(new),
            "farthest": is_farthest(facts, fault),
            "chance": 0.5 / len(candidates(file)),
        })  # fmt: skip
    return rows


def is_back(place: str, direction: Direction, fault: Fault, facts: Facts) -> bool:
    """Tells whether a cure is of the spoilt parameter and leads back."""
    own = _place_of(fault)
    return own in facts.matching(place) and direction is fault.back


def _place_of(fault: Fault) -> str:
    """Returns the doctor's name for the spoilt parameter."""
    node, _, name = fault.place.partition(": ")
    node = node.partition("/")[0]
    if node == "controller_server" and name.startswith(f"{PLUGIN}."):
        bare = name.removeprefix(f"{PLUGIN}.")
        return f"controller.{ALIASES.get(bare, bare)}"
    if node == "controller_server" and name.startswith(("goal_checker.", "progress_checker.")):
        return name
    return f"{node}.{name.rpartition('.')[2]}"


def is_farthest(facts: Facts, fault: Fault) -> bool:
    """Tells whether the spoilt parameter is the one farthest from its default, if one knows it.

    Of the controller's parameters, whose defaults Nav2 declares.
    """
    ratios: dict[str, float] = {}
    for place, default in facts.defaults.items():
        value = facts[place]
        if isinstance(default, bool) or isinstance(value, bool):
            ratios[place] = math.log(2.0) if value != default else 0.0
        elif isinstance(default, int | float) and isinstance(value, int | float):
            both = value * default > 0.0
            ratios[place] = abs(math.log(value / default)) if both else 0.0
    return bool(ratios) and max(ratios, key=lambda place: ratios[place]) == _place_of(fault)


def drawn() -> list[Fault]:
    """Returns the faults of the file of the draw."""
    return [Fault(**entry) for entry in yaml.safe_load(DRAWN.read_text(encoding="utf-8"))]


def main() -> None:
    """Runs a step of the study."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    steps = parser.add_subparsers(dest="step", required=True)
    steps.add_parser("draw", help=f"draw the faults into {DRAWN.name}")
    read = steps.add_parser(
        "read", help="print the doctor's first look at each fault; drives nothing"
    )
    read.add_argument("seeds", type=int, nargs="*", help=f"of other draws than {DRAWN.name}")
    arguments = parser.parse_args()
    if arguments.step == "draw":
        entries = [fault._asdict() for fault in draw()]
        DRAWN.write_text(yaml.safe_dump(entries, sort_keys=False), encoding="utf-8")
    else:
        faults = [fault for seed in arguments.seeds for fault in draw(seed)] or drawn()
        rows = read_score(faults)
        for row in rows:
            print(row)
        for name in ("first", "named", "farthest", "chance"):
            print(f"{name}: {sum(row[name] for row in rows):g} of {len(rows)}")


if __name__ == "__main__":
    main()
