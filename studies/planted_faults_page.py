"""The page of the planted faults: what was driven, and what was read.

`python studies/planted_faults_page.py` writes docs/doctor_planted_faults.md; it drives nothing.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np
from harmful_faults import CONTROLLERS, DRAWS, SEED, is_missed, read_entries
from harmful_visits import score_of, share_text
from planted_faults import FAULTS_EACH, drawn, read_score
from sound_files import HERE, candidates, good_file

PAGE = HERE.parent / "docs" / "doctor_planted_faults.md"
NAMES = {
    "rpp": "Regulated Pure Pursuit", "dwb": "DWB", "graceful": "Graceful",
    "mppi": "MPPI", "vector_pursuit": "Vector Pursuit",
    "shim": "Rotation shim, Regulated Pure Pursuit", "shim_dwb": "Rotation shim, DWB",
}  # fmt: skip
# The chances of a parameter at random in the draws before, whose files are history.
CHANCES = {2040: 0.215, 2041: 0.208}
HEAD = """\
# Planted faults

Does the doctor find a parameter that somebody spoilt? A fault is one spoilt parameter in a sound
Nav2 file; the doctor does not know the sound file. `python studies/planted_faults_page.py` makes
this page.

## Driven
"""
ABOUT = """\
Each file is of another controller: in 2040 and 2041 for a round base of 0.2 m, in 2042 for one of
0.6 x 0.45 m. They are *good*: in all trials of 17 probes, two of each or more, none shows a touch
or a near miss. Of 2042's seven files, four trials of each probe, Graceful's shows nothing, the
others one or two swings in a rough door, DWB's also a late turn. A seed draws parameters from all
numbers and switches of a file. A number becomes 3 times as large or as small, else 10 times, until
a probe shows a symptom that the good file does not show, in at least four of six trials. The doctor
gets that symptom. `studies/harmful_faults.py` has the rules of each draw, written before anything
of it was driven; then the doctor was not changed until the end."""
COMMAND = "python studies/harmful_faults.py drive DIR --until 12:30"
# Why a visit missed the first cause, left the symptom, or made something worse.
LIKE_GOOD = """\
so does the good file on these seeds, in 1 or 2 of 34 trials: Graceful touches in a closed way,
Vector Pursuit stops in the rough door; the spoilt robot did not get there"""
SLOW_PROBES = """\
the probes are made for the spoilt speed; the sound one stops in their door, too, or touches"""
OWN_TOUCH = "one touch more in 34 trials, none more than with the good file"
TOO_FAST = """\
to ask for less, of a smoother and a robot that do not give it, counted as no cure"""
NO_BEGIN = "a radius with which no drive begins came first"
IN_BODY = "a radius below the robot's body came first"
REASONS = {
    "2042 rpp controller_server: FollowPath.lookahead_dist": """\
half of the way back took the place of Nav2's 0.6 m by luck of four pairs, and helped no more""",
    "2042 graceful controller_server: FollowPath.v_linear_max": """\
the base is lent the file's 0.05 m/s; on one that can do more the symptom is rare""",
    "2042 shim controller_server: FollowPath.max_linear_vel": SLOW_PROBES,
    "2042 shim_dwb controller_server: FollowPath.max_vel_x": SLOW_PROBES,
    "2042 vector_pursuit controller_server: FollowPath.use_collision_detection": LIKE_GOOD,
    "2042 vector_pursuit controller_server: FollowPath.min_lookahead_dist": LIKE_GOOD,
    "2042 vector_pursuit local_costmap/local_costmap: obstacle_layer.scan.obstacle_max_range": (
        LIKE_GOOD
    ),
    "2042 vector_pursuit controller_server: FollowPath.max_lateral_accel": LIKE_GOOD,
    "2042 vector_pursuit controller_server: FollowPath.rotate_to_heading_min_angle": LIKE_GOOD,
    "2042 graceful controller_server: FollowPath.k_delta": LIKE_GOOD,
    "2042 graceful controller_server: FollowPath.max_lookahead": LIKE_GOOD,
    "2042 graceful controller_server: FollowPath.v_linear_min": LIKE_GOOD,
    "2042 graceful controller_server: FollowPath.slowdown_radius": LIKE_GOOD,
    "2042 graceful controller_server: FollowPath.k_phi": LIKE_GOOD,
    "2041 dwb controller_server: FollowPath.max_speed_xy": """\
with the sound value, as in the good file, 2 of 31 trials stall before a goal; so it was refused""",
    "2041 rpp controller_server: FollowPath.max_linear_vel": TOO_FAST,
    "2041 mppi controller_server: FollowPath.vx_max": TOO_FAST,
    "2041 shim controller_server: FollowPath.max_linear_vel": SLOW_PROBES,
    "2040 mppi global_costmap/global_costmap: resolution": NO_BEGIN,
    "2040 dwb global_costmap/global_costmap: resolution": NO_BEGIN,
    "2040 graceful controller_server: FollowPath.slowdown_radius": """\
Nav2's 1.5 m is too much for this file""",
    "2040 graceful controller_server: FollowPath.v_linear_max": """\
the base is lent the file's 0.05 m/s: on the robot's 0.5 m/s the symptom is rare""",
    "2040 graceful controller_server: FollowPath.k_delta": """\
too slow by 6%: no change takes away the third of it that was asked for""",
    "2040 shim controller_server: failure_tolerance": IN_BODY,
    "2040 rpp controller_server: failure_tolerance": IN_BODY,
    "2040 graceful controller_server: FollowPath.k_phi": OWN_TOUCH,
    "2040 graceful global_costmap/global_costmap: obstacle_layer.scan.obstacle_max_range": """\
touches in 5 of 24 trials: too rare for the search""",
    "2040 graceful controller_server: FollowPath.max_lookahead": OWN_TOUCH,
}
MENDED = """\
The misses taught mends. After 2040: what no pair shows any more is taken away, a change with which
no drive begins is no cure, no radius below the body is tried. After 2041: half of a way back and
half as much again are tried, a lighter symptom is a price, asking for less speed cures a robot that
cannot give more, a symptom hardly above its threshold may go. After 2042, not judged: luck in a few
pairs no longer puts half of a way back in the place of the whole. One visit of 2042 was scored as a
miss and corrected: the scorer did not know `desired_linear_vel` by the doctor's name for it."""
EARLIER = """\
### Earlier draws

Ten draws (2030 to 2039), each for a doctor that had learnt from those before, in files for the
TurtleBot 4 of which DWB's had near misses and Graceful's touches without any fault; seven visits
were not blind. The history of the study has their rules and misses."""
READ = f"""\
## Read

Five files for the TurtleBot 4 (Regulated Pure Pursuit, DWB, MPPI, TEB, Graceful) with {FAULTS_EACH}
faults each: a number times 1/4, 2/5, 5/2 or 4, a switch turned round; most of them do no harm in
any probe. The findings about values far from Nav2's, and about costmaps that disagree, were written
with these 60 faults known."""
SCORES = (
    ("the first cause shown is the spoilt parameter", "first", "90%"),
    ("at most half as many fresh trials show the symptom: gone", "gone", "90%"),
    ("of these, nothing else is worse on further seeds", "fine", "100%"),
    ("of these, nothing is worse than in the good file", "as_sound", ""),
    ("driving cannot tell the first from another parameter", "rivals", ""),
    ("no skill: the likeliest abnormal value", "abnormal", ""),
    ("no skill: the value farthest from Nav2's default", "farthest", ""),
)
SHORT = (("first", "first cause"), ("gone", "gone"), ("fine", "nothing worse"),
    ("abnormal", "likeliest abnormal value"), ("farthest", "farthest value"))  # fmt: skip

Entry = dict[str, Any]


def page_lines() -> Iterator[str]:
    """Yields the page."""
    done = read_entries()
    faults = {key: e for key, e in done.items() if draw_of(key) and "place" in e}
    visited = {key: e for key, e in faults.items() if "first" in e}
    columns = {
        f"seed {seed}": [e for key, e in visited.items() if draw_of(key) == seed]
        for seed in reversed(DRAWS)
    }
    yield from [*HEAD.splitlines(), ""]
    yield from [*_total_lines(columns | {"all": [*visited.values()]}), ""]
    yield from [*_fair_lines(visited), ""]
    yield from ["### What was missed", "", *_miss_lines(visited), "", *MENDED.splitlines(), ""]
    yield from ["### By controller", "", *_controller_lines(faults), ""]
    yield from [*ABOUT.splitlines(), "", f"`{COMMAND}`", ""]
    earlier = [e for key, e in done.items() if is_earlier(key, e)]
    yield from [*EARLIER.splitlines(), "", *_short_lines("earlier draws", {"all": earlier}), ""]
    yield from [*READ.splitlines(), "", *_read_lines(), ""]


def draw_of(key: str) -> int | None:
    """Returns the seed of the draw of good files to which an entry belongs, None of others."""
    return next((seed for seed in DRAWS if key.startswith(f"{seed} ")), None)


def is_earlier(key: str, entry: Any) -> bool:
    """Tells whether an entry is the first visit of a fault of an earlier draw."""
    return key.partition(" ")[0] in map(str, range(2030, DRAWS[0])) and "first" in entry


def _total_lines(columns: dict[str, list[Entry]]) -> Iterator[str]:
    """Yields the scores of the blind visits, a column for each draw and one for all."""
    heads = [f"{name}: {len(visits)} visits" for name, visits in columns.items()]
    yield f"| | goal | {' | '.join(heads)} |"
    yield f"|---|---|{'---|' * len(heads)}"
    for told, key, goal in SCORES:
        cells = [_share(*score_of(visits, key)) for visits in columns.values()]
        yield f"| {told} | {goal} | {' | '.join(cells)} |"
    *_, everything = columns.values()
    chances = [*map(_chance, DRAWS[::-1], columns.values())]
    cells = [f"{chance:.1f}" for chance in (*chances, sum(chances))]
    yield f"| no skill: any parameter and direction at random | | {' | '.join(cells)} |"
    trials = np.mean([e["trials"] for e in everything if "trials" in e])
    yield ""
    yield f"In brackets Wilson's 95% interval. A visit drove {trials:.0f} trials on average; those"
    yield "of the census come on top. Faults of one controller share their file, so they are less"
    yield "apart than the intervals suppose."


def _chance(seed: int, visits: list[Entry]) -> float:
    """Returns the number of visits that a parameter and direction at random would get right."""
    if seed in CHANCES:
        return CHANCES[seed]
    return sum(0.5 / len(candidates(good_file(e["controller"]))) for e in visits)


def _fair_lines(visited: dict[str, Entry]) -> Iterator[str]:
    """Yields the limits of the comparison of the draws, and who alone is right."""
    known = [e for e in visited.values() if "abnormal" in e]
    driven = sum(e["first"] and not e["abnormal"] for e in known)
    read = sum(e["abnormal"] and not e["first"] for e in known)
    last = [e for key, e in visited.items() if draw_of(key) == SEED]
    before = {_change(e) for key, e in visited.items() if draw_of(key) != SEED}
    new = [e for e in last if _change(e) not in before]
    first, gone = _count(new, "first"), _count(new, "gone")
    yield f"- Of {len(known)} visits the doctor alone is right in {driven}, the likeliest abnormal"
    yield f"  value alone in {read}."
    yield f"- Of {SEED}'s faults {len(new)} are of a parameter and direction that no visit before"
    yield f"  had: first {first}, gone {gone}."
    yield f"- Files share parameters: {SEED}'s {len(last)} faults are"
    yield f"  {len({(e['place'], e['spoilt']) for e in last})} different changes of a value."


def _change(entry: Entry) -> tuple[str, bool]:
    """Returns the place of a fault, and whether its value is more than the sound one."""
    return entry["place"], entry["spoilt"] > entry["sound"]


def _share(count: int, of: int) -> str:
    return f"{count} of {of} ({share_text(count, of)})" if of else ""


def _miss_lines(visited: dict[str, Entry]) -> Iterator[str]:
    """Yields a row for the visits of a draw that miss the same goals for the same reason."""
    done = read_entries()
    rows: dict[tuple[str, ...], list[str]] = {}
    for key, entry in visited.items():
        if is_missed(entry):
            again = done.get(f"again {key}")
            today = "" if again is None else _missed(again) or "right"
            why = " ".join(REASONS[key].split())
            missed = "worse" if REASONS[key] == LIKE_GOOD else _missed(entry)
            row = (str(draw_of(key)), missed, why, today)
            name = entry["place"].rpartition(": ")[2].removeprefix("FollowPath.")
            values = f"{entry['sound']} -> {entry['spoilt']}, {entry['harmful'][0]}"
            told = f"{entry['controller']} `{name}` ({values})"
            rows.setdefault(row, []).append(told)
    yield "| seed | faults and complaints | missed | why | again, by today's doctor |"
    yield "|---|---|---|---|---|"
    # The newest draw first, what missed the first cause before what missed less.
    for row in sorted(rows, key=lambda row: (-int(row[0]), not row[1].startswith("first"))):
        seed, missed, why, today = row
        yield f"| {seed} | {'; '.join(rows[row])} | {missed} | {why} | {today} |"


def _missed(entry: Entry) -> str:
    """Returns the goals that a visit misses: 'first, gone', 'worse: collision'."""
    told = [name for name in ("first", "gone") if not entry[name]]
    worse = ", ".join(entry.get("worse", ()))
    return ", ".join([*told, *[f"worse: {worse}"] * bool(worse)])


def _controller_lines(entries: dict[str, Entry]) -> Iterator[str]:
    """Yields the counts of faults and the scores of each controller."""
    names = " | ".join(name for _, name in SHORT)
    yield f"| | screened | harmful | visited | {names} |"
    yield f"|---|---|---|---|{'---|' * len(SHORT)}"
    for controller in CONTROLLERS:
        own = [e for e in entries.values() if e["controller"] == controller]
        visits = [e for e in own if "first" in e]
        counts = [len(own), sum(bool(e["harmful"]) for e in own)]
        cells = [*map(str, counts), str(len(visits)), *(_count(visits, key) for key, _ in SHORT)]
        yield f"| {NAMES[controller]} | {' | '.join(cells)} |"


def _short_lines(title: str, groups: dict[str, list[Entry]]) -> Iterator[str]:
    yield f"| {title} | visits | {' | '.join(name for _, name in SHORT)} |"
    yield f"|---|---|{'---|' * len(SHORT)}"
    for name, visits in groups.items():
        cells = [_count(visits, key) for key, _ in SHORT]
        yield f"| {name} | {len(visits)} | {' | '.join(cells)} |"


def _count(visits: list[Entry], key: str) -> str:
    count, of = score_of(visits, key)
    return f"{count} of {of}" if of else ""


def _read_lines() -> Iterator[str]:
    """Yields the scores of the 60 faults by reading alone."""
    rows = read_score(drawn())
    count = len(rows)
    silent = sum(row["findings"] == 0 for row in rows)
    yield f"| of {count} faults | number | share |"
    yield "|---|---|---|"
    for told, number in (
        ("the rules' first cure names the spoilt parameter and the right direction", "first"),
        ("some cure of the rules does", "named"),
        ("the rules find no more than in the sound file", silent),
        ("no skill: the value farthest from its default in Nav2", "farthest"),
        ("no skill: any parameter and direction at random", "chance"),
    ):
        total = sum(row[number] for row in rows) if isinstance(number, str) else number
        text = f"{total:.1f}" if number == "chance" else str(total)
        yield f"| {told} | {text} | {total / count:.0%} |"


def main() -> None:
    """Writes the page."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    PAGE.write_text("\n".join(page_lines()), encoding="utf-8")


if __name__ == "__main__":
    main()
