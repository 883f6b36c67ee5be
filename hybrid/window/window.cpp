// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <deque>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "hybrid/view/frame_painter.h"
#include "hybrid/window/glfw_library.h"
#include "hybrid/window/script_events.h"
#include "hybrid/window/window_keys.h"

namespace hybrid {
namespace {

struct CloseWindow {
  void operator()(GLFWwindow* window) const {
    if (!display_is_gone()) glfwDestroyWindow(window);
  }
};

enum class Drag { none, orbit, pan, tool, slice, object };

constexpr int kMostPixels = 8192;        // greatest number of pixels along a side of a frame
constexpr double kIdle_s = 1.0 / 120.0;  // wait for input after a frame in which nothing changed
constexpr double kDepthStep = 0.01;  // of the dragged tool, for a turn of the wheel (unit: the view's height)
constexpr float kSlowest_s = 0.25F;  // longest time between frames that the panel gets

constexpr std::array<std::pair<char, UiKey>, 6> kLetters{
    {{'a', UiKey::a}, {'c', UiKey::c}, {'v', UiKey::v}, {'x', UiKey::x}, {'y', UiKey::y}, {'z', UiKey::z}}};

}  // namespace

struct Window::State {
  GlfwLibrary library;
  std::unique_ptr<GLFWwindow, CloseWindow> window;
  const DrawnScene* scene;
  std::optional<FramePainter> painter;
  Camera camera;
  bool framed = false;  // has the view been chosen? It needs the tool's position from the first snapshot
  bool painted = false;
  bool exposed = true;  // the display has lost the window's content
  Drag drag = Drag::none;
  double x = 0.0, y = 0.0;  // position of the pointer (pixels of the framebuffer)
  glm::dvec3 grip_m{0.0};   // from the point under the pointer to the tool, when the drag began
  // Position of the tool when the drag began. The plane of the drag goes through it and does not follow the
  // device, because contact could then push the goal away.
  glm::dvec3 drag_plane_m{0.0};
  glm::dvec3 device_m{0.0};  // device position in the last frame
  SoftBox box;               // of the scene
  std::size_t dragged_slice = 0;
  ObjectMover mover;
  std::optional<glm::dvec3> goal_m;
  ViewState user;
  UiInput input;
  bool wants_text = false, wants_presses = false;  // as in PanelResult
  TickHistory history;
  Panels panels;
  std::deque<ScriptEvent> events;
  std::chrono::steady_clock::time_point last_frame = std::chrono::steady_clock::now();
  bool visible = true;
  int width = 0, height = 0;
  FrameLayout layout;  // layout of the last frame

  State(const DrawnScene& drawn, const WindowOptions& options)
      : scene(&drawn), box(soft_box(drawn)), history(options.history_s), visible(options.visible) {
    user.panels = options.panels;
  }

  static State& of(GLFWwindow* handle) { return *static_cast<State*>(glfwGetWindowUserPointer(handle)); }

  // Takes a pointer position in screen units. Drawing is in pixels; on some displays the two differ.
  void pointer(double screen_x, double screen_y) {
    int screen_width = 0;
    int screen_height = 0;
    glfwGetWindowSize(window.get(), &screen_width, &screen_height);
    const double scale_x = screen_width > 0 ? static_cast<double>(width) / screen_width : 1.0;
    const double scale_y = screen_height > 0 ? static_cast<double>(height) / screen_height : 1.0;
    move_to(screen_x * scale_x, screen_y * scale_y);
  }

  void move_to(double to_x, double to_y) {
    const double dx = to_x - x;
    const double dy = to_y - y;
    x = to_x;
    y = to_y;
    input.x = static_cast<float>(x);
    input.y = static_cast<float>(y);
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
        goal_m = under_pointer() + grip_m;
        break;
      case Drag::slice:
        drag_slice({dx, dy});
        break;
      case Drag::object:
        mover.drag(camera, layout.scene, text_height(height), {dx, dy});
        break;
      case Drag::none:
        break;
    }
  }

  void drag_slice(const glm::dvec2& motion) {
    for (const SliceFrame& frame : slice_frames(box, user.view)) {
      if (frame.axis != dragged_slice) continue;
      double& share = user.view.slices[frame.axis].share;
      share = std::clamp(share + dragged_share(frame, box, camera, layout.scene, motion), 0.0, 1.0);
    }
  }

  // The point in the drag's plane that the scene shows under the pointer.
  [[nodiscard]] glm::dvec3 under_pointer() const {
    const PixelRect& view = layout.scene;
    return camera.point_at({x - view.x, y - view.y}, view.width, view.height, drag_plane_m);
  }

  [[nodiscard]] bool over_panel() const {
    return user.panels && layout.column.width > 0 && x >= layout.column.x && y >= layout.column.y;
  }

  void button(int which, bool pressed, bool shift) {
    if (which > GLFW_MOUSE_BUTTON_MIDDLE) return;
    input.press_button(static_cast<std::size_t>(which), pressed && over_panel());
    if (!pressed) {
      if (std::exchange(drag, Drag::none) == Drag::object) {
        if (const auto change = mover.let_go(*scene))
          hybrid::act(user, {.verb = ViewVerb::change, .change = *change});
      }
      goal_m.reset();
      return;
    }
    if (over_panel()) return;
    input.by_keyboard = false;
    if (which == GLFW_MOUSE_BUTTON_MIDDLE) {
      drag = Drag::pan;
    } else if (which == GLFW_MOUSE_BUTTON_RIGHT || (which == GLFW_MOUSE_BUTTON_LEFT && shift)) {
      drag = Drag::tool;
      // The drag starts at the tool's position, so that the tool does not jump to the pointer.
      drag_plane_m = device_m;
      grip_m = drag_plane_m - under_pointer();
      goal_m = drag_plane_m;
    } else if (which == GLFW_MOUSE_BUTTON_LEFT) {
      if (mover.take(camera, layout.scene, text_height(height), {x, y})) {
        drag = Drag::object;
        return;
      }
      const auto slice =
          slice_at(slice_frames(box, user.view), camera, layout.scene, {x, y}, text_height(height));
      drag = slice ? Drag::slice : Drag::orbit;
      dragged_slice = slice.value_or(0);
    }
  }

  void wheel(double turns) {
    if (over_panel()) {
      input.wheel += static_cast<float>(turns);
      return;
    }
    if (drag == Drag::tool) {  // the tool moves away from the eye, and the drag's plane with it
      const glm::dvec3 by_m = -kDepthStep * turns * camera.view_height_m() * camera.toward_eye();
      drag_plane_m += by_m;
      goal_m = *goal_m + by_m;
      grip_m = *goal_m - under_pointer();
      return;
    }
    camera.distance_m *= std::exp(-0.12 * std::clamp(turns, -10.0, 10.0));
    camera.distance_m = std::clamp(camera.distance_m, 1e-9, 1e9);
  }

  // Handles a key, given by its name. Keys that move between controls reach the panel only if it has the
  // keyboard's focus.
  void key(std::string_view name, bool pressed) {
    bool for_panel = false;
    for (const NamedKey& k : named_keys()) {
      if (k.name != name || k.ui < 0) continue;
      for_panel = input.by_keyboard || wants_text;
      input.press_key(static_cast<UiKey>(k.ui), pressed && for_panel);
    }
    for (const auto& [letter, k] : kLetters) {
      if (name.size() == 1 && name[0] == letter) input.press_key(k, pressed && wants_text);
    }
    if (!pressed || wants_text) return;
    if (name == "tab" && user.panels && !input.by_keyboard) {
      input.by_keyboard = true;
    } else if (name == "escape" && input.by_keyboard) {
      input.by_keyboard = false;
    } else if (!for_panel) {
      if (const auto action = action_of_key(name, input.control, user)) hybrid::act(user, *action);
    }
  }

  void glfw_key(int which, int action, int mods) {
    input.control = (mods & GLFW_MOD_CONTROL) != 0;
    input.shift = (mods & GLFW_MOD_SHIFT) != 0;
    input.alt = (mods & GLFW_MOD_ALT) != 0;
    if (action == GLFW_REPEAT) return;
    for (const NamedKey& k : named_keys()) {
      if (k.glfw == which) key(k.name, action == GLFW_PRESS);
    }
    const bool letter = which >= GLFW_KEY_A && which <= GLFW_KEY_Z;
    if (!letter && (which < GLFW_KEY_0 || which > GLFW_KEY_9)) return;
    const char name = static_cast<char>(letter ? 'a' + which - GLFW_KEY_A : '0' + which - GLFW_KEY_0);
    key({&name, 1}, action == GLFW_PRESS);
  }

  // Plays the script's events of this frame.
  void play_events() {
    using Kind = ScriptEvent::Kind;
    while (!events.empty()) {
      const ScriptEvent event = events.front();
      events.pop_front();
      if (event.kind == Kind::next_frame) return;
      if (event.kind == Kind::move) move_to(event.x, event.y);
      if (event.kind == Kind::press || event.kind == Kind::release)
        button(static_cast<int>(event.button), event.kind == Kind::press, false);
      if (event.kind == Kind::key_down || event.kind == Kind::key_up)
        key(event.key, event.kind == Kind::key_down);
      if (event.kind == Kind::wheel) wheel(event.x);
    }
  }

  void choose_view(const Snapshot& snapshot) {
    if (!framed) user.look = "all";
    if (user.look == "all") camera = frame_scene(*scene, snapshot, layout.aspect(), scene->path_m);
    if (user.look == "contact") camera = frame_contact(*scene, snapshot, camera);
    if (user.look.size() == 1) look_along(camera, user.look[0] - 'x');
    user.look.clear();
    framed = true;
  }

  void paint(const Snapshot& snapshot, const SessionNotes& notes) {
    mover.place(user, *scene, !notes.building.empty());
    const PanelFrame panel{user, history, notes, input, camera, layout.scene, mover.handles()};
    FrameOptions options;
    options.width = std::min(width, kMostPixels);
    options.height = std::min(height, kMostPixels);
    options.inset = user.view.inset;
    options.help = kWindowHelp;
    options.paused = user.paused;
    options.notice = notes.error.empty() ? notes.message : notes.error;
    options.view = user.view;
    panels.show(panel);
    options.panel = user.panels && layout.column.width > 0 ? &panels : nullptr;
    const bool changed = painter->paint(snapshot, camera, options);
    const PanelResult asked = panels.take_result();
    for (const ViewAction& action : asked.actions) hybrid::act(user, action);
    wants_text = asked.wants_text;
    wants_presses = asked.wants_presses;
    input.end_frame();
    show(changed, options);
  }

  // A frame that equals the one before is not shown again. This function then waits in place of the display's
  // refresh.
  void show(bool changed, const FrameOptions& frame) {
    if (changed || std::exchange(exposed, false)) {
      painter->present(frame.width, frame.height);
      glfwSwapBuffers(window.get());
    } else if (visible) {
      glfwWaitEventsTimeout(kIdle_s);
    }
    painted = true;
  }

  // All hidden frames last equally long, so that they are reproducible.
  void measure_frame() {
    const auto now = std::chrono::steady_clock::now();
    const float real_s = std::chrono::duration<float>(now - std::exchange(last_frame, now)).count();
    input.dt_s = visible ? std::min(real_s, kSlowest_s) : 1.0F / 60.0F;
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
  s.window.reset(glfwCreateWindow(std::clamp(options.width, 64, kMostPixels),
                                  std::clamp(options.height, 64, kMostPixels), title.c_str(), nullptr,
                                  nullptr));
  if (!s.window) {
    throw std::runtime_error(
        "the display opens no OpenGL 3.3 window: " + glfw_reason() +
        "; update the graphics driver, or set LIBGL_ALWAYS_SOFTWARE=1 to draw without it");
  }
  GLFWwindow* const handle = s.window.get();
  glfwSetWindowUserPointer(handle, &s);
  glfwSetCursorPosCallback(handle, [](GLFWwindow* w, double x, double y) { State::of(w).pointer(x, y); });
  glfwSetMouseButtonCallback(handle, [](GLFWwindow* w, int b, int action, int mods) {
    State::of(w).button(b, action == GLFW_PRESS, (mods & GLFW_MOD_SHIFT) != 0);
  });
  glfwSetKeyCallback(handle, [](GLFWwindow* w, int key, int, int action, int mods) {
    State::of(w).glfw_key(key, action, mods);
  });
  glfwSetCharCallback(handle, [](GLFWwindow* w, unsigned int c) {
    State& state = State::of(w);
    if (state.wants_text) state.input.typed.push_back(static_cast<char32_t>(c));
  });
  glfwSetWindowRefreshCallback(handle, [](GLFWwindow* w) { State::of(w).exposed = true; });
  glfwSetDropCallback(handle, [](GLFWwindow* w, int count, const char** files) {
    for (int n = 0; n < count; ++n)
      hybrid::act(State::of(w).user, {.verb = ViewVerb::open, .text = files[n]});
  });
  glfwSetScrollCallback(handle, [](GLFWwindow* w, double, double y) { State::of(w).wheel(y); });
  glfwMakeContextCurrent(handle);
  glfwSwapInterval(options.visible ? 1 : 0);
  glfwGetFramebufferSize(handle, &s.width, &s.height);
  s.painter.emplace(scene, Samples::fast, s.height);
}

Window::~Window() = default;

void Window::show_scene(const DrawnScene& scene, std::optional<double> changed_at_s) {
  State& s = *state_;
  glfwMakeContextCurrent(s.window.get());
  s.painter->release();
  go_to_scene(s.user, *s.scene, scene);
  s.scene = &scene;
  s.box = soft_box(scene);
  s.mover = {};
  s.user.back_s = 0.0;  // states of the previous scene are not kept
  s.painter.emplace(scene, Samples::fast, s.height);
  if (changed_at_s) {
    s.history.mark(*changed_at_s);
  } else {
    s.history.clear();
  }
}

const DrawnScene& Window::scene() const {
  return *state_->scene;
}

bool Window::frame(const Snapshot& snapshot, const SessionNotes& notes) {
  State& s = *state_;
  GLFWwindow* const handle = s.window.get();
  glfwPollEvents();
  if (const std::string why = why_window_is_lost(); !why.empty()) throw std::runtime_error(why);
  s.play_events();
  if (notes.kept_s.empty()) s.user.back_s = 0.0;  // there is no past to look at
  if (s.user.quit || glfwWindowShouldClose(handle) == GLFW_TRUE) return false;
  s.device_m = snapshot.device_m;
  s.measure_frame();
  glfwGetFramebufferSize(handle, &s.width, &s.height);
  if (s.width < 1 || s.height < 1) return true;  // minimised: there is nothing to draw
  s.layout = frame_layout(s.width, s.height, true, s.user.panels, !s.box.empty);
  s.choose_view(snapshot);
  glfwMakeContextCurrent(handle);
  s.paint(snapshot, notes);
  return true;
}

std::size_t Window::add_ticks(TickSamples& samples, ForcesAtRest* at_rest) {
  TickSample sample;
  while (samples.pop(sample)) state_->history.add(sample);
  ForceAtRest found;
  std::size_t count = 0;
  for (; at_rest != nullptr && at_rest->pop(found); ++count) state_->history.add(found);
  return count;
}

void Window::act(const ViewAction& action) {
  switch (action.verb) {
    case ViewVerb::key:
    case ViewVerb::click:
    case ViewVerb::drag:
    case ViewVerb::wheel:
      add_events(state_->events, action);
      break;
    default:
      hybrid::act(state_->user, action);
  }
}

WindowInput Window::take_input() {
  State& s = *state_;
  return {.dragged_goal_m = s.goal_m,
          .paused = s.user.paused,
          .wants_presses = s.wants_presses,
          .wants_boxes = s.user.map && s.user.panels,
          .compares_with_rest = s.user.compares_with_rest,
          .speed = s.user.speed,
          .restarts = s.user.restarts,
          .single_ticks = s.user.single_ticks,
          .back_s = s.user.back_s,
          .asked = s.painter->asked(s.user.view),
          .edits = std::exchange(s.user.edits, {}),
          .changes = std::exchange(s.user.changes, {}),
          .comparison = std::exchange(s.user.comparison, {}),
          .opened = std::exchange(s.user.opened, {}),
          .recording = std::exchange(s.user.recording, {}),
          .save_scene = std::exchange(s.user.save_scene, false),
          .reload = std::exchange(s.user.reload, false),
          .go_on = std::exchange(s.user.go_on, false)};
}

std::optional<std::filesystem::path> Window::take_screenshot() {
  return std::exchange(state_->user.screenshot, {});
}

Camera& Window::camera() {
  return state_->camera;
}

FramePicture Window::picture() {
  State& s = *state_;
  if (!s.painted) throw std::runtime_error("there is no frame to save yet; show one first");
  glfwMakeContextCurrent(s.window.get());
  return {std::min(s.width, kMostPixels), std::min(s.height, kMostPixels), s.painter->read_rgb()};
}

}  // namespace hybrid
