// SPDX-License-Identifier: GPL-3.0-or-later
// Precompiled header: the headers that nearly every test includes. A source still names each header that it
// uses. This file only saves compiling the headers again.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "hybrid/session/session.h"
