// Rotations and rigid transforms, as far as controllers use them.
#pragma once

#include <chrono>
#include <stdexcept>

#include "stand_ins/geometry_msgs.hpp"

namespace tf2 {

using Duration = std::chrono::nanoseconds;
using TimePoint = std::chrono::time_point<std::chrono::system_clock, Duration>;
inline const TimePoint TimePointZero = TimePoint(Duration::zero());

inline Duration durationFromSec(double seconds) {
  return Duration(static_cast<std::int64_t>(seconds * 1e9));
}
inline double durationToSec(const Duration & span) { return 1e-9 * span.count(); }
inline TimePoint timeFromSec(double seconds) { return TimePoint(durationFromSec(seconds)); }

struct TransformException : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct ConnectivityException : TransformException {
  using TransformException::TransformException;
};
struct LookupException : TransformException {
  using TransformException::TransformException;
};
struct ExtrapolationException : TransformException {
  using TransformException::TransformException;
};
struct InvalidArgumentException : TransformException {
  using TransformException::TransformException;
};
struct TimeoutException : TransformException {
  using TransformException::TransformException;
};

class Vector3 {
 public:
  Vector3() = default;
  Vector3(double x, double y, double z) : x_(x), y_(y), z_(z) {}
  double x() const { return x_; }
  double y() const { return y_; }
  double z() const { return z_; }
  double getX() const { return x_; }
  double getY() const { return y_; }
  double getZ() const { return z_; }
  void setX(double x) { x_ = x; }
  void setY(double y) { y_ = y; }
  void setZ(double z) { z_ = z; }
  double dot(const Vector3 & other) const { return x_ * other.x_ + y_ * other.y_ + z_ * other.z_; }
  double length() const { return std::sqrt(dot(*this)); }
  Vector3 operator+(const Vector3 & other) const {
    return {x_ + other.x_, y_ + other.y_, z_ + other.z_};
  }
  Vector3 operator-(const Vector3 & other) const {
    return {x_ - other.x_, y_ - other.y_, z_ - other.z_};
  }
  Vector3 operator-() const { return {-x_, -y_, -z_}; }
  Vector3 operator*(double factor) const { return {x_ * factor, y_ * factor, z_ * factor}; }

 private:
  double x_ = 0, y_ = 0, z_ = 0;
};

class Quaternion {
 public:
  Quaternion() = default;
  Quaternion(double x, double y, double z, double w) : x_(x), y_(y), z_(z), w_(w) {}
  static Quaternion getIdentity() { return {0, 0, 0, 1}; }
  double x() const { return x_; }
  double y() const { return y_; }
  double z() const { return z_; }
  double w() const { return w_; }
  double getX() const { return x_; }
  double getY() const { return y_; }
  double getZ() const { return z_; }
  double getW() const { return w_; }

  // About fixed axes: first roll about x, then pitch about y, then yaw about z.
  void setRPY(double roll, double pitch, double yaw) {
    const double cr = std::cos(roll * 0.5), sr = std::sin(roll * 0.5);
    const double cp = std::cos(pitch * 0.5), sp = std::sin(pitch * 0.5);
    const double cy = std::cos(yaw * 0.5), sy = std::sin(yaw * 0.5);
    *this = {sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
             cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy};
  }
  // About the axes as they turn: yaw about y, then pitch about x, then roll about z.
  void setEuler(double yaw, double pitch, double roll) {
    *this = Quaternion{0, std::sin(yaw * 0.5), 0, std::cos(yaw * 0.5)} *
            Quaternion{std::sin(pitch * 0.5), 0, 0, std::cos(pitch * 0.5)} *
            Quaternion{0, 0, std::sin(roll * 0.5), std::cos(roll * 0.5)};
  }
  double length2() const { return x_ * x_ + y_ * y_ + z_ * z_ + w_ * w_; }
  Quaternion normalized() const {
    const double length = std::sqrt(length2());
    return {x_ / length, y_ / length, z_ / length, w_ / length};
  }
  void normalize() { *this = normalized(); }
  Quaternion inverse() const { return {-x_, -y_, -z_, w_}; }
  double angleShortestPath(const Quaternion & other) const {
    const double scale = std::sqrt(length2() * other.length2());
    const double dot = x_ * other.x_ + y_ * other.y_ + z_ * other.z_ + w_ * other.w_;
    return std::acos(dot < 0 ? -dot / scale : dot / scale) * 2.0;
  }
  Quaternion operator*(const Quaternion & q) const {
    return {w_ * q.x_ + x_ * q.w_ + y_ * q.z_ - z_ * q.y_,
            w_ * q.y_ + y_ * q.w_ + z_ * q.x_ - x_ * q.z_,
            w_ * q.z_ + z_ * q.w_ + x_ * q.y_ - y_ * q.x_,
            w_ * q.w_ - x_ * q.x_ - y_ * q.y_ - z_ * q.z_};
  }
  // At the share t of the way to another, by the shorter arc.
  Quaternion slerp(const Quaternion & other, double t) const {
    const double half = 0.5 * angleShortestPath(other);
    if (half == 0.0) return *this;
    const double near = std::sin((1.0 - t) * half), sine = std::sin(half);
    const double dot = x_ * other.x_ + y_ * other.y_ + z_ * other.z_ + w_ * other.w_;
    const double far = std::copysign(std::sin(t * half), dot);
    return {(x_ * near + other.x_ * far) / sine, (y_ * near + other.y_ * far) / sine,
            (z_ * near + other.z_ * far) / sine, (w_ * near + other.w_ * far) / sine};
  }
  Vector3 rotate(const Vector3 & v) const {
    const double xx = x_ * x_, yy = y_ * y_, zz = z_ * z_, ww = w_ * w_;
    return {(ww + xx - yy - zz) * v.x() + (2 * x_ * y_ - 2 * w_ * z_) * v.y() +
                (2 * x_ * z_ + 2 * w_ * y_) * v.z(),
            (2 * x_ * y_ + 2 * w_ * z_) * v.x() + (ww - xx + yy - zz) * v.y() +
                (2 * y_ * z_ - 2 * w_ * x_) * v.z(),
            (2 * x_ * z_ - 2 * w_ * y_) * v.x() + (2 * y_ * z_ + 2 * w_ * x_) * v.y() +
                (ww - xx - yy + zz) * v.z()};
  }

 private:
  double x_ = 0, y_ = 0, z_ = 0, w_ = 1;
};

// About fixed axes, of a rotation.
inline void get_roll_pitch_yaw(const Quaternion & q, double & roll, double & pitch, double & yaw) {
  const double xx = q.x() * q.x(), yy = q.y() * q.y(), zz = q.z() * q.z(), ww = q.w() * q.w();
  const double sine = -2 * (q.x() * q.z() - q.w() * q.y()) / (xx + yy + zz + ww);
  if (std::abs(sine) >= 0.99999) {
    pitch = std::copysign(0.5 * M_PI, sine);
    roll = 0;
    yaw = std::copysign(2.0, sine) * std::atan2(q.y(), q.x());
    return;
  }
  pitch = std::asin(sine);
  roll = std::atan2(2 * (q.y() * q.z() + q.w() * q.x()), ww - xx - yy + zz);
  yaw = std::atan2(2 * (q.x() * q.y() + q.w() * q.z()), ww + xx - yy - zz);
}

class Matrix3x3 {
 public:
  explicit Matrix3x3(const Quaternion & rotation) : rotation_(rotation) {}
  void getRPY(double & roll, double & pitch, double & yaw) const {
    get_roll_pitch_yaw(rotation_, roll, pitch, yaw);
  }
  Vector3 operator*(const Vector3 & v) const { return rotation_.rotate(v); }

 private:
  Quaternion rotation_;
};

class Transform {
 public:
  Transform() = default;
  explicit Transform(const Quaternion & rotation, const Vector3 & origin = {})
      : rotation_(rotation), origin_(origin) {}
  static Transform getIdentity() { return {}; }
  void setIdentity() { *this = {}; }
  const Vector3 & getOrigin() const { return origin_; }
  Quaternion getRotation() const { return rotation_; }
  Matrix3x3 getBasis() const { return Matrix3x3(rotation_); }
  void setOrigin(const Vector3 & origin) { origin_ = origin; }
  void setRotation(const Quaternion & rotation) { rotation_ = rotation; }
  Transform inverse() const {
    const Quaternion back = rotation_.inverse();
    return Transform(back, -back.rotate(origin_));
  }
  Vector3 operator*(const Vector3 & v) const { return rotation_.rotate(v) + origin_; }
  Transform operator*(const Transform & other) const {
    return Transform(rotation_ * other.rotation_, *this * other.origin_);
  }

 private:
  Quaternion rotation_;
  Vector3 origin_;
};
using Pose = Transform;

template <typename Content>
class Stamped : public Content {
 public:
  TimePoint stamp_ = TimePointZero;
  std::string frame_id_;
  Stamped() = default;
  Stamped(const Content & content, const TimePoint & stamp, const std::string & frame)
      : Content(content), stamp_(stamp), frame_id_(frame) {}
};

inline void fromMsg(const geometry_msgs::msg::Quaternion & message, Quaternion & q) {
  q = {message.x, message.y, message.z, message.w};
}
inline void fromMsg(const geometry_msgs::msg::Vector3 & message, Vector3 & v) {
  v = {message.x, message.y, message.z};
}
inline void fromMsg(const geometry_msgs::msg::Point & message, Vector3 & v) {
  v = {message.x, message.y, message.z};
}
inline void fromMsg(const geometry_msgs::msg::Transform & message, Transform & transform) {
  const auto & [t, q] = message;
  transform = Transform({q.x, q.y, q.z, q.w}, {t.x, t.y, t.z});
}
inline void fromMsg(const geometry_msgs::msg::Pose & message, Transform & pose) {
  const auto & [p, q] = message;
  pose = Transform({q.x, q.y, q.z, q.w}, {p.x, p.y, p.z});
}
inline void fromMsg(const geometry_msgs::msg::PoseStamped & message, Stamped<Transform> & pose) {
  fromMsg(message.pose, static_cast<Transform &>(pose));
  pose.frame_id_ = message.header.frame_id;
}

inline geometry_msgs::msg::Quaternion toMsg(const Quaternion & q) {
  return {q.x(), q.y(), q.z(), q.w()};
}
inline geometry_msgs::msg::Vector3 toMsg(const Vector3 & v) { return {v.x(), v.y(), v.z()}; }
inline geometry_msgs::msg::Point & toMsg(const Vector3 & v, geometry_msgs::msg::Point & point) {
  return point = {v.x(), v.y(), v.z()};
}
inline geometry_msgs::msg::Transform toMsg(const Transform & transform) {
  return {toMsg(transform.getOrigin()), toMsg(transform.getRotation())};
}
inline geometry_msgs::msg::Pose & toMsg(const Transform & transform,
                                        geometry_msgs::msg::Pose & pose) {
  toMsg(transform.getOrigin(), pose.position);
  pose.orientation = toMsg(transform.getRotation());
  return pose;
}
template <typename Message, typename Content>
void convert(const Message & message, Content & content) {
  fromMsg(message, content);
}
inline void convert(const Quaternion & q, geometry_msgs::msg::Quaternion & message) {
  message = toMsg(q);
}

inline double getYaw(const Quaternion & q) {
  const double xx = q.x() * q.x(), yy = q.y() * q.y(), zz = q.z() * q.z(), ww = q.w() * q.w();
  const double sine = -2 * (q.x() * q.z() - q.w() * q.y()) / (xx + yy + zz + ww);
  if (sine <= -0.99999) return -2 * std::atan2(q.y(), q.x());
  if (sine >= 0.99999) return 2 * std::atan2(q.y(), q.x());
  return std::atan2(2 * (q.x() * q.y() + q.w() * q.z()), ww + xx - yy - zz);
}
inline double getYaw(const geometry_msgs::msg::Quaternion & message) {
  return getYaw(Quaternion(message.x, message.y, message.z, message.w));
}

inline void doTransform(const geometry_msgs::msg::Pose & in, geometry_msgs::msg::Pose & out,
                        const geometry_msgs::msg::TransformStamped & by) {
  Transform transform, pose;
  fromMsg(by.transform, transform);
  fromMsg(in, pose);
  toMsg(transform * pose, out);
}
inline void doTransform(const geometry_msgs::msg::PoseStamped & in,
                        geometry_msgs::msg::PoseStamped & out,
                        const geometry_msgs::msg::TransformStamped & by) {
  doTransform(in.pose, out.pose, by);
  out.header = by.header;
}
inline void doTransform(const geometry_msgs::msg::Point & in, geometry_msgs::msg::Point & out,
                        const geometry_msgs::msg::TransformStamped & by) {
  Transform transform;
  fromMsg(by.transform, transform);
  toMsg(transform * Vector3(in.x, in.y, in.z), out);
}
inline void doTransform(const geometry_msgs::msg::PointStamped & in,
                        geometry_msgs::msg::PointStamped & out,
                        const geometry_msgs::msg::TransformStamped & by) {
  doTransform(in.point, out.point, by);
  out.header = by.header;
}
inline void doTransform(const geometry_msgs::msg::Vector3 & in, geometry_msgs::msg::Vector3 & out,
                        const geometry_msgs::msg::TransformStamped & by) {
  Transform transform;
  fromMsg(by.transform, transform);
  out = toMsg(transform.getRotation().rotate(Vector3(in.x, in.y, in.z)));
}

}  // namespace tf2
