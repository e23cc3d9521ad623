"""What a manifest tells of the machine."""

from __future__ import annotations

from drake_navbench.analysis.report_sections import compute_note
from drake_navbench.processes.machine import machine_facts, processor_name


def test_the_model_of_the_processor_is_the_one_that_the_system_tells(tmp_path):
    told = tmp_path / "cpuinfo"
    told.write_text("processor\t: 0\nmodel name\t: Some  CPU @ 2.00GHz\nflags\t: fpu\n")
    assert processor_name(told) == "Some CPU @ 2.00GHz"


def test_where_the_system_does_not_tell_there_is_a_word_all_the_same(tmp_path):
    assert processor_name(tmp_path / "missing")


def test_the_facts_of_a_machine_tell_jobs_cores_and_load():
    told = machine_facts(3)
    assert told["jobs"] == 3
    assert told["cores"] >= 1
    assert told["load_before"] is None or told["load_before"] >= 0.0


def test_compute_times_of_a_cluster_are_told_of_its_machines():
    note = compute_note(
        {
            "machines": [{"processor": "Here", "cores": 1, "jobs": 1, "load_before": 0.0}],
            "cluster": [
                {"processor": "Far", "trials": 16},
                {"processor": "Far", "trials": 8},
                {"processor": "Farther", "trials": 1},
            ],
        }
    )
    assert "a cluster of Far (24 trials), a cluster of Farther (1 trials); trials that no" in note
