"""Changes of a file in words, for terminal, page and patch."""

from __future__ import annotations

from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor.causes import with_short_outlines
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.tried import Tried


def cause_told(entry: Tried) -> str:
    """Returns the change of an entry, or the instruction of its cause where there is none."""
    return change_told(entry.trial) if entry.trial is not None else entry.suspicion.cause.told


def change_told(trial: Trial) -> str:
    """Returns a change as `name = value`, with the node of all but the controller server.

    Of a critic or a layer that is added, the instruction alone.
    """
    if trial.parts:
        return "; ".join(map(change_told, trial.parts))
    if trial.is_new_plugin:
        return trial.cause.told
    told = (f"{name_of_place(place)} = {_plain(value)}" for place, value in trial.changes.items())
    return with_short_outlines(" and ".join(told))


def name_of_place(place: Place) -> str:
    """Returns a place with its node, unless that is the controller server."""
    node = place.node.rpartition("/")[2]
    return place.name if node == SERVER else f"{node}: {place.name}"


def _plain(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(map(_plain, value))}]"
    return str(value)
