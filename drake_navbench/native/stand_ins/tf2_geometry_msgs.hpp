#pragma once

#include "stand_ins/tf2.hpp"
