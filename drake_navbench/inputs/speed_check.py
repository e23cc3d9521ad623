"""Whether a base can drive as fast as a column's parameters ask."""

from __future__ import annotations

from collections.abc import Iterable

from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot

# A smaller excess, as a share, is rounding.
TOLERANCE = 0.01


def asks_for_more(preset: Preset, robot: Robot) -> str:
    """Returns the speeds of a column that the base cannot drive, as text; '' for none."""
    demanded, drive = preset.for_robot(robot).parameters.asked_speeds(), robot.drive
    has = {
        "m/s ahead": (demanded.max_linear_mps, drive.max_linear_velocity_mps),
        "rad/s": (demanded.max_angular_radps, getattr(drive, "max_angular_velocity_radps", None)),
    }
    return " and ".join(
        f"{wanted:g} {unit} of a base that drives {most:g}"
        for unit, (wanted, most) in has.items()
        if wanted is not None and most is not None and wanted > most * (1.0 + TOLERANCE)
    )


def lines_of(columns: Iterable[tuple[Preset, Robot]]) -> list[str]:
    """Returns a line for each column that asks for higher speeds than its base drives."""
    demanded = {preset.name: asks_for_more(preset, robot) for preset, robot in columns}
    return [f"controller {name}: asks {what}" for name, what in demanded.items() if what]
