// SPDX-License-Identifier: GPL-3.0-or-later
#include "truth_world.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "hybrid/build.h"
#include "hybrid/denormals.h"
#include "hybrid/session.h"
#include "polygon/mesh_surface.h"

namespace tests {

using glm::dvec3;

TruthWorld::TruthWorld(std::vector<TruthBody> bodies, const TruthOptions& options)
    : bodies_(std::move(bodies)) {
  hybrid::flush_denormals();
  dvec3 low(1e300), high(-1e300);
  for (TruthBody& body : bodies_) {
    hybrid::RigidDescription description;
    description.source = hybrid::MeshSource{};
    description.motion = body.motion;
    hybrid::RigidObject object;
    object.name = "body";
    object.drawn = std::make_shared<const polygon::TriangleMesh>(body.mesh);
    object.surface = body.surface
                         ? body.surface
                         : polygon::make_mesh_surface(
                               object.drawn, {.solid = body.solid, .vertex_normals = body.feel.shading});
    object.pose = body.pose;
    object.motion = hybrid::RigidMotion(description, body.pose, body.mesh, body.solid);
    object.feel = body.feel;
    for (const dvec3& v : body.mesh.vertices) {
      low = glm::min(low, object.to_scene(v));
      high = glm::max(high, object.to_scene(v));
    }
    judges_.push_back(std::make_unique<Judge>(body.mesh));
    world_.rigid.push_back(std::move(object));
  }
  const dvec3 size = high - low;
  extent_ = glm::length(size);
  world_.tool = {.radius_m = options.tool_radius_m, .stiffness_N_per_m = options.stiffness_N_per_m};
  world_.limits = {.max_force_N = 1e12, .max_slew_N_per_s = 1e18, .soft_start_s = 0.0};
  world_.use_map = options.use_map;
  world_.set_scale(low, high);
  const double cell = hybrid::rigid_cell_m(std::max({size.x, size.y, size.z}), options.tool_radius_m);
  hybrid::OccupancyMap map(cell, 0.5 * (low + high));
  for (std::uint32_t b = 0; b < bodies_.size(); ++b) {
    const hybrid::RigidObject& object = world_.rigid[b];
    const auto& v = bodies_[b].mesh.vertices;
    if (object.motion.moves()) {
      auto cells = std::make_shared<hybrid::SurfaceCells>(
          cell, 0.5 * (object.surface->lower() + object.surface->upper()));
      for (const auto& t : bodies_[b].mesh.triangles) cells->add_triangle(1, v[t[0]], v[t[1]], v[t[2]]);
      cells->seal();
      map.add_moving(b, std::move(cells), object.pose.position_m, object.pose.rotation);
    } else {
      for (const auto& t : bodies_[b].mesh.triangles)
        map.add_triangle(b, object.to_scene(v[t[0]]), object.to_scene(v[t[1]]), object.to_scene(v[t[2]]));
    }
  }
  map.reserve_bricks(0);
  state_ = std::make_unique<hybrid::WorldState>(world_, std::move(map));
  state_->prepare(world_);
}

bool TruthWorld::start(const dvec3& at_m) {
  return hybrid::start_proxy(world_, *state_, at_m);
}

hybrid::RigidStep TruthWorld::step(const dvec3& goal_m) {
  trail_.assign(1, state_->proxy_m);
  state_->trail = steps_;
  const hybrid::RigidStep step = hybrid::step_rigid(world_, *state_, goal_m, 1e-3);
  state_->trail = {};
  if (!step.free) {
    const auto corners = static_cast<std::ptrdiff_t>(state_->trail_count);
    trail_.insert(trail_.end(), steps_.begin(), steps_.begin() + corners);
  }
  trail_.push_back(state_->proxy_m);
  return step;
}

double TruthWorld::clearance(const dvec3& at_m) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < judges_.size(); ++b)
    least = std::min(least, judges_[b]->reference.distance(in_body(b, at_m)));
  return least - radius();
}

double TruthWorld::trail_clearance() const {
  double least = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> near;
  for (std::size_t b = 0; b < judges_.size(); ++b) {
    for (std::size_t n = 1; n < trail_.size(); ++n) {
      const dvec3 from = in_body(b, trail_[n - 1]), to = in_body(b, trail_[n]);
      judges_[b]->exact.near_segment(from, to, radius(), near);
      for (const std::uint32_t id : near)
        least = std::min(least, judges_[b]->exact.segment_distance(from, to, id));
    }
  }
  return least - radius();
}

bool TruthWorld::trail_crosses() const {
  std::vector<std::uint32_t> near;
  for (std::size_t b = 0; b < judges_.size(); ++b) {
    for (std::size_t n = 1; n < trail_.size(); ++n) {
      const dvec3 from = in_body(b, trail_[n - 1]), to = in_body(b, trail_[n]);
      judges_[b]->exact.near_segment(from, to, 0.0, near);
      for (const std::uint32_t id : near) {
        if (judges_[b]->exact.crosses(from, to, id)) return true;
      }
    }
  }
  return false;
}

bool TruthWorld::inside(const dvec3& at_m) const {
  for (std::size_t b = 0; b < judges_.size(); ++b) {
    if (bodies_[b].solid && judges_[b]->reference.inside(in_body(b, at_m))) return true;
  }
  return false;
}

polygon::NearestOptimum TruthWorld::optimum(std::uint32_t body, const dvec3& goal_m, double search_m) const {
  return judges_[body]->reference.nearest_optimum(in_body(body, goal_m), in_body(body, state_->proxy_m),
                                                  radius(), search_m);
}

}  // namespace tests
