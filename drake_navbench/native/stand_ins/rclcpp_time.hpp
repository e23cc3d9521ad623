// Times, durations and clocks. Every clock shows the time of the trial, which the host sets.
#pragma once

#include <chrono>

#include "stand_ins/builtin_interfaces.hpp"

enum rcl_clock_type_t { RCL_CLOCK_UNINITIALIZED = 0, RCL_ROS_TIME, RCL_SYSTEM_TIME, RCL_STEADY_TIME };

namespace rclcpp {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

class Duration {
 public:
  Duration() = default;
  Duration(std::int32_t seconds, std::uint32_t nanoseconds)
      : nanoseconds_(seconds * kNanosecondsPerSecond + nanoseconds) {}
  template <typename Count, typename Period>
  Duration(std::chrono::duration<Count, Period> span)
      : nanoseconds_(std::chrono::duration_cast<std::chrono::nanoseconds>(span).count()) {}
  Duration(const builtin_interfaces::msg::Duration & span) : Duration(span.sec, span.nanosec) {}

  static Duration from_seconds(double seconds) {
    return from_nanoseconds(static_cast<std::int64_t>(seconds * 1e9));
  }
  static Duration from_nanoseconds(std::int64_t nanoseconds) {
    return Duration(std::chrono::nanoseconds(nanoseconds));
  }
  double seconds() const { return static_cast<double>(nanoseconds_) / 1e9; }
  std::int64_t nanoseconds() const { return nanoseconds_; }
  template <typename Span>
  Span to_chrono() const {
    return std::chrono::duration_cast<Span>(std::chrono::nanoseconds(nanoseconds_));
  }
  operator builtin_interfaces::msg::Duration() const {
    // The rest is never negative, as in the message.
    const std::int64_t rest =
        (nanoseconds_ % kNanosecondsPerSecond + kNanosecondsPerSecond) % kNanosecondsPerSecond;
    return {static_cast<std::int32_t>((nanoseconds_ - rest) / kNanosecondsPerSecond),
            static_cast<std::uint32_t>(rest)};
  }
  Duration operator+(const Duration & other) const {
    return from_nanoseconds(nanoseconds_ + other.nanoseconds_);
  }
  Duration operator-(const Duration & other) const {
    return from_nanoseconds(nanoseconds_ - other.nanoseconds_);
  }
  Duration operator*(double factor) const {
    return from_nanoseconds(
        static_cast<std::int64_t>(static_cast<long double>(nanoseconds_) * factor));
  }
  bool operator==(const Duration & other) const { return nanoseconds_ == other.nanoseconds_; }
  bool operator!=(const Duration & other) const { return nanoseconds_ != other.nanoseconds_; }
  bool operator<(const Duration & other) const { return nanoseconds_ < other.nanoseconds_; }
  bool operator<=(const Duration & other) const { return nanoseconds_ <= other.nanoseconds_; }
  bool operator>(const Duration & other) const { return nanoseconds_ > other.nanoseconds_; }
  bool operator>=(const Duration & other) const { return nanoseconds_ >= other.nanoseconds_; }

 private:
  std::int64_t nanoseconds_ = 0;
};

class Time {
 public:
  explicit Time(std::int64_t nanoseconds = 0, rcl_clock_type_t = RCL_SYSTEM_TIME)
      : nanoseconds_(nanoseconds) {}
  Time(std::int32_t seconds, std::uint32_t nanoseconds, rcl_clock_type_t = RCL_SYSTEM_TIME)
      : nanoseconds_(seconds * kNanosecondsPerSecond + nanoseconds) {}
  Time(const builtin_interfaces::msg::Time & time, rcl_clock_type_t = RCL_ROS_TIME)
      : Time(time.sec, time.nanosec) {}

  double seconds() const { return static_cast<double>(nanoseconds_) / 1e9; }
  std::int64_t nanoseconds() const { return nanoseconds_; }
  rcl_clock_type_t get_clock_type() const { return RCL_ROS_TIME; }
  operator builtin_interfaces::msg::Time() const {
    return {static_cast<std::int32_t>(nanoseconds_ / kNanosecondsPerSecond),
            static_cast<std::uint32_t>(nanoseconds_ % kNanosecondsPerSecond)};
  }
  Duration operator-(const Time & other) const {
    return Duration::from_nanoseconds(nanoseconds_ - other.nanoseconds_);
  }
  Time operator+(const Duration & span) const { return Time(nanoseconds_ + span.nanoseconds()); }
  Time operator-(const Duration & span) const { return Time(nanoseconds_ - span.nanoseconds()); }
  bool operator==(const Time & other) const { return nanoseconds_ == other.nanoseconds_; }
  bool operator!=(const Time & other) const { return nanoseconds_ != other.nanoseconds_; }
  bool operator<(const Time & other) const { return nanoseconds_ < other.nanoseconds_; }
  bool operator<=(const Time & other) const { return nanoseconds_ <= other.nanoseconds_; }
  bool operator>(const Time & other) const { return nanoseconds_ > other.nanoseconds_; }
  bool operator>=(const Time & other) const { return nanoseconds_ >= other.nanoseconds_; }

 private:
  std::int64_t nanoseconds_ = 0;
};

// Found for a message as well, as rclcpp's members are.
inline Time operator+(const builtin_interfaces::msg::Time & time, const Duration & span) {
  return Time(time) + span;
}
inline Time operator-(const builtin_interfaces::msg::Time & time, const Duration & span) {
  return Time(time) - span;
}

class Clock {
 public:
  DRAKE_NAVBENCH_POINTERS(Clock)

  explicit Clock(rcl_clock_type_t type = RCL_SYSTEM_TIME) : type_(type) {}
  Time now() const { return Time(trial_time()); }
  rcl_clock_type_t get_clock_type() const { return type_; }

  // For the host: the time that all clocks show, ns.
  static std::int64_t & trial_time() {
    static std::int64_t nanoseconds = 0;
    return nanoseconds;
  }

 private:
  rcl_clock_type_t type_;
};

}  // namespace rclcpp
