// Point clouds only for what a controller draws: they are filled and seen by nobody.
#pragma once

#include "stand_ins/geometry_msgs.hpp"

namespace sensor_msgs {

namespace msg {

struct ChannelFloat32 {
  std::string name;
  std::vector<float> values;
  DRAKE_NAVBENCH_MESSAGE(ChannelFloat32)
};

struct PointField {
  enum DataType : std::uint8_t { INT8 = 1, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64 };
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;
  std::uint32_t count = 0;
  DRAKE_NAVBENCH_MESSAGE(PointField)
};

struct PointCloud {
  std_msgs::msg::Header header;
  std::vector<geometry_msgs::msg::Point32> points;
  std::vector<ChannelFloat32> channels;
  DRAKE_NAVBENCH_MESSAGE(PointCloud)
};

struct PointCloud2 {
  std_msgs::msg::Header header;
  std::uint32_t height = 0, width = 0;
  std::vector<PointField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = false;
  DRAKE_NAVBENCH_MESSAGE(PointCloud2)
};

}  // namespace msg

class PointCloud2Modifier {
 public:
  explicit PointCloud2Modifier(msg::PointCloud2 &) {}
  template <typename... Fields>
  void setPointCloud2Fields(int, Fields...) {}
  template <typename... Fields>
  void setPointCloud2FieldsByString(int, Fields...) {}
  void resize(std::size_t) {}
};

template <typename Value>
class PointCloud2Iterator {
 public:
  PointCloud2Iterator(msg::PointCloud2 &, const std::string &) {}
  Value & operator*() { return value_; }
  Value & operator[](std::size_t) { return value_; }
  PointCloud2Iterator & operator++() { return *this; }

 private:
  Value value_{};
};

}  // namespace sensor_msgs
