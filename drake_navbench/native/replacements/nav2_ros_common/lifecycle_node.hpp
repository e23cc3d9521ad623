// The node of a server, for every release: where there is no nav2_ros_common, nav2_util's is it.
#pragma once

#include "stand_ins/pluginlib.hpp"
#include "stand_ins/rclcpp_lifecycle.hpp"
#include "stand_ins/tf2_ros.hpp"

namespace nav2 {

using CallbackReturn = rclcpp_lifecycle::node_interfaces::LifecycleNodeInterface::CallbackReturn;
template <typename Message>
using Publisher = rclcpp::Publisher<Message>;
template <typename Message>
using Subscription = rclcpp::Subscription<Message>;
using TransformBuffer = tf2_ros::Buffer;
using TransformListener = tf2_ros::TransformListener;

namespace qos {
struct StandardTopicQoS : rclcpp::QoS { using rclcpp::QoS::QoS; };
struct LatchedPublisherQoS : rclcpp::QoS { using rclcpp::QoS::QoS; };
struct LatchedSubscriptionQoS : rclcpp::QoS { using rclcpp::QoS::QoS; };
struct SensorDataQoS : rclcpp::QoS { using rclcpp::QoS::QoS; };
}  // namespace qos

class LifecycleNode : public rclcpp_lifecycle::LifecycleNode {
 public:
  DRAKE_NAVBENCH_POINTERS(LifecycleNode)
  using rclcpp_lifecycle::LifecycleNode::LifecycleNode;

  SharedPtr shared_from_this() {
    return std::static_pointer_cast<LifecycleNode>(rclcpp_lifecycle::LifecycleNode::shared_from_this());
  }
  WeakPtr weak_from_this() { return shared_from_this(); }

  // Returns the value of a parameter, declared with a default where it is not yet.
  template <typename Value>
  Value declare_or_get_parameter(const std::string & name, const Value & value,
                                 const Descriptor & = {}) {
    if (!has_parameter(name)) return declare_parameter(name, value);
    return get_parameter(name).template get_value<Value>();
  }
  std::string declare_or_get_parameter(const std::string & name, const char * value,
                                       const Descriptor & = {}) {
    return declare_or_get_parameter(name, std::string(value));
  }
  // The same without a default; raises InvalidParameterValueException where none is given.
  template <typename Value>
  Value declare_or_get_parameter(const std::string & name, const Descriptor & = {}) {
    if (!has_parameter(name)) {
      declare_parameter(name, rclcpp::ParameterValue(Value{}).get_type());
    }
    Value value{};
    if (!get_parameter(name, value)) {
      throw rclcpp::exceptions::InvalidParameterValueException("Parameter " + name +
                                                               " not in overrides");
    }
    return value;
  }
};

}  // namespace nav2

// Publishers and subscriptions of a node that is handed on without its type.
namespace nav2::interfaces {

template <typename Message, typename NodePointer, typename... Rest>
auto create_publisher(const NodePointer & node, const std::string & topic, const Rest &...) {
  return node->template create_publisher<Message>(topic);
}
template <typename Message, typename NodePointer, typename... Rest>
auto create_subscription(const NodePointer & node, const std::string & topic, Rest &&...) {
  return node->template create_subscription<Message>(topic);
}

}  // namespace nav2::interfaces

namespace nav2_util {
using nav2::CallbackReturn;
// Where nav2_util has a node of its own, that one takes over the pointer types of its base.
using rclcpp_lifecycle::LifecycleNode;
}  // namespace nav2_util

// The original brings these with it.
#include "nav2_ros_common/node_utils.hpp"
