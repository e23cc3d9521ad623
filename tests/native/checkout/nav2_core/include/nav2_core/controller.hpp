// The public controller interface of the Jazzy release, written for the tests.
#pragma once

#include <memory>
#include <string>

#include "geometry_msgs/msg/pose_stamped.hpp"
#include "geometry_msgs/msg/twist_stamped.hpp"
#include "nav2_core/goal_checker.hpp"
#include "nav_msgs/msg/path.hpp"
#include "pluginlib/class_loader.hpp"
#include "tf2_ros/buffer.h"

namespace nav2_core {

struct Controller {
  virtual ~Controller() = default;
  virtual void configure(const rclcpp_lifecycle::LifecycleNode::WeakPtr & parent, std::string name,
                         std::shared_ptr<tf2_ros::Buffer> transforms,
                         std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap) = 0;
  virtual void cleanup() = 0;
  virtual void activate() = 0;
  virtual void deactivate() = 0;
  virtual void setPlan(const nav_msgs::msg::Path & path) = 0;
  virtual geometry_msgs::msg::TwistStamped computeVelocityCommands(
      const geometry_msgs::msg::PoseStamped & pose, const geometry_msgs::msg::Twist & velocity,
      GoalChecker * goal_checker) = 0;
  virtual bool cancel() { return true; }
  virtual void setSpeedLimit(const double & limit, const bool & is_percentage) = 0;
  virtual void reset() {}
};

}  // namespace nav2_core
