// The goal checker that a controller may ask: it repeats what the benchmark's own has said.
#pragma once

#include "angles/angles.h"
#include "host/conversions.hpp"
#include "nav2_core/goal_checker.hpp"

namespace drake_navbench {

class ToldGoalChecker : public nav2_core::GoalChecker {
 public:
  void Tell(double xy_tolerance, double yaw_tolerance, bool is_xy_reached) {
    xy_tolerance_ = xy_tolerance;
    yaw_tolerance_ = yaw_tolerance;
    is_xy_reached_ = is_xy_reached;
  }

  // Which of these are virtual, and with which arguments, differs from release to release.
  void initialize(const nav2::LifecycleNode::WeakPtr &, const std::string &,
                  const std::shared_ptr<nav2_costmap_2d::Costmap2DROS>) {}
  void initialize(const rclcpp_lifecycle::LifecycleNode::WeakPtr &, const std::string &,
                  const std::shared_ptr<nav2_costmap_2d::Costmap2DROS>) {}
  void reset() {}

  bool isGoalReached(const geometry_msgs::msg::Pose & query, const geometry_msgs::msg::Pose & goal,
                     const geometry_msgs::msg::Twist &) {
    return is_xy_reached_ &&
           std::abs(angles::shortest_angular_distance(tf2::getYaw(query.orientation),
                                                      tf2::getYaw(goal.orientation))) <=
               yaw_tolerance_;
  }
  bool isGoalReached(const geometry_msgs::msg::Pose & query, const geometry_msgs::msg::Pose & goal,
                     const geometry_msgs::msg::Twist & velocity, const nav_msgs::msg::Path &) {
    return isGoalReached(query, goal, velocity);
  }
  bool isGoalXYReached(const geometry_msgs::msg::Pose &, const geometry_msgs::msg::Pose &,
                       const geometry_msgs::msg::Twist &, const nav_msgs::msg::Path &) {
    return is_xy_reached_;
  }

  bool getTolerances(geometry_msgs::msg::Pose & pose, geometry_msgs::msg::Twist & velocity) {
    constexpr double kNone = std::numeric_limits<double>::lowest();
    pose = Pose(xy_tolerance_, xy_tolerance_, yaw_tolerance_);
    pose.position.z = kNone;
    velocity = {{kNone, kNone, kNone}, {kNone, kNone, kNone}};
    return true;
  }
  bool getTolerances(geometry_msgs::msg::Pose & pose, geometry_msgs::msg::Twist & velocity,
                     double & path_length) {
    path_length = std::numeric_limits<double>::lowest();
    return getTolerances(pose, velocity);
  }

 private:
  double xy_tolerance_ = 0.25;
  double yaw_tolerance_ = 0.25;
  bool is_xy_reached_ = false;
};

}  // namespace drake_navbench
