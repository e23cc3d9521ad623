// A node without a network: parameters are read, what is published is seen by nobody, and nothing
// ever calls back.
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstring>
#include <functional>
#include <iomanip>
#include <iostream>
#include <limits>
#include <mutex>
#include <thread>
#include <unordered_map>
#include <utility>

#include "stand_ins/rclcpp_logging.hpp"
#include "stand_ins/rclcpp_parameters.hpp"
#include "stand_ins/rclcpp_time.hpp"

// The oldest, so that sources for several releases take what every release has.
#define RCLCPP_VERSION_GTE(major, minor, patch) 0
#define RCLCPP_SMART_PTR_DEFINITIONS(Type) DRAKE_NAVBENCH_POINTERS(Type)
#define RCLCPP_SHARED_PTR_DEFINITIONS(Type) DRAKE_NAVBENCH_POINTERS(Type)

namespace rclcpp {

inline bool ok() { return true; }

class QoS {
 public:
  QoS(std::size_t = 10) {}
  QoS & transient_local() { return *this; }
  QoS & durability_volatile() { return *this; }
  QoS & reliable() { return *this; }
  QoS & best_effort() { return *this; }
  QoS & keep_last(std::size_t) { return *this; }
};
struct KeepLast : QoS { using QoS::QoS; };
struct SystemDefaultsQoS : QoS {};
struct SensorDataQoS : QoS {};

enum class CallbackGroupType { MutuallyExclusive, Reentrant };
struct CallbackGroup {
  DRAKE_NAVBENCH_POINTERS(CallbackGroup)
};
struct TimerBase {
  DRAKE_NAVBENCH_POINTERS(TimerBase)
  void cancel() {}
};
struct SubscriptionOptions {
  CallbackGroup::SharedPtr callback_group;
};

template <typename Message>
class Publisher {
 public:
  DRAKE_NAVBENCH_POINTERS(Publisher)
  void publish(const Message &) {}
  void publish(std::unique_ptr<Message>) {}
  std::size_t get_subscription_count() const { return 0; }
  std::size_t get_intra_process_subscription_count() const { return 0; }
  void on_activate() { is_active_ = true; }
  void on_deactivate() { is_active_ = false; }
  bool is_activated() const { return is_active_; }

 private:
  bool is_active_ = false;
};

template <typename Message>
struct Subscription {
  DRAKE_NAVBENCH_POINTERS(Subscription)
};

class NodeOptions {
 public:
  NodeOptions & start_parameter_services(bool) { return *this; }
  NodeOptions & start_parameter_event_publisher(bool) { return *this; }
  NodeOptions & arguments(const std::vector<std::string> &) { return *this; }
  NodeOptions & use_global_arguments(bool) { return *this; }
};

class Node {
 public:
  DRAKE_NAVBENCH_POINTERS(Node)
  using Parameters = node_interfaces::NodeParametersInterface;
  using Descriptor = Parameters::Descriptor;
  using SetParametersResult = rcl_interfaces::msg::SetParametersResult;
  using OnSetParametersCallbackHandle = node_interfaces::OnSetParametersCallbackHandle;

  explicit Node(std::string name, const NodeOptions & = {}) : name_(std::move(name)) {}
  Node(std::string name, const std::string &, const NodeOptions & = {}) : Node(std::move(name)) {}
  virtual ~Node() = default;
  static SharedPtr make_shared(const std::string & name, const NodeOptions & = {}) {
    return std::make_shared<Node>(name);
  }

  const char * get_name() const { return name_.c_str(); }
  const char * get_namespace() const { return "/"; }
  const char * get_fully_qualified_name() const { return name_.c_str(); }
  Logger get_logger() const { return Logger(name_); }
  Clock::SharedPtr get_clock() const { return clock_; }
  Time now() const { return clock_->now(); }
  Parameters::SharedPtr get_node_parameters_interface() const { return parameters_; }

  bool has_parameter(const std::string & name) const { return parameters_->has_parameter(name); }
  const ParameterValue & declare_parameter(const std::string & name, const ParameterValue & value,
                                           const Descriptor & = {}, bool ignore_override = false) {
    return parameters_->declare_parameter(name, value, {}, ignore_override);
  }
  const ParameterValue & declare_parameter(const std::string & name, ParameterType type,
                                           const Descriptor & = {}, bool = false) {
    return parameters_->declare_parameter(name, type);
  }
  template <typename Value>
  auto declare_parameter(const std::string & name, const Value & value, const Descriptor & = {},
                         bool ignore_override = false) {
    return parameters_->declare_parameter(name, ParameterValue(value), {}, ignore_override)
        .template get<Value>();
  }
  template <typename Value>
  Value declare_parameter(const std::string & name) {
    const ParameterValue & value =
        parameters_->declare_parameter(name, ParameterValue(Value{}).get_type());
    if (value.get_type() == PARAMETER_NOT_SET) {
      throw exceptions::ParameterUninitializedException(name);
    }
    return value.get<Value>();
  }
  Parameter get_parameter(const std::string & name) const {
    return parameters_->get_parameter(name);
  }
  bool get_parameter(const std::string & name, Parameter & parameter) const {
    return parameters_->get_parameter(name, parameter);
  }
  template <typename Value>
  bool get_parameter(const std::string & name, Value & value) const {
    Parameter parameter;
    if (!parameters_->get_parameter(name, parameter)) return false;
    value = parameter.get_value<Value>();
    return true;
  }
  template <typename Value>
  bool get_parameter_or(const std::string & name, Value & value, const Value & otherwise) const {
    if (get_parameter(name, value)) return true;
    value = otherwise;
    return false;
  }
  SetParametersResult set_parameter(const Parameter & parameter) {
    parameters_->set_parameter(parameter);
    return {true, ""};
  }
  std::vector<SetParametersResult> set_parameters(const std::vector<Parameter> & parameters) {
    std::vector<SetParametersResult> results;
    for (const Parameter & parameter : parameters) results.push_back(set_parameter(parameter));
    return results;
  }

  // Parameters are fixed from the start of a trial, so nothing is ever called back.
  template <typename Callback>
  auto add_on_set_parameters_callback(Callback &&) {
    return std::make_shared<node_interfaces::OnSetParametersCallbackHandle>();
  }
  template <typename Callback>
  auto add_post_set_parameters_callback(Callback &&) {
    return std::make_shared<node_interfaces::PostSetParametersCallbackHandle>();
  }
  template <typename Callback>
  auto add_pre_set_parameters_callback(Callback &&) {
    return std::make_shared<node_interfaces::PreSetParametersCallbackHandle>();
  }
  void remove_on_set_parameters_callback(const void *) {}
  void remove_post_set_parameters_callback(const void *) {}
  void remove_pre_set_parameters_callback(const void *) {}

  template <typename Message, typename... Rest>
  auto create_publisher(const std::string &, const Rest &...) {
    return std::make_shared<Publisher<Message>>();
  }
  template <typename Message, typename... Rest>
  auto create_subscription(const std::string &, Rest &&...) {
    return std::make_shared<Subscription<Message>>();
  }
  template <typename... Rest>
  TimerBase::SharedPtr create_wall_timer(Rest &&...) {
    return std::make_shared<TimerBase>();
  }
  CallbackGroup::SharedPtr create_callback_group(CallbackGroupType, bool = true) {
    return std::make_shared<CallbackGroup>();
  }

 private:
  std::string name_;
  Clock::SharedPtr clock_ = std::make_shared<Clock>(RCL_ROS_TIME);
  Parameters::SharedPtr parameters_ = std::make_shared<Parameters>();
};

class Rate {
 public:
  DRAKE_NAVBENCH_POINTERS(Rate)

  explicit Rate(double frequency)
      : period_(static_cast<std::int64_t>(kNanosecondsPerSecond / frequency)) {}
  bool sleep() { return true; }
  std::chrono::nanoseconds period() const { return period_; }

 private:
  std::chrono::nanoseconds period_;
};
using WallRate = Rate;

template <typename NodePointer>
void spin_some(const NodePointer &) {}

}  // namespace rclcpp
