// SPDX-License-Identifier: GPL-3.0-or-later
// The library of windows, which runs as long as a window exists.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace hybrid {

// The reason of the library's last error.
std::string glfw_reason();

// Why the window is lost, in words; empty: it is there. After that no call may use the window.
std::string why_window_is_lost();
// Is the connection to the display broken? Then even closing the window would wait for an answer.
bool display_is_gone();

// A key by its name, with its numbers in the library and in the panel.
struct NamedKey {
  std::string_view name;
  int glfw;
  int ui;  // UiKey, or -1
};
std::span<const NamedKey> named_keys();

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
