"""Searches a block of unknowns: studies in a journal, which an interrupted run goes on with."""

from __future__ import annotations

import time
import warnings
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.identification.budget import Share
from drake_navbench.identification.unknowns import Block
from drake_navbench.tuning.search_space import plain_values

if TYPE_CHECKING:
    from optuna.samplers import BaseSampler
    from optuna.storages import JournalStorage
    from optuna.study import Study

JOURNAL = "searches.journal"
SECONDS, REFUSED = "seconds", "refused"
# Before the sampler knows anything; they are the same whatever is held out, and driven once.
SOBOL_POINTS = 8
# The error of settings that cannot be driven: that of a table in which every cell is wrong.
ERROR_OF_REFUSED = 1.0

Values = Mapping[str, Any]


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

    def run(
        self, key: str, block: Block, share: Share, error_of: Callable[[Values], float]
    ) -> list[Evaluation]:
        """Searches until the share is used up, and returns all evaluations, also earlier ones.

        key: digest of all that decides what the search does. error_of: the mean error of some
        values; raises InputError where they cannot be driven.
        """
        study = _optuna().create_study(
            study_name=key, storage=self._storage, direction="minimize", load_if_exists=True
        )
        while True:
            finished = [t for t in study.get_trials(deepcopy=False) if t.state.is_finished()]
            spent_s = sum(float(trial.user_attrs.get(SECONDS, 0.0)) for trial in finished)
            if share.is_used_up(len(finished), spent_s):
                break
            study.sampler = self._sampler(block, len(finished))
            _evaluate(study, block, error_of)
        return [
            Evaluation(plain_values(trial.params), float(trial.values[0])) for trial in finished
        ]

    def _sampler(self, block: Block, known: int) -> BaseSampler:
        optuna = _optuna()
        # Made anew for each: then a search goes on as if it had not been interrupted.
        own = (self._seed + zlib.crc32(f"{block.kind}/{block.name}".encode())) % 2**32
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if known < SOBOL_POINTS:
                return optuna.samplers.QMCSampler(
                    seed=own,
                    scramble=True,
                    independent_sampler=optuna.samplers.RandomSampler(seed=(own + known) % 2**32),
                    warn_independent_sampling=False,
                    warn_asynchronous_seeding=False,
                )
            return optuna.samplers.TPESampler(
                multivariate=True, n_startup_trials=SOBOL_POINTS, seed=(own + known) % 2**32
            )


def best_of(evaluations: list[Evaluation]) -> Evaluation:
    """Returns the one of the smallest error, the first of equal ones."""
    return min(evaluations, key=lambda evaluation: evaluation.error)


def _evaluate(study: Study, block: Block, error_of: Callable[[Values], float]) -> None:
    trial = study.ask()
    values = plain_values({entry.name: entry.suggest(trial) for entry in block.dimensions})
    begun = time.monotonic()
    try:
        error = error_of(values)
    except InputError as refusal:
        trial.set_user_attr(REFUSED, str(refusal))
        error = ERROR_OF_REFUSED
    trial.set_user_attr(SECONDS, time.monotonic() - begun)
    study.tell(trial, error)


def _journal(path: Path) -> JournalStorage:
    _optuna()
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return JournalStorage(JournalFileBackend(str(path)))
    except OSError as error:
        raise InputError(f"{path}: cannot be used: {error.strerror or error}") from error
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not the journal of searches: {error}") from error


def _optuna() -> Any:
    try:
        import optuna
    except ImportError as error:
        raise InputError(
            "identify: expected the package optuna; pip install 'drake-navbench[tune]'"
        ) from error
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna
