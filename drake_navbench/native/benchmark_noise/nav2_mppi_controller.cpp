// MPPI's generator of noise, with the benchmark's numbers: the class is the checkout's, and of it
// only what makes numbers is ours. It has no thread, since each number is a function of its cycle.

#include "nav2_mppi_controller/tools/noise_generator.hpp"

#include "host/cycle_noise.hpp"
#include "host/normal_noise.hpp"

namespace mppi {

namespace {

// As the port numbers its axes, and names its two ways to draw.
enum Axis : std::uint64_t { kVx, kVy, kWz };
enum Way : std::uint64_t { kOnceATask, kInEachPass };

}  // namespace

void NoiseGenerator::initialize(models::OptimizerSettings & settings, bool is_holonomic,
                                const std::string & name, ParametersHandler * parameters) {
  parameters->getParamGetter(name)(regenerate_noises_, "regenerate_noises", false);
  settings_ = settings;
  is_holonomic_ = is_holonomic;
}

void NoiseGenerator::shutdown() {}

void NoiseGenerator::generateNextNoises() { ++drake_navbench::cycle_noise().passes; }

void NoiseGenerator::reset(models::OptimizerSettings & settings, bool is_holonomic) {
  settings_ = settings;
  is_holonomic_ = is_holonomic;
  ++drake_navbench::cycle_noise().resets;
}

void NoiseGenerator::setNoisedControls(models::State & state,
                                       const models::ControlSequence & sequence) {
  auto & key = drake_navbench::cycle_noise();
  // A plugin is also reset before its first task, between two of them, and after a pause.
  if (key.is_new_task) key.resets = 0;
  key.is_new_task = false;
  const auto fill = [&](Axis axis, double deviation, const auto & mean, auto * controls) {
    const std::vector<std::uint64_t> names =
        regenerate_noises_
            ? std::vector<std::uint64_t>{key.stream, kInEachPass, key.step, key.passes, axis}
            : std::vector<std::uint64_t>{key.stream, kOnceATask, key.resets, axis};
    drake_navbench::DrawNormals(
        key.seed, names, static_cast<float>(deviation), settings_.batch_size, settings_.time_steps,
        [&](std::size_t sample, std::size_t step, float normal) {
          (*controls)(sample, step) = mean(step) + normal;
        });
  };
  fill(kVx, settings_.sampling_std.vx, sequence.vx, &state.cvx);
  fill(kWz, settings_.sampling_std.wz, sequence.wz, &state.cwz);
  // What cannot move sideways has no noise there, as in the original and in the port.
  if (is_holonomic_) fill(kVy, settings_.sampling_std.vy, sequence.vy, &state.cvy);
}

// The checkout declares these for its thread, which is never started here.
void NoiseGenerator::noiseThread() {}
void NoiseGenerator::generateNoisedControls() {}

}  // namespace mppi
