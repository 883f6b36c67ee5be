// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/tissue_facets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <numbers>

#include "polygon/mesh/triangle.h"

namespace hybrid {
namespace {

// A facet faces the centre if the line from the facet's nearest point to the centre is within 45 degrees of
// the facet's normal. So beyond a convex edge the facet's half-space does not bound the centre.
constexpr double kFaces = 0.70710678118654752;

// A square between four neighbouring voxels: `corner`, and one step along each of two axes.
struct Square {
  std::array<voxel::VoxelId, 4> voxels{};  // in a ring
  bool filled = false;
};

Square square_at(const voxel::Lattice& lattice, voxel::VoxelId corner, int e, int f) noexcept {
  const voxel::VoxelId by_e = lattice.up(corner, e), by_f = lattice.up(corner, f);
  if (!lattice.filled(by_e) || !lattice.filled(by_f)) return {};
  const voxel::VoxelId far = lattice.up(by_e, f);
  return {{corner, by_e, far, by_f}, lattice.filled(far)};
}

// Is there a full cell next to the square, on its upper or lower side along axis d?
bool has_cell(const voxel::Lattice& lattice, const Square& square, int d, bool up) noexcept {
  for (const voxel::VoxelId v : square.voxels) {
    if (!lattice.filled(up ? lattice.up(v, d) : lattice.down(v, d))) return false;
  }
  return true;
}

// The longest link that limits allow (m).
double longest_link_m(const voxel::Lattice& lattice) noexcept {
  double most = 1.0;
  for (const voxel::LinkMaterial& m : lattice.materials())
    most = std::max(most, std::sqrt(m.stretch_max * m.stretch_max + 2.0 * m.shear * m.shear));
  return most * lattice.max_spacing_m();
}

// The half-space of one triangle, if the triangle faces the centre and is within `within` (m) of it. The
// tissue's surface lies `surface` (m) outside the triangle. `normal`: not of unit length, out of the tissue.
bool bound_of(const std::array<glm::dvec3, 3>& at, const glm::dvec3& normal, const glm::dvec3& centre,
              double within, double surface, voxel::ToolBound& bound) noexcept {
  const double length = glm::length(normal);
  if (length == 0.0) return false;
  const glm::dvec3 nearest = polygon::closest_point_on_triangle(centre, at[0], at[1], at[2]);
  const glm::dvec3 away = centre - nearest;
  const double distance = glm::length(away);
  if (distance > within) return false;
  bound.normal = normal / length;
  if (std::fabs(glm::dot(away, bound.normal)) < kFaces * distance) return false;
  bound.offset = glm::dot(bound.normal, at[0]) + surface;
  return true;
}

// Is the point (body frame) in a full cell of the tissue as it is now? Valid where tissue is nearly at rest:
// the displacement is taken from the voxel nearest to the point at rest.
bool in_resting_tissue(const voxel::SoftObject& object, const glm::dvec3& point) noexcept {
  const voxel::Lattice& lattice = object.lattice();
  const glm::dvec3 at = point / lattice.spacing_m();
  const auto inside = [&](const glm::dvec3& p) {
    for (int d = 0; d < 3; ++d) {
      if (!(p[d] >= 0.0 && p[d] < lattice.grid().dims[static_cast<std::size_t>(d)] - 1)) return false;
    }
    return true;
  };
  if (!inside(at)) return false;
  const glm::ivec3 nearest(glm::round(at));
  const voxel::VoxelId v = lattice.at(nearest.x, nearest.y, nearest.z);
  if (!lattice.filled(v)) return false;
  const glm::dvec3 rest = at - object.displacement(v) / lattice.spacing_m();
  if (!inside(rest)) return false;
  const glm::ivec3 cell(glm::floor(rest));
  for (int corner = 0; corner < 8; ++corner) {
    if (!lattice.filled(
            lattice.at(cell.x + (corner & 1), cell.y + ((corner >> 1) & 1), cell.z + (corner >> 2))))
      return false;
  }
  return true;
}

}  // namespace

std::size_t facet_bounds(const voxel::SoftObject& object, const voxel::ToolInBody& tool, double within,
                         std::span<voxel::ToolBound> out) noexcept {
  // A punch needs no facets. The voxels under its flat face stop it at the same distance.
  if (tool.shape == voxel::ToolInBody::Shape::punch) return 0;
  const voxel::Lattice& lattice = object.lattice();
  // The surface of tissue is half a spacing outside its outermost voxels.
  const double surface = object.voxel_radius(), reach = within + surface;
  // The line from the centre to a triangle's nearest point is perpendicular to the triangle's plane or to a
  // side, or ends at a corner. The nearest point is at most (longest side)/√3 from the nearest corner. The
  // longest side is the diagonal of a square, at most two links long.
  const double near = std::hypot(reach, 2.0 / std::numbers::sqrt3 * longest_link_m(lattice));
  std::size_t count = 0;
  const auto add = [&](const voxel::ToolBound& bound) {
    const auto known = [&](const voxel::ToolBound& b) {
      return b.normal == bound.normal && b.offset == bound.offset;
    };
    if (count < out.size() && std::none_of(out.begin(), out.begin() + static_cast<long>(count), known))
      out[count++] = bound;
  };
  for (const voxel::VoxelId v : object.touched()) {
    const glm::dvec3 from = object.position(v) - tool.centre;
    if (glm::dot(from, from) > near * near) continue;
    // Visits every square that has this voxel as one of its corners. The other corners need not be listed.
    for (int n = 0; n < 12; ++n) {
      const int d = n / 4, e = (d + 1) % 3, f = (d + 2) % 3;
      voxel::VoxelId corner = v;
      if ((n & 1) != 0) corner = lattice.down(corner, e);
      if ((n & 2) != 0) corner = lattice.down(corner, f);
      if (!lattice.filled(corner)) continue;
      const Square square = square_at(lattice, corner, e, f);
      if (!square.filled) continue;
      const bool above = has_cell(lattice, square, d, true), below = has_cell(lattice, square, d, false);
      if (above == below) continue;
      std::array<glm::dvec3, 4> p;
      for (std::size_t i = 0; i < 4; ++i) p[i] = object.position(square.voxels[i]);
      for (const std::array<std::size_t, 3> corners : {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 3}}) {
        const std::array<glm::dvec3, 3> at{p[corners[0]], p[corners[1]], p[corners[2]]};
        // The ring turns about +d by the right-hand rule, so `up` points along +d.
        const glm::dvec3 up = glm::cross(at[1] - at[0], at[2] - at[0]);
        voxel::ToolBound bound;
        if (bound_of(at, below ? up : -up, tool.centre, reach, surface, bound)) add(bound);
      }
    }
  }
  return count;
}

void flag_lost_tool(const World& world, WorldState& state) noexcept {
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.reactions[o].pressed > 0) continue;
    const auto& pose = world.soft[o].pose;
    if (in_resting_tissue(*state.soft[o], glm::inverse(pose.rotation) * (state.proxy_m - pose.origin)))
      state.faults |= fault_tool_in_tissue;
  }
}

}  // namespace hybrid
