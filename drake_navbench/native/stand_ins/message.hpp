// What every message struct of the stand-ins has.
#pragma once

// ROS's own headers bring all these with them, and sources of Nav2 rely on it; without the first
// two a bare abs(double) would be abs(int).
#include <math.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#define DRAKE_NAVBENCH_POINTERS(Type)                  \
  using SharedPtr = std::shared_ptr<Type>;             \
  using ConstSharedPtr = std::shared_ptr<const Type>;  \
  using UniquePtr = std::unique_ptr<Type>;             \
  using ConstUniquePtr = std::unique_ptr<const Type>;  \
  using WeakPtr = std::weak_ptr<Type>;

// What is compiled as C++17 compares no messages.
#if __cplusplus >= 202002L
#define DRAKE_NAVBENCH_MESSAGE(Type) \
  DRAKE_NAVBENCH_POINTERS(Type)      \
  bool operator==(const Type &) const = default;
#else
#define DRAKE_NAVBENCH_MESSAGE(Type) DRAKE_NAVBENCH_POINTERS(Type)
#endif
