#pragma once

#include <stdexcept>

namespace nav2_core {

class ControllerException : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
class NoValidControl : public ControllerException {
 public:
  using ControllerException::ControllerException;
};
class InvalidPath : public ControllerException {
 public:
  using ControllerException::ControllerException;
};

}  // namespace nav2_core
