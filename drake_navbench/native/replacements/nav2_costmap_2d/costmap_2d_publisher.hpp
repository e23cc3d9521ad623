// Nobody sees what it publishes.
#pragma once

#include "nav2_ros_common/lifecycle_node.hpp"

namespace nav2_costmap_2d {

class Costmap2DPublisher {
 public:
  template <typename... Arguments>
  explicit Costmap2DPublisher(const Arguments &...) {}
  void on_activate() {}
  void on_deactivate() {}
  void publishCostmap() {}
};

}  // namespace nav2_costmap_2d
