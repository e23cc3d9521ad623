// The only source of the host that is compiled anew for another set of packages.

#include "host/plugin_names.hpp"

#include "made/plugin_names.hpp"

namespace drake_navbench {

std::vector<std::pair<const char *, const char *>> PluginNames() {
  return {kPluginNames.begin(), kPluginNames.end()};
}

}  // namespace drake_navbench
