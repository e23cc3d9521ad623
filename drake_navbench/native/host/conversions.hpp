// What the protocol tells, as ROS's messages and parameters.
#pragma once

#include "host/message_pack.hpp"
#include "nav_msgs/msg/path.hpp"
#include "rclcpp/rclcpp.hpp"
#include "tf2/utils.h"

namespace drake_navbench {

using msgpack::Value;

inline constexpr const char * kFrame = "odom";

inline std_msgs::msg::Header Header() { return {rclcpp::Clock().now(), kFrame}; }

inline geometry_msgs::msg::Pose Pose(double x, double y, double yaw) {
  tf2::Quaternion rotation;
  rotation.setRPY(0.0, 0.0, yaw);
  return {{x, y, 0.0}, tf2::toMsg(rotation)};
}

inline geometry_msgs::msg::PoseStamped StampedPose(const Value & pose) {
  return {Header(), Pose(pose.number_at(0), pose.number_at(1), pose.number_at(2))};
}

// Packed arrays hold doubles of 8 bytes, least significant first, as almost every machine has them.
inline nav_msgs::msg::Path Path(const Value & packed) {
  const std::string & data = packed["data"].bytes();
  nav_msgs::msg::Path path;
  path.header = Header();
  path.poses.resize(data.size() / (3 * sizeof(double)));
  for (std::size_t i = 0; i < path.poses.size(); ++i) {
    double row[3];
    std::memcpy(row, data.data() + i * sizeof row, sizeof row);
    path.poses[i] = {path.header, Pose(row[0], row[1], row[2])};
  }
  return path;
}

template <typename Number>
std::vector<Number> Numbers(const Value::Array & array) {
  std::vector<Number> numbers;
  for (const Value & each : array) {
    numbers.push_back(static_cast<Number>(each.number()));
  }
  return numbers;
}

inline rclcpp::ParameterValue ArrayParameter(const Value::Array & array) {
  const auto has_only = [&array](auto... types) {
    return std::all_of(array.begin(), array.end(), [types...](const Value & each) {
      return ((each.type() == types) || ...);
    });
  };
  using Type = Value::Type;
  if (has_only(Type::kText)) {
    std::vector<std::string> texts;
    for (const Value & each : array) texts.push_back(each.text());
    return rclcpp::ParameterValue(texts);
  }
  if (has_only(Type::kBool)) {
    std::vector<bool> flags;
    for (const Value & each : array) flags.push_back(each.boolean());
    return rclcpp::ParameterValue(flags);
  }
  if (has_only(Type::kInt)) return rclcpp::ParameterValue(Numbers<std::int64_t>(array));
  return rclcpp::ParameterValue(Numbers<double>(array));
}

// Adds a tree of parameters by their dotted names; what is nil is not given.
inline void AddParameters(const std::string & name, const Value & value,
                          std::map<std::string, rclcpp::ParameterValue> * parameters) {
  switch (value.type()) {
    case Value::Type::kNil: return;
    case Value::Type::kMap:
      for (const auto & [key, entry] : value.map()) {
        AddParameters(name.empty() ? key : name + "." + key, entry, parameters);
      }
      return;
    case Value::Type::kBool:
      (*parameters)[name] = rclcpp::ParameterValue(value.boolean());
      return;
    case Value::Type::kInt:
      (*parameters)[name] = rclcpp::ParameterValue(value.integer());
      return;
    case Value::Type::kDouble:
      (*parameters)[name] = rclcpp::ParameterValue(value.number());
      return;
    case Value::Type::kArray: (*parameters)[name] = ArrayParameter(value.array()); return;
    default: (*parameters)[name] = rclcpp::ParameterValue(value.text()); return;
  }
}

// Returns a parameter as the protocol tells it.
inline Value ParameterAsValue(const rclcpp::ParameterValue & parameter) {
  return std::visit(
      [](const auto & content) -> Value {
        using Content = std::decay_t<decltype(content)>;
        if constexpr (std::is_same_v<Content, std::monostate>) {
          return Value();
        } else if constexpr (std::is_arithmetic_v<Content> || std::is_same_v<Content, std::string>) {
          return Value(content);
        } else {
          Value::Array array;
          for (const auto & each : content) {
            using Each = typename Content::value_type;
            array.push_back(ParameterAsValue(rclcpp::ParameterValue(static_cast<Each>(each))));
          }
          return Value(std::move(array));
        }
      },
      parameter.content());
}

}  // namespace drake_navbench
