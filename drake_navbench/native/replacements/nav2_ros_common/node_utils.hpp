// What plugins do with a node's parameters.
#pragma once

#include "nav2_ros_common/lifecycle_node.hpp"

namespace nav2 {

using rcl_interfaces::msg::ParameterDescriptor;

template <typename NodePointer, typename Value>
void declare_parameter_if_not_declared(NodePointer node, const std::string & name,
                                       const Value & value_or_type,
                                       const ParameterDescriptor & = {}) {
  if (!node->has_parameter(name)) node->declare_parameter(name, value_or_type);
}

template <typename Value, typename NodePointer>
Value declare_or_get_parameter(NodePointer node, const std::string & name,
                               const ParameterDescriptor & = {}) {
  return node->template declare_or_get_parameter<Value>(name);
}
template <typename Value, typename NodePointer,
          typename = std::enable_if_t<!std::is_same_v<Value, ParameterDescriptor>>>
Value declare_or_get_parameter(NodePointer node, const std::string & name, const Value & value,
                               const ParameterDescriptor & = {}) {
  return node->declare_or_get_parameter(name, value);
}

// Returns the type of a plugin, `<name>.plugin`; raises PluginlibException where none is given.
template <typename NodePointer>
std::string get_plugin_type_param(NodePointer node, const std::string & name) {
  declare_parameter_if_not_declared(node, name + ".plugin", rclcpp::PARAMETER_STRING);
  std::string type;
  if (!node->get_parameter(name + ".plugin", type)) {
    RCLCPP_FATAL(node->get_logger(), "Can not get 'plugin' param value for %s", name.c_str());
    throw pluginlib::PluginlibException("No 'plugin' param for param ns!");
  }
  return type;
}

inline std::string add_namespaces(const std::string & top, const std::string & sub = "") {
  if (top.empty() || top.back() != '/') return top + "/" + sub;
  return (top.front() == '/' ? top : "/" + top) + sub;
}

// Every thread of the host has the priority that it was started with.
inline void setSoftRealTimePriority() {}

}  // namespace nav2
