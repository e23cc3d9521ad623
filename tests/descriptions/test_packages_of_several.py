"""Of several models and Nav2 files in a repository those that belong together are taken."""

from __future__ import annotations

import pytest
from package_scenes import NAV2, filled, map_files

from drake_navbench.inputs.descriptions.ros_packages import forget_folders
from drake_navbench.inputs.package_search import find_package_files
from drake_navbench.nav2.driven_file import driven_file


@pytest.mark.parametrize("is_launched", [False, True])
@pytest.mark.parametrize("name", ["robot.urdf.xacro", "hauler_base.urdf.xacro"])
def test_of_two_robots_each_has_its_own_nav2_file(repository, name, is_launched):
    """The words of their folders tell, not `robot`, which each robot is; a launch file as well."""
    cart = next(repository.rglob("cart.urdf.xacro"))
    hauler = repository / "hauler_description" / "urdf" / name
    hauler.parent.mkdir(parents=True)
    hauler.write_text(cart.read_text())
    of_hauler = repository / "hauler_nav" / "params.yaml"
    of_cart = repository / "cart_nav" / "config" / "my_robot.yaml"
    for file in (of_hauler, of_cart):
        file.parent.mkdir(exist_ok=True)
        file.write_text(NAV2)
    if is_launched:
        (repository / "start.launch.py").write_text(f"start('{name}', 'my_robot.yaml')")
    files = find_package_files([repository])
    assert files.fitting("nav2", hauler) == (of_cart if is_launched else of_hauler)
    assert files.fitting("nav2", cart) == of_cart.parent / "nav2_params.yaml"


def test_words_of_folders_do_not_outweigh_a_launch_file(repository):
    """The launch file names no model; by the word `sim` the other Nav2 file is the hauler's."""
    cart = next(repository.rglob("cart.urdf.xacro"))
    hauler = repository / "hauler_sim" / "robot.urdf.xacro"
    hauler.parent.mkdir()
    hauler.write_text(cart.read_text())
    for name in ("nav/nav2_hall.yaml", "nav/sim/nav2_hall_sim.yaml"):
        (repository / name).parent.mkdir(parents=True, exist_ok=True)
        (repository / name).write_text(NAV2)
    files = find_package_files([repository])
    assert files.fitting("nav2", hauler) == repository / "nav/sim/nav2_hall_sim.yaml"
    (repository / "start.launch.py").write_text("share('nav', 'nav2_hall.yaml')")
    forget_folders()
    files = find_package_files([repository])
    assert files.fitting("nav2", hauler) == repository / "nav/nav2_hall.yaml"


@pytest.mark.parametrize(
    ("launched", "told"),
    [
        ("'urdf', 'hauler.urdf.xacro'", ["not there: hauler.urdf.xacro, which a.launch.py names"]),
        ("'urdf', 'hauler.urdf.xacro', 'urdf', 'cart.urdf.xacro'", []),
        ("'config', 'hall_nav2.yaml'", ["not there: hall_nav2.yaml, which a.launch.py names"]),
        ("'config', 'hall_nav2.yaml', 'config', 'nav2_params.yaml'", []),
        # No Nav2 file by its name.
        ("'config', 'ekf.yaml'", []),
    ],
)
def test_a_launched_file_that_is_not_in_the_repository_is_told(repository, launched, told):
    (repository / "a.launch.py").write_text(launched)
    lines = filled("--package", str(repository))[1]
    assert [line.strip() for line in lines if "not there" in line] == told


def test_a_launch_file_passes_another_map_to_the_one_that_it_includes(repository):
    map_files(repository / "cart_nav" / "maps", "attic", "hall", "hall_keep_out")
    (repository / "a_nav.launch.py").write_text("'nav2_params.yaml', 'maps', 'attic.yaml'")
    (repository / "main.launch.py").write_text(
        "HALL = 'hall'\n'a_nav.launch.py', 'nav2_params.yaml', 'maps', f'{HALL}.yaml', "
        "f'{HALL}_keep_out.yaml'"
    )
    assert filled("--package", str(repository))[0].map.name == "hall.yaml"


def test_a_file_that_another_has_replaced_comes_after_it(tmp_path):
    for name in ("a_backup.yaml", "a.old.yaml", "a_copy.yaml", "bold.yaml", "scopy.yaml", "z.yaml"):
        (tmp_path / name).write_text(NAV2)
    found = [path.name for path in find_package_files([tmp_path]).files["nav2"]]
    assert found[:3] == ["bold.yaml", "scopy.yaml", "z.yaml"]


def test_a_launch_file_tells_which_nav2_file_and_map_belong_together(repository):
    """By their names alone, real.yaml and attic.yaml would come first."""
    config = repository / "cart_nav" / "config"
    (config / "nav2_params.yaml").rename(config / "sim_nav2.yaml")
    (config / "real_nav2.yaml").write_text(NAV2)
    map_files(repository / "cart_nav" / "maps", "attic", "hall")
    map_files(repository / "cart_old" / "maps", "hall")
    launch = repository / "cart_nav" / "launch"
    launch.mkdir()
    (launch / "sim.launch.py").write_text(
        "# default: attic.yaml\n"
        "share = get_package_share_directory('cart_nav')\n"
        "nav2 = os.path.join(share, 'config', 'sim_nav2.yaml')\n"
        "map = share + '/maps/hall.yaml'\n"
    )
    arguments, lines = filled("--package", str(repository))
    assert [path.name for path in arguments.nav2] == ["sim_nav2.yaml"]
    assert arguments.map == repository / "cart_nav" / "maps" / "hall.yaml"
    assert any("cart_nav/maps/hall.yaml (as in sim.launch.py)" in line for line in lines)
    picked, _ = filled("--package", str(repository), "--pick", "map=2")
    assert picked.map != arguments.map


@pytest.mark.parametrize(
    ("launched", "taken"),
    [("stock_nav_params.yaml", "stock_nav_params.yaml"), ("other.yaml", "nav2_params.yaml")],
)
def test_a_launched_nav2_file_is_taken_though_another_has_the_plainer_name(
    repository, launched, taken
):
    (repository / "cart_nav" / "config" / "stock_nav_params.yaml").write_text(NAV2)
    (repository / "start.launch.py").write_text(f"'config', '{launched}'")
    arguments, _ = filled("--package", str(repository))
    assert [path.name for path in arguments.nav2] == [taken]


def test_a_map_goes_with_the_nav2_file_that_an_included_launch_file_names(repository):
    """By its name alone attic.yaml would come first, and another launch file names it, too."""
    map_files(repository / "cart_nav" / "maps", "attic", "hall")
    launch = repository / "cart_nav" / "launch"
    launch.mkdir()
    (launch / "navigation.launch.py").write_text("'nav2_params.yaml'")
    (launch / "map.launch.py").write_text("'attic.yaml'")
    (launch / "main.launch.py").write_text("'navigation.launch.py', 'hall.yaml'")
    arguments, lines = filled("--package", str(repository))
    assert arguments.map.name == "hall.yaml"
    assert any("hall.yaml (as in main.launch.py)" in line for line in lines)


def test_a_launched_map_without_its_picture_is_told(repository):
    map_files(repository / "cart_nav" / "maps", "attic", "hall")
    (repository / "cart_nav" / "maps" / "hall.pgm").unlink()
    (repository / "cart_nav" / "main.launch.py").write_text("'nav2_params.yaml', 'hall.yaml'")
    arguments, lines = filled("--package", str(repository))
    assert arguments.map.name == "attic.yaml"
    told = "not read: cart_nav/maps/hall.yaml, which a launch file names: its picture is not there"
    assert told in [line.strip() for line in lines]


def test_a_model_whose_name_an_environment_variable_completes_is_launched(repository):
    """The variable is set in another launch file than that which names the model."""
    cart = next(repository.rglob("cart.urdf.xacro"))
    for name in ("cart_long", "cart_short"):
        (cart.parent / f"{name}.urdf.xacro").write_text(cart.read_text())
    cart.unlink()

    def first():
        return find_package_files([repository]).files["robot"][0].name

    (repository / "show.launch.py").write_text(
        "'urdf', 'cart_' + os.environ['CART'] + '.urdf.xacro'"
    )
    assert first() == "cart_long.urdf.xacro"
    (repository / "all.launch.py").write_text("SetEnvironmentVariable('CART', 'short')")
    forget_folders()
    assert first() == "cart_short.urdf.xacro"


def test_a_launch_file_that_adds_a_mask_makes_it_no_map(repository):
    map_files(repository / "cart_nav" / "maps", "hall", "keepout_mask")
    (repository / "keepout.launch.py").write_text("'nav2_params.yaml', 'keepout_mask.yaml'")
    assert filled("--package", str(repository))[0].map.name == "hall.yaml"


def test_of_nav2_files_of_one_name_it_is_the_one_in_the_folder_of_the_launch_file(repository):
    map_files(repository / "cart_bringup" / "maps", "hall")
    for package in ("cart_bringup", "cart_start"):
        (repository / package / "config").mkdir(parents=True, exist_ok=True)
        (repository / package / "config" / "nav2_params.yaml").write_text(NAV2)
    (repository / "start.launch.py").write_text(
        "share('cart_start', 'nav2_params.yaml'), 'hall.yaml'"
    )
    arguments, _ = filled("--package", str(repository))
    assert arguments.nav2 == [repository / "cart_start" / "config" / "nav2_params.yaml"]


def test_of_nav2_files_of_one_name_it_is_the_one_without_further_folders(repository):
    """A launch file of another robot names the further folder."""
    map_files(repository / "cart_nav" / "maps", "hall")
    further = repository / "cart_nav" / "config" / "a_client" / "nav2_params.yaml"
    further.parent.mkdir()
    further.write_text(NAV2)
    cart = repository / "cart_description" / "urdf" / "cart.urdf.xacro"
    other = repository / "other" / "urdf" / "other.urdf.xacro"
    other.parent.mkdir(parents=True)
    other.write_text(cart.read_text())
    cart.rename(cart.with_name("a_wagon.urdf.xacro"))
    asked = "'config', '{}nav2_params.yaml', 'hall.yaml', '{}'"
    (repository / "a.launch.py").write_text(asked.format("a_client', '", "other.urdf.xacro"))
    (repository / "wagon.launch.py").write_text(asked.format("", "a_wagon.urdf.xacro"))
    arguments, _ = filled("--package", str(repository))
    assert arguments.robot.endswith("a_wagon.urdf.xacro")
    assert arguments.nav2 == [repository / "cart_nav" / "config" / "nav2_params.yaml"]


def test_of_two_models_it_is_the_one_that_a_launch_file_names(repository):
    cart = repository / "cart_description" / "urdf" / "cart.urdf.xacro"
    newer = cart.with_name("wagon_v2.urdf.xacro")
    newer.write_text(cart.read_text())
    (repository / "a.launch.py").write_text("share, 'urdf', 'wagon_v2.urdf.xacro'")
    assert find_package_files([repository]).files["robot"][0] == newer


def test_of_two_models_it_is_the_one_with_the_base_frame_of_the_nav2_file(repository):
    cart = next(repository.rglob("cart.urdf.xacro"))
    text = cart.read_text()
    assert "base_link" in text
    other = cart.with_name("other.urdf.xacro")
    other.write_text(text.replace("base_link", "body_link"))
    for frame, model in (("base_link", cart), ("<robot>/body_link", other)):
        nav2 = NAV2.replace("base_footprint", frame)
        (repository / "cart_nav" / "config" / "nav2_params.yaml").write_text(nav2)
        arguments, _ = filled("--package", str(repository))
        assert arguments.robot == str(model)


def test_without_launch_files_the_plainest_name_of_a_nav2_file_counts(repository):
    config = repository / "cart_nav" / "config"
    (config / "nav2_explore_params.yaml").write_text(NAV2)
    arguments, _ = filled("--package", str(repository))
    assert [path.name for path in arguments.nav2] == ["nav2_params.yaml"]


def test_a_file_that_names_the_controller_server_only_in_a_remark_is_no_nav2_file(repository):
    text = NAV2.partition("local_costmap:")
    (repository / "cart_nav" / "config" / "nav2.yaml").write_text(
        f"# no controller_server here: FollowPath is a node of ours\n{text[1]}{text[2]}"
    )
    found = find_package_files([repository]).files["nav2"]
    assert [file.name for file in found] == ["nav2_params.yaml"]


def test_a_nav2_file_of_whose_controllers_none_exists_here_gives_way_to_the_next(repository):
    folder = repository / "cart_nav" / "config"
    own = NAV2.replace("nav2_regulated_pure_pursuit_controller::Regulated", "cart_nav::Own")
    (folder / "nav2_params.yaml").write_text(own)
    (folder / "nav2_params_rpp.yaml").write_text(NAV2)
    assert driven_file([folder / "nav2_params.yaml"]) == (folder / "nav2_params.yaml", [])
    arguments, lines = filled("--package", str(repository))
    assert [path.name for path in arguments.nav2] == ["nav2_params_rpp.yaml"]
    (told,) = (line for line in lines if line.startswith("left out, the next Nav2 file is taken: "))
    assert "'cart_nav::OwnPurePursuitController' has no counterpart here" in told
    picked, _ = filled("--package", str(repository), "--pick", "nav2=1")
    assert [path.name for path in picked.nav2] == ["nav2_params.yaml"]
    # A controller server of 2019 lists none.
    (folder / "nav2_params.yaml").write_text(
        "controller_server:\n  ros__parameters: {max_vel_x: 1}"
    )
    files = [folder / "nav2_params.yaml", folder / "nav2_params_rpp.yaml"]
    taken, (line,) = driven_file(files)
    assert taken == files[1]
    assert line.endswith("nav2_params.yaml: its controller_server lists no controller")


def test_the_nav2_file_of_a_model_in_gazebo_s_form_is_found_by_its_folder(repository):
    model = repository / "models" / "cart_mini" / "model.sdf"
    model.parent.mkdir(parents=True)
    model.write_text("")
    config = repository / "cart_nav" / "config"
    (config / "cart_mini_nav2.yaml").write_text(NAV2)
    fitting = find_package_files([repository]).fitting("nav2", model)
    assert fitting == config / "cart_mini_nav2.yaml"
