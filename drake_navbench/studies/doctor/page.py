"""The files of a visit: the page, the patched files and the patch."""

from __future__ import annotations

from collections.abc import Sequence, Set
from html import escape
from pathlib import Path

from drake_navbench.errors import writing
from drake_navbench.studies.doctor.before_after import REPLAY, name_of, write_replays
from drake_navbench.studies.doctor.change_words import change_told
from drake_navbench.studies.doctor.driving import Driver
from drake_navbench.studies.doctor.files import Patient, told_files
from drake_navbench.studies.doctor.judged import Judged
from drake_navbench.studies.doctor.labels import HEADING, offer_label, patch_name
from drake_navbench.studies.doctor.next_step import next_step
from drake_navbench.studies.doctor.offers import MOST_OFFERS
from drake_navbench.studies.doctor.patches import names_of_changes, patch_of, texts_of_changes
from drake_navbench.studies.doctor.symptoms import LOOKS_LIKE, Symptom
from drake_navbench.studies.doctor.told import (
    QUESTION,
    told_cures,
    told_no_findings,
    without_repeated_cures,
)
from drake_navbench.studies.doctor.tried import Tried
from drake_navbench.studies.doctor.visited import Visit
from drake_navbench.studies.doctor.words import assumed, evidence, verdict

PAGE = "doctor.html"
STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;"
    "color:#1c1c1c;background:#fff}"
    "h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}h3{font-size:1rem}.verdict{font-size:1.15rem;"
    "border-left:.3rem solid #2b6cb0;padding:.4rem 1rem;background:#f2f6fb}"
    "table{border-collapse:collapse;width:100%}td,th{text-align:left;padding:.3rem .6rem;"
    "border-bottom:1px solid #ddd;vertical-align:top}td.n,th.n{text-align:right}"
    "code,pre{font:14px/1.4 ui-monospace,monospace;overflow-wrap:anywhere}"
    "td{overflow-wrap:anywhere;min-width:4rem}td.name{white-space:nowrap}"
    "iframe{width:100%;height:34rem;border:1px solid #ddd}"
    "pre{background:#f6f6f6;padding:.8rem;white-space:pre-wrap}small{color:#555}"
    "pre del,pre ins{text-decoration:none}del{background:#fbe3e3}ins{background:#dff3e0}"
)


def write_outputs(
    visit: Visit, patient: Patient, folder: Path, driver: Driver | None = None
) -> list[Path]:
    """Writes the page, and patched files, patches and replays of the changes; returns them.

    driver: drives what the replays show; without one there are none. Files of an earlier visit to
    the folder that this one does not write are removed, unless it was interrupted.
    """
    texts = {PAGE: page(visit, patient), **texts_of_changes(visit, patient)}
    written = [_write(folder / name, text) for name, text in texts.items()]
    if visit.seen and driver is not None and not visit.is_interrupted:
        replays = write_replays(patient, visit, driver, folder)
        _write(folder / PAGE, page(visit, patient, replays))
        written += replays
    if not visit.is_interrupted:
        _remove_older(patient, folder, {path.name for path in written})
    return written


def _remove_older(patient: Patient, folder: Path, written: Set[str]) -> None:
    """Removes the files of an earlier visit that would contradict the page of this one."""
    replays = (REPLAY, *map(name_of, Symptom))
    for name in {*names_of_changes(patient, MOST_OFFERS), *replays} - written:
        with writing(folder / name):
            (folder / name).unlink(missing_ok=True)


def _write(path: Path, text: str) -> Path:
    with writing(path):
        path.write_text(text, encoding="utf-8")
    return path


def page(visit: Visit, patient: Patient, replays: Sequence[Path] = ()) -> str:
    """Returns the page: the verdict in plain words, then what it rests on.

    replays: pages beside it that it links: trials with a symptom, and one before and after.
    """
    name = told_files(patient.paths)
    parts = [
        f"<h1>The doctor on {escape(name)}</h1>",
        f'<p class="verdict">{escape(verdict(visit))}</p>',
    ]
    if told := next_step(visit):
        parts.append(f"<p><b>{escape(told)}</b></p>")
    if visit.cure is not None:
        parts += _change(visit.cure, patient)
    parts += _offers(visit, patient)
    names = {path.name for path in replays}
    if REPLAY in names:
        parts.append(_frame(REPLAY, "the trial in which the symptom falls most, before and after"))
    elif visit.treated is not None and name_of(visit.treated) in names:
        told = "the trial of the unchanged file in which the symptom is most severe"
        parts.append(_frame(name_of(visit.treated), told))
    parts += _seen(visit, names)
    parts += _tried(visit)
    if visit.around.recorded:
        lines = "".join(f"<li>{escape(line)}</li>" for line in visit.around.recorded)
        parts.append(f"<h2>What the recording shows</h2><ul>{lines}</ul>")
    parts += _findings(visit)
    parts += _question(visit)
    parts += ["<h2>What was assumed</h2><ul>"]
    parts += [f"<li>{escape(line)}</li>" for line in assumed(visit, patient.robot)]
    parts.append("</ul>")
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f"<title>The doctor on {escape(name)}</title><style>{STYLE}</style></head><body>"
        + "\n".join(parts)
        + "</body></html>\n"
    )


def _frame(name: str, told: str) -> str:
    """Returns a replay within the page."""
    return (
        f'<p><a href="{name}">Open the replay alone</a>: {told}.</p>'
        f'<iframe src="{name}" title="{told}"></iframe>'
    )


def _change(cure: Judged, patient: Patient) -> list[str]:
    suspicion = cure.tried.suspicion
    # A rule's sentence on the file is enough; the suspects' says the same in general.
    count = len(cure.trial.parts) or (1 if suspicion.findings else 2)
    reasons = " ".join(f"{why.rstrip('.')}." for why in suspicion.reasons[:count])
    return [
        "<h2>The change</h2>",
        f"<p><code>{escape(change_told(cure.trial))}</code></p>",
        f"<p>Why: {escape(reasons)} <small>Source: {escape(_source(cure.tried))}</small></p>",
        f"<pre>{_marked(patch_of(patient, cure.trial))}</pre>",
        "<h2>Before and after, on fresh seeds</h2>",
        *_counts(cure),
    ]


def _offers(visit: Visit, patient: Patient) -> list[str]:
    if not visit.offers:
        return []
    parts = [f"<h2>{HEADING}</h2>"]
    for number, offer in enumerate(visit.offers, 1):
        name = patch_name(number)
        told = escape(change_told(offer.trial))
        parts += [
            f'<h3><a href="{name}">{name}</a>: <code>{told}</code></h3>',
            f"<p>{escape(offer_label(offer))} "
            f"<small>Source: {escape(_source(offer.tried))}</small></p>",
            f"<pre>{_marked(patch_of(patient, offer.trial))}</pre>",
        ]
        if offer.judged is not None and offer.judged.before != offer.judged.after:
            parts += _counts(offer.judged)
    return parts


def _counts(judged: Judged) -> list[str]:
    """Returns a table of the symptoms before and after a change."""
    rows = [
        f'<tr><td>{escape(LOOKS_LIKE[Symptom(name)])}</td><td class="n">{judged.before[name]}</td>'
        f'<td class="n">{judged.after[name]}</td></tr>'
        for name in judged.before
        if judged.before[name] or judged.after[name]
    ]
    if not rows:
        return [f"<p>None of {judged.trials} trials shows a symptom, before and after.</p>"]
    return [
        f"<p>Number of trials, of {judged.trials}, in which the robot shows the symptom. A drive "
        "that ends early before the change, by a touch or stuck, may miss what would follow: "
        f"symptoms of the way are counted only in the {judged.compared} other trials.</p>",
        '<table><tr><th>symptom</th><th class="n">before</th><th class="n">after</th></tr>',
        *rows,
        "</table>",
    ]


def _marked(patch: str) -> str:
    """Returns a patch with its removed and its added lines marked."""
    lines = []
    for line in patch.split("\n"):
        tag = {"-": "del", "+": "ins"}.get(line[:1])
        text = escape(line)
        is_name = line.startswith(("---", "+++"))
        lines.append(f"<{tag}>{text}</{tag}>" if tag and not is_name else text)
    return "\n".join(lines)


def _source(entry: Tried) -> str:
    findings = entry.suspicion.findings
    return findings[0].rule.source if findings else entry.suspicion.cause.source


def _tried(visit: Visit) -> list[str]:
    if not visit.tried:
        return []
    rows = []
    for entry in visit.tried:
        what = entry.suspicion.cause.told if entry.trial is None else change_told(entry.trial)
        rows.append(
            f"<tr><td><code>{escape(what)}</code></td><td>{escape(entry.verdict)}</td>"
            f"<td>{escape(evidence(entry))}</td></tr>"
        )
    head = (
        f"<h2>Causes of {escape(str(visit.treated))} that were tried</h2><p>Each change "
        "was driven alone against the unchanged file, on the same probes and seeds. The severity "
        "is the measured number divided by its threshold: above 1 the robot shows the symptom. "
        "The p-values are corrected for the number of changes that were driven.</p>"
    )
    return [
        head,
        "<table><tr><th>change</th><th>verdict</th><th>evidence</th></tr>",
        *rows,
        "</table>",
    ]


def _seen(visit: Visit, replays: Set[str]) -> list[str]:
    if not visit.probes:
        return []
    rows = [
        f'<tr><td class="name">{escape(symptom.value)}</td><td>{escape(LOOKS_LIKE[symptom])}</td>'
        f"<td>{escape('; '.join(visit.probes[name].description for name in names))}</td>"
        f"<td>{_link(name_of(symptom), replays)}</td></tr>"
        for symptom, names in visit.seen.items()
    ]
    if not rows:
        return ["<h2>What the probes show</h2><p>No probe shows a symptom.</p>"]
    enough = "in at least one" if visit.bar == 1.0 else f"at {visit.bar:.0%} of its threshold"
    asked = (
        "" if visit.asked not in visit.seen else f"; {visit.asked}, which was asked for, {enough}"
    )
    return [
        "<h2>What the probes show</h2><p>Symptoms of the unchanged file, in at least half of a "
        f"probe's trials{asked}.</p>",
        "<table><tr><th>class</th><th>the robot</th><th>probes</th><th>replay</th></tr>",
        *rows,
        "</table>",
    ]


def _link(name: str, replays: Set[str]) -> str:
    return f'<a href="{name}">watch</a>' if name in replays else ""


def _question(visit: Visit) -> list[str]:
    if not visit.alike:
        return []
    rows = (
        f'<tr><td class="name"><code>{a.name}</code></td><td>{escape(a.line)}</td></tr>'
        for a in visit.alike
    )
    return ["<h2>The doctor asks back</h2>", f"<p>{QUESTION}</p><table>", *rows, "</table>"]


def _findings(visit: Visit) -> list[str]:
    if not visit.findings:
        return [f"<h2>What the rules find</h2><p>{told_no_findings(visit.facts)}</p>"]
    rows = [
        f"<tr><td>{escape(f.seen)}<br><small>{escape(f.rule.name)}. Source: "
        f"{escape(f.rule.source)}</small></td><td>{escape(told_cures(f, visit.facts))}</td></tr>"
        for f in without_repeated_cures(visit.findings)
    ]
    return [
        "<h2>What the rules find</h2>",
        "<table><tr><th>seen in the file</th><th>cure</th></tr>",
        *rows,
        "</table>",
    ]
