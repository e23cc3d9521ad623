#pragma once

#include "stand_ins/geometry_msgs.hpp"

namespace nav_msgs::msg {

struct Path {
  std_msgs::msg::Header header;
  std::vector<geometry_msgs::msg::PoseStamped> poses;
  DRAKE_NAVBENCH_MESSAGE(Path)
};

struct Goals {
  std_msgs::msg::Header header;
  std::vector<geometry_msgs::msg::PoseStamped> goals;
  DRAKE_NAVBENCH_MESSAGE(Goals)
};

struct MapMetaData {
  builtin_interfaces::msg::Time map_load_time;
  float resolution = 0;
  std::uint32_t width = 0, height = 0;
  geometry_msgs::msg::Pose origin;
  DRAKE_NAVBENCH_MESSAGE(MapMetaData)
};

struct OccupancyGrid {
  std_msgs::msg::Header header;
  MapMetaData info;
  std::vector<std::int8_t> data;
  DRAKE_NAVBENCH_MESSAGE(OccupancyGrid)
};

struct Odometry {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  geometry_msgs::msg::PoseWithCovariance pose;
  geometry_msgs::msg::TwistWithCovariance twist;
  DRAKE_NAVBENCH_MESSAGE(Odometry)
};

struct TrajectoryPoint {
  std_msgs::msg::Header header;
  geometry_msgs::msg::Pose pose;
  geometry_msgs::msg::Twist velocity;
  geometry_msgs::msg::Accel acceleration;
  geometry_msgs::msg::Vector3 effort;
  DRAKE_NAVBENCH_MESSAGE(TrajectoryPoint)
};

struct Trajectory {
  std_msgs::msg::Header header;
  std::vector<TrajectoryPoint> points;
  DRAKE_NAVBENCH_MESSAGE(Trajectory)
};

}  // namespace nav_msgs::msg
