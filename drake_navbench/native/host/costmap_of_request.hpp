// A costmap as a request describes it, with the inflation layer that plugins ask for its parameters.
#pragma once

#include "host/conversions.hpp"
#include "nav2_costmap_2d/costmap_2d_ros.hpp"
#if __has_include("nav2_costmap_2d/inflation_layer.hpp")
#include "nav2_costmap_2d/inflation_layer.hpp"
#define DRAKE_NAVBENCH_HAS_INFLATION_LAYER 1
#endif

namespace drake_navbench {

struct CostmapSize {
  unsigned int columns, rows;
  double resolution;
};

inline std::shared_ptr<nav2_costmap_2d::Costmap2DROS> CostmapOfRequest(
    const Value & request, const CostmapSize & size,
    const std::shared_ptr<tf2_ros::Buffer> & transforms) {
  std::optional<double> radius;
  if (request["footprint_is_circle"].boolean()) {
    radius = request["circumscribed_radius_m"].number();
  }
  auto costmap = std::make_shared<nav2_costmap_2d::Costmap2DROS>(
      request["tracks_unknown_space"].boolean(), radius);
  costmap->set_transforms(transforms);
  auto * layers = costmap->getLayeredCostmap();
#ifdef DRAKE_NAVBENCH_HAS_INFLATION_LAYER
  // It is asked how costs fall with the distance; the costs themselves are told.
  constexpr const char * kLayer = "inflation_layer";
  auto & overrides = costmap->get_node_parameters_interface()->overrides();
  overrides["inflation_layer.inflation_radius"] =
      rclcpp::ParameterValue(request["inflation_radius_m"].number());
  overrides["inflation_layer.cost_scaling_factor"] =
      rclcpp::ParameterValue(request["inflation_cost_scaling_factor"].number());
  auto layer = std::make_shared<nav2_costmap_2d::InflationLayer>();
  layers->addPlugin(layer);
  layer->initialize(layers, kLayer, transforms.get(), costmap, nullptr);
#endif
  layers->resizeMap(size.columns, size.rows, size.resolution, 0.0, 0.0);
  std::vector<geometry_msgs::msg::Point> footprint;
  for (const Value & corner : request["footprint"].array()) {
    footprint.push_back({corner.number_at(0), corner.number_at(1), 0.0});
  }
  costmap->set_footprint(footprint);
  return costmap;
}

inline CostmapSize SizeOf(const Value & told) {
  const Value::Array & shape = told["shape"].array();
  return {static_cast<unsigned int>(shape.at(1).integer()),
          static_cast<unsigned int>(shape.at(0).integer()), told["resolution"].number()};
}

inline void SetCosts(const Value & told, nav2_costmap_2d::Costmap2D & grid) {
  const auto [columns, rows, resolution] = SizeOf(told);
  const std::string & costs = told["data"].bytes();
  if (costs.size() != std::size_t{rows} * columns) throw std::runtime_error("a costmap cut off");
  grid.resizeMap(columns, rows, resolution, told["origin"].number_at(0),
                 told["origin"].number_at(1));
  std::memcpy(grid.getCharMap(), costs.data(), costs.size());
}

}  // namespace drake_navbench
