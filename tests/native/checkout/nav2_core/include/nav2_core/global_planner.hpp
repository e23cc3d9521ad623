// The public planner interface of the Jazzy release, written for the tests.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "geometry_msgs/msg/pose_stamped.hpp"
#include "nav2_costmap_2d/costmap_2d_ros.hpp"
#include "nav_msgs/msg/path.hpp"

namespace nav2_core {

struct NoValidPathCouldBeFound : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct GlobalPlanner {
  virtual ~GlobalPlanner() = default;
  virtual void configure(const rclcpp_lifecycle::LifecycleNode::WeakPtr & parent, std::string name,
                         std::shared_ptr<tf2_ros::Buffer> transforms,
                         std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap) = 0;
  virtual void cleanup() = 0;
  virtual void activate() = 0;
  virtual void deactivate() = 0;
  virtual nav_msgs::msg::Path createPlan(const geometry_msgs::msg::PoseStamped & start,
                                         const geometry_msgs::msg::PoseStamped & goal,
                                         std::function<bool()> cancel_checker) = 0;
};

}  // namespace nav2_core
