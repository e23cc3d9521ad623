"""The search: a study in a journal that several processes may join, and the race in it.

Processes of several machines share the journal in a folder that they share. The results of a
configuration are kept with it, pair by pair: a process that joins races against all that the others
have driven.
"""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from drake_navbench.analysis.statistics import pareto_front
from drake_navbench.campaign.rows_of_trials import Row, measure, with_column
from drake_navbench.errors import InputError, one_line
from drake_navbench.kernels.arrays import Array
from drake_navbench.studies.tuning.guards import touches_of
from drake_navbench.studies.tuning.journal import BROKEN, JOURNAL, appending, import_optuna
from drake_navbench.studies.tuning.objectives import (
    CENSORED,
    Objective,
    excess_failures,
    pair_difference,
    require_comparable,
    scales_of,
)
from drake_navbench.studies.tuning.race import is_dropped, looks_until
from drake_navbench.studies.tuning.search_space import SearchSpace, plain_values
from drake_navbench.trial.spec import TrialSpec

if TYPE_CHECKING:
    from optuna.samplers import BaseSampler
    from optuna.study import Study
    from optuna.trial import FrozenTrial, Trial

Sampler = Literal["tpe", "nsga2", "random"]

DIFFERENCES, EXCESS, ENDING, REFUSED = "differences", "excess", "ending", "refused"
TOUCHES, TRIALS = "touches", "trials"
# The number of points of Sobol's sequence before the sampler begins; they leave no part unseen.
SOBOL_POINTS = 16


class Ending(StrEnum):
    """The end of a configuration's race: its last look, or earlier a better rival or a touch."""

    THROUGH = "through"
    DROPPED = "dropped"
    TOUCHED = "touched"


class Configuration(NamedTuple):
    """A configuration that was driven.

    differences: (N, K) of its pairs, see `objectives`. excess: see `excess_failures`. touches: the
    number of trials with a touch, by scenario, among all its `trials`.
    """

    number: int
    parameters: dict[str, Any]
    differences: Array
    excess: float
    ending: Ending
    touches: dict[str, int]
    trials: int

    @property
    def means(self) -> Array:
        """The mean differences, (K,)."""
        return np.asarray(self.differences.mean(axis=0))

    @property
    def as_rival(self) -> Array:
        """The differences against which other configurations race; none if it touched something."""
        return self.differences[:0] if self.ending == Ending.TOUCHED else self.differences


def configurations_of(study: Study) -> list[Configuration]:
    """Returns the configurations that were driven to their end, in order.

    Raises InputError where the journal holds something else.
    """
    found = []
    try:
        for trial in study.get_trials(deepcopy=False):
            if trial.state.is_finished() and DIFFERENCES in trial.user_attrs:
                found.append(_configuration_of(trial))
    except BROKEN as error:
        raise InputError(f"{JOURNAL}: not the journal of a study: {one_line(error)}") from error
    return found


def _configuration_of(trial: FrozenTrial) -> Configuration:
    attributes = trial.user_attrs
    differences = np.array(attributes[DIFFERENCES], dtype=float)
    if differences.ndim != 2 or not len(differences):
        raise ValueError(f"trial {trial.number}: {DIFFERENCES} are no table of numbers")
    return Configuration(
        trial.number,
        plain_values(trial.params),
        differences,
        float(attributes[EXCESS]),
        Ending(attributes[ENDING]),
        dict(attributes[TOUCHES]),
        int(attributes[TRIALS]),
    )


def front_of(configurations: Sequence[Configuration], most: int) -> list[Configuration]:
    """Returns the configurations that no other beats in all objectives; at most `most`, the best.

    They have come through the race, touch nothing, and fail no more often than is allowed.
    """
    through = [c for c in configurations if c.ending == Ending.THROUGH and c.excess <= 0.0]
    if not through:
        return []
    is_best = pareto_front(np.array([c.means for c in through]))
    best = [c for c, chosen in zip(through, is_best, strict=True) if chosen]
    return sorted(best, key=lambda c: float(c.means.sum()))[:most]


class Trials(NamedTuple):
    """The trials of a configuration, planned for the baseline.

    pairs: in order. closed: trials beside the first pairs. worlds: trials after the race, for
    configurations that come through it.
    """

    pairs: Sequence[TrialSpec]
    closed: Sequence[TrialSpec]
    worlds: Sequence[TrialSpec]


def drive_baseline(trials: Trials, objectives: Sequence[Objective], *, jobs: int) -> list[Row]:
    """Drives the baseline and returns its rows: pairs first, then closed way and worlds.

    Raises InputError where the pairs leave nothing to compare with.
    """
    rows = measure([*trials.pairs, *trials.closed, *trials.worlds], jobs=jobs)
    tasks = {spec.scenario.name for spec in trials.pairs if spec.scenario.suite is not None}
    require_comparable(rows[: len(trials.pairs)], objectives, tasks)
    return rows


class Sampling(NamedTuple):
    """The sampler that proposes a study's configurations after Sobol's points, and its seed."""

    sampler: Sampler
    seed: int


class Search:
    """Asks a study for configurations and races them.

    baseline: the baseline's rows in the pairs. journal: the file of the study, for messages.
    """

    def __init__(
        self,
        study: Study,
        space: SearchSpace,
        trials: Trials,
        objectives: Sequence[Objective],
        *,
        baseline: Sequence[Row],
        sampling: Sampling,
        jobs: int,
        journal: Path,
    ) -> None:
        self._study, self._space, self._trials = study, space, trials
        self._objectives = objectives
        self._sampler, self._seed = sampling
        self._jobs, self._baseline, self._journal = jobs, baseline, journal
        self._looks = looks_until(len(trials.pairs))
        self._scales = scales_of(baseline, objectives)

    def run(self, configurations: int, on_driven: Callable[[Configuration], None]) -> None:
        """Drives until the study has `configurations`; calls on_driven for each driven here.

        Raises CannotBeWritten where the journal takes no more, as on a full disk.
        """
        while (known := self._finished_count()) < configurations:
            with appending(self._journal):
                self._study.sampler = self._sampler_for(known)
                trial = self._study.ask()
                parameters = self._space.suggest(trial)
            try:
                column = self._space.candidate(parameters)
                trials = Trials(*(with_column(specs, column) for specs in self._trials))
            except InputError as error:
                # Parameters that are each valid may be invalid together.
                self._refuse(trial, str(error))
                continue
            driven = self._race(trial.number, parameters, trials)
            self._keep(trial, driven)
            on_driven(driven)

    def _finished_count(self) -> int:
        return sum(trial.state.is_finished() for trial in self._study.get_trials(deepcopy=False))

    def _sampler_for(self, known: int) -> BaseSampler:
        optuna = import_optuna()
        # The sampler is made anew each time, so that a resumed study goes on as an uninterrupted
        # one.
        seed = (self._seed + known) % 2**32
        independent = optuna.samplers.RandomSampler(seed=seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if known < SOBOL_POINTS:
                return optuna.samplers.QMCSampler(
                    seed=self._seed % 2**32,
                    scramble=True,
                    independent_sampler=independent,
                    warn_independent_sampling=False,
                    warn_asynchronous_seeding=False,
                )
            if self._sampler == "tpe":
                return optuna.samplers.TPESampler(
                    multivariate=True, constant_liar=True, constraints_func=_violations, seed=seed
                )
            if self._sampler == "nsga2":
                return optuna.samplers.NSGAIISampler(constraints_func=_violations, seed=seed)
        return independent

    def _race(self, number: int, parameters: dict[str, Any], trials: Trials) -> Configuration:
        """Drives a configuration until it touches something, is dropped, or comes through."""
        rivals = [entry.as_rival for entry in configurations_of(self._study)]
        rows: list[Row] = []
        guards = list(trials.closed)
        touches: Counter[str] = Counter()
        ending = Ending.THROUGH
        for end in self._looks:
            pairs = trials.pairs[len(rows) : end]
            driven = measure([*pairs, *guards], jobs=self._jobs)
            rows += driven[: len(pairs)]
            guards = []
            touches += touches_of(driven)
            if touches:
                ending = Ending.TOUCHED
                break
            if end < len(trials.pairs) and is_dropped(self._differences(rows), rivals):
                ending = Ending.DROPPED
                break
        count = len(rows) + len(trials.closed)
        if ending == Ending.THROUGH and trials.worlds:
            touches += touches_of(measure(trials.worlds, jobs=self._jobs))
            count += len(trials.worlds)
            ending = Ending.TOUCHED if touches else ending
        excess = excess_failures(rows, self._baseline[: len(rows)])
        differences = self._differences(rows)
        return Configuration(number, parameters, differences, excess, ending, dict(touches), count)

    def _refuse(self, trial: Trial, reason: str) -> None:
        from optuna.trial import TrialState

        with appending(self._journal):
            trial.set_user_attr(REFUSED, reason)
            self._study.tell(trial, state=TrialState.FAIL)

    def _keep(self, trial: Trial, driven: Configuration) -> None:
        """Writes the results of a configuration into the journal.

        Dropped configurations are written, too: the sampler learns from them which parameters are
        bad. A configuration that touches gets the worst value in every objective, whatever its
        other trials were like.
        """
        has_touched = driven.ending == Ending.TOUCHED
        means = np.full(len(self._objectives), CENSORED) if has_touched else driven.means
        with appending(self._journal):
            trial.set_user_attr(DIFFERENCES, driven.differences.tolist())
            trial.set_user_attr(EXCESS, driven.excess)
            trial.set_user_attr(ENDING, driven.ending.value)
            trial.set_user_attr(TOUCHES, driven.touches)
            trial.set_user_attr(TRIALS, driven.trials)
            self._study.tell(trial, [float(mean) for mean in means])

    def _differences(self, rows: Sequence[Row]) -> Array:
        return np.array(
            [
                pair_difference(own, base, self._objectives, self._scales[str(base["scenario"])])
                for own, base in zip(rows, self._baseline, strict=False)
            ]
        )


def importance_of(study: Study, objective: int) -> dict[str, float]:
    """Returns the importance of each parameter for an objective, as shares that sum to 1.

    PED-ANOVA computes it from the distribution of the parameters among the best tenth of the
    configurations. The result is empty where too few configurations were driven.
    """
    optuna = import_optuna()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = optuna.importance.get_param_importances(
                study,
                evaluator=optuna.importance.PedAnovaImportanceEvaluator(),
                target=lambda trial: float(trial.values[objective]),
            )
        except (RuntimeError, ValueError):
            return {}
    return {str(name): float(share) for name, share in found.items()}


def _violations(trial: FrozenTrial) -> Sequence[float]:
    attributes = trial.user_attrs
    return float(attributes.get(EXCESS, 0.0)), float(sum(attributes.get(TOUCHES, {}).values()))
