// Parameters with their types.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <type_traits>
#include <variant>

#include "stand_ins/rcl_interfaces.hpp"

namespace rclcpp {

enum ParameterType : std::uint8_t {
  PARAMETER_NOT_SET, PARAMETER_BOOL, PARAMETER_INTEGER, PARAMETER_DOUBLE, PARAMETER_STRING,
  PARAMETER_BYTE_ARRAY, PARAMETER_BOOL_ARRAY, PARAMETER_INTEGER_ARRAY, PARAMETER_DOUBLE_ARRAY,
  PARAMETER_STRING_ARRAY
};

namespace exceptions {

struct InvalidParametersException : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct InvalidParameterValueException : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct InvalidParameterTypeException : std::runtime_error {
  InvalidParameterTypeException(const std::string & name, const std::string & message)
      : std::runtime_error("parameter '" + name + "' has invalid type: " + message) {}
};
struct ParameterNotDeclaredException : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct ParameterUninitializedException : std::runtime_error {
  explicit ParameterUninitializedException(const std::string & name)
      : std::runtime_error("parameter '" + name + "' is not initialized") {}
};
struct ParameterAlreadyDeclaredException : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace exceptions

struct ParameterTypeException : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline const char * to_string(ParameterType type) {
  constexpr const char * kNames[] = {"not set",       "bool",         "integer",     "double",
                                     "string",        "byte_array",   "bool_array",
                                     "integer_array", "double_array", "string_array"};
  return kNames[type];
}

class ParameterValue {
 public:
  // In the order of ParameterType.
  using Content =
      std::variant<std::monostate, bool, std::int64_t, double, std::string,
                   std::vector<std::uint8_t>, std::vector<bool>, std::vector<std::int64_t>,
                   std::vector<double>, std::vector<std::string>>;

  ParameterValue() = default;
  explicit ParameterValue(bool value) : content_(value) {}
  template <typename Number, typename = std::enable_if_t<std::is_arithmetic_v<Number> &&
                                                         !std::is_same_v<Number, bool>>>
  explicit ParameterValue(Number value)
      : content_(static_cast<std::conditional_t<std::is_integral_v<Number>, std::int64_t, double>>(
            value)) {}
  explicit ParameterValue(const char * value) : content_(std::string(value)) {}
  explicit ParameterValue(const std::string & value) : content_(value) {}
  explicit ParameterValue(const std::vector<std::uint8_t> & value) : content_(value) {}
  explicit ParameterValue(const std::vector<bool> & value) : content_(value) {}
  explicit ParameterValue(const std::vector<int> & value)
      : content_(std::vector<std::int64_t>(value.begin(), value.end())) {}
  explicit ParameterValue(const std::vector<std::int64_t> & value) : content_(value) {}
  explicit ParameterValue(const std::vector<float> & value)
      : content_(std::vector<double>(value.begin(), value.end())) {}
  explicit ParameterValue(const std::vector<double> & value) : content_(value) {}
  explicit ParameterValue(const std::vector<std::string> & value) : content_(value) {}

  ParameterType get_type() const { return static_cast<ParameterType>(content_.index()); }
  const Content & content() const { return content_; }

  // Returns the value; raises ParameterTypeException where it is of another type.
  template <typename Value>
  decltype(auto) get() const {
    using Plain = std::decay_t<Value>;
    if constexpr (std::is_same_v<Plain, bool>) {
      return bool(stored<bool>());
    } else if constexpr (std::is_integral_v<Plain>) {
      return static_cast<Plain>(stored<std::int64_t>());
    } else if constexpr (std::is_floating_point_v<Plain>) {
      return static_cast<Plain>(stored<double>());
    } else if constexpr (std::is_same_v<Plain, std::vector<float>>) {
      const auto & values = stored<std::vector<double>>();
      return Plain(values.begin(), values.end());
    } else if constexpr (std::is_same_v<Plain, std::vector<int>>) {
      const auto & values = stored<std::vector<std::int64_t>>();
      return Plain(values.begin(), values.end());
    } else {
      return Plain(stored<Plain>());
    }
  }
  template <ParameterType kType>
  decltype(auto) get() const {
    return stored<std::variant_alternative_t<kType, Content>>();
  }
  bool operator==(const ParameterValue & other) const { return content_ == other.content_; }

 private:
  template <typename Value>
  const Value & stored() const {
    const Value * found = std::get_if<Value>(&content_);
    if (found == nullptr) {
      throw ParameterTypeException(
          std::string("expected [") +
          to_string(static_cast<ParameterType>(Content(Value{}).index())) + "] got [" +
          to_string(get_type()) + "]");
    }
    return *found;
  }

  Content content_;
};

class Parameter {
 public:
  Parameter() = default;
  explicit Parameter(std::string name) : name_(std::move(name)) {}
  Parameter(std::string name, ParameterValue value)
      : name_(std::move(name)), value_(std::move(value)) {}
  template <typename Value>
  Parameter(std::string name, Value value) : Parameter(std::move(name), ParameterValue(value)) {}

  const std::string & get_name() const { return name_; }
  ParameterType get_type() const { return value_.get_type(); }
  std::string get_type_name() const { return to_string(get_type()); }
  const ParameterValue & get_parameter_value() const { return value_; }
  template <typename Value>
  auto get_value() const {
    return value_.get<Value>();
  }
  bool as_bool() const { return value_.get<bool>(); }
  std::int64_t as_int() const { return value_.get<std::int64_t>(); }
  double as_double() const { return value_.get<double>(); }
  std::string as_string() const { return value_.get<std::string>(); }
  auto as_bool_array() const { return value_.get<std::vector<bool>>(); }
  auto as_integer_array() const { return value_.get<std::vector<std::int64_t>>(); }
  auto as_double_array() const { return value_.get<std::vector<double>>(); }
  auto as_string_array() const { return value_.get<std::vector<std::string>>(); }
  bool operator==(const Parameter & other) const {
    return name_ == other.name_ && value_ == other.value_;
  }

 private:
  std::string name_;
  ParameterValue value_;
};

namespace node_interfaces {

struct OnSetParametersCallbackHandle {
  DRAKE_NAVBENCH_POINTERS(OnSetParametersCallbackHandle)
};
struct PostSetParametersCallbackHandle {
  DRAKE_NAVBENCH_POINTERS(PostSetParametersCallbackHandle)
};
struct PreSetParametersCallbackHandle {
  DRAKE_NAVBENCH_POINTERS(PreSetParametersCallbackHandle)
};

// What a node knows of its parameters: those that were given, and those declared.
class NodeParametersInterface {
 public:
  DRAKE_NAVBENCH_POINTERS(NodeParametersInterface)
  using Overrides = std::map<std::string, ParameterValue>;
  using Descriptor = rcl_interfaces::msg::ParameterDescriptor;

  Overrides & overrides() { return overrides_; }
  const Overrides & get_parameter_overrides() const { return overrides_; }
  const Overrides & defaults() const { return defaults_; }
  bool has_parameter(const std::string & name) const { return values_.count(name) > 0; }

  const ParameterValue & declare_parameter(const std::string & name, const ParameterValue & value,
                                           const Descriptor & = {}, bool ignore_override = false) {
    if (has_parameter(name)) {
      throw exceptions::ParameterAlreadyDeclaredException(
          "parameter '" + name + "' has already been declared");
    }
    const auto given = overrides_.find(name);
    const bool is_given = given != overrides_.end() && !ignore_override;
    defaults_[name] = value;
    return values_[name] = is_given ? converted(name, given->second, value.get_type()) : value;
  }
  const ParameterValue & declare_parameter(const std::string & name, ParameterType type,
                                           const Descriptor & = {}, bool = false) {
    const auto given = overrides_.find(name);
    if (given == overrides_.end()) return values_[name];
    return values_[name] = converted(name, given->second, type);
  }
  Parameter get_parameter(const std::string & name) const {
    const auto found = values_.find(name);
    if (found == values_.end()) {
      throw exceptions::ParameterNotDeclaredException("parameter '" + name +
                                                      "' is not declared");
    }
    if (found->second.get_type() == PARAMETER_NOT_SET) {
      throw exceptions::ParameterUninitializedException(name);
    }
    return Parameter(name, found->second);
  }
  bool get_parameter(const std::string & name, Parameter & parameter) const {
    const auto found = values_.find(name);
    if (found == values_.end() || found->second.get_type() == PARAMETER_NOT_SET) return false;
    parameter = Parameter(name, found->second);
    return true;
  }
  void set_parameter(const Parameter & parameter) {
    values_[parameter.get_name()] = parameter.get_parameter_value();
  }

 private:
  // Returns a given value as the type that is declared. A whole number serves for a double and an
  // empty list for any array, since what comes from the benchmark does not tell them apart.
  static ParameterValue converted(const std::string & name, const ParameterValue & given,
                                  ParameterType type) {
    const ParameterType own = given.get_type();
    if (own == type || type == PARAMETER_NOT_SET) return given;
    if (own == PARAMETER_INTEGER && type == PARAMETER_DOUBLE) {
      return ParameterValue(static_cast<double>(given.get<std::int64_t>()));
    }
    if (own == PARAMETER_INTEGER_ARRAY && type == PARAMETER_DOUBLE_ARRAY) {
      const auto values = given.get<std::vector<std::int64_t>>();
      return ParameterValue(std::vector<double>(values.begin(), values.end()));
    }
    if (own == PARAMETER_STRING_ARRAY && given.get<std::vector<std::string>>().empty()) {
      if (type == PARAMETER_DOUBLE_ARRAY) return ParameterValue(std::vector<double>());
      if (type == PARAMETER_INTEGER_ARRAY) return ParameterValue(std::vector<std::int64_t>());
      if (type == PARAMETER_BOOL_ARRAY) return ParameterValue(std::vector<bool>());
    }
    throw exceptions::InvalidParameterTypeException(
        name, std::string("expected [") + to_string(type) + "] got [" + to_string(own) + "]");
  }

  Overrides overrides_, defaults_, values_;
};

}  // namespace node_interfaces

}  // namespace rclcpp

namespace std {
inline string to_string(const rclcpp::Parameter & parameter) { return parameter.get_name(); }
}  // namespace std
