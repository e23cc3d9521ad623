"""A mission that cannot be is refused in one line that names file, field and value."""

from __future__ import annotations

import copy

import numpy as np
import pytest
import yaml
from mission_scenes import SMALL, described_mission, small_mission
from PIL import Image

from drake_navbench.errors import InputError
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.inputs.task_check import check_task

MAP = (
    "{{image: {name}.png, resolution: 0.05, origin: [-2.0, -2.0, 0.0], negate: 0, "
    "occupied_thresh: 0.65, free_thresh: 0.196}}"
)


def write_map(folder, name: str, width_m: float, wall=None) -> None:
    """Writes a map 4 m high from (-2, -2) on; wall: columns from, to that are occupied."""
    pixels = np.full((80, round(width_m / 0.05)), 254, np.uint8)
    if wall is not None:
        pixels[:, slice(*wall)] = 0
    Image.fromarray(pixels).save(folder / f"{name}.png")
    (folder / f"{name}.yaml").write_text(MAP.format(name=name))


def load_and_check(path: str) -> None:
    scenario = load_scenario(path)
    check_task(scenario, scenario.load_robot("wheelchair"))


def refusal(tmp_path, data) -> str:
    """Returns what is said of a mission in a file, as the file is loaded and the task checked."""
    path = tmp_path / "a_mission.yaml"
    own = {name: value for name, value in data.items() if name != "name"}
    path.write_text(yaml.safe_dump(own))
    with pytest.raises(InputError) as caught:
        load_and_check(str(path))
    assert "\n" not in str(caught.value)
    return str(caught.value)


LIFT_TO_NOWHERE = {"stops": {"ground": [0.8, 0.0, 0.0], "roof": [0.0, 0.0, 0.0]}}
GOAL = {"floor": "upper", "goal": [5.0, 3.0, 1.5]}
RIDE = {"lift": "main", "to": "upper"}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"lift": LIFT_TO_NOWHERE}, "lifts[0].stops: unknown floor 'roof'"),
        ({"lift": {"stops": {"ground": [0.0, 0.0, 0.0]}}}, "lifts[0].stops: dictionary should"),
        ({"lift": {"travel_s": -2.0}}, "lifts[0].travel_s: input should be greater than"),
        ({"lift": {"refused_probability": 1.2}}, "lifts[0].refused_probability: input should be"),
        ({"mission": []}, "mission: expected at least one leg, found none"),
        ({"floors": []}, "mission: expected floors as well, found none"),
        ({"mission": [{"floor": "atic", "goal": [0.0, 0.0, 0.0]}]}, "mission[0].floor: unknown"),
        ({"mission": [GOAL]}, "mission[0].floor: expected ground, where the robot then is"),
        ({"mission": [{"lift": "min", "to": "upper"}]}, "mission[0].lift: unknown lift 'min'"),
        ({"mission": [{"lift": "main", "to": "ground"}]}, "mission[0].to: expected another floor"),
        ({"mission": [{"lift": "main"}]}, "mission[0]: expected either a goal and its floor, or"),
        ({"mission": [RIDE | GOAL]}, "mission[0]: expected either a goal and its floor, or"),
        ({"navigation_mode": "follow_path"}, "navigation_mode: expected navigate_to_pose for a"),
        ({"goal": [1.0, 0.0, 0.0]}, "goal: has no meaning with a mission, which ends at [5.0"),
        ({"waypoints": [[1.0, 0.0, 0.0]]}, "waypoints: has no meaning with a mission"),
        (
            {"floors": [SMALL["floors"][0], {"name": "upper"}, {"name": "upper"}]},
            "floors[2].name: 'upper' is given twice, expected once",
        ),
        (
            {"floors": [SMALL["floors"][0], {"name": "upper", "storey": "first"}]},
            "floors[1]: storey: expected an origin as well, where in first its map lies",
        ),
        (
            {"floors": [*SMALL["floors"], {"name": "cellar"}]},
            "floors[2]: the mission never gets to cellar, and no lift stops there",
        ),
        (
            {"lift": {"stops": {"ground": [0.8, 0.9, 0.0], "upper": [5.0, 2.0, 0.0]}}},
            "lifts[0].stops.ground: the robot's footprint at [0.8, 0.9, 0.0] on floor ground "
            "overlaps an obstacle; expected free space",
        ),
        (
            {"mission": [{"floor": "ground", "goal": [1.0, 1.1, 0.0]}, RIDE, GOAL]},
            "mission[0].goal: [1.0, 1.1] lies inside an obstacle on floor ground",
        ),
    ],
)
def test_what_does_not_fit_together_is_refused(tmp_path, changes, said):
    changes = copy.deepcopy(changes)
    message = refusal(tmp_path, described_mission(changes.pop("lift", None), **changes))
    assert said in message
    assert "a_mission" in message


def test_a_goal_of_another_floors_map_is_off_the_map(tmp_path):
    write_map(tmp_path, "narrow", 4.0)
    floors = [SMALL["floors"][0], {"name": "upper", "world": {"map": "narrow.yaml"}}]
    lift = {"stops": {"ground": [0.8, 0.0, 0.0], "upper": [0.0, 0.0, 0.0]}}
    message = refusal(tmp_path, described_mission(lift, floors=floors))
    assert "mission[1].goal: [5.0, 3.0] lies off the map on floor upper" in message


def test_a_lift_in_a_wall_of_the_map_is_refused(tmp_path):
    write_map(tmp_path, "walled", 10.0, wall=(40, 44))
    floors = [SMALL["floors"][0], {"name": "upper", "world": {"map": "walled.yaml"}}]
    lift = {"stops": {"ground": [0.8, 0.0, 0.0], "upper": [0.1, 0.0, 0.0]}}
    message = refusal(tmp_path, described_mission(lift, floors=floors))
    assert "lifts[0].stops.upper: the robot's footprint at [0.1, 0.0, 0.0]" in message


def test_a_mask_of_another_size_than_the_floors_map_is_refused(tmp_path):
    write_map(tmp_path, "wide", 10.0)
    write_map(tmp_path, "small", 4.0)
    masked = [{"type": "keepout", "mask": "small.yaml"}]
    upper = {"name": "upper", "world": {"map": "wide.yaml"}, "filters": masked}
    message = refusal(tmp_path, described_mission(floors=[SMALL["floors"][0], upper]))
    assert "floors[1].filters[0].mask: small.yaml covers [-2.0, -2.0, 2.0, 2.0]" in message


def test_a_storey_above_another_is_none_of_its_maps(tmp_path):
    floors = [dict(floor, origin=[0.0, 0.0]) for floor in SMALL["floors"]]
    lift = {"stops": {"ground": [0.8, 0.0, 0.0], "upper": [0.0, 0.0, 0.0]}}
    mission = [RIDE, GOAL | {"goal": [1.0, 0.4, 0.0]}]
    message = refusal(tmp_path, described_mission(lift, floors=floors, mission=mission))
    assert "floors[1].origin: upper would lie on top of ground" in message


def test_recorded_people_on_a_floor_are_refused(tmp_path):
    (tmp_path / "hall.csv").write_text("time_s,person,x_m,y_m\n0.0,a,5.0,3.0\n1.0,a,5.5,3.0\n")
    upper = copy.deepcopy(SMALL["floors"][1])
    upper.setdefault("world", {})["people"] = {"recording": "hall.csv"}
    message = refusal(tmp_path, described_mission(floors=[SMALL["floors"][0], upper]))
    assert "floors[1].world.people.recording: got 'hall.csv', expected people who walk" in message


def test_floors_lie_side_by_side_out_of_sight_of_one_another():
    ground, upper = small_mission().placed_floors
    assert ground.offset == (0.0, 0.0)
    assert upper.bounds[0] - ground.bounds[2] >= 10.0
    assert upper.offset[1] == 0.0
    assert upper.offset[0] == int(upper.offset[0])


def test_maps_of_one_storey_keep_their_places_and_storeys_lie_apart():
    names = ("west 0", "east 0", "west 1", "east 1")
    floors = [
        {"name": name, "origin": [10.0 * name.startswith("east"), 1.0], "storey": name[-1]}
        for name in names
    ]
    stops = {name: [1.0, 0.0, 0.0] for name in names}
    mission = [{"lift": "main", "to": "east 1"}]
    placed = small_mission({"stops": stops}, floors=floors, mission=mission).placed_floors
    assert [floor.offset for floor in placed[:2]] == [(0.0, 0.0), (10.0, 0.0)]
    assert placed[3].offset[0] - placed[2].offset[0] == 10.0
    assert placed[2].bounds[0] - placed[1].bounds[2] >= 10.0
    assert [floor.storey for floor in placed] == [0, 0, 2, 2]


def test_a_mission_is_the_same_after_a_round_trip(tmp_path):
    scenario = small_mission({"travel_s": 3.0})
    path = tmp_path / "small_mission.yaml"
    dumped = scenario.model_dump(mode="json", exclude={"name", "directory"})
    path.write_text(yaml.safe_dump(dumped))
    again = load_scenario(str(path))
    assert again.model_dump() == scenario.model_dump()
    assert again.goals == scenario.goals
