// Its own noise is 0.5 everywhere.
#include "nav2_mppi_controller/tools/noise_generator.hpp"

namespace mppi {

void NoiseGenerator::initialize(models::OptimizerSettings &, bool, const std::string &,
                                ParametersHandler *) {}
void NoiseGenerator::shutdown() {}
void NoiseGenerator::generateNextNoises() {}
void NoiseGenerator::reset(models::OptimizerSettings &, bool) {}
void NoiseGenerator::setNoisedControls(models::State & state, const models::ControlSequence &) {
  for (auto * table : {&state.cvx, &state.cvy, &state.cwz}) table->numbers.assign(70 * 3, 0.5f);
}

}  // namespace mppi
