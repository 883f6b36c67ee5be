// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/rigid_errors.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace hybrid::bench {
namespace {

// Lengths in a scene of size 1 (m); they are multiplied by the run's scale.
constexpr double kDeep_m =
    1e-5;  // a deeper proxy is inside: below the inscribed sphere, or below a file's mesh
constexpr double kLeak_m = 1e-6;    // a deeper proxy is inside: past a cube's face or a corner's plane
constexpr double kSearch_m = 1e-3;  // radius of the search for the first-order optimum around the proxy
constexpr std::size_t kProbe = 16;  // ticks that are always judged; their time gives the cost of one
// distance from the corner within which a leak is looked for (unit: the scene's scale)
constexpr double kCornerSeen_m = 0.1;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct MaxRms {
  double most = 0.0, squares = 0.0;
  std::size_t count = 0;
  void add(double e) {
    most = std::max(most, e);
    squares += e * e;
    ++count;
  }
  [[nodiscard]] double rms() const {
    return count == 0 ? 0.0 : std::sqrt(squares / static_cast<double>(count));
  }
};

double percentile(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

// About `count` of the candidates at a constant stride. The stride shares no factor with the 41 ticks of a
// tap, so that all phases of a tap occur.
std::vector<std::size_t> thinned(const std::vector<std::size_t>& candidates, std::size_t count) {
  std::size_t stride =
      std::max<std::size_t>(1, (candidates.size() + count - 1) / std::max<std::size_t>(1, count));
  if (stride % 41 == 0) ++stride;
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < candidates.size(); i += stride) kept.push_back(candidates[i]);
  return kept;
}

// Number of the `all` ticks that fit into the budget, if `done` ticks took `spent_s`. At least kProbe.
std::size_t affordable(std::size_t all, std::size_t done, double spent_s, double budget_s) {
  if (budget_s < 0.0 || done == 0) return all;
  const double each = std::max(1e-9, spent_s / static_cast<double>(done));
  return std::clamp<std::size_t>(static_cast<std::size_t>(std::min(1e9, budget_s / each)), kProbe,
                                 std::max(kProbe, all));
}

}  // namespace

Judge::Judge(const BenchMesh& mesh, const GoalPath& path, const glm::dvec3& offset_m, double tool_radius_m,
             double scale, const polygon::OptimalityReference* reference)
    : mesh_(mesh),
      path_(path),
      offset_m_(offset_m),
      radius_m_(tool_radius_m),
      scale_(scale),
      reference_(reference) {}

glm::dvec3 Judge::in_body(const glm::dvec3& p, std::size_t tick) const {
  return p - (path_.body_m.empty() ? offset_m_ : path_.body_m[tick]);
}

bool Judge::inside(const glm::dvec3& p) const {
  switch (mesh_.shape) {
    case BenchShape::sphere:
      return glm::length(p) < mesh_.inscribed_radius_m - kDeep_m * scale_;
    case BenchShape::cube: {
      const glm::dvec3 a = glm::abs(p);
      return std::max({a.x, a.y, a.z}) < mesh_.inscribed_radius_m - kLeak_m * scale_;
    }
    case BenchShape::from_file:
      return reference_->inside(p) && reference_->distance(p) > kDeep_m * scale_;
    case BenchShape::corner:
      break;
  }
  return std::min({p.x, p.y, p.z}) < -kLeak_m * scale_ && std::max({p.x, p.y, p.z}) < kCornerSeen_m * scale_;
}

// Candidates are the ticks in which an object holds the proxy. If there are none, all counted ticks are.
std::vector<std::size_t> Judge::ticks_to_judge(const TouchRun& run, double budget_s) {
  std::vector<std::size_t> held, all;
  for (std::size_t k = path_.counted_from; k < run.ticks; ++k) {
    all.push_back(k);
    if (run.proxy_m[k] != path_.goals[k]) held.push_back(k);
  }
  const std::vector<std::size_t>& candidates = held.empty() ? all : held;
  if (budget_s < 0.0) return candidates;
  const std::vector<std::size_t> probe = thinned(candidates, kProbe);
  const auto start = std::chrono::steady_clock::now();
  for (const std::size_t k : probe)
    static_cast<void>(reference_->nearest_optimum(in_body(path_.goals[k], k), in_body(run.proxy_m[k], k),
                                                  radius_m_, kSearch_m * scale_));
  return thinned(candidates, affordable(candidates.size(), probe.size(), seconds_since(start), budget_s));
}

void Judge::judge_exactly(const TouchRun& run, double budget_s, Judgement& out) {
  if (reference_ == nullptr) return;
  std::vector<double> errors;
  double least = std::numeric_limits<double>::max();
  for (const std::size_t k : ticks_to_judge(run, budget_s)) {
    const auto optimum = reference_->nearest_optimum(in_body(path_.goals[k], k), in_body(run.proxy_m[k], k),
                                                     radius_m_, kSearch_m * scale_);
    ++out.error_ticks;
    if (!optimum.found) ++out.lost_ticks;
    // If no optimum was found, the error is at least the radius of the search.
    errors.push_back(optimum.found ? optimum.error_m : kSearch_m * scale_);
    if (!(errors.back() <= out.error_mesh_max.value_or(0.0))) out.error_worst_tick = k;
    out.error_mesh_max = std::max(out.error_mesh_max.value_or(0.0), errors.back());
    least = std::min(least, optimum.clearance_m);
  }
  if (errors.empty()) return;
  out.error_mesh_p99 = percentile(errors, 0.99);
  out.clearance_min = least;
}

void Judge::judge_optimum(const TouchRun& run, double budget_s, Judgement& out) {
  const bool pressed = mesh_.shape == BenchShape::sphere && path_.counted_from > 0;  // a slide
  if (reference_ == nullptr || !pressed || path_.reference.empty()) return;
  if (!has_optimum_) {
    has_optimum_ = true;
    std::vector<std::size_t> all;
    for (std::size_t k = path_.counted_from; k < path_.goals.size(); ++k) all.push_back(k);
    const auto find = [&](std::size_t k) {
      const glm::dvec3 optimum = reference_->convex_optimum(in_body(path_.goals[k], k), radius_m_);
      return glm::length(optimum - in_body(path_.reference[k], k));
    };
    const std::vector<std::size_t> probe = thinned(all, kProbe);
    const auto start = std::chrono::steady_clock::now();
    for (const std::size_t k : probe) static_cast<void>(find(k));
    for (const std::size_t k :
         thinned(all, affordable(all.size(), probe.size(), seconds_since(start), budget_s)))
      optimum_.push_back({k, find(k)});
  }
  MaxRms own, there;
  for (const Optimum& o : optimum_) {
    own.add(o.off_sphere_m);
    if (o.tick < run.ticks) there.add(glm::length(run.proxy_m[o.tick] - path_.reference[o.tick]));
  }
  out.optimum_sphere_max = own.most;
  out.optimum_sphere_rms = own.rms();
  if (there.count > 0) out.error_sphere_there_max = there.most;
}

void Judge::judge_closed(const TouchRun& run, Judgement& out) const {
  if (path_.reference.empty()) return;
  MaxRms error;
  for (std::size_t k = path_.counted_from; k < run.ticks; ++k)
    error.add(glm::length(run.proxy_m[k] - path_.reference[k]));
  if (error.count == 0) return;
  const bool sphere = mesh_.shape == BenchShape::sphere;
  (sphere ? out.error_sphere_max : out.error_closed_max) = error.most;
  (sphere ? out.error_sphere_rms : out.error_closed_rms) = error.rms();
}

void Judge::judge_forces(const TouchRun& run, Judgement& out) const {
  std::vector<double> steps;
  auto start = path_.starts.begin();
  for (std::size_t k = 0; k < run.ticks; ++k) {
    const bool fresh = start != path_.starts.end() && *start == k;
    if (fresh) ++start;
    if (k < path_.counted_from) continue;
    const bool touches = run.force_N[k] != glm::dvec3(0.0);
    if (touches) ++out.contact_ticks;
    if (touches && !fresh && k > path_.counted_from && run.force_N[k - 1] != glm::dvec3(0.0))
      steps.push_back(glm::length(run.force_N[k] - run.force_N[k - 1]));
  }
  if (!steps.empty()) out.force_step_p99_N = percentile(steps, 0.99);
}

void Judge::judge_places(const TouchRun& run, Judgement& out) const {
  if (mesh_.shape == BenchShape::from_file && (!mesh_.solid || reference_ == nullptr)) return;
  out.inside_ticks = out.pop_throughs = 0;
  bool was_inside = false;
  auto start = path_.starts.begin();
  for (std::size_t k = 0; k < run.ticks; ++k) {
    if (start != path_.starts.end() && *start == k) {
      was_inside = false;
      ++start;
    }
    const bool now = !std::isfinite(glm::length(run.proxy_m[k])) || inside(in_body(run.proxy_m[k], k));
    if (now) ++*out.inside_ticks;
    if (now && !was_inside) ++*out.pop_throughs;
    was_inside = now;
  }
}

Judgement Judge::judge(const TouchRun& run, double budget_s) {
  Judgement out;
  judge_places(run, out);
  judge_forces(run, out);
  judge_closed(run, out);
  judge_optimum(run, budget_s, out);
  judge_exactly(run, budget_s, out);
  // Without an exact reference the closed form stands in. It is exact on a cube and a corner.
  if (!out.error_mesh_max && out.error_closed_max) out.error_mesh_max = out.error_closed_max;
  return out;
}

}  // namespace hybrid::bench
