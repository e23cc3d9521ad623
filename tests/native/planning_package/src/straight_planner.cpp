// Under NavFn's name: straight to the goal, whatever is in between, but not to where it is lethal.
#include "nav2_core/global_planner.hpp"
#include "nav2_util/node_utils.hpp"
#include "pluginlib/class_list_macros.hpp"

namespace nav2_navfn_planner {

class NavfnPlanner : public nav2_core::GlobalPlanner {
 public:
  void configure(const rclcpp_lifecycle::LifecycleNode::WeakPtr & parent, std::string name,
                 std::shared_ptr<tf2_ros::Buffer>,
                 std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap) override {
    costmap_ = costmap;
    const auto node = parent.lock();
    nav2_util::declare_parameter_if_not_declared(node, name + ".starts_off",
                                                 rclcpp::ParameterValue(0.0));
    node->get_parameter(name + ".starts_off", starts_off_);
  }
  void cleanup() override {}
  void activate() override { is_active_ = true; }
  void deactivate() override {}
  nav_msgs::msg::Path createPlan(const geometry_msgs::msg::PoseStamped & start,
                                 const geometry_msgs::msg::PoseStamped & goal,
                                 std::function<bool()>) override {
    const auto & to = goal.pose.position;
    if (!is_active_ || costmap_->getCostmap()->cost_at(to.x, to.y) == 254) {
      throw nav2_core::NoValidPathCouldBeFound("straight: the goal is in a wall");
    }
    nav_msgs::msg::Path path;
    path.poses = {start, goal};
    path.poses[0].pose.position.x += starts_off_;
    return path;
  }

 private:
  std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap_;
  double starts_off_ = 0.0;
  bool is_active_ = false;
};

}  // namespace nav2_navfn_planner

PLUGINLIB_EXPORT_CLASS(nav2_navfn_planner::NavfnPlanner, nav2_core::GlobalPlanner)
