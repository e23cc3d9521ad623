"""Changes that the user proposes, such as a forum's advice: tried first, judged like all others."""

from __future__ import annotations

from collections.abc import Sequence

import yaml

from drake_navbench.errors import InputError
from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.patch import SHORT_NODES, Place, place_of
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.typed_files.ros_yaml import RosLoader

OPTION = "--try"


def read_proposals(texts: Sequence[str], patient: Patient) -> list[Trial]:
    """Returns the changes of --try PARAMETER=VALUE; raises InputError where the file refuses one.

    PARAMETER: of the controller server, `FollowPath.lookahead_dist`, or with its node,
    `local_costmap.inflation_layer.inflation_radius`. VALUE: as in the file.
    """
    return [_proposal(text, patient) for text in texts]


def _proposal(text: str, patient: Patient) -> Trial:
    name, equals, value_text = (part.strip() for part in text.partition("="))
    if not (name and equals and value_text):
        raise InputError(f"{OPTION} {text!r}: expected PARAMETER=VALUE")
    try:
        value = yaml.load(value_text, Loader=RosLoader)
        place = _place(name, patient)
        if not patient.patched_texts({place: value}):
            raise InputError("the file has this value already")
        patient.require_read(place, value)
        patient.before_and_after({place: value})
    except yaml.YAMLError as error:
        raise InputError(f"{OPTION} {text!r}: expected a value as in the file") from error
    except InputError as error:
        raise InputError(f"{OPTION} {text!r}: {error}") from error
    return Trial(
        Cause(str(place), Direction.SET, value, "You proposed it.", OPTION), {place: value}
    )


def _place(name: str, patient: Patient) -> Place:
    """Returns the place of a parameter; one without its node is the controller server's."""
    first, dot, _ = name.strip("/").partition(".")
    facts = patient.facts()
    if first in SHORT_NODES or facts.has_node(first):
        return place_of(name)
    if dot and not any(known.startswith(f"{SERVER}.{first}.") for known in facts.raw):
        raise InputError(f"the file has neither a node nor a controller's block {first}")
    return Place(SERVER, name)
