#pragma once

#include "stand_ins/geometry_msgs.hpp"

namespace visualization_msgs::msg {

struct Marker {
  enum Shape : std::int32_t {
    ARROW, CUBE, SPHERE, CYLINDER, LINE_STRIP, LINE_LIST, CUBE_LIST, SPHERE_LIST, POINTS,
    TEXT_VIEW_FACING, MESH_RESOURCE, TRIANGLE_LIST
  };
  enum Action : std::int32_t { ADD = 0, MODIFY = 0, DELETE = 2, DELETEALL = 3 };

  std_msgs::msg::Header header;
  std::string ns;
  std::int32_t id = 0, type = 0, action = 0;
  geometry_msgs::msg::Pose pose;
  geometry_msgs::msg::Vector3 scale;
  std_msgs::msg::ColorRGBA color;
  builtin_interfaces::msg::Duration lifetime;
  bool frame_locked = false;
  std::vector<geometry_msgs::msg::Point> points;
  std::vector<std_msgs::msg::ColorRGBA> colors;
  std::string text;
  DRAKE_NAVBENCH_MESSAGE(Marker)
};

struct MarkerArray {
  std::vector<Marker> markers;
  DRAKE_NAVBENCH_MESSAGE(MarkerArray)
};

}  // namespace visualization_msgs::msg
