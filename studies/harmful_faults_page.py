"""The part of the page about planted faults that do harm: numbers by seed, and remarks on them."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from harmful_faults_drawn import CONTROLLERS_OF, SEEDS, entries_of, fault_of, read_entries
from planted_faults import _farthest, _is_back, candidates, patient_of, spoilt_file
from planted_faults_driven import score_lines

from drake_navbench.studies.doctor.cures import trials_of
from drake_navbench.studies.doctor.differences import with_differences
from drake_navbench.studies.doctor.reading import suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom

ABOUT = """\
Made by `python studies/harmful_faults.py both DIR SEED`. Most of the faults above do no harm in any
probe, and what does no harm nobody can find by driving. So further faults were drawn from the files
of RPP, DWB and Graceful (seed 2031: and MPPI; 2032 and 2033: and TEB) and made stronger until a
probe shows a symptom that the sound file does not show: by a factor of 3, else of 10, in a
direction drawn by a coin. The rules, at the top of the study, were written before anything was
driven."""


REMARKS = {
    2030: """\
The two misses have reasons. Graceful's costmap of 1 m: both changes that are shown take the symptom
away (5 of 6 trials before, 0 after), but the sound Graceful file itself touches something in the
closed way, so no way back to it is free of touches. DWB's patience of 45 s: the two steps that
were tried, 30 and 20 s, are both longer than a probe. Since then Nav2's own value is a third step.
With it this fault is found and gone (2 -> 0 of 2 trials, nothing worse), which is not counted here.
The changed doctor has the seed 2031.""",
    2031: """\
So few visits show nothing about the goals. The computer was shared, a visit of RPP or DWB took up
to ten minutes there, and the end of the time ended the study; TEB was not drawn. The sound MPPI
file itself shows goal_not_reached and stall_before_goal, so that a fault which brings these counts
as harmless.

As it was at the draw the doctor would never have tried the way back of four of the harmful ones,
whatever it drove: DWB's `max_vel_x` and `BaseObstacle.sum_scores` (a critic's switch), Graceful's
`v_angular_max` and MPPI's `vx_max`. It held limits of motion for the robot's own matter and knew no
usual value of a critic's switch. Both misses are of these four. `max_vel_x` of 0.9 m/s stands
beside a `max_speed_xy` of 0.3, so that the robot drives a third of the speed that the file asks
for; with Graceful's `v_angular_max` of 0.1 rad/s a limit of the velocity smoother was shown
instead, and no change was offered.

These four were known when the doctor was changed: it now tries a speed that the file lets nothing
drive, critics' switches and, last of all, limits of motion. It was also changed for reasons found
by reading its code: a trial in which the program fails is no cure, a drive that a change cuts short
shows no fall, and the search has seeds of its own. The changed doctor was not scored; it has the
seed 2032.

Of the nine faults that the doctor of 2034 was to go on with, time sufficed for one. Its way back is
the other costmap's 0.45 m, so the contradiction of the costmaps was set right, in place of Nav2's
0.55 m. The next visit, of DWB's `PathDist.scale`, was stopped after 350 trials: the unchanged file
shows `no_recovery` in 11 of 52 trials beside the person. So seldom a symptom cannot be shown to
fall in 12 pairs, and the visit tries all its changes.""",
    2032: """\
Seven visits, of the twelve aimed at, leave the goals open: the symptom went in all seven, but
in one of them a touch came with the change on further seeds, and the first cause is the spoilt
parameter no more often than without skill. The end of the time ended the study. The doctor was
not changed after an answer.

All four misses have a change that takes the symptom away, but of another parameter. DWB's
`GoalDist.scale` of 2.4 makes the robot stand before a closed way for 20 s without giving up; a
shorter patience of the progress checker cures that. With Graceful's `v_linear_max` of 0.9 m/s
the robot weaves; a smaller gain `k_phi` cures that (6 -> 1 of 8 fresh trials). In these two the
ways back were third and sixth in the order of causes and were not tried: the search ends with
the batch in which a change takes the symptom away, and since six changes make a batch instead
of twelve, it ends earlier. A batch of twelve would have had both; a likelier cause that takes
all away would still have been named before them.

A visit counts the trials that it drove itself; those of the census come on top. That of DWB was
interrupted, so its 172 trials were counted again from the journal, with those of the census.""",
    2033: """\
Three visits, of the twelve aimed at, leave the goals open. The computer was shared, and the end of
the time ended the study before the visit that was next, of MPPI at 200 control cycles a second,
which takes ten times as long as others.

The miss cannot be mended by this doctor: the radius of the local costmap is the robot's body in the
probes, so no other one is driven. The reading names it first; what is shown is a larger inflation
of the global costmap.

The two hits need no driving: the spoilt value is the likeliest of the abnormal ones. In files as
close to Nav2's as these, driving confirms what a comparison finds.

Two faults of 2032, known by then and not counted, were visited again; both stay misses. Graceful's
`v_linear_max` of 0.9 m/s: the way back is now shown, before a smaller `k_delta` that takes the
weaving away as well. But with it two more trials of all probes do not reach their goal in time, so
the change that is offered is `k_delta` (6 -> 0 of 8 fresh trials), and the score calls that the
first cause. DWB's `GoalDist.scale`: the way back does not help (mean severity 0.5 before, 1.0
after, four pairs). So that symptom comes with the sound value, too: the census, with one seed of a
probe, took chance for harm.""",
    2034: """\
No visit was driven to its end, so this seed says nothing about the goals. Others used the computer,
and a trial of MPPI took ten seconds and more. Two of the parameters taken do harm, both of MPPI.
The visit of PathFollowCritic's `cost_power` of 10 was stopped in its judgement to go on with 2031,
of which more could be visited. It shows what the census still lacks: two of three trials had stops
and starts, but of the first eight fresh ones one has, so two of three seeds are chance, too.

The reader's part of the expectation holds: the way back is among the first changes (counted at the
top of the study). What (e) and (f) do in visits is not known but for the one of 2031.

The doctor of 2035 was to visit both. It began with 2035, whose trials take a fifth, and time
sufficed for neither.""",
    2035: """\
The loss first: with Graceful's patience of 1.5 s the robot gives up in 24 of 34 trials, and the
doctor offers a shorter way of progress instead of the way back. It had shown the way back (10 s,
severity 2 to 0 in 12 pairs) and judged it first. But with it a touch, two near misses and two more
slow trials come up. The sound Graceful file shows these three as well; the fault had hidden them,
since a robot that gives up does not get so far. The change that is offered leaves six of the 24. In
the three probes that it was judged by the symptom is gone (6 to 0 of 6), as the score asks.

The likeliest abnormal value alone, nothing driven, is right in 3 of 3, the doctor in 2: driving
adds nothing here but the proof, as in 2033. *Expected* were 70% first and 75% gone; 2 of 3 and 3 of
3 neither show nor refute that. A fifth was expected to be too rare: none of three is. 100 trials a
visit were expected, 125 were driven.

The fourth visit, of DWB's `inflation_radius` in the global costmap, was in its search when the time
ended. The computer was shared, so a trial took up to 25 s in place of one.

The early end could be seen in journals only: of six earlier visits whose trials are kept none
would be called too rare (5 to 12 of 12 trials have the symptom), and 2031's `PathDist.scale` would
be, after 24 trials (3 have it) in place of 350 without an end.""",
    2036: """\
The loss first: the one harmful fault of 29 parameters is missed, by the doctor and not by reading.
RPP's speed of 0.1 m/s is the likeliest abnormal value, but no way back from it can be driven: the
base of the probes takes its limits from the file, and 0.2 m/s "asks more of the base than the file
does". The visit tried 43 other changes. Since then its verdict names such a change.

Of earlier draws every fourth parameter does harm, here one of 29, so the time went to faults that
waited: of nine, one of 2035 and four of 2031 (above). With these the doctor of 2036 has six visits:
the likeliest cause is the spoilt one in 4, as is that of the change offered; the symptom is gone in
4. Without skill the farthest value is right in 4 as well, the likeliest abnormal value, nothing
driven, in 5. The next visit, of `BaseObstacle.sum_scores`, was before its search when it was ended.
*Expected* were 65% to 80% first, 65% to 80% gone and 90% nothing worse; 4 of 6, 4 of 6 and 3 of 4
neither show nor refute that. In none of the six does the new rule name another cause than that of
the change offered, so they say nothing on it.

In 2035's fault, the inflation of the planner's costmap, driving is right and the likeliest abnormal
value is not: by reading the other costmap's radius comes first, is driven, and does little or
nothing.""",
    2037: """\
None of the eight parameters taken does harm, so this seed says nothing yet. The doctor of 2037 has
one visit, of 2031's `BaseObstacle.sum_scores` (above): its first cause is the spoilt switch, and
the symptom is gone, but two more trials have a near miss. The sound DWB file has near misses as
well; the fault, with which the robot hardly moves, had hidden them. Six were expected at most. The
computer was shared by so many that a trial took up to eight seconds, and the next visit, of
`PathAlign.scale`, was in its search when the time ended. One visit neither shows nor refutes what
was expected.""",
}


def harmful_lines() -> Iterator[str]:
    """Yields the part of the page about faults that do harm."""
    done = read_entries()
    yield from ["", "## Faults that do harm", "", *ABOUT.splitlines()]
    for seed in SEEDS:
        own = entries_of(done, seed)
        if own:
            yield from ["", f"### Seed {seed}", ""]
            yield from _seed_lines(seed, own)
            yield from ["", *REMARKS.get(seed, "").splitlines()]


def _seed_lines(seed: int, own: list[dict[str, Any]]) -> Iterator[str]:
    harmful = [entry for entry in own if entry["harmful"]]
    later = [entry for entry in harmful if "by" in entry]
    visited = [entry for entry in harmful if "first" in entry and entry not in later]
    refused = sum("refused" in entry for entry in own)
    taken = ", ".join(
        f"{sum(entry['controller'] == c for entry in own)} of {len(candidates(c))} of {c}"
        for c in CONTROLLERS_OF[seed]
    )
    yield f"{len(own)} parameters were taken ({taken}). The reader refuses the values of {refused},"
    yield f"{len(own) - refused - len(harmful)} do no harm, {len(harmful)} do harm."
    yield f"The doctor was given {len(visited)} of these."
    by_controller = ", ".join(
        f"{_count(visited, c)} of {_count(harmful, c)} of {c}" for c in CONTROLLERS_OF[seed]
    )
    yield f"By controller: {by_controller}."
    if harmful:
        yield from ["", *_undriven_lines(harmful)]
    if visited:
        yield from _visited_lines(visited)
    for doctor in sorted({entry["by"] for entry in later}):
        yield from ["", f"Gone on with by the doctor of {doctor}, which knew that these do harm:"]
        yield from _visited_lines([entry for entry in later if entry["by"] == doctor])


def _visited_lines(visited: list[dict[str, Any]]) -> Iterator[str]:
    yield from score_lines(visited)
    chance = np.mean([0.5 / len(candidates(entry["controller"])) for entry in visited])
    yield f"Any parameter and direction at random: {chance:.1%}."
    yield from ["", "| fault | sound | spoilt | complaint | first cause shown | change | worse |"]
    yield "|---|---|---|---|---|---|---|"
    for entry in visited:
        worse = ", ".join(entry.get("worse", ())) or ("none" if entry["gone"] else "")
        cells = [
            f"{entry['controller']} `{entry['place'].rpartition(': ')[2]}`", str(entry["sound"]),
            str(entry["spoilt"]), _complaint(entry), entry["shown"] or "none",
            entry["change"] or "none", worse,
        ]  # fmt: skip
        yield f"| {' | '.join(cells)} |"


def _complaint(entry: dict[str, Any]) -> str:
    """Returns the symptom that the doctor was given, and how seldom it is if it is too rare."""
    told = str(entry["harmful"][0])
    if "rare" not in entry:
        return told
    shown, trials = entry["rare"]
    return f"{told}: too rare ({shown} of {trials})"


def _count(entries: list[dict[str, Any]], controller: str) -> int:
    return sum(entry["controller"] == controller for entry in entries)


def _undriven_lines(harmful: list[dict[str, Any]]) -> Iterator[str]:
    """Yields today's answers that need no drive, to all harmful faults."""
    counts = np.zeros(3, dtype=int)
    for entry in harmful:
        fault = fault_of(entry)
        with tempfile.TemporaryDirectory() as folder:
            patient = patient_of(spoilt_file(fault), Path(folder))
            facts = patient.facts()
            read = suspicions_of(facts, Symptom(entry["harmful"][0]), "")
            tried = [
                s
                for s in with_differences(read, facts)
                if trials_of(s.cause, facts, patient.columns().setup)
            ]
            back = [
                any(_is_back(s.cause.place, s.cause.direction, fault, facts) for s in several)
                for several in (read[:1], tried)
            ]
            counts += [back[0], _farthest(facts, fault), back[1]]
    first, farthest, candidates = counts
    yield f"Nothing driven, of all {len(harmful)}: today's doctor names the spoilt parameter first"
    yield f"in {first}; the value farthest from Nav2's default is the spoilt one in {farthest}; and"
    yield f"a visit would try the way back in {candidates}, which bounds what driving can find."
