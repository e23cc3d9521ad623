"""The part of the page about planted faults that do harm: scores and misses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from harmful_faults_drawn import SEEDS, is_missed, read_entries
from planted_faults import candidates
from planted_faults_driven import score_of, share_text

ABOUT = """\
Most of the faults above do no harm in any probe, and what does no harm nobody can find by driving.
So further faults were drawn (`python studies/harmful_faults.py both DIR SEED`) and made stronger,
by a factor of 3, else of 10, until a probe shows a symptom that the sound file does not show. Each
seed is a draw for a doctor that had learnt from those before; its rules were written at the top of
the study before anything of it was driven. A visit is *blind* if the doctor was not
changed after it was known that the fault does harm. `studies/harmful_faults.json` has every
visit: values, complaint, causes, change."""

# Why a visit missed the first cause, left the symptom, or made something worse.
REASONS = {
    "2030 dwb controller_server: progress_checker.movement_time_allowance": """\
the values tried, 30 and 20 s, are longer than a probe; since then Nav2's own value is a third""",
    "2030 graceful local_costmap/local_costmap: width": """\
the way back is shown, but the sound file touches something where the spoilt one stands""",
    "2031 dwb controller_server: FollowPath.max_vel_x": """\
the robot is slower than the file asks; to ask for less makes it no faster, and is not tried""",
    "2031 graceful controller_server: FollowPath.v_angular_max": """\
limits of speed were not tried; they are since 2032""",
    "2031 dwb controller_server: FollowPath.PathDist.scale": """\
chance: 3 of 24 trials have the symptom; the census asks for more since 2038""",
    "2031 dwb controller_server: FollowPath.vx_samples": """\
the sound file has the near misses, too; the spoilt robot gave up before""",
    "2031 dwb controller_server: FollowPath.BaseObstacle.sum_scores": """\
the sound file has the near misses, too; the spoilt robot hardly moved""",
    "2032 dwb controller_server: FollowPath.GoalDist.scale": """\
chance: with the sound value the symptom is no rarer; a shorter patience takes it away""",
    "2032 graceful controller_server: FollowPath.v_linear_max": """\
a smaller gain takes the weaving away, too, and ended the search; visited again, the way back is
shown, but two more trials end late with it""",
    "2032 mppi controller_server: FollowPath.ax_min": """\
another weight takes the symptom away, too, and ended the search""",
    "2032 graceful controller_server: FollowPath.v_linear_min": """\
another gain takes the symptom away, too; on further seeds a touch comes with it""",
    "2033 rpp local_costmap/local_costmap: robot_radius": """\
the radius is the robot's body in the probes, so no other one is driven; reading names it first""",
    "2035 graceful controller_server: progress_checker.movement_time_allowance": """\
the way back is shown, but the robot then gets as far as the sound file's touch; a shorter way of
progress is offered""",
    "2036 rpp controller_server: FollowPath.max_linear_vel": """\
the base of the probes did no more than the file asks; since 2038 it does what its file gives""",
    "2039 dwb controller_server: FollowPath.max_vel_theta": """\
the sound file has the near misses, too; the spoilt robot hardly turned""",
    "2039 dwb controller_server: FollowPath.sim_time": """\
the sound file has the near misses, too; the spoilt robot stopped in the door""",
    "2039 graceful controller_server: FollowPath.k_phi": """\
the way back is shown, 9 to 0 of 16 trials, but refused for one touch in 46; the sound file has
touches, too""",
}
CLASSES = """\
The classes of misses of the first cause, and of what is done about each:

- *The way back was no value to try* (2030: patience; 2031: `v_angular_max`; 2036: a speed). Mended.
- *The file asks for more speed than it lets drive* (2031 `max_vel_x`), and the complaint is
  `too_slow`. Asking for less makes no robot faster, so the doctor does not try it.
- *Another change takes the symptom away as well* (2032: three; 2035). Mended: causes that driving
  cannot tell apart stand in the order of reading, the values set back first. The change offered may
  still be the other one: what its judgement finds worse counts, and the right value lets the robot
  go on to where the sound file touches something.
- *Chance* (2031 `PathDist.scale`, 2032 `GoalDist.scale`): the fault did no harm that 24 trials
  show. No change can be shown then; since 2039 the first's way back is the third change to try.
- *The fault is the robot's body* (2033 `robot_radius`): of a built-in robot the file's outline is
  the body, so none other is driven. Of a robot of one's own it is (`--robot` with a model).

What got worse, or was refused with the right cause shown, are symptoms of the sound files, DWB's
near misses and Graceful's touches. The doctor refuses a change for one further touch, so in a file
that touches something when sound the goals for gone and nothing worse cannot both be reached."""
COMMAND_AGAIN = "python studies/harmful_faults.py again DIR SEED"
SCORES = (
    ("the first cause shown is the spoilt parameter", "first", "90%"),
    ("some cause shown is", "among", ""),
    ("the first cause shown is or, where none is, the first change to try", "named", ""),
    ("at most half as many fresh trials show the symptom: gone", "gone", "90%"),
    ("of these, nothing else is worse on further seeds", "fine", "100%"),
    ("of these, nothing is worse than in the sound file", "as_sound", ""),
    ("driving cannot tell the first from another parameter", "rivals", ""),
    ("called too rare to find its cause", "rare", ""),
    ("the first suspect by reading alone, with the symptom", "read", ""),
    ("no skill: the value farthest from Nav2's default", "farthest", ""),
    ("no skill: the likeliest abnormal value", "abnormal", ""),
)


def harmful_lines() -> Iterator[str]:
    """Yields the part of the page about faults that do harm."""
    done = read_entries()
    own = {s: {k: e for k, e in done.items() if k.startswith(f"{s} ")} for s in SEEDS}
    visited = {k: e for entries in own.values() for k, e in entries.items() if "first" in e}
    yield from ["", "## Faults that do harm", "", *ABOUT.splitlines(), ""]
    yield from _total_lines(visited)
    yield from ["", "### What was missed", "", *_miss_lines(visited)]
    yield from ["", *CLASSES.splitlines()]
    again = {key.partition(" ")[2]: e for key, e in done.items() if key.startswith("again ")}
    yield from _again_lines(again)


def _total_lines(visited: dict[str, dict[str, Any]]) -> Iterator[str]:
    """Yields the scores of all visits, of the blind ones, and of those that were not."""
    last = [e for key, e in visited.items() if key.startswith(f"{SEEDS[-1]} ")]
    groups = {
        "all visits": [*visited.values()],
        "blind": [e for e in visited.values() if "by" not in e],
        "not blind": [e for e in visited.values() if "by" in e],
        f"blind, doctor of {SEEDS[-1]}": last,
    }
    groups = {name: rows for name, rows in groups.items() if rows}
    yield f"| | goal | {' | '.join(f'{name}: {len(rows)}' for name, rows in groups.items())} |"
    yield f"|---|---|{'---|' * len(groups)}"
    for told, key, goal in SCORES:
        cells = [_share(*score_of(rows, key)) for rows in groups.values()]
        yield f"| {told} | {goal} | {' | '.join(cells)} |"
    trials = np.mean([entry["trials"] for entry in visited.values()])
    chance = np.mean([0.5 / len(candidates(e["controller"])) for e in visited.values()])
    yield ""
    yield f"In brackets Wilson's 95% interval. A visit drove {trials:.0f} trials on average; those"
    yield f"of the census come on top. Any parameter and direction at random: {chance:.1%}. Faults"
    yield "of one controller share a sound file, so they are less apart than the intervals suppose."


def _share(count: int, of: int) -> str:
    return f"{count} of {of} ({share_text(count, of)})" if of else ""


def _miss_lines(visited: dict[str, dict[str, Any]]) -> Iterator[str]:
    """Yields a row for each visit that misses a goal, with its reason."""
    yield "| seed | fault | first cause | symptom gone | worse | why |"
    yield "|---|---|---|---|---|---|"
    for key, entry in visited.items():
        if is_missed(entry):
            why = " ".join(REASONS[key].split())
            told = ["missed" if not entry["first"] else "", "no" if not entry["gone"] else ""]
            worse = ", ".join(entry.get("worse", ()))
            yield f"| {key[:4]} | {_named(entry)} | {' | '.join(told)} | {worse} | {why} |"


def _again_lines(again: dict[str, dict[str, Any]]) -> Iterator[str]:
    """Yields the misses that a later doctor has visited again, and the scores of these visits."""
    counts = [f"{name} {_count(again, key)}" for name, key in (
        ("first cause", "first"), ("gone", "gone"), ("of these nothing worse", "fine"),
        ("the likeliest abnormal value", "abnormal"),
    )]  # fmt: skip
    yield from ["", f"**Visited again**, by a later doctor, not blind: {', '.join(counts)}."]
    yield f"`{COMMAND_AGAIN}`"
    yield from ["", "| seed | fault | doctor of | first cause | change offered | worse |"]
    yield "|---|---|---|---|---|---|"
    for key, entry in again.items():
        worse = ", ".join(entry.get("worse", ()))
        told = f"{entry['by']} | {'right' if entry['first'] else 'missed'}"
        change = entry["change"].rpartition(": ")
        name = change[0].rpartition("controller_server.")[2]
        offered = f"`{name}` {change[2]}" if name else ""
        yield f"| {key[:4]} | {_named(entry)} | {told} | {offered} | {worse} |"


def _count(rows: dict[str, dict[str, Any]], key: str) -> str:
    count, of = score_of([*rows.values()], key)
    return f"{count} of {of}"


def _named(entry: dict[str, Any]) -> str:
    return f"{entry['controller']} `{entry['place'].rpartition(': ')[2]}`"
