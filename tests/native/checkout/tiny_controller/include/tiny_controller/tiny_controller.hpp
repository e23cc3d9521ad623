#pragma once

#include "nav2_core/controller.hpp"
#include "tiny_msgs/msg/seen2_d_pose.hpp"

namespace tiny {

// Drives towards the plan's end at a speed of its own; `deed` tells it to do worse.
class Controller : public nav2_core::Controller {
 public:
  void configure(const rclcpp_lifecycle::LifecycleNode::WeakPtr & parent, std::string name,
                 std::shared_ptr<tf2_ros::Buffer> transforms,
                 std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap) override;
  void cleanup() override {}
  void activate() override {}
  void deactivate() override {}
  void setPlan(const nav_msgs::msg::Path & path) override { plan_ = path; }
  geometry_msgs::msg::TwistStamped computeVelocityCommands(
      const geometry_msgs::msg::PoseStamped & pose, const geometry_msgs::msg::Twist & velocity,
      nav2_core::GoalChecker * goal_checker) override;
  bool cancel() override { return !slows_down_ || (is_cancelled_ = true, speed_ <= 0.0); }
  void setSpeedLimit(const double & limit, const bool & is_percentage) override;
  void reset() override {
    is_cancelled_ = false;
    ++resets_;
  }

 private:
  rclcpp::Logger logger_;
  std::shared_ptr<tf2_ros::Buffer> transforms_;
  std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap_;
  nav_msgs::msg::Path plan_;
  std::string deed_;
  double own_speed_ = 0.0, speed_ = 0.0;
  bool slows_down_ = false, is_cancelled_ = false;
  int resets_ = 0;
};

}  // namespace tiny
