// Transforms as Eigen's types.
#pragma once

#include <Eigen/Geometry>

#include "stand_ins/geometry_msgs.hpp"

namespace tf2 {

inline Eigen::Isometry3d transformToEigen(const geometry_msgs::msg::Transform & message) {
  const auto & [t, q] = message;
  return Eigen::Isometry3d(Eigen::Translation3d(t.x, t.y, t.z) *
                           Eigen::Quaterniond(q.w, q.x, q.y, q.z));
}
inline Eigen::Isometry3d transformToEigen(const geometry_msgs::msg::TransformStamped & message) {
  return transformToEigen(message.transform);
}

}  // namespace tf2
