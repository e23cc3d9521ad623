#pragma once

#include "stand_ins/message.hpp"

namespace builtin_interfaces::msg {

struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  DRAKE_NAVBENCH_MESSAGE(Time)
};

struct Duration {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  DRAKE_NAVBENCH_MESSAGE(Duration)
};

}  // namespace builtin_interfaces::msg
