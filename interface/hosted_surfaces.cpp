// SPDX-License-Identifier: GPL-3.0-or-later
#include "interface/hosted_surfaces.h"

#include <algorithm>
#include <utility>

#include "hybrid/snapshot/fill_snapshot.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/snapshot/merge_live_surface.h"

namespace c_interface {
namespace {

const std::vector<glm::vec3>& moved_of(const hybrid::Snapshot& snapshot, std::size_t object) {
  static const std::vector<glm::vec3> kAtRest;
  return object < snapshot.soft_moved_m.size() ? snapshot.soft_moved_m[object] : kAtRest;
}

bool all_at_rest(const std::vector<glm::vec3>& moved) {
  return std::all_of(moved.begin(), moved.end(), [](const glm::vec3& m) { return m == glm::vec3(0.0F); });
}

// An object that never moved has no displacements.
bool same(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  if (a.empty() || b.empty()) return all_at_rest(a) && all_at_rest(b);
  return a == b;
}

bool same(const hybrid::RigidPlace& a, const hybrid::RigidPlace& b) {
  if (a.moved != b.moved) return false;
  return !a.moved || (a.about_m == b.about_m && a.shift_m == b.shift_m && a.turn == b.turn);
}

}  // namespace

HostedSurfaces::HostedSurfaces(const hybrid::Scene& scene, const hybrid::BuiltScene& built)
    : drawn_(hybrid::drawn_scene(scene, built, scene.title)), changed_(drawn_.objects.size(), false) {}

void HostedSurfaces::publish(const hybrid::World& world, const hybrid::WorldState& state,
                             const hybrid::TickResult& felt, std::uint64_t ticks, bool live) {
  published_.back().number = ++published_number_;
  hybrid::Snapshot& out = published_.back().snapshot;
  out.tick = ticks;
  out.device_m = felt.device_m;
  out.proxy_m = felt.proxy_m;
  out.force_N = felt.force_N;
  if (live) {
    hybrid::fill_moved_near(world, state, out);
  } else {
    hybrid::fill_moved(world, state, out);
  }
  published_.publish();
}

bool HostedSurfaces::take(const std::function<const hybrid::RelaxedTissue*()>& relaxed) {
  const auto& [newest, number] = published_.take();
  if (number == taken_number_) {
    changed_.assign(changed_.size(), false);
    return false;
  }
  hybrid::Snapshot shown;
  const hybrid::RelaxedTissue* const of_thread = relaxed();
  hybrid::merge_live_surface(drawn_, newest, of_thread ? *of_thread : hybrid::RelaxedTissue{}, nullptr,
                             shown);
  const hybrid::Snapshot before = taken_ ? std::move(*taken_) : hybrid::Snapshot{};
  for (std::size_t o = 0; o < changed_.size(); ++o) changed_[o] = differ(o, before, shown);
  taken_ = std::move(shown);
  taken_number_ = number;
  return true;
}

bool HostedSurfaces::differ(std::size_t object, const hybrid::Snapshot& a, const hybrid::Snapshot& b) const {
  if (drawn_.objects[object].soft) return !same(moved_of(a, object), moved_of(b, object));
  return !same(a.place_of(object), b.place_of(object));
}

void HostedSurfaces::copy_vertices(std::size_t object, double* to) const {
  const std::vector<glm::dvec3>& at_rest = drawn_.objects[object].surface.vertices;
  const std::vector<glm::vec3>* moved = taken_ ? &moved_of(*taken_, object) : nullptr;
  const bool displaced = moved != nullptr && !moved->empty();
  const hybrid::RigidPlace place =
      taken_ && !drawn_.objects[object].soft ? taken_->place_of(object) : hybrid::RigidPlace{};
  for (std::size_t v = 0; v < at_rest.size(); ++v) {
    const glm::dvec3 at = displaced ? at_rest[v] + glm::dvec3((*moved)[v]) : place(at_rest[v]);
    for (int d = 0; d < 3; ++d) *to++ = at[d];
  }
}

}  // namespace c_interface
