// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/scene_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "hybrid/tick/copy_state.h"
#include "hybrid/tick/tissue/press_tissue.h"

namespace hybrid {
namespace {

constexpr std::size_t kPlaces = 4;  // places of contact that are measured
// Time in which the hand moves in free space before it reaches the object.
constexpr double kBeforeArrival_s = 0.05;
constexpr double kSample_s = 0.25;  // measured time at each place
constexpr double kLook_s = 1e-3;    // time between two samples of the path
// Samples of the path at most. A longer path is sampled more coarsely.
constexpr double kMostLooks = 200'000.0;

// The part of a path from `from_s` on.
class PathFrom final : public device::Path {
 public:
  PathFrom(std::shared_ptr<const device::Path> path, double from_s)
      : path_(std::move(path)), from_s_(from_s) {}
  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override {
    return path_->position(from_s_ + t_s);
  }
  [[nodiscard]] double duration_s() const noexcept override {
    return std::max(0.0, path_->duration_s() - from_s_);
  }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return path_->notes(); }

 private:
  std::shared_ptr<const device::Path> path_;
  double from_s_;
};

// The times at which the path comes near an object. Objects are taken at rest, from the occupancy map.
std::vector<double> arrivals_s(const World& world, const WorldState& state, const device::Path& path) {
  const double margin = std::max(world.contact_radius_m(), soft_reach(world, state));
  const double step = std::max(kLook_s, path.duration_s() / kMostLooks);
  std::vector<double> arrivals;
  double near_until_s = -1.0;
  for (double t = 0.0; t <= path.duration_s(); t += step) {
    const glm::dvec3 at = path.position(t);
    if (!state.map.any_near(at - margin, at + margin)) continue;
    std::array<std::uint32_t, 1> voxel{};
    if (state.map.rigid_in(at - margin, at + margin) == 0 &&
        state.map.soft_in(at - margin, at + margin, voxel) == 0)
      continue;
    if (arrivals.empty() || t > near_until_s + kBeforeArrival_s) arrivals.push_back(t);
    near_until_s = t;
  }
  return arrivals;
}

}  // namespace

SceneCost measure_cost(const Scene& scene, const BuiltScene& built) {
  SceneCost cost{.load_s = built.seconds,
                 .held_bytes = built.resident_bytes,
                 .tick_us = std::nullopt,
                 .period_us = 1e6 / scene.rate_hz};
  for (const auto& object : built.state->soft) cost.touched_bytes += soft_touched_bytes(object->lattice());
  const std::shared_ptr<const device::Path> path = scene_path(scene);
  const std::vector<double> arrivals = arrivals_s(*built.world, *built.state, *path);
  const std::size_t places = std::min(kPlaces, arrivals.size());
  LatencyHistogram ticks;
  for (std::size_t n = 0; n < places; ++n) {
    const double arrival = arrivals[n * arrivals.size() / places];
    BuiltScene copy;
    copy.world = std::make_unique<const World>(*built.world);
    copy.state = copy_state(*copy.world, *built.state);
    SessionOptions options{.seconds = kSample_s, .keep_recording = false, .progress = {}};
    options.async_relaxation = true;
    options.path = std::make_shared<const PathFrom>(path, std::max(0.0, arrival - kBeforeArrival_s));
    SessionResult felt;
    try {
      felt = run_session(scene, copy, options);
    } catch (const SceneError&) {
      continue;  // the path starts here inside a rigid object, where no session can begin
    }
    bool any = false;
    for (const TraceRow& row : felt.rows) {
      if (row.contacts == 0) continue;
      ticks.add(row.tick_us);
      any = true;
    }
    if (any) ++cost.places;
  }
  cost.ticks = ticks.count();
  if (cost.ticks > 0) cost.tick_us = ticks.percentiles();
  return cost;
}

std::string in_words(const SceneCost& cost) {
  std::string text = fmt::format("loads in {:.2g} s, holds {:.3g} MB", cost.load_s,
                                 1e-6 * static_cast<double>(cost.held_bytes));
  if (cost.touched_bytes > 0) {
    text += fmt::format(", and tissue touched everywhere takes about {:.3g} MB",
                        1e-6 * static_cast<double>(cost.touched_bytes));
  }
  if (!cost.tick_us) return text + "; ticks were not measured, because the path touches nothing";
  return text +
         fmt::format("; tick p50 {:.3g}, p99 {:.3g} us of {:.4g}, over {} ticks at {} place{} of contact",
                     cost.tick_us->p50, cost.tick_us->p99, cost.period_us, cost.ticks, cost.places,
                     cost.places == 1 ? "" : "s");
}

}  // namespace hybrid
