// A controller in a process of its own, without dependencies: the same as carrot_client.py.
//
//     c++ -std=c++17 -O2 -ffp-contract=off -o carrot_client carrot_client.cpp
//     drake-navbench run empty --controllers external:command=./carrot_client
//
// docs/external_controllers.md describes the protocol. To write one of your own, replace the class
// `CarrotController`.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

// The messages and the two pipes; copy these headers where you keep a controller of your own.
#include "../../drake_navbench/native/host/message_pack.hpp"
#include "../../drake_navbench/native/host/pipes.hpp"

using msgpack::Value;

// Packed arrays hold doubles of 8 bytes, least significant first, as almost every machine has them.
inline std::vector<double> Unpacked(const Value& packed) {
  const std::string& data = packed["data"].bytes();
  std::vector<double> numbers(data.size() / sizeof(double));
  std::memcpy(numbers.data(), data.data(), numbers.size() * sizeof(double));
  return numbers;
}

inline Value Packed(const std::vector<double>& numbers, Value::Array shape) {
  std::string data(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double));
  return Value::Map{{"shape", std::move(shape)}, {"data", Value::Bytes(std::move(data))}};
}

inline double Wrapped(double angle) { return std::atan2(std::sin(angle), std::cos(angle)); }

// Turns and drives towards the first plan pose farther away than the lookahead distance.
class CarrotController {
 public:
  Value Configure(const Value& request) {
    for (const auto& [name, value] : request["parameters"].map()) {
      if (name == "speed") {
        speed_ = value.number();
      } else if (name == "lookahead_m") {
        lookahead_m_ = value.number();
      } else {
        return Value::Map{{"error", name + " is not a parameter"}};
      }
    }
    speed_ = std::min(speed_, request["max_linear_velocity_mps"].number());
    turn_limit_ = request["max_angular_velocity_radps"].number();
    for (const Value& corner : request["footprint"].array()) {
      front_m_ = std::max(front_m_, corner.number_at(0));
    }
    wants_diagnostics_ = request["wants_diagnostics"].boolean();
    return Value::Map{{"protocol", 1}};
  }

  Value Compute(const Value& request) const {
    const double x = request["pose"].number_at(0);
    const double y = request["pose"].number_at(1);
    const double yaw = request["pose"].number_at(2);
    const auto [carrot_x, carrot_y] = Carrot(Unpacked(request["local_plan"]), x, y);
    if (IsBlocked(request["costmap"], x, y, yaw)) {
      return Value::Map{{"failure", "no_valid_control"}, {"message", "something stands in front"}};
    }
    const double bearing = Wrapped(std::atan2(carrot_y - y, carrot_x - x) - yaw);
    double speed = speed_ * std::max(0.0, std::cos(bearing));
    double turn = 2.0 * bearing;
    if (request["goal_xy_reached"].boolean()) {
      speed = 0.0;
      turn = 2.0 * Wrapped(request["goal"].number_at(2) - yaw);
    }
    const Value& limit = request["speed_limit"];
    if (!limit.is_nil()) {
      const double value = limit["value"].number();
      speed = std::min(speed, limit["is_percentage"].boolean() ? value / 100.0 * speed_ : value);
    }
    turn = std::max(-turn_limit_, std::min(turn_limit_, turn));
    Value::Map decision{{"command", Value::Array{speed, turn}},
                        {"diagnostics", Value::Map{{"bearing_rad", bearing}}}};
    if (wants_diagnostics_) decision["carrot"] = Packed({carrot_x, carrot_y}, {2});
    return decision;
  }

 private:
  std::pair<double, double> Carrot(const std::vector<double>& plan, double x, double y) const {
    std::pair<double, double> point{x, y};
    for (std::size_t i = 0; i + 2 < plan.size(); i += 3) {
      point = {plan[i], plan[i + 1]};
      const double ahead = point.first - x, beside = point.second - y;
      if (std::sqrt(ahead * ahead + beside * beside) >= lookahead_m_) break;
    }
    return point;
  }

  // Whether a lethal cell lies within 0.3 m ahead of the middle of the front.
  bool IsBlocked(const Value& costmap, double x, double y, double yaw) const {
    constexpr std::uint8_t kLethal = 254;
    const std::int64_t rows = costmap["shape"].array().at(0).integer();
    const std::int64_t columns = costmap["shape"].array().at(1).integer();
    const double resolution = costmap["resolution"].number();
    const std::string& costs = costmap["data"].bytes();
    for (int step = 0; step < 7; ++step) {
      const double ahead_m = front_m_ + 0.05 * step;
      const double at_x = x + ahead_m * std::cos(yaw) - costmap["origin"].number_at(0);
      const double at_y = y + ahead_m * std::sin(yaw) - costmap["origin"].number_at(1);
      const auto column = static_cast<std::int64_t>(std::floor(at_x / resolution));
      const auto row = static_cast<std::int64_t>(std::floor(at_y / resolution));
      const bool is_inside = row >= 0 && row < rows && column >= 0 && column < columns;
      if (is_inside && static_cast<std::uint8_t>(costs[row * columns + column]) == kLethal) {
        return true;
      }
    }
    return false;
  }

  double speed_ = 0.4;
  double lookahead_m_ = 0.6;
  double turn_limit_ = 0.0;
  double front_m_ = -1e9;
  bool wants_diagnostics_ = false;
};

int main() {
  const drake_navbench::Pipes pipes;
  CarrotController controller;
  std::string message;
  while (pipes.Read(&message)) {
    const Value request = msgpack::Reader(message).Read();
    const std::string& call = request["call"].text();
    if (call == "shutdown") break;
    Value answer = Value::Map{};  // reset and set_plan: nothing is remembered.
    if (call == "configure") answer = controller.Configure(request);
    if (call == "compute") answer = controller.Compute(request);
    std::string body;
    msgpack::Append(&body, answer);
    pipes.Write(body);
  }
  return 0;
}
