// Plugins that are linked in: each PLUGINLIB_EXPORT_CLASS puts its class into its base's table.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace pluginlib {

struct PluginlibException : std::runtime_error {
  using std::runtime_error::runtime_error;
};
struct CreateClassException : PluginlibException {
  using PluginlibException::PluginlibException;
};
struct LibraryLoadException : PluginlibException {
  using PluginlibException::PluginlibException;
};
struct ClassLoaderException : PluginlibException {
  using PluginlibException::PluginlibException;
};

template <typename Base>
using UniquePtr = std::unique_ptr<Base>;

template <typename Base>
std::map<std::string, std::function<std::unique_ptr<Base>()>> & registered() {
  static std::map<std::string, std::function<std::unique_ptr<Base>()>> factories;
  return factories;
}

// The names that plugin descriptions give to classes, where these have others.
inline std::map<std::string, std::string> & described_names() {
  static std::map<std::string, std::string> classes;
  return classes;
}

// Returns a class as `namespace::Class`: without blanks, and without a leading colon.
inline std::string class_name(const std::string & text) {
  std::string name;
  for (const char character : text) {
    if (character == '/') {
      name += "::";
    } else if (character != ' ') {
      name += character;
    }
  }
  return name.rfind("::", 0) == 0 ? name.substr(2) : name;
}

template <typename Class, typename Base>
bool register_class(const char * name) {
  registered<Base>()[class_name(name)] = [] { return std::make_unique<Class>(); };
  return true;
}

template <typename Base>
class ClassLoader {
 public:
  ClassLoader(const std::string & package, const std::string & base, const std::string & = "",
              const std::vector<std::string> & = {})
      : package_(package), base_(base) {}

  std::unique_ptr<Base> createUniqueInstance(const std::string & name) {
    const auto found = find(name);
    if (found == registered<Base>().end()) {
      std::string known;
      for (const std::string & each : getDeclaredClasses()) known += " " + each;
      throw LibraryLoadException("According to the loaded plugin descriptions the class " + name +
                                 " with base class type " + base_ +
                                 " does not exist. Declared types are" + known);
    }
    return found->second();
  }
  std::shared_ptr<Base> createSharedInstance(const std::string & name) {
    return createUniqueInstance(name);
  }
  Base * createUnmanagedInstance(const std::string & name) {
    return createUniqueInstance(name).release();
  }
  bool isClassAvailable(const std::string & name) const {
    return find(name) != registered<Base>().end();
  }
  std::vector<std::string> getDeclaredClasses() const {
    std::vector<std::string> names;
    for (const auto & [name, factory] : registered<Base>()) names.push_back(name);
    return names;
  }
  std::string getName(const std::string & name) const {
    return name.substr(name.find_last_of(":/") + 1);
  }
  std::string getBaseClassType() const { return base_; }
  // All are in the program itself.
  std::string getClassLibraryPath(const std::string &) const { return ""; }

 private:
  static auto find(const std::string & name) {
    const auto described = described_names().find(name);
    return registered<Base>().find(
        class_name(described == described_names().end() ? name : described->second));
  }

  std::string package_, base_;
};

}  // namespace pluginlib

#define DRAKE_NAVBENCH_JOIN(left, right) left##right
#define DRAKE_NAVBENCH_NAME(stem, number) DRAKE_NAVBENCH_JOIN(stem, number)
#define PLUGINLIB_EXPORT_CLASS(Class, Base)                                                   \
  namespace {                                                                                 \
  [[maybe_unused]] const bool DRAKE_NAVBENCH_NAME(drake_navbench_registered_, __COUNTER__) =  \
      pluginlib::register_class<Class, Base>(#Class);                                         \
  }
