"""The published metrics under their published names, each exactly as the publication computes it.

Source of all of them: F. Schena, "Development of an automated benchmark for the analysis of Nav2
controllers", Politecnico di Torino, 2024. Their weaknesses are kept, so that the comparison with
the published tables is honest; `drake_navbench.analysis.metrics` holds the corrected forms. The
publication plans once a trial; where there are later plans, its plan stands for the first of each
leg.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_navbench.analysis.metrics.definition import Metric, Undefined, metric
from drake_navbench.analysis.metrics.signals import poses_at, require
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.percent import PERCENT
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome

FIRST_SAMPLE_AFTER_START_S = 0.06
SAMPLING_PERIOD_S = 0.115
# Sample times count as equal if they differ by rounding only; this is far below any sampling
# period.
TIME_TOLERANCE_S = 1e-9
DROPPED_PLAN_POSES = 4
MIN_YAW_RATE_RADPS = 0.01
MIN_RADIUS_M = 0.01
PLAN_POSES_AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class PublishedSamples:
    """A trial on the publication's sampling.

    time_s: (N,). pose: (N, 3) true x m, y m, yaw rad, interpolated. v_mps, w_radps: (N,) the last
    command, held. obstacle_corner_distance_m: (N,) from the reference point to the nearest lower
    left corner of a lethal cell of the local costmap, held; +inf without such a cell. is_carried:
    (N - 1,) whether a lift changed the floor between two samples; None for one floor.
    """

    time_s: Array
    pose: Array
    v_mps: Array
    w_radps: Array
    obstacle_corner_distance_m: Array
    is_carried: NDArray[np.bool_] | None = None

    @property
    def duration_s(self) -> float:
        """Last stamp minus first stamp, s."""
        return float(self.time_s[-1] - self.time_s[0])

    @property
    def step_s(self) -> float:
        """The publication's dt, s: the duration divided by the number of samples, not of steps."""
        return self.duration_s / len(self.time_s)


def published_samples(
    log: TrialLog,
    *,
    first_after_start_s: float = FIRST_SAMPLE_AFTER_START_S,
    period_s: float = SAMPLING_PERIOD_S,
) -> PublishedSamples:
    """Samples a trial as the publication did: every 0.115 s from 0.06 s after the start.

    The last sample lies strictly before the end. Raises Undefined where there is no sample, or a
    recording has no commands.
    """
    require(log, "command_v_mps")
    first_s = float(log.info["start_time_s"]) + first_after_start_s
    span_s = log.end_time_s - first_s - TIME_TOLERANCE_S
    count = int(np.ceil(span_s / period_s))
    rows = log.samples
    if count < 1 or len(rows) == 0:
        raise Undefined("the trial ended before the first published sample")
    times = first_s + period_s * np.arange(count, dtype=np.float64)
    logged = rows["time_s"].to_numpy()
    held = np.searchsorted(logged, times + TIME_TOLERANCE_S, side="right") - 1
    held = np.maximum(held, 0)
    return PublishedSamples(
        time_s=times,
        pose=poses_at(log, times),
        is_carried=np.diff(rows["floor"].to_numpy()[held]) != 0 if "floor" in rows else None,
        v_mps=rows["command_v_mps"].to_numpy()[held],
        w_radps=rows["command_w_radps"].to_numpy()[held],
        obstacle_corner_distance_m=rows["obstacle_corner_distance_m"].to_numpy()[held],
    )


def max_velocity_of(log: TrialLog) -> float:
    """Returns the robot's highest forward velocity, m/s."""
    return float(log.info["robot"]["drive"]["max_linear_velocity_mps"])


@metric(unit="%", better="higher", title="Success rate")
def success_rate(log: TrialLog) -> float:
    """Share of the trials that reached the goal: of one trial, 100 or 0.

    Formula: succeeded trials / trials.
    """
    return PERCENT if log.outcome is Outcome.SUCCEEDED else 0.0


@metric(unit="m/s", better="higher", title="Average commanded speed")
def avg_linear_speed(log: TrialLog) -> float:
    """Mean of the commanded forward velocity.

    Formula: mean(v).
    """
    return published_samples(log).v_mps.mean()


@metric(unit="m", better="lower", title="Path length")
def path_length(log: TrialLog) -> float:
    """Driven length.

    Formula: sum of the distances between consecutive samples.
    """
    return float(_steps_m(published_samples(log)).sum())


@metric(unit="s", better="lower", title="Time taken")
def time_taken(log: TrialLog) -> float:
    """Duration of the task.

    Formula: T = time of the last sample - time of the first.
    """
    return published_samples(log).duration_s


@metric(unit="m", better="higher", title="Smallest distance to an obstacle cell")
def min_obstacle_distance(log: TrialLog) -> float:
    """Smallest distance from the reference point to a lethal cell of the local costmap.

    Formula: minimum over the published samples of the distance to origin + resolution (i, j) of a
    lethal cell of column i and row j, its lower left corner. Ignores the footprint, and is a cell's
    edge longer behind the robot than ahead.
    """
    return _seen_distances_m(log).min()


@metric(unit="m", better="neither", title="Spread of the distance to obstacles")
def std_obstacle_distance(log: TrialLog) -> float:
    """Spread of the distance from the reference point to the nearest lethal cell.

    Formula: standard deviation (divisor n) of the distance of min_obstacle_distance over the
    samples that see an obstacle.
    """
    return _seen_distances_m(log).std()


@metric(unit="m/s^3", better="lower", title="Commanded jerk, r.m.s.")
def rms_linear_jerk(log: TrialLog) -> float:
    """Root mean square of the second difference of the commanded forward velocity.

    Formula: sqrt(mean(j^2)), j = diff(a)/dt, a = diff(v)/dt, dt = T/n. Grows as the sampling period
    shrinks: comparable at the published 0.115 s only.
    """
    samples = published_samples(log)
    jerk = np.diff(samples.v_mps, n=2)
    if len(jerk) == 0:
        raise Undefined("fewer than 3 published samples")
    return float(np.sqrt(np.mean(jerk**2)) / samples.step_s**2)


@metric(unit="m/s^2", better="lower", title="Largest commanded centripetal acceleration")
def max_centripetal_acceleration(log: TrialLog) -> float:
    """Largest centripetal acceleration of the commands.

    Formula: maximum of v^2/r, r = v/|w|, where |w| > 0.01 rad/s and r > 0.01 m; else 0.
    """
    samples = published_samples(log)
    turning = np.abs(samples.w_radps) > MIN_YAW_RATE_RADPS
    radius = samples.v_mps[turning] / np.abs(samples.w_radps[turning])
    counted = radius > MIN_RADIUS_M
    accelerations = samples.v_mps[turning][counted] ** 2 / radius[counted]
    return float(accelerations.max(initial=0.0))


@metric(unit="% of v max", better="higher", title="Highest commanded velocity")
def max_velocity(log: TrialLog) -> float:
    """Highest commanded forward velocity as a share of the robot's highest (published: 0.5 m/s).

    Formula: 100 max(v) / v max.
    """
    return PERCENT * published_samples(log).v_mps.max() / max_velocity_of(log)


@metric(unit="m", better="lower", title="Largest path error")
def max_path_error(log: TrialLog) -> float:
    """Largest distance from a plan pose to the nearest driven pose.

    Formula: maximum, over the poses of the first plan but the last 4, of the distance to the
    nearest sample. A trial that gives up early gets the length of the plan that it did not drive.
    """
    return _path_errors_m(log).max()


@metric(unit="m", better="lower", title="Smallest path error")
def min_path_error(log: TrialLog) -> float:
    """Smallest distance from a plan pose to the nearest driven pose.

    Formula: minimum of the distances of max_path_error.
    """
    return _path_errors_m(log).min()


@metric(unit="m", better="lower", title="Average path error")
def avg_path_error(log: TrialLog) -> float:
    """Mean distance from a plan pose to the nearest driven pose.

    Formula: mean of the distances of max_path_error. A perfectly driven line gives a quarter of the
    distance between two samples.
    """
    return _path_errors_m(log).mean()


@metric(unit="deg", better="lower", title="Average heading error")
def avg_heading_error(log: TrialLog) -> float:
    """Mean difference of the absolute headings of plan and robot.

    Formula: mean, over the poses of the first plan, of | |yaw robot| - |yaw plan| | at the nearest
    sample. Ignores the sign of a heading. Of several equally near samples, as of a robot that turns
    in place, the first counts. Its "std" is over the trials.
    """
    return _heading_error_deg(log, takes_last=False)


@metric(unit="deg", better="neither", title="Average heading error, last of equally near samples")
def avg_heading_error_last(log: TrialLog) -> float:
    """`avg_heading_error` with the other rule for equally near samples.

    Formula: as `avg_heading_error`, but the last of several equally near samples counts.
    """
    return _heading_error_deg(log, takes_last=True)


@metric(unit="m^2/s", better="lower", title="Energy as published")
def energy(log: TrialLog) -> float:
    """The publication's "energy" (printed in J): integral of the squared speed.

    Formula: sum of (dx^2 + dy^2)/dt over consecutive samples with dt = T/n.
    """
    samples = published_samples(log)
    if len(samples.time_s) < 2:
        raise Undefined("fewer than 2 published samples")
    return float((_steps_m(samples) ** 2).sum() / samples.step_s)


@metric(unit="s", better="lower", title="Time to give up")
def abort_time(log: TrialLog) -> float:
    """Time from the slowest sample of a failed trial to its end.

    Formula: time of the last sample - time of the first one with the trial's lowest v; 0 where that
    v is not below v max, no value where only the last sample has it.
    """
    if log.outcome is Outcome.SUCCEEDED:
        raise Undefined("the trial reached its goal")
    samples = published_samples(log)
    if samples.v_mps.min() >= max_velocity_of(log):
        return 0.0
    slowest = int(samples.v_mps.argmin())
    if slowest == len(samples.v_mps) - 1:
        raise Undefined("the robot is slowest in the last published sample, at the end itself")
    return float(samples.time_s[-1] - samples.time_s[slowest])


@metric(unit="rad/s", better="neither", title="Highest commanded yaw rate")
def max_yaw_rate(log: TrialLog) -> float:
    """Highest commanded yaw rate; the publication gives it in its text, not in its tables.

    Formula: max |w|.
    """
    return float(np.abs(published_samples(log).w_radps).max())


# The metrics of the publication's tables, in their order; std_heading_error is a spread over
# trials, see tables.py.
PUBLISHED_METRICS: tuple[Metric, ...] = (
    success_rate,
    avg_linear_speed,
    path_length,
    time_taken,
    min_obstacle_distance,
    std_obstacle_distance,
    rms_linear_jerk,
    max_centripetal_acceleration,
    max_velocity,
    max_path_error,
    min_path_error,
    avg_path_error,
    avg_heading_error,
    energy,
    abort_time,
)


def published_metrics(log: TrialLog) -> dict[str, float]:
    """Returns the published metrics of a trial by name, NaN where one is undefined."""
    return {entry.name: entry.measure(log).value for entry in PUBLISHED_METRICS}


def _steps_m(samples: PublishedSamples) -> Array:
    steps = np.hypot(*np.diff(samples.pose[:, :2], axis=0).T)
    return steps if samples.is_carried is None else np.where(samples.is_carried, 0.0, steps)


def _distances_m(plan: Array, pose: Array) -> Iterator[Array]:
    """Yields the (B, N) distances between plan poses and driven poses, B plan poses at a time.

    All of a plan of 200 m and a trial of 20 min at once would take 1 GB.
    """
    for begin in range(0, len(plan), PLAN_POSES_AT_ONCE):
        some = plan[begin : begin + PLAN_POSES_AT_ONCE, None, :2]
        yield np.hypot(*(some - pose[None, :, :2]).transpose(2, 0, 1))


def _heading_error_deg(log: TrialLog, *, takes_last: bool) -> float:
    samples, plan = published_samples(log), log.course
    if len(plan) == 0:
        raise Undefined("there is no plan")
    last = len(samples.pose) - 1
    nearest = np.concatenate(
        [
            last - distances[:, ::-1].argmin(axis=1) if takes_last else distances.argmin(axis=1)
            for distances in _distances_m(plan, samples.pose)
        ]
    )
    robot_yaw = np.abs([wrap(yaw) for yaw in samples.pose[nearest, 2]])
    plan_yaw = np.abs([wrap(yaw) for yaw in plan[:, 2]])
    return float(np.degrees(np.abs(robot_yaw - plan_yaw).mean()))


def _path_errors_m(log: TrialLog) -> Array:
    whole = log.course
    plan = whole[:-DROPPED_PLAN_POSES]
    if len(plan) == 0:
        raise Undefined(f"the plan has {len(whole)} poses; the last 4 are not looked at")
    driven = published_samples(log).pose
    return np.concatenate([distances.min(axis=1) for distances in _distances_m(plan, driven)])


def _seen_distances_m(log: TrialLog) -> Array:
    require(log, "obstacle_corner_distance_m")
    distances = published_samples(log).obstacle_corner_distance_m
    seen = distances[np.isfinite(distances)]
    if len(seen) == 0:
        raise Undefined("no obstacle came into the local costmap")
    return seen
