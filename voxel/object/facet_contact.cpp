// SPDX-License-Identifier: GPL-3.0-or-later
// Search for facets, and the steps of the pair solver.
#include "voxel/object/facet_contact.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace voxel {
namespace {

// Least length of the difference of the two outward normals. If it is shorter, the surfaces face the same
// way.
constexpr double kLeastSide = 0.1;
// Least component of a facet's unit normal along the axis. A steeper facet is pressed as if it were level.
constexpr double kLeastAlong = 0.3;
// Fraction of the touching distance. A voxel over no facet is past the edge of the surface if the surface's
// nearest voxel is further away than this across the axis.
constexpr double kBeside = 0.75;
constexpr double kPushed = 1e-6;  // fraction of the touching distance; less is rounding
constexpr double kParted = 0.01;  // fraction of the touching distance; less overlap is left to the next tick
// kHollow: fraction of the touching distance. A surface has a hollow if the place under the voxel is deeper
// than the middle of the other facet by at least this. kFarBeside: barycentric distance beside a facet at
// which a voxel may still touch it.
constexpr double kHollow = 0.005, kFarBeside = 0.5;
constexpr double kNormalTurn = 0.01;  // fraction of the way to the facet's normal that the force direction
                                      // turns at each update of the facet
constexpr int kSteps = 4;             // steps over the surface in search of the facet
constexpr double kInside = -1e-9;     // barycentric; less is outside
constexpr VoxelId kNone = std::numeric_limits<VoxelId>::max();

struct End {
  glm::dvec3 u;           // displacement at equilibrium with links, dependents and the other pairs
  glm::dvec3 compliance;  // per body axis (m/N); 0 at an anchor
};

glm::dvec3 to_scene(const PosedObject& o, const glm::dvec3& in_body) noexcept {
  return o.pose.origin + o.pose.rotation * in_body;
}
glm::dvec3 to_body(const PosedObject& o, const glm::dvec3& in_scene) noexcept {
  return glm::conjugate(o.pose.rotation) * (in_scene - o.pose.origin);
}
glm::dvec3 scene_position(const PosedObject& o, VoxelId v) noexcept {
  return to_scene(o, o.object.position(v));
}

// Compliance per body axis (m/N) of a voxel with its dependents; 0 at an anchor.
glm::dvec3 with_dependents(const glm::dvec3& own, const ContactLoad& dependents) noexcept {
  glm::dvec3 w = own;
  for (int axis = 0; axis < 3; ++axis) {
    if (dependents.stiffness_N_per_m[axis] > 0.0) w[axis] = 1.0 / dependents.stiffness_N_per_m[axis];
  }
  return w;
}

glm::dvec3 compliance_of(const PosedObject& o, VoxelId v, std::uint32_t number) noexcept {
  return with_dependents(o.object.compliance(v), o.object.dependents_of_pair(number));
}

End end_of(const PosedObject& o, VoxelId v, std::uint32_t number) noexcept {
  const glm::dvec3 own = o.object.compliance(v);
  const ContactLoad dependents = o.object.dependents_of_pair(number);
  const glm::dvec3 w = with_dependents(own, dependents);
  glm::dvec3 u = o.object.unconstrained_minimum(v);
  for (int axis = 0; axis < 3; ++axis) {
    if (!(dependents.stiffness_N_per_m[axis] > 0.0)) continue;
    const double now = o.object.state().at(v)[axis];
    u[axis] = now + w[axis] * ((u[axis] - now) / own[axis] + dependents.force_N[axis]);
  }
  return {u + w * o.object.pair_load(number), w};
}

// Motion along `way` per unit of force along it (body frame, m/N).
double yielding(const glm::dvec3& compliance, const glm::dvec3& way) noexcept {
  return glm::dot(way, compliance * way);
}

// A surface, given as a height along one axis of its lattice over the other two axes.
struct Surface {
  const SoftObject& object;
  int axis;
  bool upwards;

  [[nodiscard]] int across(int n) const { return (axis + 1 + n) % 3; }
  [[nodiscard]] VoxelId outer(VoxelId v) const {
    return upwards ? object.lattice().up(v, axis) : object.lattice().down(v, axis);
  }
  [[nodiscard]] VoxelId inner(VoxelId v) const {
    return upwards ? object.lattice().down(v, axis) : object.lattice().up(v, axis);
  }
  [[nodiscard]] bool is_top(VoxelId v) const {
    return object.lattice().filled(v) && !object.lattice().filled(outer(v));
  }
  // The neighbour on the surface, at most one step of the lattice higher or lower; kNone if there is none.
  [[nodiscard]] VoxelId beside(VoxelId v, int n, bool up) const {
    if (v == kNone) return kNone;
    const VoxelId level = up ? object.lattice().up(v, across(n)) : object.lattice().down(v, across(n));
    for (const VoxelId w : {level, outer(level), inner(level)}) {
      if (is_top(w)) return w;
    }
    return kNone;
  }
  [[nodiscard]] glm::dvec2 flat(const glm::dvec3& p) const { return {p[across(0)], p[across(1)]}; }
};

double cross(const glm::dvec2& a, const glm::dvec2& b) noexcept {
  return a.x * b.y - a.y * b.x;
}

// Barycentric coordinates of p in a triangle; false if p is outside, or the triangle is degenerate.
bool shares(const std::array<glm::dvec2, 3>& at, const glm::dvec2& p, std::array<double, 3>& out) noexcept {
  const double area = cross(at[1] - at[0], at[2] - at[0]);
  if (area == 0.0) return false;
  out[1] = cross(p - at[0], at[2] - at[0]) / area;
  out[2] = cross(at[1] - at[0], p - at[0]) / area;
  out[0] = 1.0 - out[1] - out[2];
  return out[0] >= kInside && out[1] >= kInside && out[2] >= kInside;
}

void set_facet(const SoftObject& object, const std::array<VoxelId, 3>& facet, PressedPair& pair) noexcept {
  if (facet == pair.facet) return;  // never true for the initial facet {0, 0, 0}: 0 is no surface voxel
  pair.facet = facet;
  for (std::size_t i = 0; i < 3; ++i) pair.number[i] = object.surface_number(facet[i]);
}

// Finds the facet under p among those around a surface voxel. Squares are split along the diagonal from the
// lower to the upper corner.
bool facet_round(const Surface& surface, VoxelId v, const glm::dvec3& p, PressedPair& pair) noexcept {
  const glm::dvec2 flat = surface.flat(p), from = flat - surface.flat(surface.object.position(v));
  for (int n = 0; n < 4; ++n) {
    // the most likely square comes first
    const bool up0 = (from.x >= 0.0) != ((n & 1) != 0), up1 = (from.y >= 0.0) != ((n & 2) != 0);
    VoxelId corner = v;
    if (!up0) corner = surface.beside(corner, 0, false);
    if (!up1) corner = surface.beside(corner, 1, false);
    const VoxelId along0 = surface.beside(corner, 0, true), along1 = surface.beside(corner, 1, true);
    const VoxelId far_corner = surface.beside(along0, 1, true);
    if (corner == kNone || far_corner == kNone) continue;
    for (const VoxelId third : {along0, along1}) {
      if (third == kNone) continue;
      const std::array<VoxelId, 3> voxels{corner, third, far_corner};
      std::array<glm::dvec2, 3> at;
      for (std::size_t i = 0; i < 3; ++i) at[i] = surface.flat(surface.object.position(voxels[i]));
      if (!shares(at, flat, pair.share)) continue;
      set_facet(surface.object, voxels, pair);
      return true;
    }
  }
  return false;
}

// Returns the size of the component of a triangle's unit normal along the axis. `out`: the normal divided by
// that component; for a steep triangle, the direction of the axis.
double normal_of(const std::array<glm::dvec3, 3>& at, int axis, bool inwards_up, glm::dvec3& out) noexcept {
  const glm::dvec3 n = glm::cross(at[1] - at[0], at[2] - at[0]);
  const double length = glm::length(n), along = length > 0.0 ? std::fabs(n[axis]) / length : 0.0;
  out = glm::dvec3(0.0);
  out[axis] = inwards_up ? 1.0 : -1.0;
  if (along >= kLeastAlong) out = n / (inwards_up ? n[axis] : -n[axis]);
  return along;
}

glm::dvec3 middle(const PosedObject& b, const PressedPair& pair) noexcept {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < 3; ++i) sum += pair.share[i] * scene_position(b, pair.facet[i]);
  return sum;
}

// Sets the members that overlap_of() reads.
void set_across(const PosedObject& a, const PosedObject& b, PressedPair& pair,
                const glm::dvec3& across) noexcept {
  pair.across = across;
  pair.across_a = glm::conjugate(a.pose.rotation) * across;
  pair.across_b = glm::conjugate(b.pose.rotation) * across;
  pair.at_rest_m = pair.reach_m - glm::dot(b.pose.origin - a.pose.origin, across) +
                   glm::dot(a.object.lattice().rest(pair.a), pair.across_a);
  for (std::size_t i = 0; i < 3; ++i) {
    if (pair.share[i] > 0.0)
      pair.at_rest_m -= pair.share[i] * glm::dot(b.object.lattice().rest(pair.facet[i]), pair.across_b);
  }
}

double overlap_of(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept {
  double overlap = pair.at_rest_m + glm::dot(a.object.state().at(pair.a), pair.across_a);
  for (std::size_t i = 0; i < 3; ++i) {
    if (pair.share[i] > 0.0)
      overlap -= pair.share[i] * glm::dot(b.object.state().at(pair.facet[i]), pair.across_b);
  }
  return overlap;
}

template <class Visit>
void for_corners(const PressedPair& pair, const Visit& visit) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    if (pair.share[i] > 0.0) visit(pair.facet[i], pair.share[i], i);
  }
}

double yielding_of_facet(const PosedObject& b, const PressedPair& pair) noexcept {
  double sum = 0.0;
  for_corners(pair, [&](VoxelId v, double share, std::size_t i) {
    sum += share * share * yielding(compliance_of(b, v, pair.number[i]), pair.across_b);
  });
  return sum;
}

void press_more(const PosedObject& a, const PosedObject& b, PressedPair& pair, double more_N) noexcept {
  pair.force_N += more_N * pair.across;
  a.object.add_pair_load(pair.number_a, -more_N * pair.across_a);
  for_corners(pair, [&](VoxelId, double share, std::size_t i) {
    b.object.add_pair_load(pair.number[i], share * more_N * pair.across_b);
  });
}

void add_loads(const PosedObject& a, const PosedObject& b, const PressedPair& pair,
               const glm::dvec3& force_N) noexcept {
  a.object.add_pair_load(pair.number_a, -(glm::conjugate(a.pose.rotation) * force_N));
  const glm::dvec3 in_b = glm::conjugate(b.pose.rotation) * force_N;
  for_corners(pair, [&](VoxelId, double share, std::size_t i) {
    b.object.add_pair_load(pair.number[i], share * in_b);
  });
}

// If the links of one object left overlap, the other object moves by this overlap. The pair's force grows
// accordingly.
void push_the_rest(const PosedObject& a, const PosedObject& b, PressedPair& pair, const End& first,
                   const std::array<End, 3>& corners, double yielding_a, double yielding_b) noexcept {
  const double least = kPushed * pair.reach_m;
  const double left = overlap_of(a, b, pair);
  if (left <= least) return;
  if (yielding_b > 0.0) {
    for_corners(pair, [&](VoxelId v, double share, std::size_t i) {
      const glm::dvec3 way = corners[i].compliance * pair.across_b;
      b.object.move(v, b.object.state().at(v) + (share * left / yielding_b) * way);
    });
    press_more(a, b, pair, std::max(left - overlap_of(a, b, pair), 0.0) / yielding_b);
  }
  const double rest = overlap_of(a, b, pair);
  if (rest > least && yielding_a > 0.0) {
    const glm::dvec3 way = first.compliance * pair.across_a;
    a.object.move(pair.a, a.object.state().at(pair.a) - (rest / yielding_a) * way);
    press_more(a, b, pair, std::max(rest - overlap_of(a, b, pair), 0.0) / yielding_a);
  }
}

bool is_facet(const PressedPair& pair) noexcept {
  return pair.over && pair.facet[0] != pair.facet[1];
}

// Barycentric coordinates of the voxel in its facet; false if it is over no facet, or over another one.
bool shares_of(const PosedObject& a, const PosedObject& b, const PressedPair& pair,
               std::array<double, 3>& out) noexcept {
  if (!is_facet(pair)) return false;
  const Surface surface{b.object, pair.axis, pair.upwards};
  std::array<glm::dvec2, 3> at;
  for (std::size_t i = 0; i < 3; ++i) at[i] = surface.flat(b.object.position(pair.facet[i]));
  return shares(at, surface.flat(to_body(b, scene_position(a, pair.a))), out);
}

// With bricks a facet that is pushed sideways also moves up and down, and its tilt may reverse. With links at
// their limits in both objects, a force along the facet's normal would flip between voxels in each tick. So
// the force direction follows the facet's normal slowly. At rest the direction is the normal, and the gap
// along the axis does not depend on the direction. Links alone couple no axes and need no such damping.
glm::dvec3 turned(const PosedObject& a, const PosedObject& b, const PressedPair& pair,
                  const glm::dvec3& across) noexcept {
  if (!a.object.lattice().has_bricks() && !b.object.lattice().has_bricks()) return across;
  return glm::dot(pair.across, across) > 0.0 ? glm::mix(pair.across, across, kNormalTurn) : across;
}

// Sets the members that follow from the facet and the shares in the current state.
void lie_on_facet(const PosedObject& a, const PosedObject& b, PressedPair& pair) noexcept {
  std::array<glm::dvec3, 3> at, rest;
  for (std::size_t i = 0; i < 3; ++i) {
    at[i] = b.object.position(pair.facet[i]);
    rest[i] = b.object.lattice().rest(pair.facet[i]);
    pair.share[i] = std::clamp(pair.share[i], 0.0, 1.0);
  }
  // Two oblique surfaces in contact are further apart along the axis than along their normal.
  const double apart = a.object.voxel_radius() + b.object.voxel_radius();
  glm::dvec3 at_rest, across(0.0);
  pair.reach_m = apart / std::max(normal_of(rest, pair.axis, !pair.upwards, at_rest), kLeastAlong);
  normal_of(at, pair.axis, !pair.upwards, across);
  const auto most = std::max_element(pair.share.begin(), pair.share.end());
  pair.b = pair.facet[static_cast<std::size_t>(most - pair.share.begin())];
  set_across(a, b, pair, turned(a, b, pair, b.pose.rotation * across));
}

}  // namespace

PressedPair pair_of(const PosedObject& a, VoxelId in_a, const PosedObject& b, VoxelId in_b) noexcept {
  PressedPair pair{.a = in_a, .b = in_b, .number_a = a.object.surface_number(in_a)};
  const glm::dvec3 side =
      a.pose.rotation * a.object.lattice().outward(in_a) - b.pose.rotation * b.object.lattice().outward(in_b);
  const double length = glm::length(side);
  if (!(length > kLeastSide)) return pair;
  const glm::dvec3 out = glm::inverse(b.pose.rotation) * (-side / length);
  double most = kLeastAlong;
  for (int axis = 0; axis < 3; ++axis) {
    const bool upwards = out[axis] > 0.0;
    if (std::fabs(out[axis]) <= most || !Surface{b.object, axis, upwards}.is_top(in_b)) continue;
    most = std::fabs(out[axis]);
    pair.axis = axis;
    pair.upwards = upwards;
    pair.side = side / length;
  }
  if (pair.side != glm::dvec3(0.0)) find_facet(a, b, pair);
  return pair;
}

void find_facet(const PosedObject& a, const PosedObject& b, PressedPair& pair) noexcept {
  const Surface surface{b.object, pair.axis, pair.upwards};
  const glm::dvec3 p = to_body(b, scene_position(a, pair.a));
  const glm::dvec2 flat = surface.flat(p);
  const auto away = [&](VoxelId v) {
    const glm::dvec2 d = surface.flat(b.object.position(v)) - flat;
    return glm::dot(d, d);
  };
  double nearest = away(pair.b);
  bool found = false;
  for (int step = 0; step < kSteps && !found; ++step) {
    found = facet_round(surface, pair.b, p, pair);
    if (found) break;
    VoxelId next = pair.b;
    for (int n = 0; n < 2; ++n) {
      for (const bool up : {false, true}) {
        const VoxelId w = surface.beside(pair.b, n, up);
        if (w == kNone || away(w) >= nearest) continue;
        nearest = away(w);
        next = w;
      }
    }
    if (next == pair.b) break;
    pair.b = next;
  }
  const double apart = a.object.voxel_radius() + b.object.voxel_radius();
  pair.over = found || nearest <= kBeside * kBeside * apart * apart;
  if (found) {
    lie_on_facet(a, b, pair);
    return;
  }
  pair.reach_m = apart;
  set_facet(b.object, {pair.b, pair.b, pair.b}, pair);
  pair.share = {1.0, 0.0, 0.0};
  glm::dvec3 across(0.0);
  across[pair.axis] = pair.upwards ? -1.0 : 1.0;
  set_across(a, b, pair, b.pose.rotation * across);
}

bool left_facet(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept {
  std::array<double, 3> share;
  return !shares_of(a, b, pair, share);
}

bool lies_beside(const PosedObject& a, const PosedObject& b, const PressedPair& pair,
                 PressedPair& beside) noexcept {
  if (!is_facet(pair) || !is_facet(beside) || beside.facet == pair.facet) return false;
  glm::dvec3 centre(0.0);
  for (const VoxelId v : beside.facet) centre += scene_position(b, v) / 3.0;
  if (glm::dot(middle(b, pair) - centre, pair.across) < kHollow * pair.reach_m) return false;
  shares_of(a, b, beside, beside.share);
  double sum = 0.0;
  for (double& share : beside.share) {
    if (!(share > -kFarBeside)) return false;
    share = std::max(share, 0.0);
    sum += share;
  }
  for (double& share : beside.share) share /= sum;
  lie_on_facet(a, b, beside);
  return gap_of_pair(a, b, beside) >= gap_of_pair(a, b, pair) - kPushed * pair.reach_m;
}

double gap_of_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept {
  return pair.over ? -overlap_of(a, b, pair) : std::numeric_limits<double>::infinity();
}

void claim_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept {
  a.object.claim(pair.a);
  for (const VoxelId v : pair.facet) b.object.claim(v);
}

void release_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept {
  a.object.release(pair.a);
  for (const VoxelId v : pair.facet) b.object.release(v);
}

void clear_pair_load(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept {
  a.object.clear_pair_load(pair.number_a);
  for (const std::uint32_t number : pair.number) b.object.clear_pair_load(number);
}

void load_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept {
  add_loads(a, b, pair, pair.force_N);
}

double relax_pair(const PosedObject& a, const PosedObject& b, PressedPair& pair) noexcept {
  add_loads(a, b, pair, -pair.force_N);  // the pair's own force is found anew
  pair.force_N = glm::dvec3(0.0);
  End first = end_of(a, pair.a, pair.number_a);
  std::array<End, 3> corners;
  double overlap = pair.at_rest_m + glm::dot(first.u, pair.across_a), of_facet = 0.0;
  for_corners(pair, [&](VoxelId v, double share, std::size_t i) {
    corners[i] = end_of(b, v, pair.number[i]);
    overlap -= share * glm::dot(corners[i].u, pair.across_b);
    of_facet += share * share * yielding(corners[i].compliance, pair.across_b);
  });
  const double of_first = yielding(first.compliance, pair.across_a);
  if (pair.over && overlap > 0.0 && of_first + of_facet > 0.0) {
    const double force = overlap / (of_first + of_facet);  // N, equal and opposite
    first.u -= force * (first.compliance * pair.across_a);
    for_corners(pair, [&](VoxelId, double share, std::size_t i) {
      corners[i].u += share * force * (corners[i].compliance * pair.across_b);
    });
    press_more(a, b, pair, force);
  }
  a.object.move(pair.a, first.u);
  for_corners(pair, [&](VoxelId v, double, std::size_t i) { b.object.move(v, corners[i].u); });
  // Needed even if the force is 0: links at their limits may keep the voxels from separating
  if (pair.over) push_the_rest(a, b, pair, first, corners, of_first, of_facet);
  return gap_of_pair(a, b, pair);
}

bool part_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair, GiveWay who) noexcept {
  if (!pair.over) return false;
  const double overlap = overlap_of(a, b, pair);
  if (overlap <= kParted * pair.reach_m) return false;
  const double of_first = yielding(compliance_of(a, pair.a, pair.number_a), pair.across_a);
  const double of_facet = yielding_of_facet(b, pair);
  const double first = who == GiveWay::second ? 0.0 : of_first;
  const double second = who == GiveWay::first ? 0.0 : of_facet;
  if (!(first + second > 0.0)) return true;
  // Voxel and facet part along the axis, so that the voxel stays over the facet. Along the normal the voxel
  // would end up over the next facet, and inside of it.
  glm::dvec3 along(0.0);
  along[pair.axis] = pair.upwards ? -overlap : overlap;
  const glm::dvec3 in_scene = b.pose.rotation * along;
  if (first > 0.0)
    a.object.drag(pair.a, glm::conjugate(a.pose.rotation) * in_scene * (-first / (first + second)));
  if (second > 0.0) {
    double squares = 0.0;
    for (const double share : pair.share) squares += share * share;
    for_corners(pair, [&](VoxelId v, double share, std::size_t) {
      b.object.drag(v, along * (share / squares * second / (first + second)));
    });
  }
  return true;
}

}  // namespace voxel
