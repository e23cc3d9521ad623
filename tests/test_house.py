"""The shape of the house: what is packaged, and how many parameters a function takes."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path
from types import CodeType

import pytest

REPOSITORY = Path(__file__).parents[1]
PYPROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
SETUPTOOLS, PROJECT = PYPROJECT["tool"]["setuptools"], PYPROJECT["project"]
# Modules that are named otherwise than the distribution that brings them.
DISTRIBUTIONS = {
    "PIL": "pillow",
    "backports": "backports.zstd",
    "drake_navbench": PROJECT["name"].replace("-", "_"),
    "pydrake": "drake",
    "ruamel": "ruamel.yaml",
    "yaml": "pyyaml",
}
# Of Pythons newer than the oldest that we support.
NEWER_STANDARD_LIBRARY = {"compression"}
MOST_PARAMETERS = 12
MANY_PARAMETERS = 8
# Functions with more than MANY_PARAMETERS. The list only shrinks: a name that no longer belongs on
# it is taken off, and none is added.
WITH_MANY_PARAMETERS = {
    "controllers/harmony/prediction.py:_updated_errors",
    "controllers/harmony/rows.py:_bound",
    "controllers/harmony/rows.py:_bound_of_two",
    "controllers/mppi/motion_models.py:_step_row",
    "controllers/mppi/motion_models.py:pose_lanes",
    "drake_navbench/campaign/benchmark.py:run_benchmark",
}

# A kernel's record is made of the parameter model (`ControllerParameters.as_record`). These tuples
# repeat at least REPEATED names of the model beside them; the list only shrinks.
REPEATED = 5
SPELLED_AGAIN = {
    # Under a speed limit, each changes from cycle to cycle.
    "controllers/dwb/kinematics.py:Kinematics",
    "controllers/graceful/control_law.py:Law",
    # In single precision.
    "controllers/mppi/motion_models.py:MotionLimits",
}


def tracked(*patterns: str) -> list[Path]:
    """Returns the files of the repository that fit, relative to it; new ones count."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z", *patterns]
    found = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=True)
    return [
        Path(name) for name in found.stdout.split("\0") if name and (REPOSITORY / name).exists()
    ]


def product_files() -> list[Path]:
    return tracked("drake_navbench/*.py", "analysis/*.py", "controllers/*.py")


def packages_in(files: list[Path]) -> set[str]:
    """Returns the packages that folders with files of ours are installed as."""
    mapped = {path: name for name, path in SETUPTOOLS["package-dir"].items() if "/" not in path}
    return {
        ".".join([mapped[file.parts[0]], *file.parent.parts[1:]])
        for file in files
        if file.parts[0] in mapped
    }


def parameter_count(code: CodeType) -> int:
    """Returns how many parameters a call may give, without `self` and `cls`."""
    names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    return len([name for name in names if name not in ("self", "cls")])


def many_parameters(code: CodeType, file: str) -> dict[str, int]:
    """Returns the functions within compiled code with more than MANY_PARAMETERS.

    They are named `file:function`. The compiler is several times as fast as a tree of its syntax.
    """
    counts: dict[str, int] = {}
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            counts |= many_parameters(inner, file)
            count = parameter_count(inner)
            if count > MANY_PARAMETERS and not inner.co_name.startswith("<"):
                counts[f"{file}:{inner.co_name}"] = count
    return counts


@pytest.fixture(scope="module")
def functions_with_many() -> dict[str, int]:
    return {
        name: n
        for file in product_files()
        for name, n in many_parameters(compiled(file), str(file)).items()
    }


def compiled(file: Path) -> CodeType:
    return compile((REPOSITORY / file).read_text(encoding="utf-8"), str(file), "exec")


def test_every_folder_with_code_is_packaged_and_no_other():
    """An editable install hides a package that the wheel would lack."""
    with_code = packages_in(tracked("*.py"))
    listed = set(SETUPTOOLS["packages"])
    assert with_code <= listed
    # Those without code hold data.
    with_files = packages_in(tracked())
    assert listed <= with_files


def test_a_folder_that_is_not_listed_is_found():
    assert packages_in([Path("analysis/planted/a.py")]) == {"drake_navbench.analysis.planted"}
    assert packages_in([Path("tests/planted/a.py")]) == set()


def test_no_function_takes_more_than_twelve_parameters(functions_with_many):
    too_many = {name: n for name, n in functions_with_many.items() if n > MOST_PARAMETERS}
    assert not too_many


def test_the_list_of_functions_with_many_parameters_only_shrinks(functions_with_many):
    added = functions_with_many.keys() - WITH_MANY_PARAMETERS
    assert not added, f"more than {MANY_PARAMETERS} parameters: group those that belong together"
    mended = WITH_MANY_PARAMETERS - functions_with_many.keys()
    assert not mended, "take them off WITH_MANY_PARAMETERS"


@cache
def fields_of_classes(file: Path, ending: str) -> dict[str, set[str]]:
    """Returns annotated names by class; `ending`: of the class's name or of a base's."""
    text = (REPOSITORY / file).read_text(encoding="utf-8")
    if ending not in text:
        return {}
    tree = ast.parse(text)
    return {
        node.name: {
            entry.target.id
            for entry in node.body
            if isinstance(entry, ast.AnnAssign) and isinstance(entry.target, ast.Name)
        }
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
        and any(name.endswith(ending) for name in (node.name, *map(ast.unparse, node.bases)))
    }


def spelled_again(files: list[Path]) -> set[str]:
    """Returns the named tuples, `file:class`, that repeat fields of the model in their folder."""
    found = set()
    for file in files:
        models = fields_of_classes(file.with_name("parameters.py"), "Parameters")
        known = set().union(*models.values())
        for name, fields in fields_of_classes(file, "NamedTuple").items():
            if len(fields & known) >= REPEATED:
                found.add(f"{file}:{name}")
    return found


def test_no_further_record_of_a_kernel_spells_the_parameters_again():
    files = tracked("controllers/*/*.py")
    assert len(files) > 100
    with_model = [f for f in files if (REPOSITORY / f).with_name("parameters.py").exists()]
    assert spelled_again(with_model) == SPELLED_AGAIN


def test_parameters_are_counted_without_self():
    code = "class A:\n    def f(self, a, /, b, *c, d=1, **e): ...\n"
    (inner,) = (part for part in compile(code, "", "exec").co_consts if isinstance(part, CodeType))
    (function,) = (part for part in inner.co_consts if isinstance(part, CodeType))
    assert parameter_count(function) == 3
    names = ", ".join(f"a{k}" for k in range(9))
    found = many_parameters(compile(f"def g({names}): lambda {names}: 0", "", "exec"), "x.py")
    assert found == {"x.py:g": 9}


def test_whoever_compiles_imports_the_package_that_knows_where_kernels_are_kept():
    """Controllers do it once, in their package."""
    compiling = {
        file: (REPOSITORY / file).read_text(encoding="utf-8")
        for file in product_files()
        if not str(file).startswith(("controllers/", "drake_navbench/kernels/"))
    }
    lost = [
        str(file)
        for file, code in compiling.items()
        if re.search(r"^from numba(\.extending)? import .*(njit|register_jitable)", code, re.M)
        and not re.search(r"^(import|from) drake_navbench\.kernels", code, re.M)
    ]
    assert not lost


# A line that imports, or a line of text that looks like one.
IMPORT = re.compile(r"^\s*(?:from\s+(\w+)|import\s+(.+))", re.MULTILINE)


def perhaps_imported_by(source: str) -> set[str]:
    """Returns all names that `imported_by` may return, sooner."""
    lists = (one or many for one, many in IMPORT.findall(source))
    names = {
        name.strip().partition(".")[0].split(" ")[0] for some in lists for name in some.split(",")
    }
    return names - sys.stdlib_module_names - NEWER_STANDARD_LIBRARY


def imported_by(source: str) -> set[str]:
    """Returns the names of the libraries that a file imports anywhere, without the standard one."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module.partition(".")[0])
    return names - sys.stdlib_module_names - NEWER_STANDARD_LIBRARY


def test_every_library_that_is_imported_is_declared():
    groups = [PROJECT["dependencies"], *PROJECT["optional-dependencies"].values()]
    texts = [text for group in groups for text in group]
    declared = {re.split(r"[<>=;\[ ]", text)[0].lower().replace("-", "_") for text in texts}
    declared.add(DISTRIBUTIONS["drake_navbench"])

    def undeclared(names: set[str]) -> set[str]:
        return {name for name in names if DISTRIBUTIONS.get(name, name).lower() not in declared}

    missing: dict[str, str] = {}
    for file in product_files():
        source = (REPOSITORY / file).read_text(encoding="utf-8")
        if undeclared(perhaps_imported_by(source)):
            missing |= dict.fromkeys(undeclared(imported_by(source)), str(file))
    assert not missing


def test_an_import_within_a_function_is_found():
    code = "def f():\n    from planted.part import g\nimport os, numpy.linalg as b, c"
    found = {"planted", "numpy", "c"}
    assert imported_by(code) == perhaps_imported_by(code) == found


# First words that name nothing: a docstring's first line names the thing that it describes.
WORDLESS = re.compile(
    r"(what|whatever|who|whoever|all that|that which|those|where|how|lets|says"
    r"|(returns|yields) (what|whatever|all that|those|that|where|how|who|which))\b",
    re.IGNORECASE,
)
HOUSES = ("drake_navbench", "controllers", "analysis", "studies", "examples", ".ci")


def wordless_docstrings(source):
    """Returns the first lines of docstrings that begin with a word of WORDLESS."""
    if not re.search(rf'"""\s*(?i:{WORDLESS.pattern})', source):
        return []
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    found = (
        ast.get_docstring(node) for node in ast.walk(ast.parse(source)) if isinstance(node, kinds)
    )
    return [text.partition("\n")[0] for text in found if text and WORDLESS.match(text)]


def test_a_docstring_that_names_nothing_is_found():
    source = '"""What a run holds."""\ndef f():\n    """Returns what it says."""\n'
    assert wordless_docstrings(source) == ["What a run holds.", "Returns what it says."]
    assert wordless_docstrings('"""Whatsoever; showers. Returns thatch."""') == []


@pytest.mark.parametrize("house", HOUSES)
def test_the_first_line_of_a_docstring_names_the_thing(house):
    files = sorted((REPOSITORY / house).rglob("*.py"))
    assert files
    found = {
        str(path.relative_to(REPOSITORY)): wordless_docstrings(path.read_text(encoding="utf-8"))
        for path in files
    }
    assert {path: lines for path, lines in found.items() if lines} == {}


# A comment names its thing, too: "Of a strip of dots, px" does not say what has pixels.
NAMELESS_COMMENT = re.compile(r"^ *# Of ", re.MULTILINE)
ROOMS = (
    *("campaign", "inputs", "kernels", "logs", "native", "nav2", "navigation"),
    *("plugins", "processes", "ros2", "trial", "typed_files"),
)


def test_a_comment_that_names_nothing_is_found():
    assert NAMELESS_COMMENT.search("A = 1\n    # Of a strip, px.\nB = 2\n")
    assert not NAMELESS_COMMENT.search("# The width of a strip. Of others none.\n")


@pytest.mark.parametrize(
    "house", ["controllers", "analysis", *(f"drake_navbench/{r}" for r in ROOMS)]
)
def test_a_comment_names_its_thing(house):
    files = sorted((REPOSITORY / house).rglob("*.py"))
    assert files
    assert [str(f) for f in files if NAMELESS_COMMENT.search(f.read_text(encoding="utf-8"))] == []


def test_scripts_of_studies_read_their_command_line():
    scripts = [
        path
        for path in sorted((REPOSITORY / "studies").glob("*.py"))
        if '__name__ == "__main__"' in path.read_text(encoding="utf-8")
    ]
    assert len(scripts) > 20
    mute = [
        path.name
        for path in scripts
        if not re.search(r"ArgumentParser\(\s*description=", path.read_text(encoding="utf-8"))
    ]
    assert mute == []
