"""Searches a block of unknowns: studies in a journal, which an interrupted run goes on with."""

from __future__ import annotations

import time
import warnings
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from drake_navbench.errors import InputError
from drake_navbench.identification.budget import Share
from drake_navbench.identification.ranges import value_at
from drake_navbench.identification.unknowns import Block
from drake_navbench.tuning.search_space import plain_values
from drake_navbench.tuning.study import import_optuna

if TYPE_CHECKING:
    from optuna.samplers import BaseSampler
    from optuna.storages import JournalStorage
    from optuna.study import Study
    from optuna.trial import FrozenTrial, Trial

JOURNAL = "searches.journal"
SECONDS = "seconds"
# Before the sampler knows anything; they are the same whatever is held out, and driven once.
SOBOL_POINTS = 8
BATCH = 4
# The error of settings that cannot be driven: that of a table in which every cell is wrong.
ERROR_OF_REFUSED = 1.0

ErrorsOf = Callable[[Sequence[Mapping[str, Any]]], list[float | None]]
"""From some candidates' values to their mean errors, None for what cannot be driven."""


class Evaluation(NamedTuple):
    """Values that were driven, and the mean error that they have."""

    values: dict[str, Any]
    error: float


class Searches:
    """All searches of a run; each is known by a key.

    folder: of the journal. seed: of them all. Raises InputError where the journal cannot be used.
    """

    def __init__(self, folder: Path, seed: int) -> None:
        self._seed = seed
        self._storage = _journal(folder / JOURNAL)

    def run(self, key: str, block: Block, share: Share, errors_of: ErrorsOf) -> list[Evaluation]:
        """Searches until the share is used up, and returns all evaluations, also earlier ones.

        key: digest of all that decides what the search does.
        """
        study = import_optuna().create_study(
            study_name=key, storage=self._storage, direction="minimize", load_if_exists=True
        )
        _give_up_interrupted(study)
        while True:
            finished = _finished(study)
            spent_s = sum(float(trial.user_attrs[SECONDS]) for trial in finished)
            if share.is_used_up(len(finished), spent_s):
                break
            self._evaluate_some(study, block, len(finished), share.evaluations, errors_of)
        return [
            Evaluation(plain_values(trial.params), float(trial.values[0])) for trial in finished
        ]

    def _evaluate_some(
        self, study: Study, block: Block, known: int, most: int, errors_of: ErrorsOf
    ) -> None:
        """Evaluates several at once, as a worker has to load what it drives with."""
        own = (self._seed + zlib.crc32(f"{block.kind}/{block.name}".encode())) % 2**32
        if known < SOBOL_POINTS:
            first = _sobol_values(block, own)[known:]
            for values in first:
                study.enqueue_trial(values)
            count = len(first)
        else:
            # Made anew for each batch: then a search goes on as if it had not been interrupted.
            study.sampler = _tpe(own + known)
            count = max(min(BATCH, most - known), 1)
        trials = [study.ask() for _ in range(count)]
        candidates = [_suggested(trial, block) for trial in trials]
        begun = time.monotonic()
        errors = errors_of(candidates)
        each_s = (time.monotonic() - begun) / count
        for trial, error in zip(trials, errors, strict=True):
            trial.set_user_attr(SECONDS, each_s)
            study.tell(trial, ERROR_OF_REFUSED if error is None else error)


def best_of(evaluations: list[Evaluation]) -> Evaluation:
    """Returns the one of the smallest error, the first of equal ones."""
    return min(evaluations, key=lambda evaluation: evaluation.error)


def _finished(study: Study) -> list[FrozenTrial]:
    from optuna.trial import TrialState

    return list(study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,)))


def _give_up_interrupted(study: Study) -> None:
    """Ends what an interrupted run has left: nobody else works at a study of ours."""
    from optuna.trial import TrialState

    for trial in study.get_trials(deepcopy=False, states=(TrialState.RUNNING, TrialState.WAITING)):
        study.tell(trial.number, state=TrialState.FAIL)


def _suggested(trial: Trial, block: Block) -> dict[str, Any]:
    return plain_values({entry.name: entry.suggest(trial) for entry in block.dimensions})


def _sobol_values(block: Block, seed: int) -> list[dict[str, Any]]:
    places = qmc.Sobol(len(block.dimensions), rng=np.random.default_rng(seed)).random(SOBOL_POINTS)
    return [
        plain_values(
            {d.name: value_at(d, float(p)) for d, p in zip(block.dimensions, point, strict=True)}
        )
        for point in places
    ]


def _tpe(seed: int) -> BaseSampler:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sampler: BaseSampler = import_optuna().samplers.TPESampler(
            multivariate=True,
            constant_liar=True,
            n_startup_trials=SOBOL_POINTS,
            seed=seed % 2**32,
        )
    return sampler


def _journal(path: Path) -> JournalStorage:
    import_optuna()
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return JournalStorage(JournalFileBackend(str(path)))
    except OSError as error:
        raise InputError(f"{path}: cannot be used: {error.strerror or error}") from error
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not the journal of searches: {error}") from error
