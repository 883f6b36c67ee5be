// SPDX-License-Identifier: GPL-3.0-or-later
#include "arbitration_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <iterator>
#include <string>

#include "hybrid/build.h"
#include "hybrid/recording.h"
#include "hybrid/session.h"
#include "voxel/brick_loads.h"

namespace tests {
namespace {

using glm::dvec3;

constexpr double kTouching = 0.02;  // of the spacing: a voxel or tool nearer than this touches
constexpr double kTight = 1e-3;  // of the spacing: a link nearer to its limit may carry more than its spring

struct Near {
  double distance = std::numeric_limits<double>::infinity();  // of a point from the surface; inside: negative
  dvec3 normal{0.0};                                          // out of it, scene frame
};

Near near_rigid(const hybrid::World& world, const hybrid::WorldState& state, std::size_t o, const dvec3& at,
                double range) {
  const polygon::RigidSurface& surface = *world.rigid[o].surface;
  const hybrid::BodyFrame& frame = state.rigid[o].frame;
  const dvec3 p = frame.to_body(at);
  Near result;
  polygon::NearPoint near;
  const bool inside = surface.inside(p);
  if (!surface.nearest(p, inside ? 1.0 : range, near)) return result;
  const dvec3 away = inside ? near.point - p : p - near.point;
  const double length = glm::length(away);
  result.distance = inside ? -length : length;
  if (length > 0.0) result.normal = frame.rotation * (away / length);
  return result;
}

// A sheet has no inside, and is flat here: the side of it, and the place on it.
bool is_sheet(const polygon::RigidSurface& surface) {
  return surface.element_count() == 1 && surface.lower().z == surface.upper().z;
}

bool crosses(const hybrid::World& world, const hybrid::WorldState& state, std::size_t o, const dvec3& from,
             const dvec3& to) {
  const polygon::RigidSurface& surface = *world.rigid[o].surface;
  if (!is_sheet(surface)) return false;
  const hybrid::BodyFrame& frame = state.rigid[o].frame;
  const dvec3 a = frame.to_body(from), b = frame.to_body(to);
  if (!(a.z * b.z < 0.0)) return false;
  const dvec3 at = a + (b - a) * (a.z / (a.z - b.z));
  const dvec3 low = surface.lower(), high = surface.upper();
  return at.x > low.x && at.x < high.x && at.y > low.y && at.y < high.y;
}

double stretch(const voxel::Displacement& state, int axis, voxel::VoxelId v, voxel::VoxelId w) {
  const auto& u = state.u[static_cast<std::size_t>(axis)];
  return static_cast<double>(u[w]) - static_cast<double>(u[v]);
}

// Of its springs on a voxel.
dvec3 pull_of_links(const voxel::SoftObject& object, voxel::VoxelId v) {
  const voxel::Lattice& lattice = object.lattice();
  dvec3 force(0.0);
  for (int d = 0; d < 3; ++d) {
    const voxel::VoxelId up = lattice.up(v, d), down = lattice.down(v, d);
    for (int axis = 0; axis < 3; ++axis) {
      if (lattice.filled(up))
        force[axis] +=
            static_cast<double>(lattice.spring(v, d).on(axis, d)) * stretch(object.state(), axis, v, up);
      if (lattice.filled(down))
        force[axis] -=
            static_cast<double>(lattice.spring(down, d).on(axis, d)) * stretch(object.state(), axis, down, v);
    }
  }
  return force;
}

std::size_t tight_links(const voxel::SoftObject& object) {
  const voxel::Lattice& lattice = object.lattice();
  std::size_t count = 0;
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const auto v = static_cast<voxel::VoxelId>(i);
    if (!lattice.filled(v)) continue;
    for (int d = 0; d < 3; ++d) {
      const voxel::VoxelId w = lattice.up(v, d);
      if (!lattice.filled(w)) continue;
      const double margin = kTight * lattice.spacing_m()[d];
      for (int axis = 0; axis < 3; ++axis) {
        const auto limits = lattice.bounds(v, d, axis);
        const double s = stretch(object.state(), axis, v, w);
        if (s < static_cast<double>(limits[0]) + margin || s > static_cast<double>(limits[1]) - margin)
          ++count;
      }
    }
  }
  return count;
}

}  // namespace

ArbitrationWatch::ArbitrationWatch(const hybrid::World& world, const hybrid::WorldState& state)
    : world_(world), at_rest_m_(world.soft.size()), before_(world.soft.size()) {
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    const voxel::SoftObject& object = *state.soft[o];
    for (const voxel::VoxelId v : object.lattice().surface()) {
      const dvec3 at = world.soft[o].to_scene(object.position(v));
      bool inside = false;
      at_rest_m_[o].push_back(std::max(0.0, depth(state, at, object.voxel_radius(), inside)));
      before_[o].push_back(at);
    }
  }
}

double ArbitrationWatch::depth(const hybrid::WorldState& state, const dvec3& at, double radius,
                               bool& inside) const {
  double worst = -radius;
  for (std::size_t r = 0; r < world_.rigid.size(); ++r) {
    const Near near = near_rigid(world_, state, r, at, radius);
    inside = inside || near.distance < 0.0;
    worst = std::max(worst, radius - near.distance);
  }
  return worst;
}

void ArbitrationWatch::see(const hybrid::WorldState& state, const hybrid::TickResult& felt) {
  ++ticks_;
  deepest_now_ = 0.0;
  for (std::size_t o = 0; o < world_.soft.size(); ++o) {
    const voxel::SoftObject& object = *state.soft[o];
    if (!object.moved_ever()) continue;
    const auto surface = object.lattice().surface();
    for (std::size_t s = 0; s < surface.size(); ++s) {
      if (object.lattice().anchored(surface[s])) continue;
      const dvec3 at = world_.soft[o].to_scene(object.position(surface[s]));
      bool inside = false;
      const double deep = depth(state, at, object.voxel_radius(), inside) - at_rest_m_[o][s];
      deepest_now_ = std::max(deepest_now_, deep / object.lattice().min_spacing_m());
      bool crossed = false;
      for (std::size_t r = 0; r < world_.rigid.size(); ++r)
        crossed = crossed || crosses(world_, state, r, before_[o][s], at);
      if (inside || crossed) ++passed_;
      before_[o][s] = at;
    }
  }
  if (deepest_now_ > deepest_) {
    deepest_ = deepest_now_;
    deepest_tick_ = ticks_;
  }
  for (std::size_t r = 0; r < world_.rigid.size(); ++r) {
    const double radius = world_.tool.radius_m;
    tool_inside_m_ =
        std::max(tool_inside_m_, radius - near_rigid(world_, state, r, felt.proxy_m, radius).distance);
    tool_crossed_ = tool_crossed_ || (tool_known_ && crosses(world_, state, r, tool_before_, felt.proxy_m));
  }
  tool_before_ = felt.proxy_m;
  tool_known_ = true;
}

namespace {

// The face's voxel centres in the volume frame, row by row; where one is missing, far away.
struct FaceGrid {
  std::array<int, 2> axes{};
  std::array<int, 2> count{};
  std::vector<dvec3> at;
  std::vector<bool> filled;
};

FaceGrid grid_of(const hybrid::WorldState& state, const Face& face) {
  const voxel::SoftObject& object = *state.soft[face.soft];
  const voxel::Lattice& lattice = object.lattice();
  FaceGrid grid;
  grid.axes = {face.axis == 0 ? 1 : 0, face.axis == 2 ? 1 : 2};
  const auto& dims = lattice.grid().dims;
  for (std::size_t a = 0; a < 2; ++a) grid.count[a] = dims[static_cast<std::size_t>(grid.axes[a])];
  std::array<int, 3> c{};
  const int deep = dims[static_cast<std::size_t>(face.axis)];
  for (int j = 0; j < grid.count[1]; ++j) {
    for (int i = 0; i < grid.count[0]; ++i) {
      c[static_cast<std::size_t>(grid.axes[0])] = i;
      c[static_cast<std::size_t>(grid.axes[1])] = j;
      // The outermost that is there: objects may have been carved.
      bool found = false;
      for (int k = 0; k < deep && !found; ++k) {
        c[static_cast<std::size_t>(face.axis)] = face.up ? deep - 1 - k : k;
        const voxel::VoxelId v = lattice.at(c[0], c[1], c[2]);
        found = lattice.filled(v);
        if (found) grid.at.push_back(object.position(v));
      }
      if (!found) grid.at.emplace_back(0.0);
      grid.filled.push_back(found);
    }
  }
  return grid;
}

double in_front_of(const FaceGrid& grid, const Face& face, const dvec3& p) {
  const int x = grid.axes[0], y = grid.axes[1], z = face.axis;
  double least = std::numeric_limits<double>::infinity();
  const auto index = [&](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(grid.count[0]) +
           static_cast<std::size_t>(i);
  };
  for (int j = 0; j + 1 < grid.count[1]; ++j) {
    for (int i = 0; i + 1 < grid.count[0]; ++i) {
      const std::array<std::size_t, 4> corner{index(i, j), index(i + 1, j), index(i + 1, j + 1),
                                              index(i, j + 1)};
      const auto past = [&](int axis) {
        const auto at = [&](std::size_t n) { return grid.at[corner[n]][axis]; };
        return p[axis] < std::min({at(0), at(1), at(2), at(3)}) ||
               p[axis] > std::max({at(0), at(1), at(2), at(3)});
      };
      if (past(x) || past(y)) continue;
      for (const std::array<std::size_t, 3>& t :
           {std::array<std::size_t, 3>{0, 1, 2}, std::array<std::size_t, 3>{0, 2, 3}}) {
        const std::size_t ia = corner[t[0]], ib = corner[t[1]], ic = corner[t[2]];
        if (!grid.filled[ia] || !grid.filled[ib] || !grid.filled[ic]) continue;
        const dvec3 &a = grid.at[ia], &b = grid.at[ib], &c = grid.at[ic];
        const double bx = b[x] - a[x], by = b[y] - a[y], cx = c[x] - a[x], cy = c[y] - a[y];
        const double area = bx * cy - by * cx;
        if (area == 0.0) continue;
        const double px = p[x] - a[x], py = p[y] - a[y];
        const double s = (px * cy - py * cx) / area, r = (bx * py - by * px) / area;
        if (s < 0.0 || r < 0.0 || s + r > 1.0) continue;
        const double height = a[z] + s * (b[z] - a[z]) + r * (c[z] - a[z]);
        least = std::min(least, face.up ? p[z] - height : height - p[z]);
      }
    }
  }
  return least;
}

}  // namespace

double in_front_of(const hybrid::World& world, const hybrid::WorldState& state, const Face& face,
                   const dvec3& point) {
  return in_front_of(grid_of(state, face), face, world.soft[face.soft].to_body(point));
}

double in_front_of(const hybrid::World& world, const hybrid::WorldState& state, const Face& face,
                   const Face& other) {
  const FaceGrid mine = grid_of(state, face), its = grid_of(state, other);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < its.at.size(); ++i) {
    if (!its.filled[i]) continue;
    const dvec3 at = world.soft[face.soft].to_body(world.soft[other.soft].to_scene(its.at[i]));
    least = std::min(least, in_front_of(mine, face, at));
  }
  return least;
}

std::vector<Bearing> bearings(const hybrid::World& world, const hybrid::WorldState& state) {
  std::vector<Bearing> result(world.soft.size());
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    Bearing& bearing = result[o];
    const voxel::SoftObject& object = *state.soft[o];
    const voxel::Lattice& lattice = object.lattice();
    const hybrid::SoftBody& body = world.soft[o];
    const double touching = kTouching * lattice.min_spacing_m();
    bearing.tight = tight_links(object);
    // Found anew, and not as the object knows them.
    const voxel::BrickLoads bricks(lattice);
    std::array<voxel::Lanes, 3> loads{};
    for (std::size_t i = 0; i < lattice.size(); ++i) {
      const auto v = static_cast<voxel::VoxelId>(i);
      const std::size_t lane = i % voxel::kRow;
      if (lane == 0 && (lattice.filled_in(v / voxel::kRow) == 0 ||
                        !bricks.loads_of(v / voxel::kRow, object.state(), loads)))
        loads = {};
      if (!lattice.filled(v)) continue;
      dvec3 force = body.pose.rotation *
                    (pull_of_links(object, v) + dvec3(loads[0][lane], loads[1][lane], loads[2][lane]));
      if (lattice.anchored(v)) {
        bearing.anchors_N += force;
        continue;
      }
      const dvec3 at = body.to_scene(object.position(v));
      const bool surface = object.surface_number(v) != voxel::SoftObject::kNoSurface;
      for (std::size_t r = 0; r < world.rigid.size() && surface; ++r) {
        const Near near = near_rigid(world, state, r, at, object.voxel_radius() + touching);
        const double across = glm::dot(force, near.normal);
        if (near.distance > object.voxel_radius() + touching || across >= 0.0) continue;
        bearing.rigid_N += across * near.normal;
        force -= across * near.normal;
      }
      const dvec3 to_tool = state.proxy_m - at;
      if (surface && glm::length(to_tool) < object.reach(world.tool.radius_m) + touching) {
        const dvec3 n = glm::normalize(to_tool);
        const double across = glm::dot(force, n);
        if (across > 0.0) {
          bearing.tool_N += across * n;
          force -= across * n;
        }
      }
      bearing.left_N += force;
      bearing.worst_left_N = std::max(bearing.worst_left_N, glm::length(force));
    }
  }
  return result;
}

dvec3 beyond_rigid(const hybrid::World& world, const hybrid::WorldState& state, const dvec3& force_N) {
  const double radius = world.contact_radius_m(), touching = 1e-3 * radius;
  std::vector<dvec3> normals;
  for (std::size_t r = 0; r < world.rigid.size(); ++r) {
    const Near near = near_rigid(world, state, r, state.proxy_m, radius + touching);
    if (near.distance <= radius + touching) normals.push_back(near.normal);
  }
  // Least squares with pressing only, by coordinate descent: few normals.
  std::vector<double> press(normals.size(), 0.0);
  dvec3 left = force_N;
  for (int n = 0; n < 1000; ++n) {
    for (std::size_t i = 0; i < normals.size(); ++i) {
      const double more = std::max(glm::dot(left, normals[i]), -press[i]);
      press[i] += more;
      left -= more * normals[i];
    }
  }
  return left;
}

void expect_replays(const std::filesystem::path& file, double seconds) {
  const hybrid::Scene scene = hybrid::load_scene(file);
  std::ifstream in(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  for (const bool realtime : {false, true}) {
    hybrid::BuiltScene built = hybrid::build_scene(scene);
    hybrid::SessionOptions options;
    options.seconds = realtime ? 1.2 : seconds;
    options.keep_rows = false;
    options.relax_apart = true;
    options.realtime = realtime;
    const hybrid::SessionResult felt = hybrid::run_session(scene, built, options);
    // How many come in a second of real time is the machine's doing.
    EXPECT_GT(felt.relaxed_apart, realtime ? 0U : 10U);
    const hybrid::ReplayResult again = hybrid::replay({.scene_file = file,
                                                       .scene_text = text,
                                                       .dt_s = felt.dt_s,
                                                       .device = hybrid::scene_limits(scene),
                                                       .relax_apart = true,
                                                       .state_hash = felt.state_hash,
                                                       .start_m = felt.start_m,
                                                       .ticks = felt.recording},
                                                      {});
    EXPECT_TRUE(again.equal) << "parts at tick " << again.parts_at << (realtime ? ", in real time" : "");
    EXPECT_EQ(built.state->faults, 0U);
  }
}

}  // namespace tests
