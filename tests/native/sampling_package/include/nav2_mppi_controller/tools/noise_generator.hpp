// A generator of noise as MPPI's optimizer calls it, written for the tests.
#pragma once

#include <string>
#include <vector>

namespace mppi {

namespace models {

struct OptimizerSettings {
  struct { float vx = 0.2f, vy = 0.3f, wz = 0.4f; } sampling_std;
  unsigned int batch_size = 70, time_steps = 3;
};

struct Table {
  std::vector<float> numbers = std::vector<float>(70 * 3);
  float & operator()(int sample, int step) { return numbers[3 * sample + step]; }
};

struct State {
  Table cvx, cvy, cwz;
};

struct Row {
  float operator()(int) const { return 0.0f; }
};

struct ControlSequence {
  Row vx, vy, wz;
};

}  // namespace models

// regenerates: what it answers to the one parameter that it is asked for.
struct ParametersHandler {
  bool regenerates = false;
  auto getParamGetter(const std::string &) {
    return [this](bool & value, const std::string &, bool) { value = regenerates; };
  }
};

class NoiseGenerator {
 public:
  void initialize(models::OptimizerSettings & settings, bool is_holonomic, const std::string & name,
                  ParametersHandler * parameters);
  void shutdown();
  void generateNextNoises();
  void setNoisedControls(models::State & state, const models::ControlSequence & sequence);
  void reset(models::OptimizerSettings & settings, bool is_holonomic);

 protected:
  void noiseThread();
  void generateNoisedControls();

  models::OptimizerSettings settings_;
  bool is_holonomic_ = false;
  bool regenerate_noises_ = false;
};

}  // namespace mppi
