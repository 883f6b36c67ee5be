// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <string>

#include "hybrid/view/frame_painter.h"
#include "hybrid/view/png_file.h"

namespace hybrid {
namespace {

constexpr const char* help_line =
    "left drag: orbit   middle: pan   wheel: zoom   right drag or shift+left: pull the tool   "
    "space: pause   R: restart   F: frame   Esc: quit";

std::string glfw_reason() {
  const char* text = nullptr;
  return glfwGetError(&text) != GLFW_NO_ERROR && text != nullptr ? text : "no reason given";
}

// GLFW is started with the first window and ended with the last.
struct Library {
  Library() {
    if (glfwInit() == GLFW_TRUE) return;
    const char* const display = std::getenv("DISPLAY");
    throw std::runtime_error("no window can be opened: " + glfw_reason() + " (DISPLAY is " +
                             (display != nullptr && *display != '\0' ? display : "not set") +
                             "); start it from a desktop session or with ssh -X, or let `hybrid run SCENE "
                             "--picture FILE.png` draw without a display");
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  Library(Library&&) = delete;
  Library& operator=(Library&&) = delete;
  ~Library() { glfwTerminate(); }
};

struct CloseWindow {
  void operator()(GLFWwindow* window) const { glfwDestroyWindow(window); }
};

enum class Drag { none, orbit, pan, tool };

}  // namespace

struct Window::State {
  Library library;
  std::unique_ptr<GLFWwindow, CloseWindow> window;
  const DrawnScene& scene;
  std::optional<FramePainter> painter;
  double history_s;
  Camera camera;
  bool framed = false;  // the view has been chosen (needs the first snapshot: it has the tool's position)
  bool wants_frame = false, painted = false;
  Drag drag = Drag::none;
  double x = 0.0, y = 0.0;  // of the pointer (pixels of the framebuffer)
  glm::dvec3 grip_m{0.0};   // from the point under the pointer to the tool, at the start of the drag
  // Tool's position at the start of the drag; the plane of the drag stays there. If the plane followed the
  // device, contact could push the goal away.
  glm::dvec3 drag_plane_m{0.0};
  glm::dvec3 device_m{0.0};  // device position in the last frame
  WindowInput input;
  std::deque<ForceSample> history;
  int width = 0, height = 0;
  FrameLayout layout;  // of the last frame

  State(const DrawnScene& drawn, const WindowOptions& options) : scene(drawn), history_s(options.history_s) {}

  static State& of(GLFWwindow* handle) { return *static_cast<State*>(glfwGetWindowUserPointer(handle)); }

  // Pointer positions are in screen units, drawing is in pixels; on some displays they differ.
  void pointer(double screen_x, double screen_y) {
    int screen_width = 0;
    int screen_height = 0;
    glfwGetWindowSize(window.get(), &screen_width, &screen_height);
    const double scale_x = screen_width > 0 ? static_cast<double>(width) / screen_width : 1.0;
    const double scale_y = screen_height > 0 ? static_cast<double>(height) / screen_height : 1.0;
    const double dx = screen_x * scale_x - x;
    const double dy = screen_y * scale_y - y;
    x += dx;
    y += dy;
    if (height <= 0) return;
    constexpr double steepest = 89.0 * std::numbers::pi / 180.0;
    switch (drag) {
      case Drag::orbit:
        camera.azimuth_rad -= 2.0 * std::numbers::pi * dx / std::max(width, 1);
        camera.elevation_rad =
            std::clamp(camera.elevation_rad + std::numbers::pi * dy / height, -steepest, steepest);
        break;
      case Drag::pan: {
        const double per_pixel = camera.view_height_m() / std::max(layout.scene.height, 1);
        camera.target_m += (camera.up() * dy - camera.right() * dx) * per_pixel;
        break;
      }
      case Drag::tool:
        input.dragged_goal_m = under_pointer() + grip_m;
        break;
      case Drag::none:
        break;
    }
  }

  // Point of the drag's plane that the scene shows under the pointer.
  [[nodiscard]] glm::dvec3 under_pointer() const {
    const PixelRect& view = layout.scene;
    return camera.point_at({x - view.x, y - view.y}, view.width, view.height, drag_plane_m);
  }

  void button(int which, int action, int mods) {
    if (action == GLFW_RELEASE) {
      drag = Drag::none;
      input.dragged_goal_m.reset();
      return;
    }
    const bool shift = (mods & GLFW_MOD_SHIFT) != 0;
    if (which == GLFW_MOUSE_BUTTON_MIDDLE) {
      drag = Drag::pan;
    } else if (which == GLFW_MOUSE_BUTTON_RIGHT || (which == GLFW_MOUSE_BUTTON_LEFT && shift)) {
      drag = Drag::tool;
      // The drag starts from the tool's position: the tool does not jump to the pointer.
      drag_plane_m = device_m;
      grip_m = drag_plane_m - under_pointer();
      input.dragged_goal_m = drag_plane_m;
    } else if (which == GLFW_MOUSE_BUTTON_LEFT) {
      drag = Drag::orbit;
    }
  }

  void key(int which, int action) {
    if (action != GLFW_PRESS) return;
    if (which == GLFW_KEY_ESCAPE) glfwSetWindowShouldClose(window.get(), GLFW_TRUE);
    if (which == GLFW_KEY_SPACE) input.paused = !input.paused;
    if (which == GLFW_KEY_R) input.restart = true;
    if (which == GLFW_KEY_F) wants_frame = true;
  }

  void remember(const Snapshot& snapshot) {
    if (!std::isfinite(snapshot.t_s)) return;
    if (!history.empty() && snapshot.t_s < history.back().t_s) history.clear();  // the session was restarted
    if (!history.empty() && snapshot.t_s <= history.back().t_s) return;          // paused
    history.push_back({snapshot.t_s, glm::length(snapshot.force_N)});
    while (history.size() > 1 && history.front().t_s < snapshot.t_s - history_s) history.pop_front();
    while (history.size() > 100'000) history.pop_front();
  }
};

Window::Window(const DrawnScene& scene, const WindowOptions& options) {
  glfwSetErrorCallback(nullptr);  // errors are polled (glfw_reason), not printed
  state_ = std::make_unique<State>(scene, options);
  State& s = *state_;
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_VISIBLE, options.visible ? GLFW_TRUE : GLFW_FALSE);
  const std::string title = scene.title.empty() ? "hybrid" : scene.title + " - hybrid";
  s.window.reset(glfwCreateWindow(std::clamp(options.width, 64, 8192), std::clamp(options.height, 64, 8192),
                                  title.c_str(), nullptr, nullptr));
  if (!s.window) {
    throw std::runtime_error(
        "the display opens no OpenGL 3.3 window: " + glfw_reason() +
        "; update the graphics driver, or set LIBGL_ALWAYS_SOFTWARE=1 to draw without it");
  }
  GLFWwindow* const handle = s.window.get();
  glfwSetWindowUserPointer(handle, &s);
  glfwSetCursorPosCallback(handle, [](GLFWwindow* w, double x, double y) { State::of(w).pointer(x, y); });
  glfwSetMouseButtonCallback(
      handle, [](GLFWwindow* w, int b, int action, int mods) { State::of(w).button(b, action, mods); });
  glfwSetKeyCallback(handle,
                     [](GLFWwindow* w, int key, int, int action, int) { State::of(w).key(key, action); });
  glfwSetScrollCallback(handle, [](GLFWwindow* w, double, double y) {
    Camera& camera = State::of(w).camera;
    camera.distance_m *= std::exp(-0.12 * std::clamp(y, -10.0, 10.0));
    camera.distance_m = std::clamp(camera.distance_m, 1e-9, 1e9);
  });
  glfwMakeContextCurrent(handle);
  glfwSwapInterval(options.visible ? 1 : 0);
  glfwGetFramebufferSize(handle, &s.width, &s.height);
  s.painter.emplace(scene, Samples::fast, s.height);
}

Window::~Window() = default;

bool Window::frame(const Snapshot& snapshot) {
  State& s = *state_;
  GLFWwindow* const handle = s.window.get();
  glfwPollEvents();
  if (glfwWindowShouldClose(handle) == GLFW_TRUE) return false;
  s.device_m = snapshot.device_m;
  s.remember(snapshot);
  glfwGetFramebufferSize(handle, &s.width, &s.height);
  if (s.width < 1 || s.height < 1) return true;  // minimised: nothing to draw
  s.layout = frame_layout(s.width, s.height, true);
  if (!s.framed || s.wants_frame) {
    s.camera = frame_scene(s.scene, snapshot, s.layout.aspect(), s.scene.path_m);
    s.framed = true;
    s.wants_frame = false;
  }
  FrameOptions options;
  options.width = std::min(s.width, 8192);
  options.height = std::min(s.height, 8192);
  options.history.assign(s.history.begin(), s.history.end());
  options.help = help_line;
  options.paused = s.input.paused;
  glfwMakeContextCurrent(handle);
  s.painter->paint(snapshot, s.camera, options);
  s.painter->present(options.width, options.height);
  glfwSwapBuffers(handle);
  s.painted = true;
  return true;
}

WindowInput Window::take_input() {
  WindowInput taken = state_->input;
  state_->input.restart = false;
  return taken;
}

Camera& Window::camera() {
  return state_->camera;
}

void Window::save_frame(const std::filesystem::path& png) {
  State& s = *state_;
  if (!s.painted) throw std::runtime_error(png.string() + ": there is no frame to save yet; show one first");
  glfwMakeContextCurrent(s.window.get());
  save_png(png, std::min(s.width, 8192), std::min(s.height, 8192), s.painter->read_rgb());
}

}  // namespace hybrid
