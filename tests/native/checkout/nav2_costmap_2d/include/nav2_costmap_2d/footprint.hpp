#pragma once

#include <vector>

#include "geometry_msgs/msg/polygon.hpp"

namespace nav2_costmap_2d {

inline geometry_msgs::msg::Polygon toPolygon(const std::vector<geometry_msgs::msg::Point> & points) {
  geometry_msgs::msg::Polygon polygon;
  for (const auto & point : points) {
    polygon.points.push_back({static_cast<float>(point.x), static_cast<float>(point.y), 0.0f});
  }
  return polygon;
}

}  // namespace nav2_costmap_2d
