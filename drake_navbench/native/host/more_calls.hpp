// Calls that the host answers besides those of the controllers' protocol, where they are linked in.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "host/message_pack.hpp"

namespace drake_navbench {

using Call = std::function<msgpack::Value(const msgpack::Value & request)>;

inline std::map<std::string, Call> & more_calls() {
  static std::map<std::string, Call> calls;
  return calls;
}

}  // namespace drake_navbench
