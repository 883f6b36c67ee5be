// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the rigid part of the tick along a path, with the engines in turns, and records the result and the
// time of every tick. The results are judged afterwards (rigid_errors.h), outside of the timing.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "hybrid/bench/meshes.h"
#include "hybrid/bench/paths.h"
#include "hybrid/bench/timer.h"
#include "hybrid/tick/proxy/rigid_proxy.h"
#include "hybrid/world/world_state.h"
#include "polygon/reference/finger_proxy.h"

namespace hybrid::bench {

enum class Engine : std::uint8_t {
  hybrid,          // the product: the rigid part of its tick
  cgal_aabb,       // the product with CGAL's AABB tree in place of its own queries
  no_map,          // the product without the occupancy map
  finger_proxy,    // the published proxy with constraint planes (polygon/reference/finger_proxy.h)
  finger_settled,  // the same, repeated within the tick until the proxy rests
  whole_tick,      // the product: all of haptic_tick()
};
inline constexpr std::array kEngines{Engine::hybrid,       Engine::cgal_aabb,      Engine::no_map,
                                     Engine::finger_proxy, Engine::finger_settled, Engine::whole_tick};
const char* engine_name(Engine engine);
inline bool is_finger(Engine engine) {
  return engine == Engine::finger_proxy || engine == Engine::finger_settled;
}

inline constexpr double kStiffness_N_per_m = 1000.0;  // of the coupling

// A surface and the time of building it; shared by all runs on the mesh.
struct TimedSurface {
  std::shared_ptr<const polygon::RigidSurface> surface;  // null for the published proxy, which uses `tree`
  std::shared_ptr<const polygon::TriangleTree> tree{};
  double build_ms = 0.0;
};
TimedSurface make_surface(const BenchMesh& mesh, Engine engine);

// One rigid object in a world of its own, at `offset_m` in the scene. `moves`: move_body() may move it.
class TouchWorld {
 public:
  TouchWorld(const BenchMesh& mesh, const TimedSurface& surface, Engine engine, double tool_radius_m,
             const glm::dvec3& offset_m, bool moves);

  [[nodiscard]] const World& world() const { return world_; }
  [[nodiscard]] WorldState& state() { return *state_; }
  [[nodiscard]] const WorldState& state() const { return *state_; }
  [[nodiscard]] double build_ms() const { return build_ms_; }  // time of building surface and map
  [[nodiscard]] double map_ms() const { return map_ms_; }
  [[nodiscard]] std::size_t bytes() const;

  // Puts the body at `body_m` if it can move, and the proxy at `goal_m`. Throws std::runtime_error if the
  // tool is not free there.
  void start(const glm::dvec3& goal_m, const glm::dvec3& body_m);
  void move_body(const glm::dvec3& body_m);  // between two ticks
  RigidStep step(const glm::dvec3& goal_m) noexcept;
  // Only for the published proxy: would a proxy at `proxy_m` move in another tick with the same goal?
  [[nodiscard]] bool would_go_on(const glm::dvec3& proxy_m, const glm::dvec3& goal_m,
                                 const glm::dvec3& body_m) const;

 private:
  void fill_world(const BenchMesh& mesh, const TimedSurface& surface, double tool_radius_m,
                  const glm::dvec3& offset_m);
  RigidStep step_finger(const glm::dvec3& goal_m) noexcept;
  RigidStep step_whole(const glm::dvec3& goal_m) noexcept;

  Engine engine_;
  World world_;
  std::unique_ptr<WorldState> state_;
  bool moves_ = false;
  double build_ms_ = 0.0, map_ms_ = 0.0;
  // Only for the published proxy. The body carries the proxy along, because its place is in the body's frame.
  std::shared_ptr<const polygon::TriangleTree> tree_;
  polygon::FingerOptions finger_;
  glm::dvec3 proxy_in_body_{0.0}, body_m_{0.0};
};

// The run of one engine along a path. Every vector has one entry per tick.
struct TouchRun {
  Engine engine = Engine::hybrid;
  std::vector<glm::dvec3> proxy_m, force_N;  // scene frame
  std::vector<float> tick_us;
  std::vector<float> pose_us;  // time of moving the body; empty if the body rests
  std::size_t ticks = 0;       // ticks that were run; fewer than the path's if the time limit was reached
  std::uint64_t steps = 0, surveys = 0;  // of all ticks
  std::uint32_t most_steps = 0;
  std::uint64_t truncated_ticks =
      0;  // counted ticks in which a bound on the steps stopped the proxy before the minimum
  double spent_s = 0.0;
  // The least time of each tick over kPasses passes, including that of moving the body. Every pass does the
  // same work, so a longer time in one pass comes from the machine and not from the engine.
  std::vector<float> least_us;
};

inline constexpr std::size_t kPasses =
    3;  // along each path; all figures but least_us come from the first pass

// Runs all worlds along the path, in turns of a block of ticks, so that other load of the machine affects all
// alike. An engine whose steps took `limit_s` (0: no limit) is stopped. Later passes stop it at the same
// tick. `path` is in the scene frame.
std::vector<TouchRun> run_engines(const GoalPath& path, std::span<const Engine> engines,
                                  std::span<TouchWorld* const> worlds, std::span<const double> limit_s,
                                  const glm::dvec3& offset_m, const TickTimer& timer);

// The path in a scene of another size and place.
GoalPath placed(const GoalPath& path, double scale, const glm::dvec3& offset_m);

}  // namespace hybrid::bench
