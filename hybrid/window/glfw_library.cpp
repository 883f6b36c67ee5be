// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/glfw_library.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <cstdlib>
#include <stdexcept>

namespace hybrid {

std::string glfw_reason() {
  const char* text = nullptr;
  return glfwGetError(&text) != GLFW_NO_ERROR && text != nullptr ? text : "no reason given";
}

GlfwLibrary::GlfwLibrary() {
  if (glfwInit() == GLFW_TRUE) return;
  const char* const display = std::getenv("DISPLAY");
  throw std::runtime_error("no window can be opened: " + glfw_reason() + " (DISPLAY is " +
                           (display != nullptr && *display != '\0' ? display : "not set") +
                           "); start it from a desktop session or with ssh -X, or let `hybrid run SCENE "
                           "--picture FILE.png` draw without a display");
}

GlfwLibrary::~GlfwLibrary() {
  glfwTerminate();
}

}  // namespace hybrid
