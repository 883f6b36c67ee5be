// SPDX-License-Identifier: GPL-3.0-or-later
// The library of windows, which runs as long as a window exists.
#pragma once

#include <string>

namespace hybrid {

// The reason of the library's last error.
std::string glfw_reason();

struct GlfwLibrary {
  // Throws std::runtime_error with the remedy if there is no display.
  GlfwLibrary();
  GlfwLibrary(const GlfwLibrary&) = delete;
  GlfwLibrary& operator=(const GlfwLibrary&) = delete;
  GlfwLibrary(GlfwLibrary&&) = delete;
  GlfwLibrary& operator=(GlfwLibrary&&) = delete;
  ~GlfwLibrary();
};

}  // namespace hybrid
