#pragma once

#include "stand_ins/builtin_interfaces.hpp"

namespace std_msgs::msg {

struct Header {
  builtin_interfaces::msg::Time stamp;
  std::string frame_id;
  DRAKE_NAVBENCH_MESSAGE(Header)
};

struct ColorRGBA {
  float r = 0, g = 0, b = 0, a = 0;
  DRAKE_NAVBENCH_MESSAGE(ColorRGBA)
};

template <typename Data>
struct Plain {
  Data data{};
  DRAKE_NAVBENCH_MESSAGE(Plain)
};
using Bool = Plain<bool>;
using Float32 = Plain<float>;
using Float64 = Plain<double>;
using Int32 = Plain<std::int32_t>;
using String = Plain<std::string>;
struct Empty {
  DRAKE_NAVBENCH_MESSAGE(Empty)
};

}  // namespace std_msgs::msg
