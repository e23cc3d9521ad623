// Transforms of one moment: the map is the odometry frame, and the host tells where the base is.
#pragma once

#include <functional>

#include "stand_ins/rclcpp.hpp"
#include "stand_ins/tf2.hpp"

namespace tf2_ros {

inline tf2::TimePoint fromMsg(const builtin_interfaces::msg::Time & time) {
  return tf2::TimePoint(std::chrono::seconds(time.sec) + std::chrono::nanoseconds(time.nanosec));
}
inline tf2::TimePoint fromRclcpp(const rclcpp::Time & time) {
  return tf2::TimePoint(std::chrono::nanoseconds(time.nanoseconds()));
}

class Buffer {
 public:
  DRAKE_NAVBENCH_POINTERS(Buffer)

  explicit Buffer(rclcpp::Clock::SharedPtr = nullptr) {}

  // For the host: where the base is in the odometry frame.
  void set_base(const tf2::Transform & pose) { base_ = pose; }

  template <typename Moment>
  geometry_msgs::msg::TransformStamped lookupTransform(const std::string & target,
                                                       const std::string & source, const Moment &,
                                                       const tf2::Duration & = {}) const {
    geometry_msgs::msg::TransformStamped found;
    found.header.stamp = rclcpp::Clock().now();
    found.header.frame_id = target;
    found.child_frame_id = source;
    const bool is_to_base = is_base(target), is_from_base = is_base(source);
    if (is_to_base && !is_from_base) found.transform = tf2::toMsg(base_.inverse());
    if (is_from_base && !is_to_base) found.transform = tf2::toMsg(base_);
    return found;
  }
  template <typename Moment, typename OtherMoment>
  geometry_msgs::msg::TransformStamped lookupTransform(const std::string & target, const Moment &,
                                                       const std::string & source,
                                                       const OtherMoment & moment,
                                                       const std::string &,
                                                       const tf2::Duration & = {}) const {
    return lookupTransform(target, source, moment);
  }
  template <typename Moment>
  bool canTransform(const std::string &, const std::string &, const Moment &,
                    const tf2::Duration & = {}, std::string * = nullptr) const {
    return true;
  }
  template <typename Message>
  Message & transform(const Message & in, Message & out, const std::string & target,
                      const tf2::Duration & = {}) const {
    const auto by = lookupTransform(target, in.header.frame_id, tf2::TimePointZero);
    Message changed = in;
    tf2::doTransform(in, changed, by);
    changed.header.stamp = in.header.stamp;
    return out = changed;
  }
  template <typename Message>
  Message transform(const Message & in, const std::string & target,
                    const tf2::Duration & patience = {}) const {
    Message out;
    return transform(in, out, target, patience);
  }

 private:
  static bool is_base(const std::string & frame) {
    if (frame == "base_link") return true;
    if (frame == "odom" || frame == "map") return false;
    throw tf2::LookupException("\"" + frame +
                               "\" passed to lookupTransform argument does not exist.");
  }

  tf2::Transform base_;
};

struct TransformListener {
  template <typename... Rest>
  explicit TransformListener(Rest &&...) {}
};

}  // namespace tf2_ros
