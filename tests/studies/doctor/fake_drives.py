"""Drivers of rows that a test makes up, and what the search and the judgement find in them."""

from __future__ import annotations

from contextlib import nullcontext

from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.change import judge
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.experiment import Experiment
from drake_navbench.studies.doctor.probes import probes_for
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import Tried, Verdict

FOOTPRINT = Place("controller_server", "FollowPath.CostCritic.consider_footprint")


CAUSE = Cause("controller.CostCritic.consider_footprint", Direction.SET, True, "why")


TRIAL = Trial(CAUSE, {FOOTPRINT: True})


def tried(before, after, p_value, **changed):
    values = {
        "suspicion": Suspicion(CAUSE, 1.0, ("The reason.",)),
        "trial": TRIAL,
        "verdict": Verdict.NOT_SHOWN,
        "before": before,
        "after": after,
        "p_value": p_value,
        "pairs": 12,
    }
    return Tried(**(values | changed))


class Fake:
    """A driver of rows that a test makes up."""

    left_s, trial_s, budget_s = 100.0, 1.0, 100.0

    def keeping(self, time_s):
        return nullcontext()

    def tell(self, line):
        pass

    def told_time(self, trials):
        return "soon"

    def check(self, preset, probes, *, seed):
        pass

    def drive_together(self, presets, probes, trials, *, seed):
        return [self.drive(preset, probes, trials, seed=seed) for preset in presets]

    def drive_nearest(self, presets, probes, trials, *, seed):
        return self.drive_together(presets, probes, trials, seed=seed)


class Rows(Fake):
    """A driver that knows what every column does: symptoms by column, on every probe.

    A column whose symptoms are None fails. seldom: how many of the seeds show the symptoms.
    """

    def __init__(self, before, after, seldom=None):
        self.symptoms = {"before": before, "after": after}
        self.seldom = seldom

    def drive(self, preset, probes, trials, *, seed):
        symptoms = self.symptoms[preset.name]
        shown = {s: 2.0 for s in symptoms or ()}
        return [
            {
                "scenario": probe.name,
                "severity": shown if self.seldom is None or trial in self.seldom else {},
                "outcome": "error" if symptoms is None else "succeeded",
                "reason": "a division by zero",
                "end": [9.0 if preset.name == "before" else 9.5],
            }
            for trial in range(trials)
            for probe in probes
        ]


PROBES = {
    name: scenario
    for name, scenario in probes_for(load_robot("wheelchair"), 0.5).items()
    if name in ("straight", "door", "corridor")
}


def judged(patient, before, after, symptom):
    shown = [tried(2.0, 0.0, 0.001, verdict=Verdict.SHOWN)]
    driver = Rows(before, after)
    return next(judge(patient, shown, symptom, PROBES, ["straight"], driver, seed=0))


class Counted(Fake):
    """A driver that counts the trials of the changed file. severity: of it, by trial."""

    def __init__(self, end, severity):
        self.end, self.severity, self.trials = end, severity, 0

    def drive(self, preset, probes, trials, *, seed):
        is_after = preset.name == "after"
        self.trials = len(probes) * trials if is_after else self.trials
        return [
            {
                "scenario": probe.name,
                "outcome": "succeeded",
                "end": [self.end if is_after else 9.0],
                "severity": {"wobble_straight": self.severity if is_after else 2.0},
            }
            for _ in range(trials)
            for probe in probes
        ]


def raced(patient, driver, symptom=Symptom.WOBBLE_STRAIGHT):
    experiment = Experiment(patient, symptom, list(PROBES.values()), driver, seed=0)
    candidate, _ = experiment.candidates.of_trial(Suspicion(CAUSE, 1.0, ()), TRIAL)
    (found,) = experiment._race.run([candidate])
    return found
