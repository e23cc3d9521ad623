// The local costmap as a controller sees it: the checkout's own grid, filled by the host.
#pragma once

#include <optional>

#include "nav2_costmap_2d/costmap_2d.hpp"
#include "nav2_costmap_2d/costmap_2d_publisher.hpp"
#include "nav2_costmap_2d/footprint.hpp"
#if __has_include("nav2_costmap_2d/footprint_collision_checker.hpp")
#include "nav2_costmap_2d/footprint_collision_checker.hpp"
#endif
#if __has_include("nav2_costmap_2d/layer.hpp")
#include "nav2_costmap_2d/layer.hpp"
#endif
#include "nav2_costmap_2d/layered_costmap.hpp"
#include "nav2_ros_common/lifecycle_node.hpp"

namespace nav2_costmap_2d {

class Costmap2DROS : public nav2::LifecycleNode {
 public:
  DRAKE_NAVBENCH_POINTERS(Costmap2DROS)

  // radius: of a robot that was given by one.
  Costmap2DROS(bool tracks_unknown, std::optional<double> radius)
      : nav2::LifecycleNode("local_costmap"),
        layered_("odom", true, tracks_unknown),
        radius_(radius) {}

  Costmap2D * getCostmap() const { return layered_.getCostmap(); }
  LayeredCostmap * getLayeredCostmap() const { return &layered_; }
  std::string getName() const { return get_name(); }
  std::string getGlobalFrameID() const { return "odom"; }
  std::string getBaseFrameID() const { return "base_link"; }
  double getTransformTolerance() const { return 0.3; }
  double getResolution() const { return getCostmap()->getResolution(); }
  bool isCurrent() const { return true; }
  bool getUseRadius() const { return radius_.has_value(); }
  double getRobotRadius() const { return radius_.value_or(0.0); }
  // Asked for at each pose whose collision is checked: neither copied, nor taken from the layers,
  // where a lock guards it.
  const std::vector<geometry_msgs::msg::Point> & getRobotFootprint() const { return footprint_; }
  const std::vector<geometry_msgs::msg::Point> & getUnpaddedRobotFootprint() const {
    return footprint_;
  }
  geometry_msgs::msg::Polygon getRobotFootprintPolygon() const { return toPolygon(footprint_); }
  bool getRobotPose(geometry_msgs::msg::PoseStamped & pose) const {
    pose = pose_;
    return true;
  }
  bool transformPoseToGlobalFrame(const geometry_msgs::msg::PoseStamped & in,
                                  geometry_msgs::msg::PoseStamped & out) const {
    out = transforms_ == nullptr ? in : transforms_->transform(in, getGlobalFrameID());
    return true;
  }
  tf2_ros::Buffer::SharedPtr getTfBuffer() const { return transforms_; }

  // For the host.
  void set_footprint(const std::vector<geometry_msgs::msg::Point> & footprint) {
    layered_.setFootprint(footprint);
    footprint_ = footprint;
  }
  void set_robot_pose(const geometry_msgs::msg::PoseStamped & pose) { pose_ = pose; }
  void set_transforms(tf2_ros::Buffer::SharedPtr transforms) { transforms_ = transforms; }

 private:
  // Controllers get at the grid through a constant costmap and write its lock.
  mutable LayeredCostmap layered_;
  std::optional<double> radius_;
  std::vector<geometry_msgs::msg::Point> footprint_;
  geometry_msgs::msg::PoseStamped pose_;
  tf2_ros::Buffer::SharedPtr transforms_;
};

}  // namespace nav2_costmap_2d
