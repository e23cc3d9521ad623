#include "tiny_controller/tiny_controller.hpp"

#include <chrono>
#include <cstdlib>
#include <thread>

#include "nav2_core/controller_exceptions.hpp"
#include "nav2_util/node_utils.hpp"
#include "pluginlib/class_list_macros.hpp"
#include "tf2/utils.h"
#include "tf2_geometry_msgs/tf2_geometry_msgs.hpp"

namespace tiny {

void Controller::configure(const rclcpp_lifecycle::LifecycleNode::WeakPtr & parent,
                           std::string name, std::shared_ptr<tf2_ros::Buffer> transforms,
                           std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap) {
  const auto node = parent.lock();
  logger_ = node->get_logger();
  transforms_ = transforms;
  costmap_ = costmap;
  const auto declare = [&](const std::string & parameter, auto value) {
    nav2_util::declare_parameter_if_not_declared(node, name + "." + parameter,
                                                 rclcpp::ParameterValue(value));
    node->get_parameter(name + "." + parameter, value);
    return value;
  };
  own_speed_ = speed_ = declare("speed", 0.3);
  deed_ = declare("deed", std::string("drives"));
  slows_down_ = declare("slows_down", false);
  if (deed_ == "refuses") throw std::runtime_error("tiny: does not like its parameters");
}

geometry_msgs::msg::TwistStamped Controller::computeVelocityCommands(
    const geometry_msgs::msg::PoseStamped & pose, const geometry_msgs::msg::Twist &,
    nav2_core::GoalChecker *) {
  if (deed_ == "throws") throw std::logic_error("tiny: lost its mind");
  if (deed_ == "throws nothing known") throw 42;
  if (deed_ == "finds no control") throw nav2_core::NoValidControl("tiny: sees no way");
  if (deed_ == "finds no path") throw nav2_core::InvalidPath("tiny: sees no plan");
  if (deed_ == "crashes") {
    RCLCPP_ERROR(logger_, "tiny: %s", "about to crash");
    std::abort();
  }
  if (deed_ == "hangs") std::this_thread::sleep_for(std::chrono::hours(1));
  if (is_cancelled_) speed_ -= 0.1;

  auto target = plan_.poses.back();
  target = transforms_->transform(target, costmap_->getBaseFrameID());
  tiny_msgs::msg::Seen2DPose seen;
  seen.pose = pose.pose;
  seen.cost = costmap_->getCostmap()->cost_at(pose.pose.position.x, pose.pose.position.y);
  geometry_msgs::msg::TwistStamped command;
  command.twist.linear.x = seen.cost == tiny_msgs::msg::Seen2DPose::FREE ? speed_ : 0.0;
  command.twist.angular.z = std::atan2(target.pose.position.y, target.pose.position.x);
  if (deed_ == "tells resets") command.twist.linear.x = resets_;
  if (deed_ == "tells yaw") command.twist.linear.x = tf2::getYaw(seen.pose.orientation);
  if (deed_ == "tells time") {
    command.twist.linear.x = rclcpp::Clock().now().seconds();
  }
  return command;
}

void Controller::setSpeedLimit(const double & limit, const bool & is_percentage) {
  if (limit == 0.0) {
    speed_ = own_speed_;
  } else {
    speed_ = is_percentage ? own_speed_ * limit / 100.0 : limit;
  }
}

}  // namespace tiny

// By this type the benchmark takes it for the original of its port `graceful`.
namespace nav2_graceful_controller {

class GracefulController : public tiny::Controller {};

}  // namespace nav2_graceful_controller

PLUGINLIB_EXPORT_CLASS(tiny::Controller, nav2_core::Controller)
PLUGINLIB_EXPORT_CLASS(nav2_graceful_controller::GracefulController, nav2_core::Controller)
