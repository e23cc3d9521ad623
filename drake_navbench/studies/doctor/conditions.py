"""Conditions: what the user's robot may have that the one of the probes lacks, one at a time.

They are driven for a complaint that no probe shows. What is then seen holds only if the user's
robot meets the condition, so each tells how to find that out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from drake_navbench.inputs.overrides import merged
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.footprint import pad_footprint
from drake_navbench.studies.doctor.driven_on import with_patience
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.probes import MADE_FOR
from drake_navbench.studies.doctor.symptoms import Symptom

# A wheel stands still below this speed, m/s.
DEADBAND_MPS = 0.05
LAG_S, LATE_S, NOISE_M, NOISE_RAD, SLIP, LARGER_M, TURNED_RAD = (
    0.4,
    0.3,
    0.03,
    0.03,
    0.2,
    0.05,
    1.57,
)
# The periods that a control cycle of a slow computer takes.
LATE_CYCLES = 2.0
# The probes for symptoms for which MADE_FOR has none.
NEAR = ("right_angle", "goal_beside_wall", "box_on_path", "door")
PROBES: Mapping[Symptom, tuple[str, ...]] = {
    **MADE_FOR,
    Symptom.COLLISION: NEAR,
    Symptom.NEAR_MISS: NEAR,
    Symptom.FALSE_ABORT: ("goal_behind", "exact_heading", "door", "dead_end"),
    Symptom.NO_START: ("goal_behind", "beside_obstacle", "dead_end"),
    Symptom.SPINS: ("goal_behind", "exact_heading", "dead_end"),
    Symptom.STOP_START_JERK: ("straight", "bends", "door"),
}


class Condition(NamedTuple):
    """One assumption on the user's robot.

    told: after "only if". measure: how the user finds out. fields: of the robot file. turned_rad:
    by how much the robot is turned at the start.
    """

    name: str
    told: str
    measure: str
    fields: Mapping[str, Any] = {}
    turned_rad: float = 0.0

    def of(self, probe: Scenario) -> Scenario:
        """Returns a probe under this condition, with another name."""
        x_m, y_m, yaw_rad = probe.start
        return probe.model_copy(
            update={
                "name": f"{probe.name}_{self.name}",
                "description": f"{probe.description}, assumed: {self.told}",
                "start": (x_m, y_m, yaw_rad + self.turned_rad),
                "robot_overrides": merged(probe.robot_overrides, self.fields),
            }
        )


def conditions_for(robot: Robot, facts: Facts, known: Mapping[str, Any]) -> list[Condition]:
    """Returns the conditions that a robot can meet, without those of which the truth is known.

    known: fields of the robot file that a recording or a board gave.
    """
    return [
        condition
        for condition in _conditions(robot, facts)
        if not any(
            name in known.get(part, {})
            for part, fields in condition.fields.items()
            if isinstance(fields, Mapping)
            for name in fields
        )
    ]


def _conditions(robot: Robot, facts: Facts) -> Iterator[Condition]:
    if robot.drive.type == "differential":
        yield Condition(
            "deadband",
            f"the wheels stand still below {DEADBAND_MPS:g} m/s",
            "command ever slower drives and turns, and note the last that moves the robot",
            {"actuators": {"deadband_mps": DEADBAND_MPS}},
        )
        yield Condition(
            "slip",
            f"the wheels lose {SLIP:.0%} of their speed by slip",
            "compare the odometry of a straight metre and of a full turn with the floor",
            {"actuators": {"slip": SLIP, "slip_std": SLIP / 2}},
        )
    yield Condition(
        "lag",
        f"the base follows a commanded speed with a time constant of {LAG_S:g} s",
        "record commands and odometry of a step in speed, or give the recording to --bag",
        {"drive": {"response_time_constant_s": LAG_S}},
    )
    yield Condition(
        "late_commands",
        f"commands reach the wheels {LATE_S:g} s late",
        "record commands and odometry of a step in speed, or give the recording to --bag",
        {"timing": {"command_latency_s": LATE_S}},
    )
    yield Condition(
        "late_cycles",
        f"a control cycle takes {LATE_CYCLES:g} periods",
        "read the controller server's log for a missed rate, or use --measure-board",
        {"timing": {"compute_time": round(1000.0 * LATE_CYCLES * facts.period_s, 1)}},
    )
    yield Condition(
        "late_scans",
        f"scans are {LATE_S:g} s old",
        "compare the stamps of scans with the time at which they arrive",
        {"timing": {"scan_latency_s": LATE_S}},
    )
    yield Condition(
        "pose_noise",
        f"the localized pose moves by {100 * NOISE_M:g} cm and {NOISE_RAD:g} rad at random",
        "watch the pose of the standing robot in the map for a minute",
        {"localization": {"period_s": 0.5, "xy_std_m": NOISE_M, "yaw_std_rad": NOISE_RAD}},
    )
    if robot.collision_outline is None:
        outline = pad_footprint(robot.outline, LARGER_M)
        yield Condition(
            "larger",
            f"the robot is {100 * LARGER_M:g} cm larger on each side than the file's outline",
            "measure the robot with all that protrudes, from the centre of base_link",
            {"collision_outline": [[round(float(x), 4), round(float(y), 4)] for x, y in outline]},
        )
    yield Condition(
        "turned",
        "the path begins at a right angle to the robot's heading",
        "see in RViz how the path begins where it happens",
        turned_rad=TURNED_RAD,
    )


def under(
    condition: Condition, symptom: Symptom, probes: Mapping[str, Scenario], facts: Facts
) -> dict[str, Scenario]:
    """Returns the probes made for a symptom under a condition, by name.

    Where a robot that gives up is looked for, they last until its patience ends.
    """
    own = {name: probes[name] for name in PROBES.get(symptom, ()) if name in probes}
    if symptom is Symptom.FALSE_ABORT:
        own = {name: with_patience(probe, facts) for name, probe in own.items()}
    # A robot that is turned may stand in a wall.
    return {
        f"{name}_{condition.name}": condition.of(probe)
        for name, probe in own.items()
        if not (name.endswith("_rough") or (condition.turned_rad and probe.world.obstacles))
    }


def told(conditions: Sequence[Condition]) -> str:
    """Returns the sentences on the conditions under which a complaint is shown."""
    first = conditions[0]
    others = "; or ".join(condition.told for condition in conditions[1:])
    more = f" It is also shown if {others}." if others else ""
    return f"It is shown only if {first.told}, which is assumed: {first.measure}.{more}"
