"""Suggests a change of a Nav2 file for a symptom: `drake-navbench doctor FILE`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drake_navbench.commands.command_line import (
    EXIT_DONE,
    EXIT_INTERRUPTED,
    command,
    print_text,
)
from drake_navbench.commands.doctor_options import (
    LENT_ROBOT,
    build_parser,
    option_of,
    require_options_that_are_used,
)
from drake_navbench.errors import InputError, writing

if TYPE_CHECKING:
    from drake_navbench.studies.doctor.alike import Told
    from drake_navbench.studies.doctor.bag import BagReport
    from drake_navbench.studies.doctor.cures import Trial
    from drake_navbench.studies.doctor.files import Patient
    from drake_navbench.studies.doctor.surroundings import Surroundings
    from drake_navbench.studies.doctor.symptoms import Symptom


def _doctor(arguments: argparse.Namespace) -> int:
    require_options_that_are_used(arguments)
    if arguments.score is not None:
        _score(arguments)
        return EXIT_DONE
    for name in ("case_files", "page"):
        if getattr(arguments, name) is not None:
            raise InputError(f"{option_of(name)}: goes with --score")
    if arguments.log is not None:
        _look_at_log(arguments)
        return EXIT_DONE
    if arguments.package is not None:
        return _look_into_package(arguments)
    if arguments.pick:
        raise InputError(f"--pick {arguments.pick[0]}: expected --package as well")
    return _look_at_files(arguments)


def _look_into_package(arguments: argparse.Namespace) -> int:
    """Looks at the Nav2 file of a repository; an error about it says how to go on."""
    from drake_navbench.campaign.package_arguments import advising_on_found_files

    arguments = _with_package(arguments)
    if arguments.read_only:
        return _look_at_files(arguments)
    alone, other = "--read-only reads what it can of it", ", --pick nav2=N another of the list"
    with advising_on_found_files(arguments, alone, other):
        return _look_at_files(arguments)


def _look_at_files(arguments: argparse.Namespace) -> int:
    from drake_navbench.studies.doctor.proposals import read_proposals
    from drake_navbench.studies.doctor.told import told_of_lent_robot, wrapped

    if not arguments.files:
        raise InputError("doctor: expected a Nav2 file, --package, --log or --score")
    for file in arguments.files:
        if " " in str(file) and not file.exists():
            raise InputError(f"{file}: no such file; a complaint in words goes with --symptom")
    is_lent = arguments.robot is None
    arguments.robot = arguments.robot or LENT_ROBOT
    if arguments.measure_board is not None:
        _measure_board(arguments)
        return EXIT_DONE
    if (arguments.map is None) != (not arguments.goals):
        raise InputError("--map: expected --goals with it, and --goals only with --map")
    if not arguments.read_only and arguments.out is None:
        raise InputError("--out: missing; expected a folder for page, patch and journal, "
                         "or --read-only")  # fmt: skip
    _require_readable_files(arguments)
    patient, symptom = _patient(arguments), _symptom(arguments)
    report = _examine_bag(arguments)
    if symptom is None and report is not None:
        symptom = report.weightiest
    proposed = read_proposals(arguments.proposals, patient)
    told = _told(arguments, symptom, patient)
    _read(patient, symptom, told)
    if arguments.read_only:
        return EXIT_DONE
    if is_lent:
        print_text("\n".join(wrapped(told_of_lent_robot(arguments.robot), rest="  ")) + "\n")
    return _visit(patient, symptom, told, arguments, report=report, proposed=proposed)


def _with_package(arguments: argparse.Namespace) -> argparse.Namespace:
    """Returns the arguments, completed from a robot's repository; prints the files found there."""
    from drake_navbench.studies.doctor.package import with_package

    arguments, lines = with_package(arguments)
    print_text("\n".join([*lines, ""]) + "\n")
    return arguments


def _require_readable_files(arguments: argparse.Namespace) -> None:
    """Raises InputError where map, goals or board's file is wrong, before anything long begins."""
    if arguments.map is not None:
        from drake_navbench.studies.doctor.surroundings import load_map

        load_map(arguments.map)
    if isinstance(arguments.goals, Path):
        from drake_navbench.inputs.goal_file import read_goal_file

        read_goal_file(arguments.goals)
    if arguments.board is not None:
        from drake_navbench.studies.doctor.board import read_times

        read_times(arguments.board)


def _examine_bag(arguments: argparse.Namespace) -> BagReport | None:
    """Prints the symptoms in the user's recording; returns a report on the recording."""
    if arguments.bag is None:
        if arguments.topics:
            raise InputError("--topics: goes with --bag")
        return None
    from drake_navbench.commands.import_bag import topics_of
    from drake_navbench.studies.doctor.bag import report_on
    from drake_navbench.studies.doctor.told import wrapped

    topics = topics_of(arguments.topics)
    report = report_on(arguments.bag, arguments.robot, topics, arguments.packages)
    lines = [*report.lines, *report.remarks]
    print_text("\n".join([*(part for line in lines for part in wrapped(line)), ""]) + "\n")
    return report


def _measure_board(arguments: argparse.Namespace) -> None:
    from drake_navbench.studies.doctor.board import measured_here, write_times
    from drake_navbench.studies.doctor.told import wrapped

    times = measured_here(_patient(arguments))
    write_times(times, arguments.measure_board)
    print_text("\n".join(wrapped(f"{arguments.measure_board}: {times.told}")) + "\n")


def _surroundings(
    patient: Patient, arguments: argparse.Namespace, report: BagReport | None
) -> Surroundings:
    """Returns the map, the base and the computer that probes are driven with; raises InputError."""
    from drake_navbench.inputs.overrides import merged
    from drake_navbench.studies.doctor.board import overrides_of_board
    from drake_navbench.studies.doctor.surroundings import Surroundings

    overrides = dict(report.overrides) if report is not None else {}
    remarks = report.remarks if report is not None else ()
    if arguments.board is not None:
        timing, remark = overrides_of_board(patient, arguments.board, arguments.out)
        overrides, remarks = merged(overrides, timing), (*remarks, remark)
    lines = tuple(report.lines) if report is not None else ()
    return Surroundings(arguments.map, arguments.goals, overrides, remarks, lines)


def _patient(arguments: argparse.Namespace) -> Patient:
    from drake_navbench.campaign.request_arguments import read_assignments
    from drake_navbench.studies.doctor.files import Patient

    return Patient(
        tuple(arguments.files),
        arguments.robot,
        read_assignments(arguments.set),
        arguments.nav2_release,
        arguments.controller or "",
        tuple(arguments.packages),
    )


def _symptom(arguments: argparse.Namespace) -> Symptom | None:
    """Returns the class of `--symptom`; prints the class that was taken for words.

    Words of `--told` alone may be about the robot: their likeliest classes are printed, and treated
    first if the probes show them.
    """
    from drake_navbench.studies.doctor.complaints import symptoms_called, symptoms_told
    from drake_navbench.studies.doctor.told import wrapped

    if arguments.symptom is not None:
        found = symptoms_called(arguments.symptom)
        first = f"Symptom: your words are taken as {found[0]}; the next likeliest classes are"
        line = f"{first} {' and '.join(found[1:3])} (--symptom NAME takes another)."
    else:
        found = symptoms_told(arguments.told)
        line = (
            f"Symptom: none is given. Your words may tell {', '.join(found[:3])}: of what the "
            "probes show, these come first (--symptom NAME takes one)."
        )
    if len(found) > 1:
        print_text("\n".join([*wrapped(line, rest="  "), ""]))
    return found[0] if arguments.symptom is not None else None


def _told(arguments: argparse.Namespace, symptom: Symptom | None, patient: Patient) -> Told:
    """Returns the user's words and the complaint of `--like`; raises InputError."""
    from drake_navbench.studies.doctor.alike import Told, complaints_named

    told = Told(f"{arguments.symptom or ''} {arguments.told}".strip())
    if arguments.like and (symptom is None or not told.has_words):
        raise InputError(
            f"--like {arguments.like[0]}: goes with --symptom and words of yours, for which the "
            "doctor prints the complaints most like them; expected --told TEXT as well"
        )
    return told._replace(liked=complaints_named(arguments.like, patient.facts()))


def _read(patient: Patient, symptom: Symptom | None, told: Told) -> None:
    """Prints the first look: the rules that fire, the symptom's causes, and the question."""
    from drake_navbench.studies.doctor.far_values import FAR
    from drake_navbench.studies.doctor.reading import asked_about, findings_of, suspicions_of
    from drake_navbench.studies.doctor.told import (
        told_of_model,
        told_of_reading,
        told_question,
    )

    facts = patient.facts()
    findings = findings_of(facts)
    suspects = []
    if symptom is not None:
        suspects = suspicions_of(facts, symptom, told)
        known = {finding.rule.name for finding in findings}
        findings += [f for f in findings_of(facts, symptom) if f.rule.name not in known]
        findings.sort(key=lambda finding: finding.rule.name.startswith(FAR))
    lines = told_of_reading(facts, findings, suspects, symptom)
    if symptom is not None:
        lines += told_question(asked_about(facts, symptom, told, suspects))
    print_text("\n".join([*lines, *told_of_model(patient.contradictions())]) + "\n")


def _visit(
    patient: Patient,
    symptom: Symptom | None,
    told: Told,
    arguments: argparse.Namespace,
    *,
    report: BagReport | None,
    proposed: Sequence[Trial],
) -> int:
    """Drives, prints the verdict and writes the page; returns the exit status."""
    from drake_navbench.processes.machine import available_cores
    from drake_navbench.studies.doctor.driving import Driver
    from drake_navbench.studies.doctor.labels import told_of_offers
    from drake_navbench.studies.doctor.next_step import next_step
    from drake_navbench.studies.doctor.page import write_outputs
    from drake_navbench.studies.doctor.told import wrapped
    from drake_navbench.studies.doctor.visit import visit
    from drake_navbench.studies.doctor.words import verdict

    def tell(line: str) -> None:
        indent = line[: len(line) - len(line.lstrip())]
        print_text("\n".join(wrapped(line.strip(), indent)) + "\n")

    with writing(arguments.out):
        arguments.out.mkdir(parents=True, exist_ok=True)
    driver = Driver(
        arguments.out,
        arguments.robot,
        jobs=arguments.jobs or available_cores(),
        budget_s=arguments.budget,
        tell=tell,
    )
    found = visit(
        patient,
        symptom,
        told,
        driver,
        seed=arguments.seed,
        around=_surroundings(patient, arguments, report),
        proposed=proposed,
    )
    lines = ["", *wrapped(verdict(found), rest=""), *told_of_offers(found)]
    if step := next_step(found):
        lines += [*[""] * bool(found.offers), *wrapped(step, rest="")]
    print_text("\n".join([*lines, ""]))
    for path in write_outputs(found, patient, arguments.out, driver):
        print_text(f"{path}\n")
    if found.is_interrupted:
        print("interrupted; the same command goes on", file=sys.stderr)
        return EXIT_INTERRUPTED
    return EXIT_DONE


def _look_at_log(arguments: argparse.Namespace) -> None:
    from drake_navbench.studies.doctor.log_symptoms import told_of_log
    from drake_navbench.studies.doctor.told import wrapped

    if arguments.files:
        raise InputError(
            f"--log {arguments.log}: a log is looked at without a Nav2 file; leave out "
            f"{arguments.files[0]}, or leave out --log to have the file examined"
        )
    lines = [line for told in told_of_log(arguments.log) for line in wrapped(told, "- ")]
    print_text("\n".join(lines) + "\n")


def _score(arguments: argparse.Namespace) -> None:
    from drake_navbench.studies.doctor.known_cases import read_cases, score_case
    from drake_navbench.studies.doctor.score_page import TITLE, score_page
    from drake_navbench.typed_files.output_file import require_replaceable, write_text

    require_replaceable("--page", arguments.page, TITLE)
    if arguments.files:
        raise InputError(
            f"--score: takes the files of its cases from --files; leave out {arguments.files[0]}"
        )
    if arguments.case_files is not None and not arguments.case_files.is_dir():
        raise InputError(f"--files {arguments.case_files}: expected a folder")
    cases = read_cases(arguments.score)
    scored = [score_case(case, arguments.case_files) for case in cases]
    page = score_page(scored, cases)
    if arguments.page is not None:
        write_text(arguments.page, page)
    print_text(page)


main = command(build_parser, _doctor, interrupted="interrupted; the same command goes on")
