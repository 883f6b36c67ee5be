// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/glfw_library.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <dlfcn.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <stdexcept>

#include "hybrid/window/ui_input.h"

namespace hybrid {
namespace {

constexpr auto ui = [](UiKey key) { return static_cast<int>(key); };
constexpr std::array<NamedKey, 19> kNamedKeys{{{"tab", GLFW_KEY_TAB, ui(UiKey::tab)},
                                               {"left", GLFW_KEY_LEFT, ui(UiKey::left)},
                                               {"right", GLFW_KEY_RIGHT, ui(UiKey::right)},
                                               {"up", GLFW_KEY_UP, ui(UiKey::up)},
                                               {"down", GLFW_KEY_DOWN, ui(UiKey::down)},
                                               {"pageup", GLFW_KEY_PAGE_UP, ui(UiKey::page_up)},
                                               {"pagedown", GLFW_KEY_PAGE_DOWN, ui(UiKey::page_down)},
                                               {"home", GLFW_KEY_HOME, ui(UiKey::home)},
                                               {"end", GLFW_KEY_END, ui(UiKey::end)},
                                               {"insert", GLFW_KEY_INSERT, ui(UiKey::insert)},
                                               {"delete", GLFW_KEY_DELETE, ui(UiKey::erase)},
                                               {"backspace", GLFW_KEY_BACKSPACE, ui(UiKey::backspace)},
                                               {"space", GLFW_KEY_SPACE, ui(UiKey::space)},
                                               {"enter", GLFW_KEY_ENTER, ui(UiKey::enter)},
                                               {"escape", GLFW_KEY_ESCAPE, ui(UiKey::escape)},
                                               {"[", GLFW_KEY_LEFT_BRACKET, -1},
                                               {"]", GLFW_KEY_RIGHT_BRACKET, -1},
                                               {",", GLFW_KEY_COMMA, -1},
                                               {".", GLFW_KEY_PERIOD, -1}}};

std::atomic<bool> request_refused{false}, connection_broken{false};

int note_refusal(void*, void*) {
  request_refused = true;
  return 0;
}

int note_break(void*) {
  connection_broken = true;
  return 0;
}

// Xlib calls this handler after note_break(). Without such a handler Xlib would end the program.
void go_on(void*, void*) {}

// By default Xlib ends the program at the first error of a display, and the session would be lost. GLFW loads
// Xlib only if the display needs it, so the functions of Xlib are looked up here.
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

std::span<const NamedKey> named_keys() {
  return kNamedKeys;
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
