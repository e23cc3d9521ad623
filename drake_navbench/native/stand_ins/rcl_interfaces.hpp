#pragma once

#include "stand_ins/builtin_interfaces.hpp"

namespace rcl_interfaces::msg {

struct SetParametersResult {
  bool successful = false;
  std::string reason;
  DRAKE_NAVBENCH_MESSAGE(SetParametersResult)
};

struct FloatingPointRange {
  double from_value = 0, to_value = 0, step = 0;
  DRAKE_NAVBENCH_MESSAGE(FloatingPointRange)
};

struct IntegerRange {
  std::int64_t from_value = 0, to_value = 0;
  std::uint64_t step = 0;
  DRAKE_NAVBENCH_MESSAGE(IntegerRange)
};

struct ParameterDescriptor {
  std::string name;
  std::uint8_t type = 0;
  std::string description, additional_constraints;
  bool read_only = false, dynamic_typing = false;
  std::vector<FloatingPointRange> floating_point_range;
  std::vector<IntegerRange> integer_range;
  DRAKE_NAVBENCH_MESSAGE(ParameterDescriptor)
};

struct ParameterType {
  enum : std::uint8_t {
    PARAMETER_NOT_SET, PARAMETER_BOOL, PARAMETER_INTEGER, PARAMETER_DOUBLE, PARAMETER_STRING,
    PARAMETER_BYTE_ARRAY, PARAMETER_BOOL_ARRAY, PARAMETER_INTEGER_ARRAY, PARAMETER_DOUBLE_ARRAY,
    PARAMETER_STRING_ARRAY
  };
};

struct ParameterEvent {
  DRAKE_NAVBENCH_MESSAGE(ParameterEvent)
};

}  // namespace rcl_interfaces::msg
