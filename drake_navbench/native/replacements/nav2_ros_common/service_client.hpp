#pragma once

#include "nav2_ros_common/lifecycle_node.hpp"
