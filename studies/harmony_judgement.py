"""The judgement of harmony's comparison, from rows of trials. See harmony_comparison.md.

A row has scenario, family, seed, controller, outcome and the columns of `MEASURES`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from drake_navbench.analysis.pairs import holm
from drake_navbench.analysis.statistics import CONFIDENCE, Interval, exact_share_interval
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.text_tables import markdown_table

OURS = "harmony"
# Scenarios in which giving up is what is expected.
CLOSED = (
    "restricted_small",
    "restricted_large",
    "restricted_small_noisy",
    "restricted_large_noisy",
)
# Fewer units that differ by chance decide nothing. A rival that arrives in a smaller share of the
# units is compared in success alone.
LEAST_UNITS, LEAST_ARRIVALS = 6, 0.5
# Sums of equal numbers differ beyond these decimals from one computer to the other.
EQUAL_DECIMALS = 9
# A share of units in which ours may fail where the rival does not, in a family and pooled.
SUCCESS_MARGIN, POOLED_SUCCESS_MARGIN = 0.10, 0.02


class Measure(NamedTuple):
    """A column that is compared where both arrived. sign: 1 where less is better.

    absolute, ratio: how much worse is allowed, the larger of so much and of this part of the
    rival's mean; both 0 where nothing is claimed but to be better.
    """

    column: str
    sign: float
    absolute: float = 0.0
    ratio: float = 0.0

    def margin(self, rivals_mean: float) -> float:
        """Returns the margin by which ours may be worse."""
        return max(self.absolute, self.ratio * abs(rivals_mean))


MEASURES = {
    "time": Measure("time_to_goal_s", 1.0, ratio=0.05),
    "path error": Measure("cross_track_error_mean_m", 1.0, absolute=0.015, ratio=0.2),
    "jerk": Measure("jerk_rms_mps3", 1.0, ratio=0.1),
    "clearance": Measure("min_clearance_m", -1.0),
    "lateral acceleration": Measure("lateral_acceleration_max_mps2", 1.0),
}
ABORT_TIME = Measure("simulated_time_s", 1.0, absolute=0.2)
# The metrics in which harmony is claimed to be better, corrected over all in all families.
SUPERIOR = ("clearance", "jerk", "lateral acceleration")


class Difference(NamedTuple):
    """Ours minus a rival's over units; positive is worse. upper: one-sided, at 95%.

    Of a scenario without chance, upper is the difference itself and p_value is 0 or 1.
    """

    units: int
    ours: float
    rival: float
    worse_by: float
    upper: float
    p_value: float


def wide(rows: pd.DataFrame) -> pd.DataFrame:
    """Returns a row a trial, by family, scenario and seed; columns are (value, controller)."""
    columns = ["outcome", *(m.column for m in (*MEASURES.values(), ABORT_TIME))]
    return rows.pivot(index=["family", "scenario", "seed"], columns="controller", values=columns)


def units_of(trials: pd.DataFrame, *controllers: str) -> pd.DataFrame:
    """Returns the trials that are no repetition: each counts once that these controllers drove so.

    Where nothing is by chance, all trials of a scenario are equal in EQUAL_DECIMALS.
    """
    known = trials.dropna(subset=[("outcome", name) for name in controllers])
    own = known.loc[:, known.columns.isin(controllers, level="controller")]
    own = own.infer_objects().round(EQUAL_DECIMALS)
    is_repeated = own.reset_index("seed", drop=True).reset_index().duplicated()
    return known[~is_repeated.to_numpy()]


def succeeded(units: pd.DataFrame, controller: str) -> NDArray[np.bool_]:
    """Returns (U,) whether a controller did what is expected of it."""
    is_closed = units.index.get_level_values("scenario").isin(CLOSED)
    wanted = np.where(is_closed, str(Outcome.ABORTED), str(Outcome.SUCCEEDED))
    return np.asarray(units["outcome", controller].astype(str) == wanted)


def share_bound(count: int, of: int) -> float:
    """Returns the exact upper bound of a share at 95% (Clopper, Pearson): 9.5% for 0 of 30."""
    return exact_share_interval(count, of, confidence=2.0 * CONFIDENCE - 1.0).high


def success_lost(trials: pd.DataFrame, rival: str) -> tuple[int, int, Interval]:
    """Returns in how many units ours failed where the rival did not, of how many, and the limits.

    Where nothing is by chance, all trials are one unit, and what it tells is exact.
    """
    units = units_of(trials, OURS, rival)
    lost, count = int((~succeeded(units, OURS) & succeeded(units, rival)).sum()), len(units)
    if count == 1 < len(trials):
        return lost, count, Interval(lost, lost)
    return lost, count, exact_share_interval(lost, count, confidence=2.0 * CONFIDENCE - 1.0)


def difference(trials: pd.DataFrame, measure: Measure, rival: str) -> Difference | None:
    """Returns ours against theirs over units where both succeeded; None where these are too few.

    Who never moved did not arrive: such a trial has no clearance, path error or acceleration.
    """
    units = units_of(trials, OURS, rival)
    if units.empty or succeeded(units, rival).mean() < LEAST_ARRIVALS:
        return None
    both = succeeded(units, OURS) & succeeded(units, rival)
    pairs = units.loc[both, measure.column][[OURS, rival]].astype(float).dropna()
    if pairs.empty:
        return None
    worse = (measure.sign * (pairs[OURS] - pairs[rival])).to_numpy()
    mean = upper = float(worse.mean())
    p_value = float(mean >= 0.0)
    is_exact = len(units) == 1 < len(trials)
    if len(worse) < LEAST_UNITS and not is_exact:
        upper, p_value = np.inf, 1.0
    elif not is_exact:
        error = max(float(worse.std(ddof=1)), 1e-12) / np.sqrt(len(worse))
        upper = mean + float(stats.t.ppf(CONFIDENCE, len(worse) - 1)) * error
        p_value = float(stats.t.cdf(mean / error, len(worse) - 1))
    ours, its = (float(pairs[name].mean()) for name in (OURS, rival))
    return Difference(len(worse), ours, its, mean, upper, p_value)


def verdicts(rows: pd.DataFrame, rivals: list[str]) -> pd.DataFrame:
    """Returns a row a family, measure and rival: what is shown of the difference.

    Not inferior to the best means not inferior to each, so that no correction is due; to be better
    is corrected by Holm over the measures of `SUPERIOR`, families and rivals.
    """
    found = []
    for family, trials in wide(rows).groupby(level="family"):
        is_closed = trials.index.get_level_values("scenario").isin(CLOSED).all()
        measures = {"abort time": ABORT_TIME} if is_closed else MEASURES
        for rival in rivals:
            units = units_of(trials, OURS, rival)
            if units.empty:
                continue
            lost, count, limits = success_lost(trials, rival)
            found.append(
                {
                    "family": family,
                    "measure": "success",
                    "rival": rival,
                    "units": count,
                    "ours": float(succeeded(units, OURS).mean()),
                    "its": float(succeeded(units, rival).mean()),
                    "worse by": lost / count,
                    "at least": limits.low,
                    "at most": limits.high,
                    "margin": SUCCESS_MARGIN,
                    "p": np.nan,
                }
            )
            for name, measure in measures.items():
                told = difference(trials, measure, rival)
                if told is not None:
                    found.append(
                        {
                            "family": family,
                            "measure": name,
                            "rival": rival,
                            "units": told.units,
                            "ours": told.ours,
                            "its": told.rival,
                            "worse by": told.worse_by,
                            "at least": 2.0 * told.worse_by - told.upper,
                            "at most": told.upper,
                            "margin": measure.margin(told.rival),
                            "p": told.p_value if name in SUPERIOR else np.nan,
                        }
                    )
    table = pd.DataFrame(found)
    has_margin = ~table["measure"].isin(["clearance", "lateral acceleration"])
    fits = table["at most"] <= table["margin"] + 1e-12
    is_inferior = table["at least"] > table["margin"] + 1e-12
    shown = np.where(fits, "yes", np.where(is_inferior, "inferior", "not shown"))
    table["not inferior"] = np.where(has_margin, shown, "")
    table["better"] = np.where(holm(table["p"].to_numpy()) < 1.0 - CONFIDENCE, "yes", "")
    return table


def losses(table: pd.DataFrame) -> pd.DataFrame:
    """Returns the comparisons that are inferior, then those not shown, against each rival."""
    lost = table[table["not inferior"].isin(["inferior", "not shown"])]
    return lost.drop(columns=["p", "better"]).sort_values(
        ["not inferior", "family", "measure"], kind="stable"
    )


def by_family(table: pd.DataFrame) -> pd.DataFrame:
    """Returns a row a family and measure: against the rival that ours comes off worst by."""
    order = table.assign(over=table["at most"] - table["margin"]).sort_values(["over", "worse by"])
    worst = order.groupby(["family", "measure"], sort=True).tail(1).drop(columns="over")
    worst = worst.sort_values(["family", "measure"])
    all_better = table.groupby(["family", "measure"])["better"].agg(lambda b: (b == "yes").all())
    keys = pd.MultiIndex.from_frame(worst[["family", "measure"]])
    return worst.assign(better=np.where(all_better.reindex(keys).to_numpy(), "yes", ""))


def page_table(rows: pd.DataFrame, rivals: list[str]) -> pd.DataFrame:
    """Returns a row a family: who does what is expected, and each measure, in the page's words.

    A measure stands with the rival that ours comes off worst by; ! marks what is not shown. The
    families with most losses come first.
    """
    trials, table = wide(rows), verdicts(rows, rivals)
    succeed = f"succeed: {OURS}; {', '.join(rivals)}"
    worst = by_family(table).set_index(["family", "measure"])
    found = []
    for family, group in trials.groupby(level="family"):
        counts = [f"{int(succeeded(group, name).sum())}" for name in (OURS, *rivals)]
        line = {"family": f"`{family}`", "units": len(group)}
        line[succeed] = f"{counts[0]}; {', '.join(counts[1:])}"
        for names in (("success",), ("time", "abort time"), ("path error",), ("jerk",)):
            told = [worst.loc[family, name] for name in names if (family, name) in worst.index]
            line[" or ".join(names)] = _words(told[0]) if told else ""
        is_better = [name for name in SUPERIOR if (family, name) in worst.index]
        is_better = [name for name in is_better if worst.loc[(family, name), "better"] == "yes"]
        found.append(line | {"better than each in": ", ".join(is_better)})
    return pd.DataFrame(sorted(found, key=lambda line: -str(line).count("**")))


def _words(told: pd.Series) -> str:
    """Returns a measure of ours beside its worst rival's; of success, the rival alone."""
    mark = {"yes": "", "not shown": " **!**", "inferior": " **inferior**"}[told["not inferior"]]
    if told["margin"] == SUCCESS_MARGIN:
        lost = f"{round(told['worse by'] * told['units'])} lost to `{told['rival']}`"
        return f"at most {100.0 * told['at most']:.1f}%" if not mark else lost + mark
    return f"{told['ours']:.3f}, `{told['rival']}` {told['its']:.3f}{mark}"


def pooled(rows: pd.DataFrame, rivals: list[str]) -> pd.DataFrame:
    """Returns a row a measure and rival over the families that have it, each with equal weight.

    The families are these and no sample of others: the error is that within families.
    """
    trials, found = wide(rows), []
    is_open = ~trials.index.get_level_values("scenario").isin(CLOSED)
    families = [group for _, group in trials[is_open].groupby(level="family")]
    for rival in rivals if families else ():
        counts = [success_lost(group, rival)[:2] for group in families]
        lost, count = (sum(column) for column in zip(*counts, strict=True))
        margin, bound = POOLED_SUCCESS_MARGIN, share_bound(lost, count)
        found.append(["success", rival, len(families), lost / count, bound, margin])
        for name, measure in MEASURES.items():
            told = [d for group in families if (d := difference(group, measure, rival))]
            if told:
                errors = [(d.upper - d.worse_by) ** 2 for d in told]
                mean = float(np.mean([d.worse_by for d in told]))
                upper = mean + float(np.sqrt(np.sum(errors))) / len(told)
                margin = measure.margin(float(np.mean([d.rival for d in told])))
                found.append([name, rival, len(told), mean, upper, margin])
    names = ["measure", "rival", "families", "worse by", "at most", "margin"]
    return pd.DataFrame(found, columns=names)


def touches(rows: pd.DataFrame) -> pd.DataFrame:
    """Returns a row a family and controller: touches, units, and the exact bound of their share."""
    trials, found = wide(rows), []
    for family, group in trials.groupby(level="family"):
        for name in group["outcome"].columns:
            units = units_of(group, name)
            count = int((units["outcome", name].astype(str) == str(Outcome.COLLIDED)).sum())
            bound = float(count) if len(units) == 1 < len(group) else share_bound(count, len(units))
            found.append([family, name, count, len(units), bound])
    return pd.DataFrame(found, columns=["family", "column", "touches", "units", "at most"])


def markdown(table: pd.DataFrame) -> str:
    """Returns a table in Markdown, numbers with three decimals."""
    rows = (
        [f"{value:.3f}" if isinstance(value, float) else str(value) for value in values]
        for values in table.itertuples(index=False)
    )
    return "\n".join(markdown_table(list(map(str, table.columns)), rows))
