"""With which flags a checkout is compiled: those of all machines, or those of its packages."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from plain_package import add_plain_package

from drake_navbench.errors import InputError
from drake_navbench.native.build import build_checkout
from drake_navbench.native.builds import Build, FlagSet, find_build
from drake_navbench.native.compiler import Compiler, find_compiler
from drake_navbench.native.flags import STRICT, Flags, flags_of
from drake_navbench.native.package import Package
from drake_navbench.native.package_options import Options, options_in

CONDITIONS = """
check_cxx_compiler_flag("-mfma" HAS_FMA)  # add_compile_options(-mnever)
if(HAS_FMA)
  add_compile_options(-mfma)
endif()
if(MSVC)
  add_compile_options(-O1)
elseif(UNIX AND (NOT APPLE))
  target_compile_options(core PUBLIC -fconcepts -O3 "-ffast-math" -Wall)
else()
  add_compile_options(-O2)
endif()
set(CMAKE_CXX_FLAGS "${CMAKE_CXX_FLAGS} -funroll-loops -fPIC -O3")
if(BUILD_TESTING)
  if(HAS_FMA)
    target_compile_options(test_core PRIVATE -O0)
  endif()
endif()
"""


def _package(name: str, *dependencies: str) -> Package:
    return Package(name, Path("nowhere"), "1.0.0", frozenset(dependencies))


def test_a_package_asks_in_its_lists_file_for_what_decides_its_numbers():
    # Each once, where it stands last; not what is for tests, for other systems or for the linker.
    found = options_in(CONDITIONS)
    assert found.of_code == ("-mfma", "-ffast-math", "-O2", "-funroll-loops", "-O3")
    assert options_in("") == options_in("if(") == Options()


def test_portable_flags_contract_nothing_and_use_no_instructions():
    package = _package("one")
    words = Flags(FlagSet.PORTABLE, {"one": ("-mfma", "-ffast-math")}).of_package(package)
    assert "-ffp-contract=off" in words
    assert not [word for word in words if word.startswith("-m") or word == "-ffast-math"]


def test_a_packages_flags_come_after_those_of_a_release_and_the_users_last():
    flags = Flags(FlagSet.PACKAGE, {"one": ("-mfma", "-O2")}, given=("-O1",))
    words = flags.of_package(_package("one"))
    levels = [word for word in words if word.startswith("-O")]
    assert levels == ["-O3", "-O2", "-O1"]
    assert "-ffp-contract=off" not in words
    assert flags.of_link == ("-O3", "-O1")


def test_all_of_a_program_uses_the_same_instructions():
    # Eigen lays out memory by them. What asks for none has nothing to contract with either.
    flags = Flags(FlagSet.PACKAGE, {"one": ("-mfma", "-ffast-math")})
    others = flags.of_package(_package("two"))
    assert "-mfma" in others
    assert "-mfma" in flags.of_host
    assert "-ffp-contract=off" in others
    assert "-ffast-math" not in others


def test_what_stands_in_computes_as_it_is_written():
    flags = Flags(FlagSet.PACKAGE, {"one": ("-ffast-math",)}, given=("-ffp-contract=fast",))
    words = flags.of_stand_in(_package("one"))
    assert words[-len(STRICT) :] == STRICT


def test_what_computes_with_xtensor_is_compiled_as_its_releases_do():
    # As C++20 the xtensor of Debian throws where it multiplies two arrays.
    for kind in FlagSet:
        flags = Flags(kind)
        assert flags.of_package(_package("one", "nav2_core", "xtensor"))[0] == "-std=c++17"
        assert flags.of_package(_package("one", "nav2_core", "eigen"))[0] == "-std=c++20"


@pytest.fixture
def asking(nothing_compiled, copied) -> Path:
    """A copy of the tiny checkout with a package that asks for options, of which none has one."""
    lists = add_plain_package(copied).parents[1] / "CMakeLists.txt"
    lists.write_text("add_compile_options(-ffast-math -mavx99 -fdump-tree-all)\n")
    return copied


def _built(checkout: Path, name: str, **named) -> Build:
    return build_checkout(checkout, name=name, wanted=["plain"], **named)


def test_what_the_compiler_does_not_have_is_told_and_left_out(asking):
    told = []
    build = _built(asking, "asking", flags=FlagSet.PACKAGE, tell=told.append)
    assert told[:2] == [
        "plain: not of this compiler or processor: -mavx99",
        "plain: no options that change its code: -fdump-tree-all",
    ]
    assert find_build("asking") == build
    assert build.more_flags == "plain -ffast-math"
    assert build.where_from.endswith("with its packages' flags")


def test_builds_of_other_flags_share_nothing(asking):
    portable, other = _built(asking, "mine"), _built(asking, "other", flags=FlagSet.PACKAGE)
    assert other.host != portable.host
    # What a package asks for is nothing to portable flags.
    (asking / "plain" / "CMakeLists.txt").unlink()
    assert _built(asking, "again").host == portable.host
    assert _built(asking, "release", flags=FlagSet.PACKAGE).host not in (portable.host, other.host)


class _Compiler(Compiler):
    """Of a machine that has one of two sets of instructions; knows no others."""

    NATIVE = "#define __K9__ 1\n#define __FMA__ 1\n"
    ADDED: Mapping[str, str] = {
        "-mfma": "#define __FMA__ 1\n",
        "-mavx9": "#define __AVX9__ 1\n#define __FMA__ 1\n",
        "-march=native": "",
        "-mtune=k9": "#define __tune_k9__ 1\n",
        "-O3": "#define __OPTIMIZE__ 1\n",
    }

    def _output(self, arguments, text):
        options = [word for word in arguments if word[:2] in {"-m", "-O"}]
        if not self.ADDED.keys() >= set(options):
            return None
        if "-march=native" in options:
            return self.NATIVE
        return "#define __K8__ 1\n" + "".join(self.ADDED[option] for option in options)


def test_the_whole_program_is_optimized_as_far_as_the_compiler_can(monkeypatch):
    monkeypatch.delenv("CXXFLAGS", raising=False)
    monkeypatch.setattr(_Compiler, "links", lambda self, words: words == ("-flto",))
    assert flags_of(FlagSet.PORTABLE, (), _Compiler(("c++",), "1")).of_link == ("-O3", "-flto")


def test_an_option_serves_where_the_processor_has_its_instructions():
    compiler = _Compiler(("c++",), "1")
    options = ("-O3", "-mfma", "-mavx9", "-mtune=k9", "-msse9")
    assert [o for o in options if compiler.serves(o)] == ["-O3", "-mfma", "-mtune=k9"]


def test_the_compiler_tells_what_it_knows_and_what_the_processor_has(builds):
    compiler = find_compiler()
    assert compiler.serves("-O3")
    assert not compiler.serves("-fno-such-option")
    assert not compiler.serves("-mno-such-instructions")
    assert not compiler.links(["-lno_such_library"])
    if compiler.knows(["-msse2"]):
        assert compiler.serves("-msse2")


def test_flags_of_the_user_come_with_all_and_are_told(builds, monkeypatch):
    monkeypatch.setenv("CXXFLAGS", "-O1 -DGIVEN")
    flags = flags_of(FlagSet.PORTABLE, (), find_compiler())
    assert flags.description == "CXXFLAGS -O1 -DGIVEN"
    for words in (flags.of_package(_package("one")), flags.of_host, flags.of_link):
        assert words[-2:] == ("-O1", "-DGIVEN")


def test_flags_that_the_compiler_refuses_are_one_line(builds, monkeypatch):
    monkeypatch.setenv("CXXFLAGS", "-fno-such-option")
    with pytest.raises(InputError, match=r"CXXFLAGS: .* refuses -fno-such-option"):
        flags_of(FlagSet.PORTABLE, (), find_compiler())
