#pragma once

#include "stand_ins/rclcpp.hpp"

namespace rclcpp_lifecycle {

template <typename Message>
using LifecyclePublisher = rclcpp::Publisher<Message>;

struct State {};

namespace node_interfaces {
struct LifecycleNodeInterface {
  enum class CallbackReturn { SUCCESS, FAILURE, ERROR };
};
}  // namespace node_interfaces

class LifecycleNode : public rclcpp::Node, public std::enable_shared_from_this<LifecycleNode> {
 public:
  DRAKE_NAVBENCH_POINTERS(LifecycleNode)
  using rclcpp::Node::Node;
};

}  // namespace rclcpp_lifecycle
