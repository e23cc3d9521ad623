"""The doctor asks back: which known complaints it lists, and what a named one does."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import yaml
from doctor_texts import RPP, RPP_BLOCK, nav2_text

from drake_navbench.commands.doctor import main
from drake_navbench.studies.doctor import alike, complaints
from drake_navbench.studies.doctor.alike import (
    LIKED,
    NEXT_NAMED,
    YOU_NAMED,
    Alike,
    Told,
    causes_liked,
    complaints_named,
    line_of,
)
from drake_navbench.studies.doctor.complaints import known_complaints
from drake_navbench.studies.doctor.page import page
from drake_navbench.studies.doctor.partial_files import facts_of_values
from drake_navbench.studies.doctor.reading import asked_about, suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.visited import Visit


def entry(says: str, *cures: str, **more: object) -> dict[str, object]:
    """A complaint of `no_start` whose cures have the shares 1, 0.5, 0.25."""
    shares = {cure: 0.5**number for number, cure in enumerate(cures)}
    return {"says": says, "symptoms": ["no_start"], "cures": shares, "why": "an example", **more}


VIOLET = entry("violet wheels hum at standstill", "amcl.alpha1 up", "amcl.alpha2 up")
YELLOW = entry("yellow wheels rattle downhill", "amcl.alpha3 up", "amcl.alpha2 up")


@pytest.fixture
def table(tmp_path, monkeypatch) -> Iterator:
    """Lets the table of known complaints have these entries alone; returns their names."""
    folder = tmp_path / "table"
    folder.mkdir()
    cached = (known_complaints, complaints._weights)

    def of(*entries):
        file = {"source": "this test", "complaints": list(entries)}
        (folder / "one.yaml").write_text(yaml.safe_dump(file))
        for function in cached:
            function.cache_clear()
        return [known.name for known in known_complaints()]

    monkeypatch.setattr(complaints, "FOLDER", folder)
    yield of
    for function in cached:
        function.cache_clear()


@pytest.fixture
def facts():
    return facts_of_values("RPP", "jazzy", {})


def asked(facts, words, liked=()):
    told = Told(words, liked)
    found = suspicions_of(facts, Symptom.NO_START, told)
    return asked_about(facts, Symptom.NO_START, told, found)


def test_no_two_known_complaints_have_one_name():
    names = [known.name for known in known_complaints()]
    assert len(set(names)) == len(names) > 1000
    assert {len(name) for name in names} == {5}


def test_a_name_stays_if_other_complaints_come_or_a_cure_changes(table):
    (name,) = table(VIOLET)
    assert name in table(YELLOW, VIOLET | {"cures": {"release upgrade": 1.0}})
    assert name not in table(VIOLET | {"says": "violet wheels hum when they stand"})


def test_of_two_complaints_with_the_same_likeliest_cure_the_more_alike_is_listed(table, facts):
    green = entry("green wheels whistle uphill", "amcl.alpha1 up")
    violet, _, yellow = table(VIOLET, green, YELLOW)
    assert {found.name for found in asked(facts, "violet hum")} == {violet, yellow}


def test_of_two_complaints_that_read_the_same_the_likelier_is_listed(table, facts):
    same = entry("violet wheels hum at each standstill", "amcl.alpha4 up")
    table(VIOLET, YELLOW)
    assert len(asked(facts, "violet")) == 2
    table(VIOLET, same, YELLOW)
    assert len(asked(facts, "violet")) == 2


def test_the_list_is_no_longer_than_is_read(table, facts):
    words = ("violet", "yellow", "green", "brown", "white", "black", "amber")
    table(*(entry(f"{w} wheels of a kind", f"amcl.alpha{n} up") for n, w in enumerate(words, 1)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(alike, "MOST_ASKED", 3)
        assert len(asked(facts, "violet")) == 3


def test_a_complaint_of_another_controller_or_of_another_symptom_is_not_listed(table, facts):
    other = YELLOW | {"controllers": ["mppi"]}
    spins = entry("green wheels whistle uphill", "amcl.alpha4 up", symptoms=["spins"])
    violet, _, _ = table(VIOLET, other, spins)
    assert [found.name for found in asked(facts, "violet")] == [violet]


@pytest.mark.parametrize("words", ["", "no_start", "No start"])
def test_without_words_nothing_is_asked(table, facts, words):
    table(VIOLET)
    assert asked(facts, words) == []


def test_a_line_has_the_phrases_that_fit_into_two_lines():
    assert line_of(f"first; second; {'x' * 130}; fourth") == "first; second"


def test_the_cures_of_a_named_complaint_come_first_with_the_reason(table, facts):
    _, yellow = table(VIOLET, YELLOW)
    liked = complaints_named([yellow], facts)
    before = suspicions_of(facts, Symptom.NO_START, Told("violet hum"))
    after = suspicions_of(facts, Symptom.NO_START, Told("violet hum", liked))
    assert before[0].cause.place != "amcl.alpha3"
    assert (after[0].cause.place, after[0].reasons[0]) == ("amcl.alpha3", YOU_NAMED)
    # It had its own score, and has 1.1 times that of the likeliest cause more.
    own = {s.cause.place: s.score for s in before}
    assert after[0].score == pytest.approx(own.get("amcl.alpha3", 0.0) + LIKED * before[0].score)
    assert asked(facts, "violet hum", liked) == []


def test_the_second_complaint_that_is_named_counts_half(table, facts):
    violet, yellow = table(VIOLET, YELLOW)
    weights = {
        c.place: w for w, c in causes_liked(facts, complaints_named([yellow, violet], facts))
    }
    assert weights == {"amcl.alpha3": 1.0, "amcl.alpha1": NEXT_NAMED, "amcl.alpha2": 0.5}


def test_a_cure_that_the_release_does_not_know_leaves_the_weight_to_the_next(table):
    stamped = "controller_server.enable_stamped_cmd_vel =true"
    (name,) = table(entry("violet wheels hum at standstill", stamped, "amcl.alpha2 up"))
    humble = facts_of_values("RPP", "humble", {})
    liked = complaints_named([name], humble)
    assert [(w, c.place) for w, c in causes_liked(humble, liked)] == [(1.0, "amcl.alpha2")]


@pytest.fixture
def doctor(tmp_path, capsys):
    """A function that runs the command on a file of RPP; returns exit status and what it prints."""
    path = tmp_path / "nav2.yaml"
    noise = {f"alpha{number}": 0.2 for number in range(1, 6)}
    path.write_text(nav2_text(RPP_BLOCK, plugin=RPP, amcl=noise))

    def run(*options):
        status = main([str(path), "--read-only", *options])
        printed = capsys.readouterr()
        return status, printed.out, printed.err

    return run


WORDS = ("--symptom", "no_start", "--told", "violet wheels hum")


def test_the_command_lists_complaints_in_80_columns_and_takes_a_name(doctor, table):
    long = entry(f"green wheels {'whistle ' * 15}uphill", "amcl.alpha5 up")
    names = table(VIOLET, YELLOW, long)
    status, printed, _ = doctor(*WORDS)
    _, question, listed = printed.partition("Which of these is most like yours?")
    assert (status, bool(question)) == (0, True)
    assert max(map(len, printed.splitlines())) <= 80
    assert all(f"  {name}  " in listed for name in names)
    # The cure of "yellow" is not the first cause, but with its name it is.
    status, printed, _ = doctor(*WORDS, "--like", names[1])
    causes = printed[printed.index("What may cause") :].splitlines()
    assert (status, causes[1].strip()[:21]) == (0, "1. raise amcl.alpha3,")
    assert causes[2].strip() == YOU_NAMED
    assert "Which of these" not in printed


def test_the_page_asks_the_same(facts, patient):
    found = Visit(facts, alike=[Alike("abcde", "speed < 1 m/s")])
    assert "<code>abcde</code></td><td>speed &lt; 1 m/s</td>" in page(found, patient)
    assert "asks back" not in page(Visit(facts), patient)


def test_what_like_cannot_take_is_one_line(doctor, table):
    violet, of_mppi = table(VIOLET, YELLOW | {"controllers": ["mppi"]})
    wrong = {
        "goes with --symptom and words of yours": ("--like", violet),
        "expected --told TEXT as well": (*WORDS[:2], "--like", violet),
        "no known complaint has this name": (*WORDS, "--like", "00000"),
        "none of its cures is possible with this controller": (*WORDS, "--like", of_mppi),
    }
    for told, options in wrong.items():
        status, _, error = doctor(*options)
        assert (status, error.count("\n")) == (2, 1)
        assert told in error
