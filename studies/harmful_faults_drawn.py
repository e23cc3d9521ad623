"""Planted faults that do harm: what each seed draws, and what was found of it.

The rules are those of `harmful_faults.py`, which drives them.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from planted_faults import HERE, Fault, candidates, spoilt_value

from drake_navbench.studies.doctor.first_look import FIRST_SEEDS

DRIVEN = HERE / "harmful_faults.json"
SEEDS = (2030, 2031, 2032, 2033, 2034, 2035, 2036, 2037, 2038, 2039)
# In the order of the turns; a controller's place in it is part of its draw.
CONTROLLERS = ("rpp", "dwb", "graceful", "mppi", "teb")
CONTROLLERS_OF = (
    {
        2030: CONTROLLERS[:3],
        2031: CONTROLLERS[:4],
    }
    | dict.fromkeys(SEEDS[2:5], CONTROLLERS)
    | dict.fromkeys(SEEDS[5:], CONTROLLERS[:3])
)
HARMFUL_EACH = {2030: 6, 2031: 4, 2032: 3, 2033: 3, 2034: 6} | dict.fromkeys(SEEDS[5:], 6)
# Trials of each probe by which a fault is found harmful.
LOOKS = {2030: FIRST_SEEDS, 2031: FIRST_SEEDS} | dict.fromkeys(SEEDS[2:], 1)
# The probes by which it is, of the seeds that do not have all.
SIX_PROBES = (
    "door_rough", "right_angle", "box_on_path", "person_crossing", "closed_way", "exact_heading",
)  # fmt: skip
SCREENED_IN = dict.fromkeys(SEEDS[2:], SIX_PROBES)
# From this seed on harm is confirmed by so many trials, of which at least this share show it.
CONFIRMED_FROM, CONFIRMED_SHARE = 2034, 0.6
CONFIRMING = dict.fromkeys(SEEDS[4:8], 3) | dict.fromkeys(SEEDS[8:], 6)
# From this seed on a fault is passed over for what an earlier draw found of its direction alone.
BY_DIRECTION_FROM = 2039
MILD, STRONG = 3.0, 10.0
# Parameters of a controller that are screened in one batch.
TOGETHER = {2030: 8, 2031: 8} | dict.fromkeys(SEEDS[2:], 4)


def in_draw_order(controller: str, seed: int) -> list[tuple[str, Any, bool]]:
    """Returns place, value and direction (up or not) of a file's parameters, in drawn order."""
    generator = np.random.default_rng([seed, CONTROLLERS.index(controller)])
    choices = candidates(controller)
    order = generator.permutation(len(choices))
    coins = generator.integers(0, 2, len(choices))
    return [(*choices[int(i)], bool(coin)) for i, coin in zip(order, coins, strict=True)]


def spoilt_by(controller: str, place: str, value: Any, is_up: bool, factor: float) -> Fault:
    """Returns a fault of a strength."""
    return Fault(controller, place, value, spoilt_value(value, factor if is_up else 1.0 / factor))


def waiting_of(seed: int, controller: str) -> list[tuple[str, Any, bool]]:
    """Returns the parameters that the census of a controller has still to take."""
    done = read_entries()
    own = entries_of(done, seed, controller)
    if sum(bool(entry["harmful"]) for entry in own) >= HARMFUL_EACH[seed]:
        return []
    return [
        parameter
        for parameter in in_draw_order(controller, seed)
        if f"{seed} {controller} {parameter[0]}" not in done
        and not _is_known(done, seed, controller, parameter)
    ]


def _is_known(
    done: Mapping[str, Any], seed: int, controller: str, parameter: tuple[str, Any, bool]
) -> bool:
    """Tells whether a parameter does harm in an earlier draw.

    From BY_DIRECTION_FROM on: in the same direction; or whether its strongest fault was found
    harmless by the same six trials.
    """
    place, value, is_up = parameter
    earlier = [done.get(f"{other} {controller} {place}") for other in SEEDS if other < seed]
    if seed < BY_DIRECTION_FROM:
        return any(entry["harmful"] for entry in earlier if entry)
    strongest = spoilt_by(controller, place, value, is_up, STRONG).spoilt
    for entry in earlier:
        if entry and entry["harmful"] and _is_same_way(value, entry["spoilt"], strongest):
            return True
    screened = [done.get(f"{other} {controller} {place}") for other in SCREENED_IN if other < seed]
    return any(e["spoilt"] in (None, strongest) and not e["harmful"] for e in screened if e)


def _is_same_way(sound: Any, one: Any, other: Any) -> bool:
    """Tells whether two faults of a parameter lie on the same side of its sound value."""
    return bool(one == other or (one > sound) == (other > sound))


def in_turn(done: Mapping[str, Any], seed: int) -> list[str]:
    """Returns the keys of the harmful faults, one of each controller in turn.

    Of seed 2031 those of MPPI, of which a visit takes as long as four others, come last.
    """
    queues = [
        [key for key, e in done.items() if key.startswith(f"{seed} {c} ") and e["harmful"]]
        for c in CONTROLLERS_OF[seed]
    ]
    turns = max(map(len, queues), default=0)
    found = [queue[turn] for turn in range(turns) for queue in queues if turn < len(queue)]
    late = [key for key in found if key.startswith("2031 mppi")]
    return [key for key in found if key not in late] + late


def is_missed(entry: Mapping[str, Any]) -> bool:
    """Tells whether a visit misses a goal; False where there was none."""
    if "first" not in entry:
        return False
    return not entry["first"] or not entry["gone"] or bool(entry.get("worse"))


def fault_of(entry: Mapping[str, Any]) -> Fault:
    return Fault(entry["controller"], entry["place"], entry["sound"], entry["spoilt"])


def entries_of(done: Mapping[str, Any], seed: int, controller: str = "") -> list[dict[str, Any]]:
    return [e for key, e in done.items() if key.startswith(f"{seed} {controller}".rstrip() + " ")]


def read_entries() -> dict[str, Any]:
    done: dict[str, Any] = json.loads(DRIVEN.read_text()) if DRIVEN.exists() else {}
    return done


def keep(key: str, entry: Any) -> dict[str, Any]:
    """Adds an entry to the file, which is read anew: another step may write to it as well."""
    done = read_entries() | {key: entry}
    DRIVEN.write_text(json.dumps(done, indent=1) + "\n", encoding="utf-8")
    return done
