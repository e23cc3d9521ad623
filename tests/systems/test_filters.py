"""The speed filter and the binary filter follow their masks as Nav2's do."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_navbench.controller import SpeedLimit
from drake_navbench.navigation.costmaps.costmap_settings import BinaryFilterSettings
from drake_navbench.navigation.costmaps.filter_masks import (
    FilterArea,
    FilterDescription,
    FilterMask,
    Lattice,
    load_filter_mask,
)
from drake_navbench.navigation.costmaps.map_file import OccupancyMap
from drake_navbench.navigation.costmaps.map_image import UNKNOWN
from drake_navbench.trial.systems.binary_filter import BinaryFilter
from drake_navbench.trial.systems.speed_filter import SpeedFilter

# One row of five cells of 1 m: x from 0 to 5 m.
VALUES = [0, 30, UNKNOWN, 60, 100]
PERIOD_S = 0.25


def mask(kind: str, base=0.0, multiplier=1.0) -> FilterMask:
    grid = OccupancyMap(np.array([VALUES], dtype=np.int8), 1.0, 0.0, 0.0)
    return FilterMask(kind, grid, base, multiplier)


class Rig:
    """A filter on a robot that is carried along x."""

    def __init__(self, system) -> None:
        builder = DiagramBuilder()
        self.system = builder.AddSystem(system)
        self.source = builder.AddSystem(ConstantVectorSource(np.zeros(6)))
        builder.Connect(self.source.get_output_port(), system.GetInputPort("estimate"))
        self.simulator = Simulator(builder.Build())

    def carry_to(self, x: float):
        """Returns the filter's state after one more period at x."""
        root = self.simulator.get_mutable_context()
        context = self.source.GetMyMutableContextFromRoot(root)
        self.source.get_mutable_source_value(context).SetFromVector([x, 0.5, 0.0, 0.0, 0.0, 0.0])
        self.simulator.AdvanceTo(root.get_time() + PERIOD_S)
        own = self.system.GetMyContextFromRoot(root)
        return self.system.GetOutputPort("filter_state").Eval(own)


def speed_rig(*args) -> Rig:
    return Rig(SpeedFilter(mask(*args), period_s=PERIOD_S, offset_s=0.01))


def test_a_percentage_is_base_plus_multiplier_times_the_masks_value():
    # Bringup's settings: the darker, the slower. 100 - 30 = 70 %, 100 - 60 = 40 %.
    rig = speed_rig("speed_percent", 100.0, -1.0)
    assert rig.carry_to(0.5).value is None
    assert rig.carry_to(1.5).value == SpeedLimit(70.0, is_percentage=True)
    assert rig.carry_to(3.5).value == SpeedLimit(40.0, is_percentage=True)


def test_an_absolute_limit_is_in_metres_per_second():
    # 0.05 + 0.01 * 30 = 0.35 m/s.
    limit = speed_rig("speed_absolute", 0.05, 0.01).carry_to(1.5).value
    assert limit.value == pytest.approx(0.35)
    assert not limit.is_percentage


def test_the_last_limit_holds_on_unknown_cells_and_off_the_mask():
    rig = speed_rig("speed_percent", 100.0, -1.0)
    rig.carry_to(1.5)
    assert rig.carry_to(2.5).value == SpeedLimit(70.0, is_percentage=True)
    assert rig.carry_to(9.0).value == SpeedLimit(70.0, is_percentage=True)
    assert rig.carry_to(0.5).value is None


@pytest.mark.parametrize(
    ("kind", "base", "multiplier"),
    [
        ("speed_percent", 80.0, 1.0),  # 80 + 30 is more than 100 %
        ("speed_percent", 0.0, -1.0),  # -30 %
        ("speed_absolute", -1.0, 0.0),
    ],
)
def test_a_limit_that_makes_no_sense_is_none(kind, base, multiplier):
    assert speed_rig(kind, base, multiplier).carry_to(1.5).value is None


def test_every_change_of_the_limit_is_kept_once_with_its_time():
    rig = speed_rig("speed_percent", 100.0, -1.0)
    for x in (0.5, 1.5, 1.6, 0.5):
        state = rig.carry_to(x)
    # Updates come 0.01 s after each whole period.
    assert state.as_plain() == [
        {"time_s": pytest.approx(0.26), "limit": 70.0, "is_percentage": True},
        {"time_s": pytest.approx(0.76), "limit": None, "is_percentage": False},
    ]


def binary_rig(default_state: bool) -> Rig:
    settings = BinaryFilterSettings(default_state=default_state, flip_threshold=50.0)
    return Rig(BinaryFilter(mask("binary"), settings, period_s=PERIOD_S, offset_s=0.01))


@pytest.mark.parametrize("default_state", [False, True])
def test_the_switch_leaves_its_default_above_the_threshold(default_state):
    rig = binary_rig(default_state)
    assert rig.carry_to(1.5).value == default_state
    assert rig.carry_to(3.5).value != default_state
    # Unknown keeps what was, off the mask is the default.
    assert rig.carry_to(2.5).value != default_state
    assert rig.carry_to(9.0).value == default_state


def test_the_switch_starts_off_whatever_its_default():
    state = binary_rig(default_state=True).carry_to(0.5)
    assert state.as_plain() == [{"time_s": pytest.approx(0.01), "is_on": True}]


def test_polygons_become_a_mask_that_covers_the_world_and_the_last_one_counts():
    areas = [
        FilterArea(polygon=[(1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0)], value=30),
        FilterArea(polygon=[(2.0, 1.0), (4.0, 1.0), (4.0, 3.0), (2.0, 3.0)], value=60),
    ]
    drawn = load_filter_mask(
        FilterDescription(type="speed_percent", areas=areas),
        file=None,
        bounds=(-1.0, -1.0, 6.0, 6.0),
        lattice=Lattice(0.0, 0.0, 0.5),
    )
    assert drawn.grid.occupancy.shape == (14, 14)
    assert drawn.value_at(np.array([1.5, 2.0])) == 30
    assert drawn.value_at(np.array([2.5, 2.0])) == 60
    assert drawn.value_at(np.array([-0.9, 5.9])) == 0
    assert drawn.value_at(np.array([7.0, 0.0])) is None


def test_a_keepout_has_no_use_for_base_and_multiplier():
    with pytest.raises(ValueError, match="base 1 and multiplier 1 have no meaning"):
        FilterDescription(type="keepout", mask="mask.yaml", base=1.0)
