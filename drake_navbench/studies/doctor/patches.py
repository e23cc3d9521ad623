"""Changes as files: patched texts, and patches whose first lines say how far each is shown."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from drake_navbench.nav2.patch import difference
from drake_navbench.studies.doctor.change_words import change_told
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.labels import cure_label, offer_label, patch_name
from drake_navbench.studies.doctor.visited import Visit

PATCHED, PATCH = "patched.yaml", "change.patch"
WIDTH = 80


def patch_of(patient: Patient, trial: Trial) -> str:
    """Returns the change of the files as a patch that `patch -p0` takes."""
    changed = patient.patched_texts(trial.changes).items()
    return "".join(difference(path.name, patient.texts[path], after) for path, after in changed)


def texts_of_changes(visit: Visit, patient: Patient) -> dict[str, str]:
    """Returns patched files and patches by name: of the cure, and of the changes to try."""
    texts: dict[str, str] = {}
    if visit.cure is not None:
        texts |= _patched(patient, visit.cure.trial, PATCHED)
        texts[PATCH] = _labelled(patient, visit.cure.trial, cure_label(visit.cure))
    for number, offer in enumerate(visit.offers, 1):
        name = patch_name(number)
        texts |= _patched(patient, offer.trial, name.replace(".patch", ".yaml"))
        texts[name] = _labelled(patient, offer.trial, offer_label(offer))
    return texts


def _patched(patient: Patient, trial: Trial, name: str) -> dict[str, str]:
    """Returns the patched files by name: patched.yaml, or patched_NAME of several merged files."""
    texts = patient.patched_texts(trial.changes)
    if len(patient.paths) == 1:
        return {name: "".join(texts.values())}
    return {f"{name.removesuffix('.yaml')}_{path.name}": text for path, text in texts.items()}


def _labelled(patient: Patient, trial: Trial, label: str) -> str:
    """Returns a patch below its label, which `patch` and `git apply` skip."""
    told = (f"drake-navbench doctor: {change_told(trial)}", label)
    lines = (line for part in told for line in textwrap.wrap(part, WIDTH - 2))
    return "".join(f"# {line}\n" for line in lines) + patch_of(patient, trial)


def names_of_changes(patient: Patient, offers: int) -> Iterator[str]:
    """Yields the names that files of changes may have; offers: how many there may be."""
    for name in (PATCHED, *(patch_name(n + 1).replace(".patch", ".yaml") for n in range(offers))):
        yield name
        yield from (f"{name.removesuffix('.yaml')}_{path.name}" for path in patient.paths)
    yield PATCH
    yield from (patch_name(n + 1) for n in range(offers))
