#pragma once

#include "stand_ins/message.hpp"

namespace angles {

inline double from_degrees(double degrees) { return degrees * M_PI / 180.0; }
inline double to_degrees(double radians) { return radians * 180.0 / M_PI; }

// In [0, 2 pi).
inline double normalize_angle_positive(double angle) {
  const double rest = std::fmod(angle, 2.0 * M_PI);
  return rest < 0.0 ? rest + 2.0 * M_PI : rest;
}

// In (-pi, pi], rounded as the package rounds it.
inline double normalize_angle(double angle) {
  const double rest = std::fmod(angle + M_PI, 2.0 * M_PI);
  return rest <= 0.0 ? rest + M_PI : rest - M_PI;
}

inline double shortest_angular_distance(double from, double to) {
  return normalize_angle(to - from);
}

}  // namespace angles
