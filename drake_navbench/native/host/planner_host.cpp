// The call `make_plan`: a planner plugin, asked as Nav2's planner server asks it.
//
// Each request has a planner and a costmap of its own, so that equal requests have equal answers.

#include <cxxabi.h>

#include <cstdlib>
#include <typeinfo>

#include "host/conversions.hpp"
#include "host/costmap_of_request.hpp"
#include "host/more_calls.hpp"
#include "nav2_core/global_planner.hpp"

namespace drake_navbench {

namespace {

constexpr const char * kPlugin = "GridBased";

bool NobodyCancels() { return false; }

// In Lyrical a plan may lead through further poses.
template <typename Planner>
nav_msgs::msg::Path CreatePlan(Planner & planner, const geometry_msgs::msg::PoseStamped & start,
                               const geometry_msgs::msg::PoseStamped & goal) {
  const std::vector<geometry_msgs::msg::PoseStamped> none;
  if constexpr (requires { planner.createPlan(start, goal, none, NobodyCancels); }) {
    return planner.createPlan(start, goal, none, NobodyCancels);
  } else if constexpr (requires { planner.createPlan(start, goal, NobodyCancels); }) {
    return planner.createPlan(start, goal, NobodyCancels);
  } else {
    return planner.createPlan(start, goal);
  }
}

// Returns the name of an exception's class without its namespace.
std::string NameOf(const std::exception & error) {
  int status = 0;
  char * text = abi::__cxa_demangle(typeid(error).name(), nullptr, nullptr, &status);
  std::string name = status == 0 ? text : typeid(error).name();
  std::free(text);
  const std::size_t colon = name.rfind(':');
  return colon == std::string::npos ? name : name.substr(colon + 1);
}

Value AsPoses(const nav_msgs::msg::Path & path) {
  Value::Array poses;
  for (const auto & each : path.poses) {
    poses.push_back(Value::Array{each.pose.position.x, each.pose.position.y,
                                 tf2::getYaw(each.pose.orientation)});
  }
  return poses;
}

Value MakePlan(const Value & request) {
  auto node = std::make_shared<nav2::LifecycleNode>("planner_server");
  auto & overrides = node->get_node_parameters_interface()->overrides();
  AddParameters(kPlugin, request["parameters"], &overrides);
  const std::string type = request["plugin"].text();
  overrides[std::string(kPlugin) + ".plugin"] = rclcpp::ParameterValue(type);
  node->declare_parameter(std::string(kPlugin) + ".plugin", rclcpp::ParameterValue(type));
  auto transforms = std::make_shared<tf2_ros::Buffer>();
  const auto costmap = CostmapOfRequest(request, SizeOf(request["costmap"]), transforms);
  SetCosts(request["costmap"], *costmap->getCostmap());
  const auto planner = pluginlib::ClassLoader<nav2_core::GlobalPlanner>(
                           "nav2_core", "nav2_core::GlobalPlanner")
                           .createUniqueInstance(type);
  planner->configure(node, kPlugin, transforms, costmap);
  planner->activate();
  try {
    const auto path =
        CreatePlan(*planner, StampedPose(request["start"]), StampedPose(request["goal"]));
    // Up to Humble a planner that finds none says so by a path without poses.
    if (!path.poses.empty()) return Value::Map{{"plan", AsPoses(path)}};
    return Value::Map{{"failure", "NoValidPathCouldBeFound"}, {"message", "the plan is empty"}};
  } catch (const std::exception & error) {
    return Value::Map{{"failure", NameOf(error)}, {"message", std::string(error.what())}};
  }
}

[[maybe_unused]] const bool is_answered = more_calls().emplace("make_plan", MakePlan).second;

}  // namespace

}  // namespace drake_navbench
