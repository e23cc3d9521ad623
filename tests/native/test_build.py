"""Building a checkout's controllers: what is found in it, what is compiled again, what is wrong."""

from __future__ import annotations

import pytest
from plain_package import add_plain_package

from drake_navbench.commands.main import main
from drake_navbench.controllers.external import ExternalController
from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot
from drake_navbench.native.build import build_checkout, folders_of
from drake_navbench.native.builds import find_build
from drake_navbench.native.checkout import checkout_around, read_checkout
from drake_navbench.native.choice import Choice, choose
from drake_navbench.native.compiler import find_compiler, first_error
from drake_navbench.native.headers import message_header
from drake_navbench.trial.column_controller import controller_setup

CONTROLLERS = ("tiny::Controller", "nav2_graceful_controller::GracefulController")


def test_a_checkout_tells_its_release_and_its_controllers(copied):
    checkout = read_checkout(copied)
    assert (checkout.release, checkout.version) == ("jazzy", "1.3.99")
    (package,) = checkout.controller_packages.values()
    assert package.controllers == CONTROLLERS
    assert set(checkout.compiled_for(["tiny_controller"])) == set(checkout.packages)


@pytest.mark.parametrize(
    ("version", "interface", "release"),
    [
        ("1.4.2", "setPlan", "kilted"),
        ("1.4.0", "newPathReceived", "lyrical"),
        ("1.5.1", "newPathReceived", "lyrical"),
    ],
)
def test_main_before_its_release_branches_off_is_told_by_its_interface(
    copied, version, interface, release
):
    package = copied / "nav2_core" / "package.xml"
    package.write_text(package.read_text().replace("1.3.99", version))
    header = copied / "nav2_core" / "include" / "nav2_core" / "controller.hpp"
    header.write_text(f"virtual void {interface}(const nav_msgs::msg::Path & path) = 0;\n")
    assert read_checkout(copied).release == release


def _add_package(checkout, name: str, source: str, *depends: str, place: str = "") -> None:
    """Adds a package with one source to a checkout, in a folder of packages where one is given."""
    folder = checkout / place / name
    (folder / "src").mkdir(parents=True)
    needed = "".join(f"<depend>{each}</depend>" for each in depends)
    (folder / "package.xml").write_text(
        f"<package><name>{name}</name><version>1.0.0</version>{needed}</package>"
    )
    (folder / "src" / f"{name}.cpp").write_text(source)


def _loads(checkout, kind: str) -> None:
    """Lets the tiny controller load plugins of a class."""
    header = checkout / "tiny_controller" / "include" / "tiny_controller" / "tiny_controller.hpp"
    header.write_text(header.read_text() + f"// pluginlib::ClassLoader<{kind}> loader_;\n")


def test_plugins_that_a_controller_loads_are_compiled_with_it(copied):
    _loads(copied, "Critic")
    _add_package(
        copied, "more_critics", "PLUGINLIB_EXPORT_CLASS(a::B, tiny::Critic)\n", "tiny_controller"
    )
    # As opennav_docking, which depends on the graceful controller and exports docks.
    _add_package(
        copied, "docking", "PLUGINLIB_EXPORT_CLASS(a::C, docking::Dock)\n", "tiny_controller"
    )
    compiled = read_checkout(copied).compiled_for(["tiny_controller"])
    assert "more_critics" in compiled
    assert "docking" not in compiled


def test_what_a_package_only_runs_beside_is_not_compiled(copied):
    _add_package(copied, "bringup", "int nothing;\n")
    path = copied / "tiny_controller" / "package.xml"
    text = path.read_text()
    path.write_text(text.replace("<depend>tiny", "<exec_depend>bringup</exec_depend><depend>tiny"))
    assert "bringup" not in read_checkout(copied).compiled_for(["tiny_controller"])


SYSTEM_TESTS = """\
#include "tiny_msgs/srv/clear_all.hpp"
PLUGINLIB_EXPORT_CLASS(tests::Controller, nav2_core::Controller)
"""


def test_what_cannot_be_built_is_left_out_with_the_reason(tiny, copied, capsys):
    _add_package(copied, "system_tests", SYSTEM_TESTS, "tiny_controller", "tiny_msgs")
    assert main(["nav2-build", str(copied), "--as", "whole"]) == 0
    reason = (
        "system_tests: src/system_tests.cpp needs tiny_msgs/srv/clear_all.hpp, "
        "for which there is neither a file nor a stand-in"
    )
    assert f"left out: {reason}\n" in capsys.readouterr().out
    build = find_build("whole")
    assert build.controllers == CONTROLLERS
    assert build.left_out == {"tests::Controller": reason}
    # Nothing of it was compiled.
    assert build.host == tiny.host
    error = _fails(copied, "--packages", "system_tests", capsys=capsys)
    assert "needs tiny_msgs/srv/clear_all.hpp" in error


def _chosen(root, *asked) -> Choice:
    """Returns what would be built of a checkout; nothing is compiled."""
    checkout = read_checkout(root)
    return choose(checkout, asked, find_compiler(), folders_of(checkout))


def test_an_include_behind_a_condition_is_not_missed(builds, copied):
    source = copied / "tiny_controller" / "src" / "tiny_controller.cpp"
    source.write_text(
        '#if __has_include("nowhere/at_all.hpp")\n#include "nowhere/at_all.hpp"\n#endif\n'
        + source.read_text()
    )
    assert _chosen(copied).reasons == {}


def test_what_needs_a_package_that_cannot_be_built_is_left_out_with_it(tiny, copied):
    _add_package(copied, "localizer", "#include <message_filters/subscriber.h>\n")
    source = "PLUGINLIB_EXPORT_CLASS(tests::Controller, nav2_core::Controller)\n"
    _add_package(copied, "system_tests", source, "localizer")
    build = build_checkout(copied, name="whole")
    assert build.controllers == CONTROLLERS
    reason = build.left_out["tests::Controller"]
    assert reason.startswith("system_tests needs localizer: src/localizer.cpp needs message_fil")


def test_plugins_for_a_controller_that_cannot_be_built_are_left_out_alone(builds, copied):
    _loads(copied, "Critic")
    source = "#include <nowhere/at_all.hpp>\nPLUGINLIB_EXPORT_CLASS(a::B, tiny::Critic)\n"
    _add_package(copied, "more_critics", source, "tiny_controller")
    choice = _chosen(copied, "tiny_controller")
    assert choice.chosen == ("tiny_controller",)
    assert list(choice.plugins_left_out) == ["a::B"]


def test_a_package_that_does_not_compile_leaves_the_others(tiny, copied, capsys):
    source = "int broken = no_such_thing;\n"
    source += "PLUGINLIB_EXPORT_CLASS(a::Controller, nav2_core::Controller)\n"
    _add_package(copied, "another", source, "nav2_core")
    assert main(["nav2-build", str(copied), "--as", "rest"]) == 0
    shown = capsys.readouterr().out
    assert "left out: another: " in shown
    assert "no_such_thing" in find_build("rest").left_out["a::Controller"]
    assert find_build("rest").controllers == CONTROLLERS


def test_a_folder_of_packages_stands_for_those_in_it(copied):
    _add_package(
        copied,
        "grouped",
        "PLUGINLIB_EXPORT_CLASS(a::Controller, nav2_core::Controller)\n",
        place="group_of_packages",
    )
    checkout = read_checkout(copied)
    assert checkout.named("group_of_packages") == ["grouped"]
    assert checkout.named("tiny_controller") == ["tiny_controller"]
    assert checkout_around(copied / "group_of_packages") == (copied, "group_of_packages")
    assert checkout_around(copied / "tiny_controller") == (copied, "tiny_controller")
    assert checkout_around(copied) == (copied, None)
    assert checkout_around(copied.parent) == (copied.parent, None)


def test_a_folder_of_a_checkout_is_built_alone(tiny, copied):
    _add_package(
        copied, "another", "PLUGINLIB_EXPORT_CLASS(a::Controller, nav2_core::Controller)\n"
    )
    build = build_checkout(copied / "tiny_controller", name="one")
    assert build.controllers == CONTROLLERS
    assert build.checkout == copied


def test_a_build_of_the_same_files_compiles_nothing(tiny, copied):
    told = []
    again = build_checkout(copied, name="again", tell=told.append)
    assert again.host == tiny.host
    assert told[-1].startswith("0 files compiled")
    assert find_build("again").controllers == CONTROLLERS


@pytest.mark.usefixtures("nothing_compiled")
def test_a_changed_source_is_compiled_alone(copied):
    source = add_plain_package(copied)
    first = build_checkout(copied, name="first", wanted=["plain"])
    source.write_text(source.read_text() + "int changed;\n")
    told = []
    changed = build_checkout(copied, name="changed", wanted=["plain"], tell=told.append)
    assert changed.host != first.host
    assert told == ["[1/1] plain.cpp", "1 files compiled, 3 taken from the cache"]


@pytest.mark.usefixtures("nothing_compiled")
def test_packages_beside_it_compile_nothing_of_a_package_again(copied):
    build_checkout(copied, name="tiny")
    other = copied / "other_controller"
    (other / "src").mkdir(parents=True)
    (other / "package.xml").write_text(
        "<package><name>other_controller</name><version>1.0.0</version>"
        "<depend>tiny_controller</depend></package>"
    )
    source = (
        '#include "tf2_ros/create_timer_ros.h"\n#include "tiny_controller/tiny_controller.hpp"\n'
    )
    source += "namespace other { struct Controller : tiny::Controller {}; }\n"
    source += "PLUGINLIB_EXPORT_CLASS(other::Controller, nav2_core::Controller)\n"
    (other / "src" / "other.cpp").write_text(source)
    told = []
    build = build_checkout(copied, name="other", tell=told.append)
    assert set(build.controllers) == {*CONTROLLERS, "other::Controller"}
    assert told == ["[1/1] other.cpp", "1 files compiled, 4 taken from the cache"]


def test_a_message_of_the_checkout_becomes_a_struct(copied):
    text = message_header("tiny_msgs", copied / "tiny_msgs" / "msg" / "Seen2DPose.msg")
    for line in (
        "static constexpr std::uint8_t FREE = 0;",
        "std_msgs::msg::Header header{};",
        "std::uint8_t cost{0};",
        "std::vector<double> distances{};",
        "std::array<std::string, 2> names{};",
        '#include "geometry_msgs/msg/pose.hpp"',
    ):
        assert line in text


def test_a_comment_with_an_apostrophe_is_no_part_of_a_message(tmp_path):
    message = tmp_path / "Wheel.msg"
    message.write_text(
        "float64 radius  # the wheel's, m\n"
        "uint8 LEFT=1 # the driver's left\n"
        "string NAME='left'  # don't translate\n"
        "bool is_driven True\n"
    )
    text = message_header("tiny_msgs", message)
    for line in (
        "double radius{};",
        "static constexpr std::uint8_t LEFT = 1;",
        'inline static const std::string NAME = "left";',
        "bool is_driven{true};",
    ):
        assert line in text


def test_the_command_builds_and_says_what_there_is(tiny, copied, capsys):
    assert main(["nav2-build", str(copied), "--as", "mine"]) == 0
    shown = capsys.readouterr().out
    assert "mine: Nav2 jazzy 1.3.99" in shown
    assert "  tiny::Controller\n" in shown


def test_builds_are_listed(tiny, capsys):
    assert main(["list"]) == 0
    # The title breaks where no other build makes the table as wide.
    shown = " ".join(capsys.readouterr().out.split())
    assert "builds of Nav2 (for rpp@NAME)" in shown
    assert "Nav2 jazzy 1.3.99" in shown


def _fails(*arguments, capsys) -> str:
    assert main(["nav2-build", *map(str, arguments)]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    return captured.err


def test_a_folder_that_is_no_checkout_is_one_line(tmp_path, capsys):
    assert "no package nav2_core" in _fails(tmp_path, capsys=capsys)
    assert "no such folder" in _fails(tmp_path / "nowhere", capsys=capsys)


def test_an_unknown_release_is_one_line(copied, capsys):
    path = copied / "nav2_core" / "package.xml"
    path.write_text(path.read_text().replace("1.3.99", "9.1.0"))
    error = _fails(copied, capsys=capsys)
    assert "nav2_core/package.xml: version: got '9.1.0', expected" in error
    assert "jazzy (1.3)" in error


def test_a_package_that_is_no_xml_is_one_line(copied, capsys):
    (copied / "tiny_controller" / "package.xml").write_text("<package>")
    assert "tiny_controller/package.xml: not XML" in _fails(copied, capsys=capsys)


def test_a_compile_error_tells_its_first_line_and_where_the_log_is(tiny, copied, capsys, builds):
    source = copied / "tiny_controller" / "src" / "tiny_controller.cpp"
    export = source.read_text().splitlines()[-1]
    # The headers are left out, as the compiler would read them first.
    source.write_text("\n" * 14 + f"int broken = no_such_thing;\n{export}\n")
    error = _fails(copied, "--as", "broken", capsys=capsys)
    assert f"{source}:15: " in error
    assert "no_such_thing" in error
    log = builds / "drake_navbench" / "native" / "logs" / "broken.log"
    assert f"the whole log: {log}" in error
    assert "no_such_thing" in log.read_text()
    with pytest.raises(InputError, match="'broken' is not known"):
        find_build("broken")


def test_a_missing_compiler_is_one_line(copied, capsys, monkeypatch):
    monkeypatch.setenv("PATH", "")
    monkeypatch.delenv("CXX", raising=False)
    assert "compiler: no c++, g++ or clang++" in _fails(copied, capsys=capsys)
    monkeypatch.setenv("CXX", "no-such-compiler -m64")
    assert "compiler: no 'no-such-compiler' (of CXX)" in _fails(copied, capsys=capsys)


def test_a_missing_library_is_one_line_with_the_package_that_has_it(copied, capsys, monkeypatch):
    library = {"nowhere": ("no/such/header.hpp", "apt-get install libnowhere-dev")}
    monkeypatch.setattr("drake_navbench.native.compiler.SYSTEM_LIBRARIES", library)
    path = copied / "tiny_controller" / "package.xml"
    path.write_text(
        path.read_text().replace("<depend>tiny", "<depend>nowhere</depend><depend>tiny")
    )
    expected = (
        "tiny_controller cannot be built, as this is missing: nowhere (apt-get install "
        "libnowhere-dev)"
    )
    assert expected in _fails(copied, capsys=capsys)
    assert expected in _fails(copied, "--packages", "tiny_controller", capsys=capsys)


def test_a_package_that_is_not_there_is_one_line_with_the_nearest(copied, capsys):
    error = _fails(copied, "--packages", "tiny_controler", capsys=capsys)
    assert "did you mean 'tiny_controller'?" in error


def test_a_name_that_no_column_could_have_is_one_line(copied, capsys):
    assert "name of a build: got 'a:b'" in _fails(copied, "--as", "a:b", capsys=capsys)


@pytest.mark.long
def test_the_stand_ins_serve_both_standards(copied, tiny, monkeypatch):
    monkeypatch.setattr("drake_navbench.native.compiler.SYSTEM_LIBRARIES", {})
    path = copied / "tiny_controller" / "package.xml"
    path.write_text(
        path.read_text().replace("<depend>tiny", "<depend>xtensor</depend><depend>tiny")
    )
    assert build_checkout(copied, name="older").controllers == tiny.controllers


def test_the_first_error_of_a_linker_is_told():
    text = "/usr/bin/ld: a.o: in function `f':\na.cpp:(.text+0x5): undefined reference to `g()'\n"
    assert first_error(text) == "undefined reference to `g()'"


def test_a_described_name_stands_for_its_class(tiny):
    client = {"plugin": "tiny/Nickname", "parameters": {"speed": 0.2}}
    parameters = ExternalController.Parameters(command=[str(tiny.host)], client=client)
    controller = ExternalController(parameters, controller_setup(load_robot("wheelchair")))
    controller.close()
    assert controller.not_read == ()
    # The tests' checkout has the interface of Jazzy, whose controllers cut the plan themselves.
    assert controller.cuts_plan
