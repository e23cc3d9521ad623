"""The host's normals: to the last bit those that the port of MPPI draws."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from drake_navbench.controllers.mppi.lanes import LANES, unpack
from drake_navbench.controllers.mppi.noise import fill_normal
from drake_navbench.native.compiler import find_compiler
from drake_navbench.native.flags import OLDER_STANDARD, RELEASE, STRICT
from drake_navbench.native.headers import NATIVE

# Writes the normals of a key. It is given: seed, deviation, samples, steps and names.
PROGRAM = """
#include "host/normal_noise.hpp"
#include <cstdio>
#include <cstdlib>
int main(int count, char ** words) {
  const auto number = [&](int i) { return std::strtoull(words[i], nullptr, 10); };
  const std::size_t samples = number(3), steps = number(4);
  std::vector<std::uint64_t> names;
  for (int i = 5; i < count; ++i) names.push_back(number(i));
  std::vector<float> normals(samples * steps);
  drake_navbench::DrawNormals(
      number(1), names, std::strtof(words[2], nullptr), samples, steps,
      [&](std::size_t sample, std::size_t step, float normal) {
        normals[sample * steps + step] = normal;
      });
  std::fwrite(normals.data(), sizeof(float), normals.size(), stdout);
}
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """The program, compiled with the flags of a build."""
    folder = tmp_path_factory.mktemp("noise")
    source = folder / "normals.cpp"
    source.write_text(PROGRAM)
    compiler = find_compiler()
    flags = (OLDER_STANDARD, *RELEASE, *STRICT)
    compiler.run(
        [*flags, f"-I{NATIVE}", str(source), "-o", str(folder / "normals")], folder / "log"
    )
    return folder / "normals"


@pytest.mark.parametrize(
    ("seed", "names", "deviation", "samples", "steps"),
    [
        (0, (4, 1, 0, 0, 0), 0.2, 64, 2),
        (7, (4, 1, 123, 1, 2), 0.4, 100, 57),
        # A seed of two words, a name of none; an odd number of rows, of which the last is half.
        (2**63 + 5, (4, 0, 3, 2), 0.35, 65, 3),
        (2**32, (0,), 1.5, 1, 1),
    ],
)
def test_normals_are_those_of_the_port(program, seed, names, deviation, samples, steps):
    blocks = np.zeros((-(-samples // LANES), steps, LANES), np.float32)
    fill_normal((seed, *names), deviation, blocks)
    words = [seed, deviation, samples, steps, *names]
    done = subprocess.run([program, *map(str, words)], capture_output=True, check=True)
    told = np.frombuffer(done.stdout, np.float32).reshape(samples, steps)
    np.testing.assert_array_equal(told, unpack(blocks, samples))
