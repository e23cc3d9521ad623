// The same for the releases that have it in nav2_util.
#pragma once

#include "nav2_ros_common/node_utils.hpp"

namespace nav2_util {
using nav2::add_namespaces;
using nav2::declare_or_get_parameter;
using nav2::declare_parameter_if_not_declared;
using nav2::get_plugin_type_param;
using nav2::setSoftRealTimePriority;
}  // namespace nav2_util
