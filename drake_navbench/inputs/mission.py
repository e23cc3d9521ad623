"""The mission of a scenario file: goals on several floors, and lifts from one floor to another."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field, model_validator

from drake_navbench.errors import nearest_name_hint
from drake_navbench.navigation.lift_ride import LiftTimes
from drake_navbench.typed_files.quantities import (
    Pose,
)
from drake_navbench.typed_files.typed_yaml import FrozenModel


class Lift(LiftTimes):
    """A connection between floors that the robot uses: a lift, or a door between two maps."""

    name: str = Field(min_length=1, description="Name of the lift in the mission.")
    stops: dict[str, Pose] = Field(
        min_length=2,
        description="For each floor's name, the pose of the robot in the lift: x [m], y [m], "
        "yaw [rad] on that floor's map.",
    )


class MissionStep(FrozenModel):
    """One leg: a goal on the floor that the robot is on, or a ride to another floor."""

    goal: Pose | None = Field(
        None, description="Goal of the leg: x [m], y [m], yaw [rad] on the floor's map."
    )
    floor: str | None = Field(None, description="Name of the floor that the goal is on.")
    lift: str | None = Field(None, description="Name of the lift to ride.")
    to: str | None = Field(None, description="Name of the floor to ride to.")

    @model_validator(mode="after")
    def _check(self) -> MissionStep:
        given = {
            name for name in ("goal", "floor", "lift", "to") if getattr(self, name) is not None
        }
        if given not in ({"goal", "floor"}, {"lift", "to"}):
            raise ValueError(
                "expected either a goal and its floor, or a lift and the floor it goes to, found "
                f"{', '.join(sorted(given)) or 'neither'}"
            )
        return self


def check_mission(
    floor_names: Sequence[str], lifts: Sequence[Lift], mission: Sequence[MissionStep]
) -> None:
    """Raises ValueError where floors, lifts and mission do not fit one another.

    The robot begins on the first floor.
    """
    if not floor_names:
        part = "mission" if mission else "lifts"
        raise ValueError(f"{part}: expected floors as well, found none")
    if not mission:
        raise ValueError("mission: expected at least one leg, found none")
    _require_different("floors", floor_names)
    _require_different("lifts", [lift.name for lift in lifts])
    for index, lift in enumerate(lifts):
        for stop in lift.stops:
            _require_known(f"lifts[{index}].stops", "floor", stop, floor_names)
    here = floor_names[0]
    for index, step in enumerate(mission):
        here = _floor_after(f"mission[{index}]", step, here, floor_names, lifts)


def end_of(mission: Sequence[MissionStep], lifts: Sequence[Lift]) -> Pose:
    """Returns the end of a mission on its last floor's map: a goal or a lift's stop."""
    last = mission[-1]
    if last.goal is not None:
        return last.goal
    return next(lift for lift in lifts if lift.name == last.lift).stops[str(last.to)]


def _floor_after(
    place: str, step: MissionStep, here: str, floor_names: Sequence[str], lifts: Sequence[Lift]
) -> str:
    """Returns the floor on which a step ends that begins on the floor `here`."""
    if step.floor is not None:
        _require_known(f"{place}.floor", "floor", step.floor, floor_names)
        if step.floor != here:
            raise ValueError(
                f"{place}.floor: expected {here}, where the robot then is, or a lift ride "
                f"before, got {step.floor}"
            )
        return here
    assert step.lift is not None
    assert step.to is not None
    _require_known(f"{place}.lift", "lift", step.lift, [lift.name for lift in lifts])
    _require_known(f"{place}.to", "floor", step.to, floor_names)
    lift = next(lift for lift in lifts if lift.name == step.lift)
    for stop in (here, step.to):
        if stop not in lift.stops:
            raise ValueError(
                f"{place}.lift: {step.lift} stops on {', '.join(lift.stops)}, expected a stop on "
                f"{stop}"
            )
    if step.to == here:
        raise ValueError(f"{place}.to: expected another floor than {here}, where the robot then is")
    return step.to


def _require_different(place: str, names: Sequence[str]) -> None:
    for index, name in enumerate(names):
        if name in names[:index]:
            raise ValueError(f"{place}[{index}].name: {name!r} is given twice, expected once")


def _require_known(place: str, noun: str, name: str, names: Sequence[str]) -> None:
    if name not in names:
        hint = nearest_name_hint(name, names)
        raise ValueError(f"{place}: unknown {noun} {name!r}{hint}")
