#include "host/controller_host.hpp"

#include "host/costmap_of_request.hpp"
#include "host/cycle_noise.hpp"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include <unistd.h>

#if __has_include("nav2_core/controller_exceptions.hpp")
#include "nav2_core/controller_exceptions.hpp"
#elif __has_include("nav2_core/exceptions.hpp")
#include "nav2_core/exceptions.hpp"
#endif

namespace nav2_core {
// Declared again where the release has them, so that its own are found below, and ours elsewhere.
class PlannerException;
class NoValidControl;
class InvalidPath;
class ControllerTFError;
}  // namespace nav2_core

namespace drake_navbench {

namespace {

constexpr const char * kPlugin = "FollowPath";
// For a plugin's threads to come to rest; longer only where they never do.
constexpr std::chrono::milliseconds kThreadPatience{500};

// Waits until the other threads sleep. A plugin may prepare its next cycle in one of its own, as
// MPPI does with noises; whether that is done must not depend on how fast the machine is.
void WaitForThreads() {
  namespace fs = std::filesystem;
  const auto is_at_work = [] {
    const std::string own = std::to_string(::gettid());
    std::error_code ignored;
    for (const auto & task : fs::directory_iterator("/proc/self/task", ignored)) {
      if (task.path().filename() == own) continue;
      std::ifstream file(task.path() / "stat");
      std::string line;
      std::getline(file, line);
      // The state follows the name, which stands in parentheses.
      const std::size_t end = line.rfind(')');
      if (end != std::string::npos && end + 2 < line.size() && line[end + 2] == 'R') return true;
    }
    return false;
  };
  const auto deadline = std::chrono::steady_clock::now() + kThreadPatience;
  while (is_at_work() && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
}

// Returns whether an exception is of a class that this release has.
template <typename Kind>
bool Is(const std::exception & error) {
  if constexpr (requires { sizeof(Kind); }) {
    return dynamic_cast<const Kind *>(&error) != nullptr;
  } else {
    return false;
  }
}

// Returns the failure that an exception stands for: the server is patient with the first alone.
const char * FailureOf(const std::exception & error) {
  if (Is<nav2_core::NoValidControl>(error)) return "no_valid_control";
  // Of releases that have one exception for everything.
  if (Is<nav2_core::PlannerException>(error)) return "no_valid_control";
  if (Is<nav2_core::InvalidPath>(error)) return "invalid_path";
  if (Is<nav2_core::ControllerTFError>(error)) return "tf_error";
  return "failed";
}

template <typename Controller>
void NewPath(Controller & controller, const nav_msgs::msg::Path & path) {
  if constexpr (requires { controller.newPathReceived(path); }) {
    controller.newPathReceived(path);
  } else {
    controller.setPlan(path);
  }
}

// Whether a controller is given the path handler's local plan; those up to Kilted cut the whole one.
template <typename Controller>
constexpr bool kTakesLocalPlan =
    requires(Controller & controller, geometry_msgs::msg::PoseStamped pose,
             geometry_msgs::msg::Twist velocity, nav2_core::GoalChecker * checker,
             nav_msgs::msg::Path path) {
      controller.computeVelocityCommands(pose, velocity, checker, path, pose);
    };

template <typename Controller>
geometry_msgs::msg::TwistStamped Command(Controller & controller,
                                         const geometry_msgs::msg::PoseStamped & pose,
                                         const geometry_msgs::msg::Twist & velocity,
                                         nav2_core::GoalChecker * checker, const Value & request) {
  if constexpr (kTakesLocalPlan<Controller>) {
    return controller.computeVelocityCommands(pose, velocity, checker, Path(request["local_plan"]),
                                              StampedPose(request["goal"]));
  } else {
    return controller.computeVelocityCommands(pose, velocity, checker);
  }
}

// Returns whether the release resets its controllers.
template <typename Controller>
bool ResetController(Controller & controller) {
  if constexpr (requires { controller.reset(); }) {
    controller.reset();
    return true;
  }
  return false;
}

template <typename Controller>
bool CancelController(Controller & controller) {
  if constexpr (requires { controller.cancel(); }) return controller.cancel();
  return true;
}

// Returns the given parameters of the plugin that nothing has declared.
Value::Array NotRead(const rclcpp::node_interfaces::NodeParametersInterface & parameters) {
  Value::Array names;
  const std::string prefix = std::string(kPlugin) + ".";
  for (const auto & [name, value] : parameters.get_parameter_overrides()) {
    if (name.starts_with(prefix) && !parameters.has_parameter(name)) {
      names.push_back(Value(name.substr(prefix.size())));
    }
  }
  return names;
}

Value::Map Defaults(const rclcpp::node_interfaces::NodeParametersInterface & parameters) {
  Value::Map defaults;
  const std::string prefix = std::string(kPlugin) + ".";
  for (const auto & [name, value] : parameters.defaults()) {
    if (name.starts_with(prefix)) defaults[name.substr(prefix.size())] = ParameterAsValue(value);
  }
  return defaults;
}

}  // namespace

Value ControllerHost::Configure(const Value & request) {
  const Value & client = request["parameters"];
  node_ = std::make_shared<nav2::LifecycleNode>("controller_server");
  auto & overrides = node_->get_node_parameters_interface()->overrides();
  const auto given = client.map().find("parameters");
  if (given != client.map().end()) AddParameters(kPlugin, given->second, &overrides);
  const std::string type = client["plugin"].text();
  overrides[std::string(kPlugin) + ".plugin"] = rclcpp::ParameterValue(type);
  node_->declare_parameter(std::string(kPlugin) + ".plugin", rclcpp::ParameterValue(type));
  node_->declare_parameter("controller_frequency",
                           rclcpp::ParameterValue(1.0 / request["control_period_s"].number()));
  node_->declare_parameter("controller_plugins",
                           rclcpp::ParameterValue(std::vector<std::string>{kPlugin}));
  MakeCostmap(request);
  controller_ = pluginlib::ClassLoader<nav2_core::Controller>("nav2_core", "nav2_core::Controller")
                    .createUniqueInstance(type);
  controller_->configure(node_, kPlugin, transforms_, costmap_);
  controller_->activate();
  // One that does not stop at once when it is cancelled wants to slow down by itself.
  const bool is_graceful = !Cancel();
  if (is_graceful) ResetController(*controller_);
  const auto & parameters = *node_->get_node_parameters_interface();
  return Value::Map{{"protocol", 1},
                    {"is_graceful", is_graceful},
                    {"cuts_plan", !kTakesLocalPlan<nav2_core::Controller>},
                    {"not_read", NotRead(parameters)},
                    {"defaults", Defaults(parameters)}};
}

void ControllerHost::MakeCostmap(const Value & request) {
  const double resolution = request["costmap_resolution_m"].number();
  const auto cells =
      static_cast<unsigned int>(std::lround(request["costmap_size_m"].number() / resolution));
  costmap_ = CostmapOfRequest(request, {cells, cells, resolution}, transforms_);
}

Value ControllerHost::Reset() {
  // As at the end of a task; in Humble the controller goes on.
  if (has_driven_ && ResetController(*controller_)) has_driven_ = false;
  return Value::Map{};
}

Value ControllerHost::SetPlan(const Value & request) {
  NewPath(*controller_, Path(request["plan"]));
  return Value::Map{};
}

Value ControllerHost::Compute(const Value & request) {
  WaitForThreads();
  TellNoise(request["noise"]);
  rclcpp::Clock::trial_time() = std::llround(request["time_s"].number() * 1e9);
  const auto pose = StampedPose(request["pose"]);
  tf2::Transform base;
  tf2::fromMsg(pose.pose, base);
  transforms_->set_base(base);
  costmap_->set_robot_pose(pose);
  SetCosts(request["costmap"], *costmap_->getCostmap());
  goal_checker_.Tell(request["goal_xy_tolerance_m"].number(),
                     request["goal_yaw_tolerance_rad"].number(),
                     request["goal_xy_reached"].boolean());
  const Value & twist = request["twist"];
  geometry_msgs::msg::Twist velocity;
  velocity.linear.x = twist.number_at(0);
  velocity.linear.y = twist.number_at(2);
  velocity.angular.z = twist.number_at(1);
  const bool is_cancelled = request["cancel_requested"].boolean();
  if (is_cancelled) Cancel();
  Value::Map answer;
  try {
    // The server answers with the failure of whatever is thrown from here on.
    TellSpeedLimit(request["speed_limit"]);
    has_driven_ = true;
    const auto command = Command(*controller_, pose, velocity, &goal_checker_, request).twist;
    Value::Array numbers{command.linear.x, command.angular.z};
    if (command.linear.y != 0.0) numbers.push_back(command.linear.y);
    answer["command"] = std::move(numbers);
  } catch (const std::exception & error) {
    answer["failure"] = FailureOf(error);
    answer["message"] = error.what();
  }
  if (is_cancelled) answer["is_at_rest"] = Cancel();
  return answer;
}

void ControllerHost::TellNoise(const Value & key) {
  CycleNoise & noise = cycle_noise();
  noise.seed = static_cast<std::uint64_t>(key["seed"].integer());
  noise.stream = static_cast<std::uint64_t>(key["stream"].integer());
  noise.step = static_cast<std::uint64_t>(key["step"].integer());
  noise.passes = 0;
  if (!has_driven_) noise.is_new_task = true;
}

void ControllerHost::TellSpeedLimit(const Value & limit) {
  std::optional<std::pair<double, bool>> told;
  if (!limit.is_nil()) told = {limit["value"].number(), limit["is_percentage"].boolean()};
  if (told == speed_limit_) return;
  speed_limit_ = told;
  // Nav2's way to say that there is none any more is a limit of 0.
  const auto [value, is_percentage] = told.value_or(std::pair{0.0, false});
  controller_->setSpeedLimit(value, is_percentage);
}

bool ControllerHost::Cancel() { return CancelController(*controller_); }

}  // namespace drake_navbench
