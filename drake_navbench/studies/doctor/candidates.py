"""Changes that can be driven: what a cause proposes, if the file and the robot allow it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.footprint import footprint_radii
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.cures import Trial, scaled, trials_of
from drake_navbench.studies.doctor.driving import Driver, Row
from drake_navbench.studies.doctor.facts import CONTROLLER, Facts
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.reading import Suspicion
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import IDLE, Tried, Verdict
from drake_navbench.typed_files.dotted_names import flattened

# Shares of the way of a change: half of it, and half as much again.
HALF, BEYOND = 0.5, 1.5
ASKS_FOR_LESS = "asks for less speed, and makes no robot faster"
BELOW_BODY = "the radius would be smaller than the robot's body"
BEYOND_BASE = "the robot's own file gives less speed"


@dataclass
class Candidate:
    """A change that is being tried. rows: of the changed file, in the pairs driven so far.

    left: why no more of its trials are driven; '' where they are. is_proposed: whether the user
    proposed it and wants a verdict, whatever other changes do. is_half: whether it goes half of a
    way back, of which the whole is driven as well.
    """

    suspicion: Suspicion
    trial: Trial
    after: Preset
    rows: list[Row] = field(default_factory=list)
    left: str = ""
    is_proposed: bool = False
    is_half: bool = False

    @property
    def is_alive(self) -> bool:
        """Whether more of its trials may be driven."""
        return not self.left


class Candidates:
    """The changes for a symptom. probe: one that each change is checked with, but not driven."""

    def __init__(
        self, patient: Patient, symptom: Symptom, probe: Scenario, driver: Driver, *, seed: int
    ) -> None:
        self._patient, self._facts, self._symptom = patient, patient.facts(), symptom
        self._probe, self._driver, self._seed = probe, driver, seed
        self._setup = patient.columns().setup

    def of(
        self, suspicion: Suspicion, most: int | None = None
    ) -> tuple[list[Candidate], list[Tried]]:
        """Returns the changes to drive for a cause, and entries for those that are not driven.

        most: the number of steps that are looked at, the mildest first; None for all.
        """
        if suspicion.cause.is_outside:
            return [], [Tried(suspicion, None, Verdict.OUTSIDE)]
        if self._symptom is Symptom.TOO_SLOW and _asks_for_less(suspicion.cause, self._facts):
            return [], [Tried(suspicion, None, Verdict.NOT_TRIED, reason=ASKS_FOR_LESS)]
        trials = trials_of(suspicion.cause, self._facts, self._setup)[:most]
        if trials and all(is_below_body(trial, self._setup.robot) for trial in trials):
            return [], [Tried(suspicion, trials[0], Verdict.NOT_TRIED, reason=BELOW_BODY)]
        trials = [trial for trial in trials if not is_below_body(trial, self._setup.robot)]
        if self._symptom is Symptom.TOO_SLOW and trials:
            first, *_ = trials
            trials = [trial for trial in trials if not _is_beyond_base(trial, self._facts)]
            if not trials:
                return [], [Tried(suspicion, first, Verdict.NOT_TRIED, reason=BEYOND_BASE)]
        if any(
            not self._facts.has_node(p.node.rpartition("/")[2]) for t in trials for p in t.changes
        ):
            # A node that the file does not have cannot be patched.
            return [], []
        if not trials:
            reason = "the doctor knows no value to try"
            return [], [Tried(suspicion, None, Verdict.NOT_TRIED, reason=reason)]
        found, told = [], []
        for trial in trials:
            candidate, reason = self.of_trial(suspicion, trial)
            if candidate is None:
                told.append(Tried(suspicion, trial, Verdict.NOT_TRIED, reason=reason))
            else:
                found.append(candidate)
        return found, told

    def way_back(self, suspicion: Suspicion) -> list[Candidate]:
        """Returns the changes that set an abnormal value back: to Nav2's, and half of the way.

        Nav2's value may go beyond what this file needs.
        """
        whole = self.of(suspicion)[0][:1]
        halves = [half for c in whole for half in self.scaled(c.suspicion, c.trial, (HALF,))]
        for half in halves:
            half.is_half = True
        return whole + halves

    def scaled(
        self, suspicion: Suspicion, trial: Trial, shares: Sequence[float]
    ) -> list[Candidate]:
        """Returns a change made smaller or larger by each share, as `cures.scaled`."""
        trials = [scaled(trial, self._facts, share) for share in shares]
        found = [self.of_trial(suspicion, each)[0] for each in trials if each is not None]
        return [candidate for candidate in found if candidate is not None]

    def of_trial(self, suspicion: Suspicion, trial: Trial) -> tuple[Candidate | None, str]:
        """Returns a change to drive; None, with the reason, if it is refused or changes nothing."""
        try:
            before, after = self._patient.before_and_after(trial.changes)
            self._driver.check(after, [self._probe], seed=self._seed)
        except InputError as error:
            return None, str(error)
        if _is_same(before, after):
            return None, IDLE
        return Candidate(suspicion, trial, after), ""


def _asks_for_less(cause: Cause, facts: Facts) -> bool:
    """Tells whether a cure only lowers the speed that the file asks for.

    To ask for no more than the robot's own file gives is a cure of its own: the robot then does
    what the controller expects.
    """
    places = (facts.speed_place, f"{CONTROLLER}.max_speed_xy")
    is_less = cause.direction is Direction.DOWN and cause.place in places
    return is_less and not 0.0 < facts.base_mps < facts.number(cause.place)


def _is_beyond_base(trial: Trial, facts: Facts) -> bool:
    """Tells whether a change lets the velocity smoother pass more speed than the robot has."""
    return any(
        place.name == "max_velocity" and isinstance(new, list) and new[0] > facts.base_mps > 0.0
        for place, new in trial.changes.items()
    )


def is_below_body(trial: Trial, robot: Robot) -> bool:
    """Tells whether a change lowers the costmaps' radius below the body's, where that is known."""
    if robot.collision_outline is None or trial.cause.direction is not Direction.DOWN:
        return False
    body_m = footprint_radii(robot.outline)[1]
    radii = [value for place, value in trial.changes.items() if place.name == "robot_radius"]
    return any(radius < body_m for radius in radii)


def _is_same(before: Preset, after: Preset) -> bool:
    """Tells whether a change alters nothing on which a trial depends."""
    return (
        before.controller == after.controller
        and _with_effect(before) == _with_effect(after)
        and before.path_handler == after.path_handler
        and before.stack == after.stack
    )


def _with_effect(preset: Preset) -> dict[str, Any]:
    """Returns a column's parameters without those that change nothing here, such as `visualize`."""
    values = preset.parameters.model_dump(mode="json")
    is_idle = preset.parameters.is_without_effect
    return {name: value for name, value in flattened(values) if not is_idle(name, values)}
