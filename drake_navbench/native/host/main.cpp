// Plugins of Nav2 behind pipes: a controller by the protocol of docs/external_controllers.md.

#include <exception>
#include <iostream>

#include "host/controller_host.hpp"
#include "host/more_calls.hpp"
#include "host/pipes.hpp"
#include "host/plugin_names.hpp"

#if __has_include(<malloc.h>)
#include <malloc.h>
#endif

namespace drake_navbench {

// Returns the answer to a call; what goes wrong outside of a cycle is an error of the program.
Value Answer(ControllerHost & host, const Value & request) {
  const std::string & call = request["call"].text();
  try {
    if (call == "configure") return host.Configure(request);
    if (call == "reset") return host.Reset();
    if (call == "set_plan") return host.SetPlan(request);
    if (call == "compute") return host.Compute(request);
    const auto found = more_calls().find(call);
    if (found != more_calls().end()) return found->second(request);
  } catch (const std::exception & error) {
    return Value::Map{{"error", std::string(error.what())}};
  }
  return Value::Map{{"error", "the call " + call + " is not known"}};
}

// Keeps memory that was freed. A controller that samples takes and frees arrays of half a megabyte
// in every cycle, and to get their pages from the system again takes as long as to fill them.
void KeepMemory() {
#ifdef M_MMAP_THRESHOLD
  constexpr int kLargest = 1 << 25;
  constexpr int kKept = 1 << 28;
  ::mallopt(M_MMAP_THRESHOLD, kLargest);
  ::mallopt(M_TRIM_THRESHOLD, kKept);
#endif
}

void Serve() {
  const Pipes pipes;
  ControllerHost host;
  for (std::string message; pipes.Read(&message);) {
    const Value request = msgpack::Reader(message).Read();
    if (request["call"].text() == "shutdown") break;
    std::string answer;
    msgpack::Append(&answer, Answer(host, request));
    pipes.Write(answer);
  }
}

}  // namespace drake_navbench

int main(int count, char ** arguments) {
  for (const auto & [name, type] : drake_navbench::PluginNames()) {
    pluginlib::described_names()[name] = type;
  }
  if (count > 1 && std::string(arguments[1]) == "--list") {
    for (const auto & [name, factory] : pluginlib::registered<nav2_core::Controller>()) {
      std::cout << name << '\n';
    }
    return 0;
  }
  drake_navbench::KeepMemory();
  drake_navbench::Serve();
  return 0;
}
