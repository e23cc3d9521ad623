"""Arms stand where ros2_control or an SRDF lets them rest, else at their joints' zeros."""

from __future__ import annotations

import pytest

from drake_navbench.inputs.check import Status
from drake_navbench.inputs.described_robot import describe_robot
from tests.descriptions_scenes import BOX, collision, link, rows, urdf

# A metre of arm on the deck of a base of 0.6 m by 0.4 m; at zero it reaches ahead to x = 1.2 m.
ARM = (
    link(BOX)
    + link(collision('<box size="1 0.1 0.1"/>', '<origin xyz="0.5 0 0"/>'), "arm_link")
    + "".join(link("", name) for name in ("hand", "finger"))
    + "".join(
        f'<joint name="{name}" type="revolute"><parent link="{above}"/><child link="{below}"/>'
        f'<origin xyz="{place}"/><axis xyz="0 1 0"/>{more}</joint>'
        for name, above, below, place, more in (
            ("lift", "base_link", "arm_link", "0.2 0 0.2", ""),
            ("wrist", "arm_link", "hand", "1 0 0", ""),
            ("grip", "hand", "finger", "0 0 0", '<mimic joint="wrist" multiplier="-2"/>'),
        )
    )
)


def started(**positions):
    """Returns a block of ros2_control that starts joints at these positions, rad."""
    joints = "".join(
        f'<joint name="{name}"><state_interface name="velocity"><param name="initial_value">9'
        '</param></state_interface><state_interface name="position"><param name="initial_value">'
        f"{value}</param></state_interface></joint>"
        for name, value in positions.items()
    )
    return f'<ros2_control name="arm" type="system">{joints}</ros2_control>'


def state(name, group="arm", **positions):
    """Returns a state of an SRDF."""
    joints = "".join(f'<joint name="{j}" value="{v}"/>' for j, v in positions.items())
    return f'<group_state name="{name}" group="{group}">{joints}</group_state>'


HOME = state("home", lift=0.3, wrist=0.1)
STOWED = state("arm_stowed", lift=-1.5708, wrist=0.5)


@pytest.mark.parametrize(
    ("control", "srdf", "reach_m", "said"),
    [
        ("", "", 1.2, None),
        # A quarter turn up: the arm is a mast, and the base's own front is the farthest point.
        (started(lift=-1.5708), STOWED, 0.3, "lift -1.57, as ros2_control starts them"),
        ("", HOME + STOWED, 0.3, "lift -1.57, wrist 0.5, in the state arm_stowed of cart.srdf"),
        # Zeros are what MoveIt's assistant writes.
        (started(lift=0, wrist=0), STOWED, 0.3, "lift -1.57, wrist 0.5, in the state arm_stowed"),
        # Of another robot, of no number, and no place to rest.
        ("", state("home", lift=1, other=1) + state("tuck", lift="x") + state("wave", lift=1), 1.2,
         None),
    ],
)  # fmt: skip
def test_an_arm_stands_where_a_file_lets_it_rest(tmp_path, control, srdf, reach_m, said):
    path = urdf(tmp_path, ARM + control)
    (tmp_path / "cart.srdf").write_text(f'<robot name="cart">{srdf}</robot>')
    robot = describe_robot(path)
    assert max(x for x, _ in robot.fields["footprint"]) == pytest.approx(reach_m, abs=2e-3)
    told = [row for row in rows(path, Status.USED) if "joints" in row]
    assert (said in told[0]) if said else not told


def test_a_joint_that_mimics_another_follows_it(tmp_path):
    model = describe_robot(urdf(tmp_path, ARM + started(lift=0.1, wrist=0.25))).source.model
    assert model.resting.positions == {"lift": 0.1, "wrist": 0.25, "grip": -0.5}


def test_an_arm_of_which_no_file_tells_where_it_rests_is_told(tmp_path):
    free = ARM.replace('<mimic joint="wrist" multiplier="-2"/>', "")
    assumed = rows(urdf(tmp_path, free), Status.ASSUMED)
    assert any("lift, wrist and 1 more at 0: no file tells where they rest" in r for r in assumed)


def test_wheels_that_a_plugin_drives_are_no_arm_whatever_they_are_called(tmp_path):
    names = [f"{end}_{side}" for end in ("front", "rear") for side in ("left", "right")]
    parts = "".join(
        link("", name) + f'<joint name="{name}_joint" type="continuous"><parent link="base_link"/>'
        f'<child link="{name}"/><axis xyz="0 1 0"/></joint>'
        for name in names
    )
    driven = "".join(f"<{n.split('_')[1]}_joint>{n}_joint</{n.split('_')[1]}_joint>" for n in names)
    drive = f'<plugin name="a" filename="libgazebo_ros_diff_drive.so">{driven}</plugin>'
    told = rows(urdf(tmp_path, link(BOX) + parts + f"<gazebo>{drive}</gazebo>"), Status.ASSUMED)
    assert not any("no file tells where they rest" in row for row in told)
