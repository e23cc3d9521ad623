// Which of the benchmark's random numbers the cycle at hand has; see drake_navbench/kernels/noise.py.
#pragma once

#include <cstdint>

namespace drake_navbench {

// Set by the host before each cycle. Only a generator of noise that stands in for an original's
// reads it, and counts its passes and resets.
struct CycleNoise {
  std::uint64_t seed = 0;
  std::uint64_t stream = 0;
  std::uint64_t step = 0;
  // Of the cycle, and of the task since its first draw.
  std::uint64_t passes = 0;
  std::uint64_t resets = 0;
  bool is_new_task = true;
};

inline CycleNoise & cycle_noise() {
  static CycleNoise noise;
  return noise;
}

}  // namespace drake_navbench
