"""Which changes the search drives, in which order, and what it finds: numbers one can count."""

from __future__ import annotations

from dataclasses import replace

import pytest
import yaml
from doctor_texts import MPPI, MPPI_BLOCK, RPP, RPP_BLOCK, nav2_text
from fake_drives import CAUSE, PROBES, Counted

from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor import visit as visits
from drake_navbench.studies.doctor.alike import NOTHING_TOLD
from drake_navbench.studies.doctor.candidates import is_below_body
from drake_navbench.studies.doctor.causes import Cause, Direction
from drake_navbench.studies.doctor.change_words import change_told
from drake_navbench.studies.doctor.cures import Trial
from drake_navbench.studies.doctor.differences import ways_back, with_differences
from drake_navbench.studies.doctor.experiment import Experiment
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.proposals import read_proposals
from drake_navbench.studies.doctor.reading import Suspicion, suspicions_of
from drake_navbench.studies.doctor.symptoms import Symptom
from drake_navbench.studies.doctor.tried import Verdict
from drake_navbench.studies.doctor.words import verdict
from drake_navbench.typed_files.dotted_names import flattened


def test_of_changes_that_do_the_same_the_way_back_from_an_abnormal_value_is_named_first(patient):
    # Nav2's progress checker waits 10 s, the file's 20 s.
    facts = patient.facts()
    compensation = Suspicion(Cause("controller.wz_std", Direction.DOWN), 0.9, ())
    patience = Cause("progress_checker.movement_time_allowance", Direction.DOWN)
    suspicions = [compensation, Suspicion(patience, 0.1, ())]
    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), Counted(9.5, 0.0), seed=0
    )
    experiment.run(suspicions, ways_back(suspicions, facts))
    first, second = (e for e in experiment.tried if e.verdict is Verdict.SHOWN)
    assert (first.trial.told, second.suspicion.cause) == (
        "controller_server.progress_checker.movement_time_allowance: 10.0", compensation.cause,
    )  # fmt: skip
    # Nav2's value is driven once, though it is the third step of the suspect as well.
    changes = [dict(entry.trial.changes) for entry in experiment.tried]
    assert len(changes) == len({str(change) for change in changes})


@pytest.mark.parametrize(
    ("after", "told"),
    [
        (0.0, "shown (severity 2.00 -> 0.00 in 12 pairs, corrected p = 0.047)"),
        # A fifth less is no cure; it is driven to the end though others take all away.
        (1.6, "not shown (severity 2.00 -> 1.60 in 12 pairs, corrected p = 0.047)"),
    ],
)
def test_what_the_user_proposes_is_tried_first_and_gets_a_verdict(patient, after, told):
    trials = read_proposals(["FollowPath.CostCritic.consider_footprint=true"], patient)

    class Mixed(Counted):
        def drive(self, preset, probes, trials, *, seed):
            critic = preset.parameters.model_dump()["CostCritic"]
            self.severity = after if critic["consider_footprint"] else 0.0
            return super().drive(preset, probes, trials, seed=seed)

    driver = Mixed(9.5, 0.0)
    found = visits.Visit(
        patient.facts(), asked=Symptom.WOBBLE_STRAIGHT, probes=PROBES, proposed=trials
    )
    found.rows = driver.drive(patient.chosen(patient.columns()), PROBES.values(), 2, seed=0)
    found.seen = {Symptom.WOBBLE_STRAIGHT: list(PROBES)}
    visits._treat(found, patient, NOTHING_TOLD, driver, seed=0)
    assert f"Your proposal, FollowPath.CostCritic.consider_footprint = true: {told}." in verdict(
        found
    )


def test_in_a_file_that_departs_from_nav2_in_many_values_none_is_set_back_first(patient):
    def back(**values):
        patient.paths[0].write_text(nav2_text(MPPI_BLOCK | values, plugin=MPPI))
        facts = replace(patient).facts()
        return {
            s.cause.place.partition(".")[2]: (s.cause.to, s.reasons[0])
            for s in ways_back(with_differences([], facts), facts)
        }

    # The file itself has twice Nav2's patience and 0.3 m in place of 0.5 m of progress. A limit of
    # motion counts from five times on, since robots differ: Nav2 has 1.9 rad/s.
    usual = {"movement_time_allowance", "required_movement_radius"}
    assert set(back()) == set(back(wz_max=0.9)) == usual
    assert back(wz_max=0.3)["wz_max"] == (1.9, "Nav2 or nav2_bringup has 1.9.")
    assert back(wz_max=0.3, gamma=0.15) == {}
    # From 2.5 times on a limit takes a place that no abnormal value needs, but not the speed.
    assert set(back(wz_max=0.6)) == {*usual, "wz_max"}
    assert set(back(wz_max=0.6, gamma=0.15)) == {*usual, "gamma"}
    assert set(back(vx_max=2.0)) == usual


def test_two_values_that_contradict_each_other_count_as_one_abnormal_value(patient):
    def back(**nodes):
        patient.paths[0].write_text(nav2_text(MPPI_BLOCK, plugin=MPPI, **nodes))
        facts = replace(patient).facts()
        return {s.cause.place for s in ways_back(with_differences([], facts), facts)}

    # The checker's two values and this contradiction are three, the most that are set back.
    smoother = {"max_velocity": [0.1, 0.0, 1.9]}
    both = {"controller.vx_max", "velocity_smoother.max_velocity"}
    assert back() | both == back(velocity_smoother=smoother)
    assert len(back()) == 2
    # A fourth abnormal value: half of Nav2's 20 Hz.
    assert back(velocity_smoother=smoother | {"smoothing_frequency": 10.0}) == set()


def _differences_of(tmp_path, block, plugin, **nodes):
    path = tmp_path / "other.yaml"
    path.write_text(nav2_text(block, plugin=plugin, **nodes))
    facts = Patient((path,), "wheelchair", {}, "jazzy").facts()
    return {
        (s.cause.place, s.cause.direction.value): s.cause.to for s in with_differences([], facts)
    }


def test_where_the_file_asks_for_more_speed_than_it_lets_drive_both_are_tried(tmp_path):
    found = _differences_of(
        tmp_path, RPP_BLOCK, RPP, velocity_smoother={"max_velocity": [0.1, 0.0, 1.5]}
    )
    assert found["controller.max_linear_vel", "down"] == 0.1
    assert found["velocity_smoother.max_velocity", "up"] == [0.5, 0.0, 1.5]


def test_a_source_of_which_the_costmaps_know_different_ranges_is_tried_with_both(tmp_path):
    block = yaml.safe_load(nav2_text(RPP_BLOCK, plugin=RPP))["local_costmap"]["local_costmap"]
    layer = block["ros__parameters"]["obstacle_layer"]
    other = {**layer, "scan": {**layer["scan"], "obstacle_max_range": 0.5}}
    path = tmp_path / "both.yaml"
    content = yaml.safe_load(nav2_text(RPP_BLOCK, plugin=RPP))
    content["global_costmap"] = {"global_costmap": {"ros__parameters": {
        "plugins": ["obstacle_layer"], "obstacle_layer": other, "update_frequency": 1.0,
    }}}  # fmt: skip
    content["local_costmap"]["local_costmap"]["ros__parameters"]["update_frequency"] = 5.0
    checker = content["controller_server"]["ros__parameters"]["progress_checker"]
    checker |= {"movement_time_allowance": 10.0, "required_movement_radius": 0.5}
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    facts = Patient((path,), "wheelchair", {}, "jazzy").facts()
    found = {s.cause.place: s.cause.to for s in with_differences([], facts)}
    assert found["local_costmap.obstacle_max_range"] == 0.5
    assert found["global_costmap.obstacle_max_range"] == 3.0
    # 5 and 1 Hz are Nav2's own.
    assert not any(place.endswith("update_frequency") for place in found)
    # 3 m is near Nav2's 2.5 m, 0.5 m is not: it is the likelier slip.
    back = [s.cause.place for s in ways_back(with_differences([], facts), facts)]
    ranges = [place for place in back if place.endswith("max_range")]
    assert ranges == ["global_costmap.obstacle_max_range", "local_costmap.obstacle_max_range"]


def test_an_abnormal_value_that_is_a_suspect_of_the_symptom_is_set_back_first(patient):
    # The file has twice Nav2's patience, 20 s, and 0.3 m of progress in place of 0.5 m.
    facts = patient.facts()
    patience, progress = "movement_time_allowance", "required_movement_radius"

    def order(name, direction):
        suspect = Suspicion(Cause(f"progress_checker.{name}", direction), 0.1, ())
        found = ways_back(with_differences([suspect], facts), facts)
        return [(s.cause.place.rpartition(".")[2], round(s.score, 2)) for s in found]

    # Each has 0.2 for being abnormal; the suspect's 0.1 is added.
    assert order(patience, Direction.DOWN) == [(patience, 0.3), (progress, 0.2)]
    assert order(progress, Direction.UP) == [(progress, 0.3), (patience, 0.2)]


class Interlocked(Counted):
    """A driver whose symptom goes only with the outline looked at and 3000 samples.

    instead: the symptom that comes with it.
    """

    def __init__(self, instead=""):
        super().__init__(9.5, 0.0)
        self.instead = instead

    def drive(self, preset, probes, trials, *, seed):
        values = dict(flattened(preset.parameters.model_dump(mode="json")))
        is_cured = values["CostCritic.consider_footprint"] and values["batch_size"] == 3000
        self.severity = 0.0 if is_cured else 2.0
        rows = super().drive(preset, probes, trials, seed=seed)
        if is_cured and self.instead:
            for row in rows:
                row["severity"][self.instead] = 2.0
        return rows


@pytest.mark.parametrize(("instead", "is_shown"), [("", True), ("door_stop", False)])
def test_of_changes_that_help_only_together_the_fewest_are_shown_unless_they_harm(
    patient, instead, is_shown
):
    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), Interlocked(instead), seed=0
    )
    useless = Cause("controller.PathAlignCritic.cost_weight", Direction.DOWN, 7.0, "useless")
    samples = Cause("controller.batch_size", Direction.UP, 3000, "samples")
    experiment.run([Suspicion(cause, 1.0, (cause.why,)) for cause in (useless, CAUSE, samples)])
    found = experiment.tried[0]
    assert (found.verdict is Verdict.SHOWN) == is_shown
    if not is_shown:
        return
    assert [part.cause.place for part in found.trial.parts] == [
        "controller.CostCritic.consider_footprint", "controller.batch_size",
    ]  # fmt: skip
    assert found.suspicion.reasons == ("why", "samples")
    assert change_told(found.trial) == (
        "FollowPath.CostCritic.consider_footprint = true; FollowPath.batch_size = 3000"
    )
    # Both are causes; the patch has both.
    assert [cause.why for cause in found.causes] == ["why", "samples"]


def test_a_likely_change_that_does_harm_hides_no_set_of_changes_behind_it(patient):
    class Spoilt(Interlocked):
        def drive(self, preset, probes, trials, *, seed):
            rows = super().drive(preset, probes, trials, seed=seed)
            if preset.parameters.model_dump()["PathAlignCritic"]["cost_weight"] == 7.0:
                rows = [row | {"severity": {"wobble_straight": 2.0}} for row in rows]
            return rows

    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), Spoilt(), seed=0
    )
    harmful = Cause("controller.PathAlignCritic.cost_weight", Direction.DOWN, 7.0, "harmful")
    samples = Cause("controller.batch_size", Direction.UP, 3000, "samples")
    experiment.run([Suspicion(cause, 1.0, (cause.why,)) for cause in (harmful, CAUSE, samples)])
    found = experiment.tried[0]
    assert found.verdict is Verdict.SHOWN
    assert [part.cause.why for part in found.trial.parts] == ["why", "samples"]


def test_the_time_that_is_left_goes_to_the_likeliest_changes(patient):
    class Short(Counted):
        def drive_together(self, presets, probes, trials, *, seed):
            return super().drive_together(presets[:3], probes, trials, seed=seed)

    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Short(9.5, 0.0), seed=0,
    )  # fmt: skip
    suspicions = suspicions_of(patient.facts(), Symptom.WOBBLE_STRAIGHT)
    experiment.run(suspicions)
    found = experiment.tried
    # The file as it is and two changes, one trial each: too little to show anything.
    assert experiment.is_out_of_time
    assert [entry.pairs for entry in found if entry.pairs] == [1, 1]
    assert {entry.verdict for entry in found if entry.pairs} == {Verdict.NOT_SHOWN}


def test_without_time_for_a_trial_nothing_is_said_to_be_tried(patient):
    class Late(Counted):
        left_s = 1.5

        def tell(self, line):
            raise AssertionError(line)

    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Late(9.5, 0.0), seed=0,
    )  # fmt: skip
    experiment.run(suspicions_of(patient.facts(), Symptom.WOBBLE_STRAIGHT))
    # One trial of the file as it is and one of a change take 2 s.
    assert experiment.is_out_of_time
    assert not [entry for entry in experiment.tried if entry.pairs]


def test_flags_without_effect_here_and_nodes_that_the_file_lacks_are_not_driven(patient):
    patient.paths[0].write_text(nav2_text(MPPI_BLOCK | {"visualize": True}, plugin=MPPI))
    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()),
        Counted(9.5, 0.0), seed=0,
    )  # fmt: skip
    flag = Cause("controller.visualize", Direction.SET, False)
    (told,) = experiment.candidates.of(Suspicion(flag, 1.0, ()))[1]
    assert told.reason == "no trial depends on it"
    # The file has no smoother server.
    weight = Cause("smoother.w_smooth", Direction.UP)
    assert experiment.candidates.of(Suspicion(weight, 1.0, ())) == ([], [])


@pytest.mark.parametrize("symptom", [Symptom.TOO_SLOW, Symptom.WOBBLE_STRAIGHT])
def test_a_lower_speed_limit_is_no_cure_of_a_robot_that_is_too_slow(patient, symptom):
    """The symptom is a share of the speed that the file asks for: asking for less hides it."""
    probes = list(PROBES.values())
    experiment = Experiment(patient, symptom, probes, Counted(9.5, 0.0), seed=0)
    less = Suspicion(Cause("controller.vx_max", Direction.DOWN, 0.3), 1.0, ())
    driven, told = experiment.candidates.of(less)
    assert bool(driven) is (symptom is Symptom.WOBBLE_STRAIGHT)
    assert [entry.reason for entry in told] == [
        "asks for less speed, and makes no robot faster"
    ] * (symptom is Symptom.TOO_SLOW)


def test_a_robot_whose_own_file_gives_less_speed_than_is_asked_may_be_asked_for_less(tmp_path):
    # The TurtleBot 4 does 0.31 m/s: more is neither asked for nor let through.
    path = tmp_path / "fast.yaml"
    smoother = {"max_velocity": [0.31, 0.0, 1.9]}
    block = RPP_BLOCK | {"desired_linear_vel": 0.9}
    path.write_text(nav2_text(block, plugin=RPP, velocity_smoother=smoother))
    one = Patient((path,), "turtlebot4", {}, "jazzy")
    found = {(s.cause.place, s.cause.direction): s for s in with_differences([], one.facts())}
    less = found["controller.max_linear_vel", Direction.DOWN]
    assert less.cause.to == 0.31
    assert ("velocity_smoother.max_velocity", Direction.UP) not in found
    experiment = Experiment(one, Symptom.TOO_SLOW, list(PROBES.values()), Counted(9.5, 0.0), seed=0)
    first, *_ = experiment.candidates.of(less)[0]
    assert [*first.trial.changes.values()] == [0.31]
    more = Suspicion(Cause("velocity_smoother.max_velocity", Direction.UP), 1.0, ("Why.",))
    driven, told = experiment.candidates.of(more)
    assert driven == []
    assert [entry.reason for entry in told] == ["the robot's own file gives less speed"]


def test_an_abnormal_value_is_set_back_half_of_the_way_as_well(patient):
    # Nav2's progress checker waits 10 s, the file's 20 s; half of the factor of 2 is 1.41.
    facts = patient.facts()
    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), Counted(9.5, 0.0), seed=0
    )
    patience = Suspicion(Cause("progress_checker.movement_time_allowance", Direction.DOWN), 0.1, ())
    (way,) = [s for s in ways_back([patience], facts) if s.cause.place == patience.cause.place]
    found = experiment.candidates.way_back(way)
    assert [next(iter(c.trial.changes.values())) for c in found] == [10.0, 14.1]


def test_a_few_pairs_do_not_put_half_of_a_way_back_in_the_place_of_the_whole(patient):
    """In the first six pairs half of the way does more than the whole, in the others nothing."""

    class Lucky(Counted):
        def drive(self, preset, probes, trials, *, seed):
            patience_s = preset.stack.navigation.progress_checker.movement_time_allowance
            rows = super().drive(preset, probes, trials, seed=seed)
            for number, row in enumerate(rows):
                half = 0.0 if number < 6 else 2.0
                value = {10.0: 0.5, 14.1: half}.get(patience_s, 2.0)
                row["severity"] = {"wobble_straight": value}
            return rows

    patience = Suspicion(Cause("progress_checker.movement_time_allowance", Direction.DOWN), 0.1, ())
    (way,) = [
        s for s in ways_back([patience], patient.facts()) if s.cause.place == patience.cause.place
    ]
    experiment = Experiment(
        patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), Lucky(9.5, 2.0), seed=0
    )
    experiment.run([way], [way])
    found = {next(iter(e.trial.changes.values())): e for e in experiment.tried}
    assert (found[10.0].verdict, found[10.0].after) == (Verdict.SHOWN, 0.5)
    assert found[14.1].verdict is Verdict.NOT_SHOWN


def test_a_change_that_no_trial_depends_on_is_not_driven(patient):
    text = nav2_text(MPPI_BLOCK, plugin=MPPI, amcl={"max_particles": 2000})
    patient.paths[0].write_text(text)
    driver = Counted(9.0, 0.0)
    experiment = Experiment(patient, Symptom.WOBBLE_STRAIGHT, list(PROBES.values()), driver, seed=0)
    # AMCL is not simulated here.
    unused = Trial(CAUSE, {Place("amcl", "max_particles"): 5000})
    candidate, reason = experiment.candidates.of_trial(Suspicion(CAUSE, 1.0, ()), unused)
    assert (candidate, driver.trials) == (None, 0)
    assert reason == "no trial depends on it"


def test_a_radius_below_the_body_is_not_tried():
    """The Waffle's body reaches 0.255 m, so its disc of 0.22 m is not made smaller."""
    smaller = Cause("local_costmap.robot_radius", Direction.DOWN, None, "smaller")
    trial = Trial(smaller, {Place("local_costmap/local_costmap", "robot_radius"): 0.132})
    assert is_below_body(trial, load_robot("turtlebot3_waffle"))
    # Of the TurtleBot 4 the Nav2 file's radius is all that is known.
    assert not is_below_body(trial, load_robot("turtlebot4"))
