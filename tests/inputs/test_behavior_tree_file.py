"""A behaviour tree comes from its XML file where all of its nodes are ours."""

from __future__ import annotations

from pathlib import Path

import pytest
from nav2_setups import read_nav2_files

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.robot import load_robot
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.release import navigation_of
from drake_navbench.navigation.behavior_tree.builder import faults_of
from drake_navbench.navigation.behavior_tree.navigators import named_tree
from drake_navbench.navigation.behavior_tree.settings import BehaviorTreeSettings
from drake_navbench.navigation.behavior_tree.tree_file import read_tree_file
from drake_navbench.plugins.releases import Release

JAZZY = Path(__file__).parents[1] / "nav2" / "nav2_files" / "jazzy.yaml"
PLAIN = """<root main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <PipelineSequence name="Drive">
      <ControllerSelector default_controller="FollowPath" selected_controller="{chosen}"/>
      <RateController hz="0.5"><ComputePathToPose goal="{goal}" path="{path}"/></RateController>
      <SubTree ID="Following"/>
    </PipelineSequence>
  </BehaviorTree>
  <BehaviorTree ID="Following">
    <RecoveryNode number_of_retries="2">
      <FollowPath path="{path}" controller_id="{chosen}"/>
      <RoundRobin>
        <Action ID="Spin" spin_dist="0.5"/>
        <ClearEntireCostmap service_name="local_costmap/clear_entirely_local_costmap"/>
      </RoundRobin>
    </RecoveryNode>
  </BehaviorTree>
</root>
"""


def write(folder: Path, text: str = PLAIN) -> Path:
    path = folder / "drive.xml"
    path.write_text(text)
    return path


def test_other_trees_of_the_file_stand_where_they_are_named(tmp_path):
    tree = read_tree_file(write(tmp_path))
    assert [node.node for node in tree.iterate()] == [
        "PipelineSequence",
        "ControllerSelector",
        "RateController",
        "ComputePathToPose",
        "RecoveryNode",
        "FollowPath",
        "RoundRobin",
        "Spin",
        "ClearEntireCostmap",
    ]
    assert tree.name == "Drive"
    assert [node.line for node in tree.iterate()][-2:] == [13, 14]
    assert list(faults_of(tree)) == []


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('ID="Spin"', 'ID="Spiin"', "line 13, Spiin: no such node here; did you mean 'Spin'?"),
        ("<FollowPath", "<DockRobot", "line 11, DockRobot: this node of Nav2 is missing here"),
        ("<FollowPath", "<ComputeRoute", "ComputeRoute: this node of Nav2 is missing here"),
        ("<FollowPath", "<TurnRobot", "line 11, TurnRobot: no such node here; Nav2's"),
        ('hz="0.5"', 'hz="fast"', "line 5, RateController: hz: expected a number, got 'fast'"),
        ('hz="0.5"', 'hz="0"', "hz: expected a number above 0"),
        ('spin_dist="0.5"', 'spin="0.5"', "line 13, Spin: spin: has no effect here"),
        ("<RoundRobin>", '<RoundRobin><IsPathValid max_cots="9"/>', "max_cots: has no effect here"),
        ("<RoundRobin>", '<RoundRobin><IsPathValid max_cost="a"/>', "max_cost: expected a number"),
        ("local_costmap/clear_entirely_local", "some/clear_entirely_some", "service_name"),
        ('<SubTree ID="Following"/>', "<RateController/>", "expected 1 children, got 0"),
        ('Action ID="Spin"', "Action", "line 13: Action: expected an ID"),
        ('execute="Main"', 'execute="Other"', "called 'Other'"),
    ],
)
def test_what_is_not_ours_is_named_with_its_line_and_the_default_tree_stands_in(
    tmp_path, old, new, told
):
    assert old in PLAIN
    setup = setup_with(tmp_path, PLAIN.replace(old, new))
    (row,) = setup.check.stand_ins
    assert told in row.remark
    assert row.remark.endswith("Nav2's default tree is used instead")
    assert setup.robot.navigation.behavior_tree.tree is None


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<root>", "line 1: not XML"),
        ("<tree/>", "expected a behaviour tree's <root>, got <tree>"),
        (PLAIN.replace('execute="Main"', 'execute="Other"'), "called 'Other'"),
        (PLAIN.replace('SubTree ID="Following"', 'SubTree ID="F"'), "line 6: no BehaviorTree is"),
        (PLAIN.replace('SubTree ID="Following"', 'SubTree ID="Main"'), "does a tree hold itself?"),
        (PLAIN.replace('Action ID="Spin"', "Action"), "line 13: Action: expected an ID"),
        ('<!DOCTYPE a [<!ENTITY b "c">]>' + PLAIN, "line 1: expected no document type"),
        ('<root><BehaviorTree ID="a"/></root>', "expected one root node, got 0"),
    ],
)
def test_a_file_that_is_wrong_is_one_line_with_its_place(tmp_path, text, reason):
    with pytest.raises(InputError) as caught:
        read_tree_file(write(tmp_path, text))
    assert reason in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "drive.xml"))


def setup_with(folder: Path, text: str | None, release: str | None = None) -> Nav2Setup:
    """Returns what a Nav2 file makes that names drive.xml, beside which it is written."""
    if text is not None:
        write(folder, text)
    path = folder / "nav2.yaml"
    named = 'default_nav_to_pose_bt_xml: "$(find-pkg-share mine)/trees/drive.xml"'
    path.write_text(JAZZY.read_text().replace("bt_loop_duration: 20", named))
    return read_nav2_files([path], load_robot("round_robot"), "round_robot", release=release)


def test_a_tree_beside_the_nav2_file_is_taken_with_the_nodes_of_the_release(tmp_path):
    def round_robin(release):
        setup = setup_with(tmp_path, PLAIN, release)
        assert setup.check.is_whole
        tree = setup.robot.navigation.behavior_tree.tree
        return next(node for node in tree.iterate() if node.node == "RoundRobin")

    assert round_robin("lyrical").attributes == {}
    assert round_robin("jazzy").attributes == {"wrap_around": "true"}


VALIDATED = PLAIN.replace(
    '<SubTree ID="Following"/>', '<IsPathValid path="{path}"/><SubTree ID="Following"/>'
)


@pytest.mark.parametrize(
    ("release", "given", "expected"),
    [
        ("jazzy", "", {}),
        ("kilted", "", {"max_cost": "253"}),
        ("kilted", 'max_cost="200"', {"max_cost": "200"}),
        ("lyrical", "", {}),
    ],
)
def test_a_path_is_valid_up_to_the_cost_of_the_release_or_of_the_tree(
    tmp_path, release, given, expected
):
    text = VALIDATED.replace('<IsPathValid path="{path}"', f'<IsPathValid path="{{path}}" {given}')
    setup = setup_with(tmp_path, text, release)
    tree = setup.robot.navigation.behavior_tree.tree
    node = next(node for node in tree.iterate() if node.node == "IsPathValid")
    assert dict(node.attributes) == {"path": "{path}"} | expected


def test_a_tree_is_found_by_the_end_of_its_path(tmp_path):
    # The Nav2 file lies in mine/config, the tree in mine/trees.
    folder = tmp_path / "mine" / "config"
    trees = tmp_path / "mine" / "trees"
    folder.mkdir(parents=True)
    trees.mkdir()
    write(trees)
    setup = setup_with(folder, None)
    assert setup.robot.navigation.behavior_tree.tree.name == "Drive"


def test_a_tree_of_the_installed_nav2_is_taken_and_told(tmp_path, monkeypatch):
    trees = tmp_path / "opt" / "share" / "nav2_bt_navigator" / "behavior_trees"
    trees.mkdir(parents=True)
    write(trees)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"/nowhere:{tmp_path / 'opt'}")
    folder = tmp_path / "mine"
    folder.mkdir()
    setup = setup_with(folder, None)
    assert setup.check.is_whole
    assert setup.robot.navigation.behavior_tree.tree.name == "Drive"
    told = [row.remark for row in setup.check.rows if row.parameter.endswith("to_pose_bt_xml")]
    assert told == [f"that of the installed Nav2, {trees / 'drive.xml'}"]


def test_a_tree_that_is_not_there_is_a_stand_in(tmp_path):
    (row,) = setup_with(tmp_path, None).check.stand_ins
    assert row.remark == "drive.xml: not beside the file; Nav2's default tree is used instead"


# The trees of Nav2 that are not the default and follow a path, with the node that paces each.
OF_NAV2 = {
    "follow_point": "RateController",
    "nav_to_pose_with_consistent_replanning_and_if_path_becomes_invalid": "PathExpiringTimer",
    "navigate_to_pose_w_replanning_goal_patience_and_recovery": "PathLongerOnApproach",
    "navigate_w_recovery_and_replanning_only_if_path_becomes_invalid": "GlobalUpdatedGoal",
    "navigate_w_replanning_distance": "DistanceController",
    "navigate_w_replanning_only_if_goal_is_updated": "GoalUpdatedController",
    "navigate_w_replanning_only_if_path_becomes_invalid": "GlobalUpdatedGoal",
    "navigate_w_replanning_speed": "SpeedController",
    "navigate_w_replanning_time": "RateController",
}


@pytest.mark.parametrize("name", OF_NAV2)
def test_another_tree_of_nav2_is_known_by_its_file_name(tmp_path, name):
    path = tmp_path / "nav2.yaml"
    named = f"default_nav_to_pose_bt_xml: /opt/ros/jazzy/share/nav2_bt_navigator/b/{name}.xml"
    path.write_text(JAZZY.read_text().replace("bt_loop_duration: 20", named))
    setup = read_nav2_files([path], load_robot("round_robot"), "round_robot")
    assert setup.check.is_whole
    assert OF_NAV2[name] in {n.node for n in setup.robot.navigation.behavior_tree.tree.iterate()}


@pytest.mark.parametrize(
    ("release", "validity", "speed"),
    [("humble", "IsPathValid", "0.05"), ("kilted", "IsPathValid", "0.15"),
     ("lyrical", "ValidatePath", "0.15")],
)  # fmt: skip
def test_a_tree_of_nav2_is_that_of_the_release(release, validity, speed):
    settings = BehaviorTreeSettings(**navigation_of(Release(release))["behavior_tree"])
    name = "navigate_w_recovery_and_replanning_only_if_path_becomes_invalid.xml"
    nodes = {node.node: node for node in named_tree(name, settings).iterate()}
    assert validity in nodes
    assert nodes["BackUp"].attributes["backup_speed"] == speed
    assert named_tree("drive.xml", settings) is None


@pytest.mark.parametrize(
    ("named", "status"),
    [
        ("drive.xml", Status.UNREAD),
        ("$(find-pkg-share a)/b/navigate_w_replanning_and_recovery.xml", Status.NO_MEANING),
    ],
)
def test_a_tree_that_is_named_as_up_to_foxy_is_not_read(tmp_path, named, status):
    write(tmp_path)
    path = tmp_path / "nav2.yaml"
    old = f"default_bt_xml_filename: {named!r}"
    path.write_text(JAZZY.read_text().replace("bt_loop_duration: 20", old))
    setup = read_nav2_files([path], load_robot("round_robot"), "round_robot")
    assert setup.robot.navigation.behavior_tree.tree is None
    (row,) = (row for row in setup.check.rows if row.parameter == "default_bt_xml_filename")
    assert row.status == status


@pytest.mark.parametrize(
    ("node", "release", "told"),
    [
        ('<GetCurrentPose current_pose="{p}"/>', "humble", "exists from jazzy on, not in humble"),
        ('<GetCurrentPose current_pose="{p}"/>', "jazzy", None),
        ('<IsPathValid path="{path}"/>', "kilted", None),
        ('<IsPathValid path="{path}"/>', "lyrical", "does not exist in lyrical"),
        ('<ValidatePath path="{path}"/>', "kilted", "exists from lyrical on, not in kilted"),
    ],
)
def test_a_node_that_the_files_release_lacks_is_told(tmp_path, node, release, told):
    setup = setup_with(tmp_path, PLAIN.replace('<SubTree ID="F', f'{node}<SubTree ID="F'), release)
    rows = [r.remark for r in setup.check.stand_ins if r.parameter.endswith("to_pose_bt_xml")]
    line = f"drive.xml: line 6, {node[1:].partition(' ')[0]} {told}: bt_navigator does not start"
    assert rows == ([f"{line}; used here all the same"] if told else [])
    # It drives here whatever the release.
    assert setup.robot.navigation.behavior_tree.tree.name == "Drive"


@pytest.mark.parametrize(
    ("node", "found", "status"),
    [("", [], Status.NO_MEANING), ('<GoalReached goal="{goal}"/>', ["0.6"], Status.USED)],
)
def test_the_navigators_tolerance_is_that_of_goal_reached(tmp_path, node, found, status):
    text = PLAIN.replace("<RoundRobin>", f"<ReactiveFallback>{node}<RoundRobin>")
    write(tmp_path, text.replace("</RoundRobin>", "</RoundRobin></ReactiveFallback>"))
    own = tmp_path / "nav2.yaml"
    parameters = "{default_nav_to_pose_bt_xml: drive.xml, goal_reached_tol: 0.6}"
    own.write_text(f"bt_navigator: {{ros__parameters: {parameters}}}\n")
    setup = read_nav2_files([JAZZY, own], load_robot("wheelchair"), "wheelchair")
    nodes = setup.robot.navigation.behavior_tree.tree.iterate()
    tolerances = [one.attributes["goal_reached_tol"] for one in nodes if one.node == "GoalReached"]
    (row,) = (row for row in setup.check.rows if row.parameter == "goal_reached_tol")
    assert (tolerances, row.status) == (found, status)


SMOOTHING = """<root main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <PipelineSequence>
      <Sequence>
        <ComputePathToPose goal="{goal}" path="{path}"/>
        <SmoothPath unsmoothed_path="{path}" smoothed_path="{RESULT}" CHECK/>
      </Sequence>
      <FollowPath path="{RESULT}"/>
    </PipelineSequence>
  </BehaviorTree>
</root>
"""


@pytest.mark.parametrize(
    ("result", "check", "told"),
    [
        ("path", "", None),
        ("smoothed_path", 'smoother_id="simple_smoother" max_smoothing_duration="1.0"', None),
        ("other", "", None),
        ("path", 'check_for_collisions="true"', "check_for_collisions: a smoothed path is not"),
    ],
)
def test_a_tree_may_smooth_its_path(tmp_path, result, check, told):
    text = SMOOTHING.replace("RESULT", result).replace("CHECK", check)
    faults = [str(fault) for fault in faults_of(read_tree_file(write(tmp_path, text)))]
    assert (faults == []) if told is None else (told in faults[0])


@pytest.mark.parametrize(
    ("plugin", "values"),
    [
        ("nav2_smoother::SimpleSmoother", {"w_smooth": 0.4, "nav2_release": "jazzy"}),
        ("nav2_constrained_smoother/ConstrainedSmoother", {"w_smooth": 0.4}),
        ("nav2_smoother::SavitzkyGolaySmoother", {"refinement_num": 5, "nav2_release": "jazzy"}),
        ("my_smoother::Smoother", None),
    ],
)
def test_the_smoother_is_read_where_the_tree_asks_for_one(tmp_path, plugin, values):
    write(tmp_path, SMOOTHING.replace("RESULT", "path").replace("CHECK", ""))
    own = tmp_path / "nav2.yaml"
    own.write_text(
        "bt_navigator: {ros__parameters: {default_nav_to_pose_bt_xml: drive.xml}}\n"
        "smoother_server: {ros__parameters: {smoother_plugins: [mine], mine: {plugin: "
        f"'{plugin}', w_smooth: 0.4, refinement_num: 5}}}}}}\n"
    )
    setup = read_nav2_files([JAZZY, own], load_robot("wheelchair"), "wheelchair")
    smoother = setup.robot.navigation.smoother
    stands_in = [row.text for row in setup.check.stand_ins if "smoother_server" in row.text]
    if values is None:
        assert smoother.plugin == "nav2_smoother::SimpleSmoother"
        assert stands_in
    else:
        assert smoother.plugin == plugin.replace("/", "::")
        assert {name: getattr(smoother, name) for name in values} == values
        assert not stands_in


@pytest.mark.parametrize(("release", "refinements"), [("humble", 4), ("iron", 2)])
@pytest.mark.parametrize("server", ["", "mine::Smoother"])
def test_without_a_smoother_of_its_own_a_file_has_that_of_its_release(
    tmp_path, release, refinements, server
):
    write(tmp_path, SMOOTHING.replace("RESULT", "path").replace("CHECK", ""))
    own = tmp_path / "nav2.yaml"
    text = "bt_navigator: {ros__parameters: {default_nav_to_pose_bt_xml: drive.xml}}\n"
    if server:
        plugins = f"{{smoother_plugins: [mine], mine: {{plugin: '{server}'}}}}"
        text += f"smoother_server: {{ros__parameters: {plugins}}}\n"
    own.write_text(text)
    chair = load_robot("wheelchair")
    smoother = read_nav2_files(
        [own], chair, "wheelchair", release=release
    ).robot.navigation.smoother
    assert smoother.plugin == "nav2_smoother::SimpleSmoother"
    assert (smoother.nav2_release, smoother.refinement_num) == (release, refinements)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('<FollowPath path="{path}"', '<FollowPath path="{paht}"', "path: no node writes {paht}"),
        ('<FollowPath path="{path}"', '<FollowPath path="path"', "expected a variable such as"),
        ('goal="{goal}"', 'goal="{dock}"', "ComputePathToPose: goal: no node writes {dock}"),
    ],
)
def test_a_variable_that_nothing_writes_is_named(tmp_path, old, new, told):
    assert old in PLAIN
    tree = read_tree_file(write(tmp_path, PLAIN.replace(old, new)))
    assert told in str(next(faults_of(tree)))


def test_a_tree_follows_the_path_that_it_cuts(tmp_path):
    text = PLAIN.replace(
        '<SubTree ID="Following"/>',
        '<TruncatePath distance="0.5" input_path="{path}" output_path="{short}"/>'
        '<SubTree ID="Following" path="{short}"/>',
    )
    tree = read_tree_file(write(tmp_path, text))
    assert list(faults_of(tree)) == []
    follow = next(node for node in tree.iterate() if node.node == "FollowPath")
    assert follow.attributes["path"] == "{short}"


def test_a_tree_of_an_included_file_is_taken(tmp_path):
    (tmp_path / "more.xml").write_text(
        "<root><BehaviorTree ID='Following'><AlwaysSuccess/></BehaviorTree></root>"
    )
    text = "<root main_tree_to_execute='Main'><include path='more.xml'/>"
    text += "<BehaviorTree ID='Main'><SubTree ID='Following'/></BehaviorTree></root>"
    assert read_tree_file(write(tmp_path, text)).node == "AlwaysSuccess"


def test_files_that_include_each_other_are_refused(tmp_path):
    text = "<root><include path='drive.xml'/></root>"
    with pytest.raises(InputError, match="files that include each other"):
        read_tree_file(write(tmp_path, text))


@pytest.mark.parametrize(
    "tree",
    [
        "<BehaviorTree ID='Own'><SubTree ID='MainTree'/></BehaviorTree></root>",
        "</root>",
    ],
)
def test_for_a_tree_of_a_package_that_is_not_there_the_default_one_stands_in(tmp_path, tree):
    include = "<include ros_pkg='nav2_bt_navigator' path='behavior_trees/main.xml'/>"
    text = f"<root main_tree_to_execute='{'Own' if 'Own' in tree else 'MainTree'}'>{include}{tree}"
    setup = setup_with(tmp_path, text)
    (row,) = setup.check.stand_ins
    assert "'behavior_trees/main.xml' of the package nav2_bt_navigator is not there" in row.remark
    assert row.remark.endswith("Nav2's default tree is used instead")
    assert setup.robot.navigation.behavior_tree.tree is None


THROUGH = PLAIN.replace(
    '<ComputePathToPose goal="{goal}" path="{path}"/>',
    '<ReactiveSequence><RemovePassedGoals input_goals="{goals}" output_goals="{goals}" radius="1"/>'
    '<ComputePathThroughPoses goals="{goals}" path="{path}"/></ReactiveSequence>',
)


def test_each_navigator_has_a_tree_of_its_own(tmp_path):
    setup = setup_naming(tmp_path, "default_nav_through_poses_bt_xml: drive.xml", THROUGH)
    trees = setup.robot.navigation.behavior_tree
    assert trees.tree is None
    assert not setup.check.stand_ins
    found = [node for node in trees.through_poses_tree.iterate() if node.node == "RoundRobin"]
    assert found[0].attributes == {"wrap_around": "true"}


DEFAULT_TO_POSE = "/opt/x/navigate_to_pose_w_replanning_and_recovery.xml"


@pytest.mark.parametrize(
    ("named", "text", "tasks"),
    [
        ("default_nav_through_poses_bt_xml: drive.xml", PLAIN, "through poses"),
        (f"default_nav_through_poses_bt_xml: {DEFAULT_TO_POSE}", PLAIN, "through poses"),
        ("default_nav_to_pose_bt_xml: drive.xml", THROUGH, "to a single pose"),
    ],
)
def test_a_tree_for_the_other_navigator_starts_and_finds_no_plan(tmp_path, named, text, tasks):
    setup = setup_naming(tmp_path, named, text)
    assert not setup.check.stand_ins
    (row,) = (row for row in setup.check.rows if "for the other navigator" in row.remark)
    assert row.status is Status.DOUBTFUL
    assert row.remark.endswith(f"no task {tasks} finds a plan")
    trees = setup.robot.navigation.behavior_tree
    tree = trees.through_poses_tree if tasks == "through poses" else trees.tree
    plans = {node.node for node in tree.iterate() if node.node.startswith("ComputePath")}
    assert plans == {"ComputePathThroughPoses" if text is THROUGH else "ComputePathToPose"}


def setup_naming(folder, named, text):
    """The setup of a Nav2 file for Jazzy that names a tree, beside which drive.xml has `text`."""
    write(folder, text)
    path = folder / "nav2.yaml"
    path.write_text(JAZZY.read_text().replace("bt_loop_duration: 20", named))
    return read_nav2_files([path], load_robot("round_robot"), "round_robot")


def test_behaviortree_cpp_3_also_writes_variables_with_a_dollar(tmp_path):
    old = PLAIN.replace('goal="{goal}"', 'goal="${goal}"')
    assert list(faults_of(read_tree_file(write(tmp_path, old)))) == []
    new = old.replace("<root ", '<root BTCPP_format="4" ')
    (fault,) = faults_of(read_tree_file(write(tmp_path, new)))
    assert "expected a variable such as {goal}" in str(fault)
