// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/snapshot/fill_snapshot.h"

#include <algorithm>
#include <glm/gtc/quaternion.hpp>

#include "voxel/composite/grid.h"

namespace hybrid {
namespace {

constexpr int kNodesInside = 24;  // nodes along an object's longest edge; their displacements are for a cut

void fill_places(const World& world, const WorldState& state, Snapshot& snapshot) {
  snapshot.rigid_place.resize(world.rigid.size());
  for (std::size_t o = 0; o < world.rigid.size(); ++o) {
    const Pose &before = world.rigid[o].pose, &now = state.rigid[o].pose;
    RigidPlace& place = snapshot.rigid_place[o];
    place.moved = now.position_m != before.position_m || now.rotation != before.rotation;
    place.about_m = before.position_m;
    place.shift_m = now.position_m - before.position_m;
    place.turn = now.rotation * glm::conjugate(before.rotation);
  }
}

void fill_surface(const SoftBody& body, const voxel::SoftObject& object, std::vector<glm::vec3>& moved) {
  moved.resize(body.drawn.vertices.size());
  for (std::size_t v = 0; v < moved.size(); ++v)
    moved[v] = glm::vec3(body.pose.rotation * object.displacement_at(body.drawn.vertices[v]));
}

// Copies the displacements at the patches' nodes: a few hundred kilobytes, however large the object is.
// Displacements of all surface vertices would take 100 ms.
void fill_dent(const SoftBody& body, const voxel::SoftObject& object, SoftDent& dent) {
  dent.used = true;
  dent.count = 0;
  const voxel::CompositeGrid* const grid = object.patches_in_use();
  if (grid == nullptr) return;
  dent.to_scene = glm::mat3_cast(body.pose.rotation);
  dent.origin_m = body.pose.origin;
  dent.spacing_m = object.lattice().spacing_m();
  dent.count = grid->patch_count();
  if (dent.boxes.size() < dent.count) dent.boxes.resize(dent.count);
  for (std::size_t n = 0; n < dent.count; ++n) {
    const voxel::CompositeGrid::Nodes nodes = grid->nodes_of(n);
    SoftDent::Box& box = dent.boxes[n];
    box.first = nodes.first;
    box.count = nodes.count;
    box.step = nodes.step;
    box.open_low = nodes.open_low;
    box.open_high = nodes.open_high;
    box.stride = nodes.stride;
    box.plane = nodes.plane;
    const std::size_t size = nodes.plane * static_cast<std::size_t>(nodes.count[2]);
    for (std::size_t a = 0; a < 3; ++a) box.moved_m[a].assign(nodes.u[a], nodes.u[a] + size);
  }
}

}  // namespace

void fill_moved(const World& world, const WorldState& state, Snapshot& snapshot) {
  fill_places(world, state, snapshot);
  snapshot.soft_moved_m.resize(world.object_count());
  for (std::size_t o = 0; o < world.soft.size(); ++o)
    fill_surface(world.soft[o], *state.soft[o], snapshot.soft_moved_m[world.rigid.size() + o]);
}

void fill_asked(const World& world, const WorldState& state, const AskedPoints& asked, bool in_tick,
                Snapshot& snapshot) {
  snapshot.asked.number = asked.number;
  snapshot.asked.moved_m.resize(world.object_count());
  for (auto& moved : snapshot.asked.moved_m) moved.clear();
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    const voxel::SoftObject& object = *state.soft[o];
    const std::size_t number = world.rigid.size() + o;
    if (number >= asked.at_rest_m.size() || (in_tick && (object.uses_patches() || state.async.has(o))))
      continue;
    const SoftBody& body = world.soft[o];
    for (const glm::dvec3& at : asked.at_rest_m[number])
      snapshot.asked.moved_m[number].emplace_back(body.pose.rotation *
                                                  object.displacement_at(body.to_body(at)));
  }
}

void fill_values(const World& world, const WorldState& state, const DrawnScene& drawn, Snapshot& snapshot) {
  snapshot.values.resize(drawn.editable.size());
  for (std::size_t n = 0; n < drawn.editable.size(); ++n) {
    const EditableValue& value = drawn.editable[n];
    snapshot.values[n] = edited_value(world, state, value.object, value.quantity);
  }
}

void fill_inside(const World& world, const WorldState& state, Snapshot& snapshot) {
  snapshot.inside.resize(world.object_count());
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    const std::size_t number = world.rigid.size() + o;
    if (number >= state.feel.size() || !state.feel[number].contact) continue;
    const SoftBody& body = world.soft[o];
    const voxel::SoftObject& object = *state.soft[o];
    const std::array<int, 3>& dims = object.lattice().grid().dims;
    SoftDent& dent = snapshot.inside[number];
    dent.used = true;
    dent.to_scene = glm::mat3_cast(body.pose.rotation);
    dent.origin_m = body.pose.origin;
    dent.spacing_m = object.lattice().spacing_m();
    dent.count = 1;
    SoftDent::Box& box = dent.boxes.emplace_back();
    box.step = std::max(1, (std::max({dims[0], dims[1], dims[2]}) + kNodesInside - 1) / kNodesInside);
    for (std::size_t d = 0; d < 3; ++d) box.count[d] = (dims[d] - 1) / box.step + 2;
    box.stride = static_cast<std::size_t>(box.count[0]);
    box.plane = box.stride * static_cast<std::size_t>(box.count[1]);
    for (int k = 0; k < box.count[2]; ++k) {
      for (int j = 0; j < box.count[1]; ++j) {
        for (int i = 0; i < box.count[0]; ++i) {
          // Nodes beyond the last voxels have the displacement of the last ones.
          const glm::dvec3 node(std::min(i * box.step, dims[0] - 1), std::min(j * box.step, dims[1] - 1),
                                std::min(k * box.step, dims[2] - 1));
          const glm::dvec3 moved = object.displacement_at(node * dent.spacing_m);
          for (std::size_t a = 0; a < 3; ++a)
            box.moved_m[a].push_back(static_cast<float>(moved[static_cast<glm::length_t>(a)]));
        }
      }
    }
  }
}

void fill_moved_near(const World& world, const WorldState& state, Snapshot& snapshot) {
  fill_places(world, state, snapshot);
  snapshot.soft_moved_m.resize(world.object_count());
  snapshot.patches.resize(world.object_count());
  snapshot.dents.resize(world.object_count());
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    const SoftBody& body = world.soft[o];
    const voxel::SoftObject& object = *state.soft[o];
    const std::size_t number = world.rigid.size() + o;
    if (object.uses_patches()) {
      fill_dent(body, object, snapshot.dents[number]);
      continue;
    }
    if (!state.async.has(o)) {
      fill_surface(body, object, snapshot.soft_moved_m[number]);
      continue;
    }
    SoftPatch& patch = snapshot.patches[number];
    patch.at_rest_m.clear();
    patch.moved_m.clear();
    for (const voxel::VoxelId v : object.touched()) {
      patch.at_rest_m.emplace_back(body.to_scene(object.lattice().rest(v)));
      patch.moved_m.emplace_back(body.pose.rotation * object.displacement(v));
    }
  }
}

Snapshot take_snapshot(const World& world, const WorldState& state, const TickResult& tick, double t_s) {
  Snapshot snapshot{.scene = 0,
                    .tick = state.tick,
                    .t_s = t_s,
                    .device_m = tick.device_m,
                    .proxy_m = tick.proxy_m,
                    .force_N = tick.force_N,
                    .feel = state.feel,
                    .soft_moved_m = {},
                    .rigid_place = {},
                    .tick_us = tick.tick_us};
  fill_moved(world, state, snapshot);
  fill_inside(world, state, snapshot);
  return snapshot;
}

}  // namespace hybrid
