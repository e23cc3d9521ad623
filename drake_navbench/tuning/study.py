"""The search: a study in a journal that several processes may join, and the race in it.

A journal is one file that is only ever appended to, so that processes of several machines share it
in a folder that they share. What a configuration did is kept with it, pair by pair: whoever joins
races against all that the others have driven.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.analysis.statistics import pareto_front
from drake_navbench.errors import InputError
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.tuning.objectives import (
    Objective,
    excess_failures,
    pair_difference,
    require_comparable,
    scales_of,
)
from drake_navbench.tuning.pairs import Row, measure, with_column
from drake_navbench.tuning.race import is_dropped, looks_until
from drake_navbench.tuning.search_space import SearchSpace, plain_values
from drake_navbench.tuning.task import TuningTask, require_same_task

if TYPE_CHECKING:
    from optuna.samplers import BaseSampler
    from optuna.study import Study
    from optuna.trial import FrozenTrial, Trial

Array = NDArray[np.float64]
Sampler = Literal["tpe", "nsga2", "random"]

JOURNAL = "study.journal"
STUDY = "tuning"
TASK, DIFFERENCES, EXCESS, DROPPED, REFUSED = "task", "differences", "excess", "dropped", "refused"
# Before a sampler knows anything: points of Sobol's sequence, which leave no part unseen.
SOBOL_POINTS = 16


class Configuration(NamedTuple):
    """A configuration that was driven.

    differences: (N, K) of its pairs, see `objectives`. excess: see `excess_failures`.
    is_dropped: whether the race ended before its last look.
    """

    number: int
    parameters: dict[str, Any]
    differences: Array
    excess: float
    is_dropped: bool

    @property
    def means(self) -> Array:
        """The mean differences, (K,)."""
        return np.asarray(self.differences.mean(axis=0))


def open_study(folder: Path, task: TuningTask) -> Study:
    """Returns the study in a folder, a new one where there is none.

    Raises InputError where there is one of another version or task, or it cannot be read.
    """
    optuna = import_optuna()
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend

    path = folder / JOURNAL
    try:
        folder.mkdir(parents=True, exist_ok=True)
        storage = JournalStorage(JournalFileBackend(str(path)))
        study = optuna.create_study(
            study_name=STUDY,
            storage=storage,
            directions=["minimize"] * len(task.objectives),
            load_if_exists=True,
        )
    except OSError as error:
        raise InputError(f"{path}: cannot be used: {error.strerror or error}") from error
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not the journal of a study: {error}") from error
    begun = study.user_attrs.get(TASK)
    if begun is None:
        study.set_user_attr(TASK, task.model_dump(mode="json"))
    else:
        require_same_task(task, begun, str(path))
    return study


def configurations_of(study: Study) -> list[Configuration]:
    """Returns what was driven to its end, in order."""
    found = []
    for trial in study.get_trials(deepcopy=False):
        if trial.state.is_finished() and DIFFERENCES in trial.user_attrs:
            attributes = trial.user_attrs
            found.append(
                Configuration(
                    trial.number,
                    plain_values(trial.params),
                    np.array(attributes[DIFFERENCES], dtype=float),
                    float(attributes[EXCESS]),
                    bool(attributes[DROPPED]),
                )
            )
    return found


def front_of(configurations: Sequence[Configuration], most: int) -> list[Configuration]:
    """Returns those that no other beats in all objectives, of too many the best on the whole.

    Only those that came through the race and fail no more often than is allowed.
    """
    through = [c for c in configurations if not c.is_dropped and c.excess <= 0.0]
    if not through:
        return []
    is_best = pareto_front(np.array([c.means for c in through]))
    best = [c for c, chosen in zip(through, is_best, strict=True) if chosen]
    return sorted(best, key=lambda c: float(c.means.sum()))[:most]


def drive_baseline(
    pairs: Sequence[TrialSpec], objectives: Sequence[Objective], *, jobs: int
) -> list[Row]:
    """Returns what the baseline did in its trials, in order.

    Raises InputError where that leaves nothing to compare with.
    """
    rows = measure(pairs, jobs=jobs)
    require_comparable(rows, objectives)
    return rows


class Search:
    """Asks a study for configurations and races them.

    pairs: trials of the baseline, in the order in which a configuration drives them. baseline: what
    it did in them. sampler: after the first points, which are Sobol's.
    """

    def __init__(
        self,
        study: Study,
        space: SearchSpace,
        pairs: Sequence[TrialSpec],
        objectives: Sequence[Objective],
        *,
        baseline: Sequence[Row],
        sampler: Sampler,
        seed: int,
        jobs: int,
    ) -> None:
        self._study, self._space, self._pairs = study, space, pairs
        self._objectives, self._sampler, self._seed = objectives, sampler, seed
        self._jobs, self._baseline = jobs, baseline
        self._looks = looks_until(len(pairs))
        self._scales = scales_of(baseline, objectives)

    def run(self, configurations: int, on_driven: Callable[[Configuration], None]) -> None:
        """Drives until the study has so many; on_driven is told of each of ours."""
        while (known := self._finished_count()) < configurations:
            self._study.sampler = self._sampler_for(known)
            driven = self._race(self._study.ask())
            if driven is not None:
                on_driven(driven)

    def _finished_count(self) -> int:
        return sum(trial.state.is_finished() for trial in self._study.get_trials(deepcopy=False))

    def _sampler_for(self, known: int) -> BaseSampler:
        optuna = import_optuna()
        # A sampler is made anew for each: then a study goes on as if it had not been interrupted.
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
                    multivariate=True, constant_liar=True, constraints_func=_excess, seed=seed
                )
            if self._sampler == "nsga2":
                return optuna.samplers.NSGAIISampler(constraints_func=_excess, seed=seed)
        return independent

    def _race(self, trial: Trial) -> Configuration | None:
        """Drives a configuration until it is dropped or through; None where it cannot be built."""
        from optuna.trial import TrialState

        parameters = self._space.suggest(trial)
        try:
            specs = with_column(self._pairs, self._space.candidate(parameters))
        except InputError as error:
            # Parameters that are each allowed may not go together.
            trial.set_user_attr(REFUSED, str(error))
            self._study.tell(trial, state=TrialState.FAIL)
            return None
        rivals = [c.differences for c in configurations_of(self._study) if not c.is_dropped]
        rivals.append(np.zeros((len(self._pairs), len(self._objectives))))
        rows: list[Row] = []
        differences = np.empty((0, len(self._objectives)))
        is_out = False
        for end in self._looks:
            rows += measure(specs[len(rows) : end], jobs=self._jobs)
            differences = self._differences(rows)
            if end < len(self._pairs) and is_dropped(differences, rivals, looks=len(self._looks)):
                is_out = True
                break
        excess = excess_failures(rows, self._baseline[: len(rows)])
        trial.set_user_attr(DIFFERENCES, differences.tolist())
        trial.set_user_attr(EXCESS, excess)
        trial.set_user_attr(DROPPED, is_out)
        # What is dropped is told, too: a sampler learns from it where not to look.
        self._study.tell(trial, [float(mean) for mean in differences.mean(axis=0)])
        return Configuration(trial.number, parameters, differences, excess, is_out)

    def _differences(self, rows: Sequence[Row]) -> Array:
        return np.array(
            [
                pair_difference(own, base, self._objectives, self._scales[str(base["scenario"])])
                for own, base in zip(rows, self._baseline, strict=False)
            ]
        )


def importance_of(study: Study, objective: int) -> dict[str, float]:
    """Returns how much each parameter matters for an objective, shares that sum to 1.

    By PED-ANOVA, which asks what the best tenth has in common. Empty where too little was driven.
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


def _excess(trial: FrozenTrial) -> Sequence[float]:
    return (float(trial.user_attrs.get(EXCESS, 0.0)),)


def import_optuna() -> Any:
    """Returns the package, told to be quiet; raises InputError where it is not installed."""
    try:
        import optuna
    except ImportError as error:
        raise InputError("optuna is not installed; pip install 'drake-navbench[tune]'") from error
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna
