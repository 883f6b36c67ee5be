// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/press_tissue.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "hybrid/tick/tissue/tissue_facets.h"

namespace hybrid {
namespace {

constexpr int kMaxHalvings = 6;           // maximum number of halvings of the search range
constexpr std::uint32_t kMapSlice = 512;  // surface voxels of each object that are updated per tick

const glm::dvec3 kPunchAxis(0.0, 0.0, -1.0);  // a punch presses downwards in the scene

}  // namespace

voxel::ToolInBody tool_in_body(const World& world, const SoftBody& body, const glm::dvec3& point) noexcept {
  voxel::ToolInBody tool;
  tool.shape = world.tool.shape == Tool::Shape::punch ? voxel::ToolInBody::Shape::punch
                                                      : voxel::ToolInBody::Shape::ball;
  tool.centre = body.to_body(point);
  tool.axis = glm::inverse(body.pose.rotation) * kPunchAxis;
  tool.radius = world.tool.radius_m;
  return tool;
}

double soft_reach(const World& world, const WorldState& state) noexcept {
  double reach = 0.0;
  for (const auto& object : state.soft) reach = std::max(reach, object->reach(world.tool.radius_m));
  return reach;
}

namespace {

// Lists the voxels within reach plus `range` of the tool: those among the first `count` map_hits, and those
// of objects pressed on nested patches. False: an object has more than fit.
bool list_touched(const World& world, WorldState& state, const glm::dvec3& point, double range,
                  std::size_t count) noexcept {
  for (auto& list : state.scratch.touched) list.clear();
  bool fits = true;
  const auto take = [&](std::size_t o, voxel::VoxelId v) {
    const voxel::SoftObject& object = *state.soft[o];
    const glm::dvec3 away = world.soft[o].to_scene(object.position(v)) - point;
    const double reach = object.reach(world.tool.radius_m) + range;
    if (glm::dot(away, away) > reach * reach) return true;
    if (state.scratch.touched[o].size() == voxel::SoftObject::kMaxTouched) return false;
    state.scratch.touched[o].push_back(v);
    return true;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t number = state.scratch.map_hits[i];
    std::size_t o = world.soft.size() - 1;
    while (world.soft[o].first_number > number) --o;
    const voxel::SoftObject& object = *state.soft[o];
    if (object.patches_in_use() != nullptr) continue;
    fits = take(o, object.lattice().surface()[number - world.soft[o].first_number]);
    if (!fits) break;
  }
  for (std::size_t o = 0; o < state.soft.size() && fits; ++o) {
    if (state.soft[o]->patches_in_use() == nullptr) continue;
    for (const voxel::VoxelId v : state.soft[o]->near_on_grid()) fits = fits && take(o, v);
  }
  return fits;
}

}  // namespace

bool find_touched_voxels(const World& world, WorldState& state, const glm::dvec3& point,
                         double& range) noexcept {
  bool any = false;
  // A voxel may have moved since its last update in the map, by much less than a cell.
  const glm::dvec3 box(soft_reach(world, state) + range + 0.5 * state.map.cell_m());
  const std::size_t count =
      state.map.soft_in(point - box, point + box, state.scratch.map_hits, state.map_trail);
  bool fits = count < state.scratch.map_hits.size() && list_touched(world, state, point, range, count);
  // If a tool of many spacings has too many voxels near, the range is halved. The range also bounds the
  // tool's motion in this tick.
  for (int n = 0; n < kMaxHalvings && !fits; ++n) {
    range *= 0.5;
    fits = list_touched(world, state, point, range, count);
  }
  if (!fits) state.faults |= fault_touch_overflow;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    // The map lists voxels in the order in which they moved. Sorting makes the result independent of that.
    std::sort(state.scratch.touched[o].begin(), state.scratch.touched[o].end());
    if (state.scratch.touched[o].empty() && state.soft[o]->touched().empty()) continue;
    state.soft[o]->touch(state.scratch.touched[o]);
    state.soft[o]->record_depths(tool_in_body(world, world.soft[o], point));
    any = any || !state.scratch.touched[o].empty();
  }
  return any;
}

void press_tissue(const World& world, WorldState& state, const glm::dvec3& point, const glm::dvec3& delta,
                  int sweeps) noexcept {
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    state.reactions[o] = {};
    if (object.touched().empty()) continue;
    const SoftBody& body = world.soft[o];
    const voxel::ToolInBody tool = tool_in_body(world, body, point);
    // Two waves of the chain: follow() moves pressed voxels along with the tool, so push_out() has fewer
    // voxels left to push out.
    if (delta != glm::dvec3(0.0)) object.follow(glm::inverse(body.pose.rotation) * delta);
    object.push_out(tool);
    object.relax_near(tool, sweeps);
    const voxel::Reaction in_body = object.reaction(tool);
    const glm::dmat3 to_scene = glm::mat3_cast(body.pose.rotation);
    const double factor = state.edited.tissue_factor[o];
    state.reactions[o].force_N = factor * (to_scene * in_body.force_N);
    state.reactions[o].stiffness_N_per_m =
        factor * (to_scene * in_body.stiffness_N_per_m * glm::transpose(to_scene));
    state.reactions[o].pressed = in_body.pressed;
  }
}

std::size_t tool_bounds(const World& world, WorldState& state, const glm::dvec3& point, bool immovable_only,
                        double facets_within, std::vector<polygon::ContactPlane>& out) noexcept {
  const std::size_t before = out.size();
  for (std::uint32_t o = 0; o < state.soft.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    if (object.touched().empty()) continue;
    const SoftBody& body = world.soft[o];
    const voxel::ToolInBody tool = tool_in_body(world, body, point);
    const auto add = [&](const voxel::ToolBound& bound) {
      if (out.size() == out.capacity()) return;
      const glm::dvec3 normal = body.pose.rotation * bound.normal;
      out.push_back({normal, bound.offset + glm::dot(normal, body.pose.origin),
                     static_cast<std::uint32_t>(world.rigid.size()) + o, 0});
    };
    auto& bounds = state.scratch.bounds;
    std::size_t count = object.give_way(tool, bounds);
    for (std::size_t i = 0; i < count; ++i) {
      if (!immovable_only || object.is_immovable(bounds[i].voxel, -bounds[i].normal)) add(bounds[i]);
    }
    count = facet_bounds(object, tool, facets_within * object.reach(world.tool.radius_m), bounds);
    for (std::size_t i = 0; i < count; ++i) add(bounds[i]);
  }
  return out.size() - before;
}

bool contact_on_patches(const WorldState& state) noexcept {
  return std::any_of(state.soft.begin(), state.soft.end(),
                     [](const auto& object) { return object->patches_in_use() != nullptr; });
}

void prepare_patches(const World& world, WorldState& state, const glm::dvec3& point) noexcept {
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (!state.soft[o]->uses_patches()) continue;
    state.soft[o]->come_near_on_grid(tool_in_body(world, world.soft[o], point));
  }
}

void refresh_map(const World& world, WorldState& state) noexcept {
  const std::uint64_t before = state.map.overflows();
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    const voxel::SoftObject& object = *state.soft[o];
    if (!object.moved_ever() || object.uses_patches()) continue;
    const SoftBody& body = world.soft[o];
    const auto surface = object.lattice().surface();
    const auto look = [&](std::uint32_t number) {
      state.map.move(body.first_number + number, body.to_scene(object.position(surface[number])));
    };
    for (const std::uint32_t number : object.touched_numbers()) look(number);
    if (!state.body_obstacles.empty()) {
      for (const std::uint32_t number : state.body_obstacles[o].near) look(number);
    }
    // If the cursor of a sleeping object is at 0, all its voxels were updated since it fell asleep.
    if (object.asleep() && state.cursor[o] == 0) continue;
    const auto count = static_cast<std::uint32_t>(surface.size());
    for (std::uint32_t i = 0; i < std::min(kMapSlice, count); ++i) {
      prefetch_surface(object, state.cursor[o]);
      look(state.cursor[o]);
      if (++state.cursor[o] == count) {
        state.cursor[o] = 0;
        if (object.asleep()) break;
      }
    }
  }
  if (state.map.overflows() != before) state.faults |= fault_map_overflow;
}

}  // namespace hybrid
