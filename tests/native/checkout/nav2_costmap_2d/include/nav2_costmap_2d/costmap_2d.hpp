// As much of a grid as the host and the tiny controller use, written for the tests.
#pragma once

#include <vector>

namespace nav2_costmap_2d {

class Costmap2D {
 public:
  void resizeMap(unsigned int width, unsigned int height, double resolution, double origin_x,
                 double origin_y) {
    width_ = width;
    resolution_ = resolution;
    origin_x_ = origin_x;
    origin_y_ = origin_y;
    costs_.assign(std::size_t{width} * height, 0);
  }
  unsigned char * getCharMap() { return costs_.data(); }
  double getResolution() const { return resolution_; }
  unsigned char cost_at(double x, double y) const {
    const auto column = static_cast<unsigned int>((x - origin_x_) / resolution_);
    const auto row = static_cast<unsigned int>((y - origin_y_) / resolution_);
    return costs_.at(std::size_t{row} * width_ + column);
  }

 private:
  unsigned int width_ = 0;
  double resolution_ = 0.0, origin_x_ = 0.0, origin_y_ = 0.0;
  std::vector<unsigned char> costs_;
};

}  // namespace nav2_costmap_2d
