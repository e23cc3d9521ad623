#pragma once

#include "geometry_msgs/msg/pose.hpp"
#include "geometry_msgs/msg/twist.hpp"
#include "nav2_costmap_2d/costmap_2d_ros.hpp"
#include "rclcpp_lifecycle/lifecycle_node.hpp"

namespace nav2_core {

struct GoalChecker {
  virtual ~GoalChecker() = default;
  virtual void initialize(const rclcpp_lifecycle::LifecycleNode::WeakPtr & parent,
                          const std::string & name,
                          const std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap) = 0;
  virtual void reset() = 0;
  virtual bool isGoalReached(const geometry_msgs::msg::Pose & query,
                             const geometry_msgs::msg::Pose & goal,
                             const geometry_msgs::msg::Twist & velocity) = 0;
  virtual bool getTolerances(geometry_msgs::msg::Pose & pose,
                             geometry_msgs::msg::Twist & velocity) = 0;
};

}  // namespace nav2_core
