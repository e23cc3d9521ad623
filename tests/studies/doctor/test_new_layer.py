"""An obstacle layer for a costmap that has none."""

from __future__ import annotations

import pytest
import yaml
from doctor_texts import RPP, RPP_BLOCK, nav2_text

from drake_navbench.nav2.patch import Place
from drake_navbench.studies.doctor.change_words import change_told
from drake_navbench.studies.doctor.cures import trials_of
from drake_navbench.studies.doctor.files import Patient
from drake_navbench.studies.doctor.new_layer import LAYER
from drake_navbench.studies.doctor.reading import suspicions_of
from drake_navbench.studies.doctor.rules.rule import put
from drake_navbench.studies.doctor.symptoms import Symptom


@pytest.fixture
def blind(tmp_path):
    """A file whose local costmap has only an inflation layer."""
    content = yaml.safe_load(nav2_text(RPP_BLOCK, plugin=RPP))
    costmap = content["local_costmap"]["local_costmap"]["ros__parameters"]
    costmap["plugins"] = ["inflation_layer"]
    del costmap["obstacle_layer"]
    path = tmp_path / "blind.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return Patient((path,), "wheelchair", {}, "humble")


def test_a_blind_costmap_gets_a_layer_before_the_inflation_that_marks_the_scan(blind):
    facts = blind.facts()
    suspicions = suspicions_of(facts, Symptom.NEAR_MISS)
    cause = next(s.cause for s in suspicions if s.cause.place == "local_costmap.plugins")
    (trial,) = trials_of(cause, facts, blind.columns().setup)
    assert change_told(trial) == "add obstacle_layer to local_costmap.plugins"
    (text,) = blind.patched_texts(trial.changes).values()
    costmap = yaml.safe_load(text)["local_costmap"]["local_costmap"]["ros__parameters"]
    assert costmap["plugins"] == ["obstacle_layer", "inflation_layer"]
    assert costmap["obstacle_layer"]["scan"] == {
        "topic": "/scan", "data_type": "LaserScan", "max_obstacle_height": 2.0,
        "marking": True, "clearing": True,
    }  # fmt: skip
    # The column of the patched file has the layer.
    before, after = blind.before_and_after(trial.changes)
    assert before.stack != after.stack


@pytest.mark.parametrize("name", ["obstacle_layer", "front_layer"])
def test_a_layer_that_the_file_has_but_does_not_list_is_listed(blind, name):
    content = yaml.safe_load(blind.paths[0].read_text())
    costmap = content["local_costmap"]["local_costmap"]["ros__parameters"]
    costmap[name] = {"plugin": "nav2_costmap_2d::VoxelLayer", "observation_sources": "a"}
    blind.paths[0].write_text(yaml.safe_dump(content, sort_keys=False))
    facts = blind.facts()
    (trial,) = trials_of(put("local_costmap.plugins", LAYER), facts, blind.columns().setup)
    place = Place("local_costmap/local_costmap", "plugins")
    assert trial.changes == {place: [name, "inflation_layer"]}
    assert change_told(trial) == f"add {name} to local_costmap.plugins"


def test_the_new_layer_listens_to_the_scan_of_the_other_costmap(tmp_path, blind):
    content = yaml.safe_load(blind.paths[0].read_text())
    source = {"topic": "/front/scan", "data_type": "LaserScan"}
    content["global_costmap"] = {"global_costmap": {"ros__parameters": {
        "plugins": ["obstacle_layer"],
        "obstacle_layer": {
            "plugin": "nav2_costmap_2d::ObstacleLayer", "observation_sources": "front",
            "front": source,
        },
    }}}  # fmt: skip
    blind.paths[0].write_text(yaml.safe_dump(content, sort_keys=False))
    facts = blind.facts()
    cause = next(
        s.cause
        for s in suspicions_of(facts, Symptom.COLLISION)
        if s.cause.place == "local_costmap.plugins"
    )
    (trial,) = trials_of(cause, facts, blind.columns().setup)
    topics = [value for place, value in trial.changes.items() if place.name.endswith("scan.topic")]
    assert topics == ["/front/scan"]
