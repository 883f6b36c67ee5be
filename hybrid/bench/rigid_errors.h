// SPDX-License-Identifier: GPL-3.0-or-later
// Judges a run along a bench path: the proxy's distance from exact optima, and the ticks in which the proxy
// was inside a solid. Only recorded positions are used, and no code is shared with the proxy.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "hybrid/bench/rigid_run.h"
#include "polygon/reference/optimality.h"

namespace hybrid::bench {

struct Judgement {  // lengths in meters; empty: the figure has no meaning here
  // Against the nearest place where the first-order conditions hold on the mesh, at `error_ticks` ticks.
  std::optional<double> error_mesh_max, error_mesh_p99;
  std::size_t error_ticks = 0, error_worst_tick = 0;
  std::size_t lost_ticks = 0;  // of those ticks, the ones without such a place within the search radius
  std::optional<double> clearance_min;  // least distance from tool to mesh in those ticks; negative: overlap
  // Against the closed form, at every tick: of the ideal sphere, or of the cube and the corner.
  std::optional<double> error_sphere_max, error_sphere_rms;
  std::optional<double> error_closed_max, error_closed_rms;
  // The exact optimum on the mesh against the ideal sphere, and the proxy's error at the same ticks.
  std::optional<double> optimum_sphere_max, optimum_sphere_rms, error_sphere_there_max;
  std::optional<double> force_step_p99_N;  // change of the force from tick to tick in contact
  std::size_t contact_ticks = 0;
  std::optional<std::size_t> inside_ticks, pop_throughs;  // empty: a mesh of a file without an inside
};

// Judges all runs of one path on one mesh, in a scene of one size and place.
class Judge {
 public:
  // `path` is in the scene frame, see placed(). `reference` is in the mesh's frame, and null if the mesh is
  // too large for it. Keeps references to mesh, path and reference.
  Judge(const BenchMesh& mesh, const GoalPath& path, const glm::dvec3& offset_m, double tool_radius_m,
        double scale, const polygon::OptimalityReference* reference);

  // `budget_s`: time for exact references. At least 16 ticks are judged, and as many more, at a constant
  // stride, as the budget allows. Negative: every tick.
  [[nodiscard]] Judgement judge(const TouchRun& run, double budget_s);

 private:
  struct Optimum {
    std::size_t tick = 0;
    double off_sphere_m = 0.0;
  };
  [[nodiscard]] glm::dvec3 in_body(const glm::dvec3& p, std::size_t tick) const;
  [[nodiscard]] bool inside(const glm::dvec3& in_body) const;
  [[nodiscard]] std::vector<std::size_t> ticks_to_judge(const TouchRun& run, double budget_s);
  void judge_places(const TouchRun& run, Judgement& out) const;
  void judge_forces(const TouchRun& run, Judgement& out) const;
  void judge_closed(const TouchRun& run, Judgement& out) const;
  void judge_exactly(const TouchRun& run, double budget_s, Judgement& out);
  void judge_optimum(const TouchRun& run, double budget_s, Judgement& out);

  const BenchMesh& mesh_;
  const GoalPath& path_;
  glm::dvec3 offset_m_;
  double radius_m_, scale_;
  const polygon::OptimalityReference* reference_;
  bool has_optimum_ = false;
  std::vector<Optimum> optimum_;  // found once, for all runs
};

}  // namespace hybrid::bench
