// The names that plugin descriptions give to classes.
#pragma once

#include <utility>
#include <vector>

namespace drake_navbench {

// Pairs of name and class.
std::vector<std::pair<const char *, const char *>> PluginNames();

}  // namespace drake_navbench
