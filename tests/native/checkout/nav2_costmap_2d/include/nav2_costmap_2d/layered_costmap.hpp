#pragma once

#include <string>
#include <vector>

#include "geometry_msgs/msg/point.hpp"
#include "nav2_costmap_2d/costmap_2d.hpp"

namespace nav2_costmap_2d {

class LayeredCostmap {
 public:
  LayeredCostmap(std::string, bool, bool) {}
  Costmap2D * getCostmap() { return &grid_; }
  void resizeMap(unsigned int width, unsigned int height, double resolution, double x, double y) {
    grid_.resizeMap(width, height, resolution, x, y);
  }
  void setFootprint(const std::vector<geometry_msgs::msg::Point> & outline) { outline_ = outline; }
  const std::vector<geometry_msgs::msg::Point> & getFootprint() const { return outline_; }

 private:
  Costmap2D grid_;
  std::vector<geometry_msgs::msg::Point> outline_;
};

}  // namespace nav2_costmap_2d
