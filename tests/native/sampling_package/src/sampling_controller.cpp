// Commands the sample that it is told to, of the pass and after the resets that it is told to make:
// some before its first draw, as after a pause, and some between its first draw and the next.
#include "nav2_core/controller.hpp"
#include "nav2_mppi_controller/tools/noise_generator.hpp"
#include "nav2_util/node_utils.hpp"
#include "pluginlib/class_list_macros.hpp"

namespace sampling {

class Controller : public nav2_core::Controller {
 public:
  void configure(const rclcpp_lifecycle::LifecycleNode::WeakPtr & parent, std::string name,
                 std::shared_ptr<tf2_ros::Buffer>,
                 std::shared_ptr<nav2_costmap_2d::Costmap2DROS>) override {
    const auto node = parent.lock();
    const auto declare = [&](const std::string & parameter, auto value) {
      nav2_util::declare_parameter_if_not_declared(node, name + "." + parameter,
                                                   rclcpp::ParameterValue(value));
      node->get_parameter(name + "." + parameter, value);
      return value;
    };
    sample_ = declare("sample", 0);
    passes_ = declare("passes", 0);
    pauses_ = declare("pauses", 0);
    resets_ = declare("resets", 0);
    is_holonomic_ = declare("is_holonomic", false);
    parameters_.regenerates = declare("regenerate_noises", true);
    noise_.initialize(settings_, is_holonomic_, name, &parameters_);
    noise_.reset(settings_, is_holonomic_);
  }
  void cleanup() override {}
  void activate() override {}
  void deactivate() override { noise_.shutdown(); }
  void setPlan(const nav_msgs::msg::Path &) override {}
  geometry_msgs::msg::TwistStamped computeVelocityCommands(
      const geometry_msgs::msg::PoseStamped &, const geometry_msgs::msg::Twist &,
      nav2_core::GoalChecker *) override {
    for (int i = 0; i < passes_; ++i) noise_.generateNextNoises();
    mppi::models::State state;
    for (int i = 0; i < pauses_; ++i) noise_.reset(settings_, is_holonomic_);
    noise_.setNoisedControls(state, {});
    for (int i = 0; i < resets_; ++i) noise_.reset(settings_, is_holonomic_);
    noise_.setNoisedControls(state, {});
    geometry_msgs::msg::TwistStamped command;
    command.twist.linear.x = state.cvx(sample_, 2);
    command.twist.linear.y = state.cvy(sample_, 2);
    command.twist.angular.z = state.cwz(sample_, 2);
    return command;
  }
  void setSpeedLimit(const double &, const bool &) override {}
  void reset() override { noise_.reset(settings_, is_holonomic_); }

 private:
  mppi::models::OptimizerSettings settings_;
  mppi::ParametersHandler parameters_;
  mppi::NoiseGenerator noise_;
  int sample_ = 0, passes_ = 0, pauses_ = 0, resets_ = 0;
  bool is_holonomic_ = false;
};

}  // namespace sampling

PLUGINLIB_EXPORT_CLASS(sampling::Controller, nav2_core::Controller)
