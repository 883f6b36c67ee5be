// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/glfw_library.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <dlfcn.h>

#include <atomic>
#include <cstdlib>
#include <stdexcept>

namespace hybrid {
namespace {

std::atomic<bool> request_refused{false}, connection_broken{false};

int note_refusal(void*, void*) {
  request_refused = true;
  return 0;
}

int note_break(void*) {
  connection_broken = true;
  return 0;
}

// After note_break() Xlib calls this one, and ends the program only if there is none.
void go_on(void*, void*) {}

// By default Xlib ends the program at the first error of a display, and the session would be lost. GLFW loads
// Xlib itself, if the display needs it, so its functions are looked up.
void survive_errors_of_display() {
  void* const xlib = dlopen("libX11.so.6", RTLD_LAZY | RTLD_NOLOAD);
  void* const of_glfw = dlsym(RTLD_DEFAULT, "glfwGetX11Display");
  if (xlib == nullptr || of_glfw == nullptr) return;
  void* const display = reinterpret_cast<void* (*)()>(of_glfw)();
  if (display == nullptr) return;
  using Refused = int (*)(void*, void*);
  using Broken = int (*)(void*);
  using Exit = void (*)(void*, void*);
  void* const set_refused = dlsym(xlib, "XSetErrorHandler");
  void* const set_broken = dlsym(xlib, "XSetIOErrorHandler");
  void* const set_exit = dlsym(xlib, "XSetIOErrorExitHandler");  // since libX11 1.7
  if (set_refused != nullptr) reinterpret_cast<Refused (*)(Refused)>(set_refused)(note_refusal);
  if (set_broken == nullptr || set_exit == nullptr) return;
  reinterpret_cast<Broken (*)(Broken)>(set_broken)(note_break);
  reinterpret_cast<void (*)(void*, Exit, void*)>(set_exit)(display, go_on, nullptr);
}

}  // namespace

std::string why_window_is_lost() {
  if (connection_broken) return "the connection to the display is broken";
  return request_refused ? "the display no longer has the window" : "";
}

bool display_is_gone() {
  return connection_broken;
}

std::string glfw_reason() {
  const char* text = nullptr;
  return glfwGetError(&text) != GLFW_NO_ERROR && text != nullptr ? text : "no reason given";
}

GlfwLibrary::GlfwLibrary() {
  if (glfwInit() == GLFW_TRUE) {
    survive_errors_of_display();
    return;
  }
  const char* const display = std::getenv("DISPLAY");
  throw std::runtime_error("no window can be opened: " + glfw_reason() + " (DISPLAY is " +
                           (display != nullptr && *display != '\0' ? display : "not set") +
                           "); start it from a desktop session or with ssh -X, or let `hybrid run SCENE "
                           "--picture FILE.png` draw without a display");
}

GlfwLibrary::~GlfwLibrary() {
  if (!display_is_gone()) glfwTerminate();
}

}  // namespace hybrid
