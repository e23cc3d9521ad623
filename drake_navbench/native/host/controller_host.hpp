// One controller plugin, called as Nav2's controller server calls it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "host/told_goal_checker.hpp"
#include "nav2_core/controller.hpp"
#include "nav2_costmap_2d/costmap_2d_ros.hpp"

namespace drake_navbench {

class ControllerHost {
 public:
  // The answers to the calls of docs/external_controllers.md. What a plugin throws where the server
  // would not catch it comes out of them.
  Value Configure(const Value & request);
  Value Reset();
  Value SetPlan(const Value & request);
  Value Compute(const Value & request);

 private:
  void MakeCostmap(const Value & request);
  void TellNoise(const Value & key);
  void TellSpeedLimit(const Value & limit);
  bool Cancel();

  std::shared_ptr<nav2::LifecycleNode> node_;
  std::shared_ptr<nav2_costmap_2d::Costmap2DROS> costmap_;
  std::shared_ptr<tf2_ros::Buffer> transforms_ = std::make_shared<tf2_ros::Buffer>();
  ToldGoalChecker goal_checker_;
  // The last member: it goes first, and may use all others until then.
  std::unique_ptr<nav2_core::Controller> controller_;
  std::optional<std::pair<double, bool>> speed_limit_;
  bool has_driven_ = false;
};

}  // namespace drake_navbench
