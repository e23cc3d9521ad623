// Warnings and errors go to standard error, whose end the log of a failed trial keeps.
#pragma once

#include <cstdio>
#include <sstream>

#include "stand_ins/rclcpp_time.hpp"

namespace rclcpp {

class Logger {
 public:
  explicit Logger(std::string name = "") : name_(std::move(name)) {}
  const char * get_name() const { return name_.c_str(); }
  Logger get_child(const std::string & suffix) const { return Logger(name_ + "." + suffix); }

 private:
  std::string name_;
};

inline Logger get_logger(const std::string & name) { return Logger(name); }

}  // namespace rclcpp

// Tells whether a place in the code may speak again, in the time of the trial.
#define DRAKE_NAVBENCH_IS_DUE(clock, period_ms)                                  \
  [&] {                                                                          \
    static std::int64_t next = INT64_MIN;                                        \
    const std::int64_t now = (clock).now().nanoseconds();                        \
    if (now < next) return false;                                                \
    next = now + static_cast<std::int64_t>((period_ms) * 1'000'000.0);           \
    return true;                                                                 \
  }()
#define DRAKE_NAVBENCH_IS_FIRST()        \
  [] {                                   \
    static bool is_first = true;         \
    return std::exchange(is_first, false); \
  }()
#define DRAKE_NAVBENCH_SAY(level, logger, ...)                     \
  do {                                                             \
    std::fprintf(stderr, "[" level "] [%s] ", (logger).get_name()); \
    std::fprintf(stderr, __VA_ARGS__);                             \
    std::fputc('\n', stderr);                                      \
  } while (false)
#define DRAKE_NAVBENCH_SAY_IF(condition, level, logger, ...) \
  do {                                                       \
    if (condition) DRAKE_NAVBENCH_SAY(level, logger, __VA_ARGS__); \
  } while (false)
#define DRAKE_NAVBENCH_SAY_STREAM(level, logger, stream)                   \
  do {                                                                     \
    std::ostringstream text;                                               \
    text << stream;                                                        \
    DRAKE_NAVBENCH_SAY(level, logger, "%s", text.str().c_str());           \
  } while (false)
// What is not shown is compiled all the same, so that nothing that it uses is unused.
#define DRAKE_NAVBENCH_KEEP_QUIET(logger, ...) DRAKE_NAVBENCH_SAY_IF(false, "", logger, __VA_ARGS__)

#define RCLCPP_DEBUG(logger, ...) DRAKE_NAVBENCH_KEEP_QUIET(logger, __VA_ARGS__)
#define RCLCPP_DEBUG_ONCE(logger, ...) DRAKE_NAVBENCH_KEEP_QUIET(logger, __VA_ARGS__)
#define RCLCPP_DEBUG_EXPRESSION(logger, expression, ...) \
  DRAKE_NAVBENCH_KEEP_QUIET(logger, __VA_ARGS__)
#define RCLCPP_DEBUG_THROTTLE(logger, clock, period, ...) \
  DRAKE_NAVBENCH_KEEP_QUIET(logger, __VA_ARGS__)
#define RCLCPP_DEBUG_STREAM(logger, stream) \
  do { if (false) DRAKE_NAVBENCH_SAY_STREAM("", logger, stream); } while (false)
#define RCLCPP_INFO(logger, ...) DRAKE_NAVBENCH_KEEP_QUIET(logger, __VA_ARGS__)
#define RCLCPP_INFO_ONCE(logger, ...) DRAKE_NAVBENCH_KEEP_QUIET(logger, __VA_ARGS__)
#define RCLCPP_INFO_EXPRESSION(logger, expression, ...) \
  DRAKE_NAVBENCH_KEEP_QUIET(logger, __VA_ARGS__)
#define RCLCPP_INFO_THROTTLE(logger, clock, period, ...) \
  DRAKE_NAVBENCH_KEEP_QUIET(logger, __VA_ARGS__)
#define RCLCPP_INFO_STREAM(logger, stream) RCLCPP_DEBUG_STREAM(logger, stream)

#define RCLCPP_WARN(logger, ...) DRAKE_NAVBENCH_SAY("WARN", logger, __VA_ARGS__)
#define RCLCPP_WARN_ONCE(logger, ...) \
  DRAKE_NAVBENCH_SAY_IF(DRAKE_NAVBENCH_IS_FIRST(), "WARN", logger, __VA_ARGS__)
#define RCLCPP_WARN_EXPRESSION(logger, expression, ...) \
  DRAKE_NAVBENCH_SAY_IF(expression, "WARN", logger, __VA_ARGS__)
#define RCLCPP_WARN_THROTTLE(logger, clock, period, ...) \
  DRAKE_NAVBENCH_SAY_IF(DRAKE_NAVBENCH_IS_DUE(clock, period), "WARN", logger, __VA_ARGS__)
#define RCLCPP_WARN_STREAM(logger, stream) DRAKE_NAVBENCH_SAY_STREAM("WARN", logger, stream)
#define RCLCPP_ERROR(logger, ...) DRAKE_NAVBENCH_SAY("ERROR", logger, __VA_ARGS__)
#define RCLCPP_ERROR_ONCE(logger, ...) \
  DRAKE_NAVBENCH_SAY_IF(DRAKE_NAVBENCH_IS_FIRST(), "ERROR", logger, __VA_ARGS__)
#define RCLCPP_ERROR_THROTTLE(logger, clock, period, ...) \
  DRAKE_NAVBENCH_SAY_IF(DRAKE_NAVBENCH_IS_DUE(clock, period), "ERROR", logger, __VA_ARGS__)
#define RCLCPP_ERROR_STREAM(logger, stream) DRAKE_NAVBENCH_SAY_STREAM("ERROR", logger, stream)
#define RCLCPP_ERROR_EXPRESSION(logger, expression, ...) \
  DRAKE_NAVBENCH_SAY_IF(expression, "ERROR", logger, __VA_ARGS__)
#define RCLCPP_FATAL_EXPRESSION(logger, expression, ...) \
  DRAKE_NAVBENCH_SAY_IF(expression, "FATAL", logger, __VA_ARGS__)
#define RCLCPP_FATAL(logger, ...) DRAKE_NAVBENCH_SAY("FATAL", logger, __VA_ARGS__)
