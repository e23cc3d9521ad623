#pragma once

#include "stand_ins/std_msgs.hpp"

namespace geometry_msgs::msg {

struct Point {
  double x = 0, y = 0, z = 0;
  DRAKE_NAVBENCH_MESSAGE(Point)
};

struct Point32 {
  float x = 0, y = 0, z = 0;
  DRAKE_NAVBENCH_MESSAGE(Point32)
};

struct Vector3 {
  double x = 0, y = 0, z = 0;
  DRAKE_NAVBENCH_MESSAGE(Vector3)
};

struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
  DRAKE_NAVBENCH_MESSAGE(Quaternion)
};

struct Pose {
  Point position;
  Quaternion orientation;
  DRAKE_NAVBENCH_MESSAGE(Pose)
};

struct Pose2D {
  double x = 0, y = 0, theta = 0;
  DRAKE_NAVBENCH_MESSAGE(Pose2D)
};

struct PoseArray {
  std_msgs::msg::Header header;
  std::vector<Pose> poses;
  DRAKE_NAVBENCH_MESSAGE(PoseArray)
};

struct PoseWithCovariance {
  Pose pose;
  std::array<double, 36> covariance{};
  DRAKE_NAVBENCH_MESSAGE(PoseWithCovariance)
};

struct Twist {
  Vector3 linear, angular;
  DRAKE_NAVBENCH_MESSAGE(Twist)
};

struct TwistWithCovariance {
  Twist twist;
  std::array<double, 36> covariance{};
  DRAKE_NAVBENCH_MESSAGE(TwistWithCovariance)
};

struct Accel {
  Vector3 linear, angular;
  DRAKE_NAVBENCH_MESSAGE(Accel)
};

struct Wrench {
  Vector3 force, torque;
  DRAKE_NAVBENCH_MESSAGE(Wrench)
};

struct Polygon {
  std::vector<Point32> points;
  DRAKE_NAVBENCH_MESSAGE(Polygon)
};

struct Transform {
  Vector3 translation;
  Quaternion rotation;
  DRAKE_NAVBENCH_MESSAGE(Transform)
};

struct TransformStamped {
  std_msgs::msg::Header header;
  std::string child_frame_id;
  Transform transform;
  DRAKE_NAVBENCH_MESSAGE(TransformStamped)
};

struct PoseStamped {
  std_msgs::msg::Header header;
  Pose pose;
  DRAKE_NAVBENCH_MESSAGE(PoseStamped)
};

struct PoseWithCovarianceStamped {
  std_msgs::msg::Header header;
  PoseWithCovariance pose;
  DRAKE_NAVBENCH_MESSAGE(PoseWithCovarianceStamped)
};

struct PointStamped {
  std_msgs::msg::Header header;
  Point point;
  DRAKE_NAVBENCH_MESSAGE(PointStamped)
};

struct PolygonStamped {
  std_msgs::msg::Header header;
  Polygon polygon;
  DRAKE_NAVBENCH_MESSAGE(PolygonStamped)
};

struct QuaternionStamped {
  std_msgs::msg::Header header;
  Quaternion quaternion;
  DRAKE_NAVBENCH_MESSAGE(QuaternionStamped)
};

struct TwistStamped {
  std_msgs::msg::Header header;
  Twist twist;
  DRAKE_NAVBENCH_MESSAGE(TwistStamped)
};

struct AccelStamped {
  std_msgs::msg::Header header;
  Accel accel;
  DRAKE_NAVBENCH_MESSAGE(AccelStamped)
};

struct WrenchStamped {
  std_msgs::msg::Header header;
  Wrench wrench;
  DRAKE_NAVBENCH_MESSAGE(WrenchStamped)
};

}  // namespace geometry_msgs::msg
