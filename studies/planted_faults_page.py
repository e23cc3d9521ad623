"""The page of the planted faults: what was driven, and what was read.

`python studies/planted_faults_page.py` writes docs/doctor_planted_faults.md; it drives nothing.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np
from harmful_faults import CONTROLLERS, DRAWS, NOT_DRIVEN, is_missed, read_entries
from harmful_visits import score_of, share_text
from planted_faults import FAULTS_EACH, drawn, read_score
from sound_files import HERE, candidates, good_file

PAGE = HERE.parent / "docs" / "doctor_planted_faults.md"
NAMES = {
    "rpp": "Regulated Pure Pursuit", "dwb": "DWB", "graceful": "Graceful",
    "shim": "Rotation shim with Regulated Pure Pursuit", "mppi": "MPPI",
}  # fmt: skip
HEAD = """\
# Planted faults

Does the doctor find a parameter that somebody spoilt? A fault is one spoilt parameter in a sound
Nav2 file; the doctor does not know the sound file. `python studies/planted_faults_page.py` makes
this page.

## Driven
"""
ABOUT = """\
Five files, each of another controller, for a round base of 0.2 m. They are *good*: in two trials of
each of 17 probes none shows a touch or a near miss. In twice as many one of Graceful's 68 does, and
four others are near a threshold, so 2041 has not this file; DWB has one swing, the other three
nothing. Parameters are drawn by a seed from all numbers and switches of a file; 2041 passes over
what 2040 had in the same direction. A number becomes 3 times as large or as small, else 10 times,
until a probe shows a symptom that the good file does not show, in at least four of six trials. The
doctor gets that symptom. `studies/harmful_faults.py` has the rules of each draw, which were written
before anything of it was driven; then the doctor was not changed until the end.
`studies/harmful_faults.json` has every visit: values, complaint, causes, change."""
COMMAND = "python studies/harmful_faults.py drive DIR --until 10:02"
# Why a visit missed the first cause, left the symptom, or made something worse.
REASONS = {
    "2041 dwb controller_server: FollowPath.max_speed_xy": """\
the sound value is shown, but refused: like the good file it stalls before a goal in 2 of 31 fresh
trials; it is offered as a trade""",
    "2041 rpp controller_server: FollowPath.max_linear_vel": """\
0.9 m/s is asked of a velocity smoother of 0.5 m/s, so the doctor raises the smoother's; to ask for
less counts as no cure of a robot that is too slow, so it is not driven""",
    "2041 mppi controller_server: FollowPath.vx_max": """\
1.5 m/s is asked of a base of 0.5 m/s; to ask for less counts as no cure of a robot that is too
slow""",
    "2041 shim controller_server: FollowPath.max_linear_vel": """\
the way back is tried with Nav2's 0.5 m/s, which stops in the rough door, too; this file's is
0.3 m/s. A shorter look ahead of the collision check takes the stop away, and touches""",
    "2040 mppi global_costmap/global_costmap: resolution": """\
the way back is second: it leaves a distance from the plan, as a sound file does, and a radius of
0.57 m, with which no drive begins, leaves none; the change offered is the right one""",
    "2040 dwb global_costmap/global_costmap: resolution": """\
the same radius is first; the way back is shown, but not judged, as it leaves more than half of the
threshold and the radius less""",
    "2040 graceful controller_server: FollowPath.slowdown_radius": """\
the way back stops at Nav2's 1.5 m; the file's lookahead of 0.7 m needs 1.0 m, so the robot, which
now comes to its goal, is too slow""",
    "2040 graceful controller_server: FollowPath.v_linear_max": """\
the sound value is shown, but refused: it brings the stops and starts that the good file has in the
rough door; the spoilt robot did not come so far""",
    "2040 graceful controller_server: FollowPath.k_delta": """\
too slow by 6% (of the good file's 89% of the threshold): no change can take away the third of it
that is asked for""",
    "2040 shim controller_server: failure_tolerance": """\
no suspect of a stop in a door, and 0.03 s lies between Nav2's 0 and nav2_bringup's 0.3 s; a radius
of 0.13 m, less than the robot's, lets it pass""",
    "2040 rpp controller_server: failure_tolerance": """\
the way back is shown, but a radius of 0.13 m, less than the robot's, comes first""",
    "2040 graceful controller_server: FollowPath.k_phi": """\
one touch more in 34 trials, none more than with the good file, which the change gives back""",
    "2040 graceful global_costmap/global_costmap: obstacle_layer.scan.obstacle_max_range": """\
the touch is too rare for the search, 5 of 24 trials; another symptom was treated, and the way back
is the first cause of it""",
    "2040 graceful controller_server: FollowPath.max_lookahead": """\
one touch more in 34 trials, none more than with the good file; the spoilt robot did not come so
far""",
}
MENDED = """\
The misses of 2040 taught three mends before 2041: a symptom counts as taken away if no pair shows
it any more, a change with which no drive begins is no cure, and no radius below the robot's body is
tried. The two `resolution` and the two `failure_tolerance`, visited again, have the right first
cause and change. 2041 has no visit like these four: none has the complaint `corner_cutting`, none
a spoilt `failure_tolerance`."""
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
    ("some cause shown is", "among", ""),
    ("the first cause shown is or, where none is, the first change to try", "named", ""),
    ("at most half as many fresh trials show the symptom: gone", "gone", "90%"),
    ("of these, nothing else is worse on further seeds", "fine", "100%"),
    ("of these, nothing is worse than in the good file", "as_sound", ""),
    ("driving cannot tell the first from another parameter", "rivals", ""),
    ("called too rare to find its cause", "rare", ""),
    ("the first suspect by reading alone, with the symptom", "read", ""),
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
    yield from [*_total_lines(columns | {"both": [*visited.values()]}), ""]
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
    """Yields the scores of the blind visits, a column for each draw and one for both."""
    heads = [f"{name}: {len(visits)} visits" for name, visits in columns.items()]
    yield f"| | goal | {' | '.join(heads)} |"
    yield f"|---|---|{'---|' * len(heads)}"
    for told, key, goal in SCORES:
        cells = [_share(*score_of(visits, key)) for visits in columns.values()]
        yield f"| {told} | {goal} | {' | '.join(cells)} |"
    chances = [
        f"{sum(0.5 / len(candidates(good_file(e['controller']))) for e in visits):.1f}"
        for visits in columns.values()
    ]
    yield f"| no skill: any parameter and direction at random | | {' | '.join(chances)} |"
    *_, both = columns.values()
    trials = np.mean([e["trials"] for e in both if "trials" in e])
    yield ""
    yield f"In brackets Wilson's 95% interval. A visit drove {trials:.0f} trials on average; those"
    yield "of the census come on top. Faults of one controller share their file, so they are less"
    yield "apart than the intervals suppose."


def _fair_lines(visited: dict[str, Entry]) -> Iterator[str]:
    """Yields the limits of the comparison of the draws, and who alone is right."""
    old, new = DRAWS
    same = [e for key, e in visited.items() if draw_of(key) == old]
    same = [e for e in same if e["controller"] not in NOT_DRIVEN]
    first, gone, fine = (_count(same, key) for key in ("first", "gone", "fine"))
    known = [e for e in visited.values() if "abnormal" in e]
    driven = sum(e["first"] and not e["abnormal"] for e in known)
    read = sum(e["abnormal"] and not e["first"] for e in known)
    faults = [(e["place"], e["spoilt"]) for key, e in visited.items() if draw_of(key) == new]
    yield f"- **The draws show no gain**: {new} has not Graceful's file. Without it {old} has"
    yield f"  first {first}, gone {gone}, of these nothing worse {fine}."
    yield f"- In both draws the doctor alone is right {driven} times, the likeliest abnormal value"
    yield f"  alone {read} times."
    yield f"- The shim's file has Regulated Pure Pursuit's parameters: the {len(faults)} faults of"
    yield f"  {new} are {len(set(faults))} different changes of a value."


def _share(count: int, of: int) -> str:
    return f"{count} of {of} ({share_text(count, of)})" if of else ""


def _miss_lines(visited: dict[str, Entry]) -> Iterator[str]:
    """Yields a row for each visit that misses a goal, with its reason."""
    yield "| seed | fault | complaint | first cause | symptom gone | worse | why |"
    yield "|---|---|---|---|---|---|---|"
    for key, entry in sorted(visited.items(), key=lambda item: -(draw_of(item[0]) or 0)):
        if is_missed(entry):
            told = ["missed" if not entry["first"] else "", "no" if not entry["gone"] else ""]
            worse = ", ".join(entry.get("worse", ()))
            why = " ".join(REASONS[key].split())
            name = f"{entry['controller']} `{entry['place'].rpartition(': ')[2]}`"
            fault = f"{name} {entry['sound']} -> {entry['spoilt']}"
            harm = f"`{entry['harmful'][0]}`"
            yield f"| {draw_of(key)} | {fault} | {harm} | {' | '.join(told)} | {worse} | {why} |"


def _controller_lines(entries: dict[str, Entry]) -> Iterator[str]:
    """Yields the counts of faults and the scores of each controller."""
    names = " | ".join(name for _, name in SHORT)
    yield f"| | screened | refused | harmful | visited | {names} |"
    yield f"|---|---|---|---|---|{'---|' * len(SHORT)}"
    for controller in CONTROLLERS:
        own = [e for e in entries.values() if e["controller"] == controller]
        visits = [e for e in own if "first" in e]
        counts = [len(own), sum("refused" in e for e in own), sum(bool(e["harmful"]) for e in own)]
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
