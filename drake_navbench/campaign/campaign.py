"""The table of trials: which there are, who runs them, what comes of them."""

from __future__ import annotations

import multiprocessing
import os
import signal
import traceback
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import TimeoutError as FutureTimeoutError
from concurrent.futures import as_completed
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import pandas as pd
from pebble import ProcessExpired, ProcessPool

from drake_navbench.analysis.tables import trial_row
from drake_navbench.campaign.warm_up import start_worker_server
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset, default_presets, load_preset
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS, load_scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.log import Outcome, TrialLog
from drake_navbench.results import ResultsFolder
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import DEFAULT_ROBOT, failed_log, make_controller, simulate

DEFAULT_TRIALS = 4
# Drake's bindings never free Python systems, so a worker is replaced after this many trials.
TRIALS_PER_WORKER = 24
# A trial that takes this much longer than the time it simulates hangs.
WALL_CLOCK_PER_SIMULATED_SECOND = 5.0
MIN_WALL_CLOCK_S = 120.0

Row = dict[str, object]


@dataclass(frozen=True)
class Campaign:
    """Every trial of a benchmark, in the order of its table, all input checked."""

    specs: tuple[TrialSpec, ...]

    @property
    def scenarios(self) -> list[str]:
        """Names of the scenarios, in order."""
        return list(dict.fromkeys(spec.scenario.name for spec in self.specs))

    @property
    def columns(self) -> list[str]:
        """Names of the presets, in order."""
        return list(dict.fromkeys(spec.preset.name for spec in self.specs))


@dataclass
class Progress:
    """How far a campaign is; `failed` counts the trials that ended in an error."""

    total: int
    done: int = 0
    running: int = 0
    failed: int = 0


def trial_seed(seed: int, scenario: str, trial: int) -> int:
    """Returns the seed of a trial: the same for every controller, so that trials are paired."""
    entropy = [seed, zlib.crc32(scenario.encode()), trial]
    return int(np.random.SeedSequence(entropy).generate_state(1)[0])


def plan_campaign(
    scenarios: Sequence[str] = (),
    presets: Sequence[str | Preset] = (),
    *,
    trials: int = DEFAULT_TRIALS,
    seed: int = 0,
    robot: str = DEFAULT_ROBOT,
    wants_diagnostics: bool = False,
) -> Campaign:
    """Returns every trial of a campaign, all input checked; raises InputError.

    Empty sequences stand for the five published scenarios and the default presets. What is given
    twice runs once; different ones of the same name are refused.
    """
    scenario_texts = tuple(dict.fromkeys(scenarios)) or PUBLISHED_SCENARIOS
    loaded = [load_scenario(text) for text in scenario_texts]
    _require_different_names(
        "scenario", [(s.name, text) for s, text in zip(loaded, scenario_texts, strict=True)]
    )
    columns = [
        preset if isinstance(preset, Preset) else load_preset(preset)
        for preset in dict.fromkeys(presets or default_presets())
    ]
    _require_different_names("controller", [(preset.name, preset.source) for preset in columns])
    specs = []
    for scenario in loaded:
        loaded_robot = scenario.load_robot(robot)
        check_task(scenario, loaded_robot)
        fitted = [preset.for_robot(loaded_robot) for preset in columns]
        for preset in fitted:
            # Some parameters are wrong only for this robot or its control period.
            make_controller(preset, preset.robot(loaded_robot))
        for trial in range(trials):
            for preset in fitted:
                specs.append(
                    TrialSpec(
                        scenario,
                        loaded_robot,
                        preset,
                        seed=trial_seed(seed, scenario.name, trial),
                        trial=trial,
                        wants_diagnostics=wants_diagnostics,
                    )
                )
    return Campaign(tuple(specs))


def _require_different_names(kind: str, names_and_sources: Iterable[tuple[str, str]]) -> None:
    """Raises InputError where two have one name: their logs would overwrite each other."""
    sources: dict[str, str] = {}
    for name, source in names_and_sources:
        if name in sources:
            raise InputError(
                f"{kind} {name!r}: expected one of this name, got {sources[name]} and {source}"
            )
        sources[name] = source


def run_campaign(
    campaign: Campaign,
    folder: ResultsFolder,
    *,
    jobs: int,
    on_progress: Callable[[Progress], None] = lambda progress: None,
) -> pd.DataFrame:
    """Runs every trial that has no log in the folder yet; returns and writes the table of trials.

    A trial that breaks, hangs or kills its worker becomes a row with the outcome `error`. Ctrl-C
    stops the workers and leaves the finished logs behind, from which a resumed run goes on.
    """
    rows: dict[int, Row] = {}
    waiting = []
    for index, spec in enumerate(campaign.specs):
        path = folder.log_path(spec.scenario.name, spec.preset.name, spec.trial)
        if path.is_file():
            rows[index] = _table_row(TrialLog.read(path))
        else:
            waiting.append(index)
    progress = Progress(total=len(campaign.specs), done=len(rows))
    progress.failed = sum(row["outcome"] == Outcome.ERROR for row in rows.values())
    on_progress(progress)
    with worker_pool(jobs) as pool:
        futures = {
            pool.schedule(
                _run_and_write,
                args=[campaign.specs[index], folder],
                timeout=wall_clock_limit_s(campaign.specs[index]),
            ): index
            for index in waiting
        }
        for future in as_completed(futures):
            index = futures.pop(future)
            rows[index] = _row_of(future, campaign.specs[index], folder)
            progress.done += 1
            progress.failed += rows[index]["outcome"] == Outcome.ERROR
            progress.running = min(jobs, len(futures))
            on_progress(progress)
    trials = pd.DataFrame([rows[index] for index in range(len(campaign.specs))])
    folder.write_trials(trials)
    return trials


def available_jobs() -> int:
    """Returns the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def wall_clock_limit_s(spec: TrialSpec) -> float:
    """Returns how long a trial may take before it counts as hanging, s of wall clock."""
    return max(MIN_WALL_CLOCK_S, WALL_CLOCK_PER_SIMULATED_SECOND * spec.scenario.timeout_s)


@contextmanager
def worker_pool(jobs: int) -> Iterator[ProcessPool]:
    """Gives a pool whose workers are forked from a server that has everything loaded.

    The end of the block waits for what is scheduled; an exception in it stops the workers at once.
    """
    start_worker_server()
    with ProcessPool(
        max_workers=jobs,
        max_tasks=TRIALS_PER_WORKER,
        initializer=_ignore_interrupts,
        context=multiprocessing.get_context("forkserver"),
    ) as pool:
        try:
            yield pool
        except BaseException:
            pool.stop()
            raise


def _ignore_interrupts() -> None:
    # Ctrl-C reaches the whole process group; the parent alone decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _run_and_write(spec: TrialSpec, folder: ResultsFolder) -> Row:
    """Runs one trial in a worker, writes its log, returns its row of the table."""
    try:
        log = simulate(spec)
        folder.write_log(log)
        return _table_row(log)
    except (Exception, SystemExit) as error:
        # Drake reports a failed C++ check as SystemExit. A log may hold what a plugin left in it.
        log = failed_log(spec, f"{type(error).__name__}: {error}", traceback.format_exc())
    folder.write_log(log)
    return _table_row(log)


def _table_row(log: TrialLog) -> Row:
    return trial_row(log) | {"simulated_time_s": log.end_time_s}


def _row_of(future, spec: TrialSpec, folder: ResultsFolder) -> Row:
    try:
        return future.result()
    except FutureTimeoutError:
        reason = f"no result after {wall_clock_limit_s(spec):g} s of wall clock; ended"
    except ProcessExpired as error:
        reason = f"the worker process died with exit code {error.exitcode}"
    log = failed_log(spec, reason)
    folder.write_log(log)
    return _table_row(log)
