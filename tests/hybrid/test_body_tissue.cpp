// SPDX-License-Identifier: GPL-3.0-or-later
// Bodies on a path beside tissue: it leaves their way and comes back, and nothing overlaps after any tick.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cfenv>
#include <csignal>
#include <execinfo.h>
#include <unistd.h>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <string>
#include <vector>

#include "arbitration_watch.h"
#include "polygon/mesh_file.h"
#include "polygon/primitives.h"
#include "polygon/signed_distance.h"
#include "touch.h"
#include "voxel/chainmail.h"

namespace {

using glm::dvec3;
using tests::Touch;

constexpr dvec3 kFarAway(0.0, 0.0, 0.2);
constexpr double kSpacing = 2e-3;

struct Shape {
  const char* name;
  std::string text;
  double lowest_mm;  // below its place
};

class BodyTissue : public tests::SceneFile {
 protected:
  static std::string head() {
    return "format = 1\n[tool]\nradius = 5\nstiffness = 1000\n" + tests::unlimited +
           "[material.gel]\nyoung = 5000\npoisson = 0.3\n";
  }
  // Its upper face is at z = 0.
  static std::string block() {
    return head() +
           "[[soft]]\nname = \"block\"\nformula = \"block\"\n"
           "size = [60, 60, 24]\nspacing = 2\nposition = [0, 0, -12]\nmaterial = \"gel\"\n" +
           tests::some_path;
  }
  // Straight down to `deep_mm` below where it touches, along by `along_mm`, where it stays, and up.
  static std::string pusher(const Shape& shape, double deep_mm, double along_mm, double speed_mm_per_s,
                            double stay_s = 0.0) {
    const double above = shape.lowest_mm + 3.0, below = shape.lowest_mm - deep_mm, from = -0.5 * along_mm;
    const auto at = [](double x, double z, const std::string& more = "") {
      return "[" + std::to_string(x) + ", 0.7, " + std::to_string(z) + more + "]";
    };
    return "[[rigid]]\nname = \"pusher\"\n" + shape.text + "position = " + at(from, above) +
           "\nmotion = \"path\"\n[rigid.path]\nkind = \"waypoints\"\nspeed = " +
           std::to_string(speed_mm_per_s) + "\npoints = [" + at(from, above) + ", " + at(from, below) + ", " +
           at(-from, below, stay_s > 0.0 ? ", " + std::to_string(stay_s) : "") + ", " + at(-from, above) +
           "]\n";
  }
  std::vector<Shape> shapes() const {
    polygon::save_ply(folder_ / "ball.ply", polygon::make_ball_mesh(7e-3, 3));
    return {
        {"ball", "primitive = \"ball\"\nradius = 8\n", 8.0},
        {"small ball", "primitive = \"ball\"\nradius = 2\n", 2.0},
        {"box", "primitive = \"box\"\nsize = [14, 10, 12]\n", 6.0},
        {"turned box", "primitive = \"box\"\nsize = [14, 10, 12]\nrotation = [40, 30, 10]\n", 10.5},
        {"capsule", "primitive = \"capsule\"\nradius = 5\nlength = 20\n", 15.0},
        {"lying capsule", "primitive = \"capsule\"\nradius = 5\nlength = 20\nrotation = [90, 0, 20]\n", 5.0},
        {"mesh", "mesh = \"ball.ply\"\nunit = \"m\"\n", 7.0}};
  }
};

const voxel::SoftObject& tissue(Touch& touch) {
  return *touch.state().soft[0];
}

// How deep the ball of a voxel is in a rigid object, at most (spacings): of the surface; of all.
struct Depths {
  double surface = 0.0, all = 0.0;
};
Depths deepest(Touch& touch, std::size_t rigid = 0) {
  const hybrid::BodyFrame& frame = touch.state().rigid[rigid].frame;
  const polygon::RigidSurface& surface = *touch.world().rigid[rigid].surface;
  const voxel::SoftObject& object = tissue(touch);
  const dvec3 low = surface.lower() - object.voxel_radius(), high = surface.upper() + object.voxel_radius();
  Depths worst;
  for (std::size_t i = 0; i < object.lattice().size(); ++i) {
    const auto v = static_cast<voxel::VoxelId>(i);
    if (!object.lattice().filled(v) || object.lattice().anchored(v)) continue;
    const dvec3 at = frame.to_body(touch.world().soft[0].to_scene(object.position(v)));
    if (glm::any(glm::lessThan(at, low)) || glm::any(glm::greaterThan(at, high))) continue;
    polygon::SignedDistance near;
    if (!polygon::signed_distance(surface, at, 0.02, dvec3(0.0), near)) continue;
    const double deep = (object.voxel_radius() - near.distance) / object.lattice().min_spacing_m();
    worst.all = std::max(worst.all, deep);
    if (object.surface_number(v) != voxel::SoftObject::kNoSurface) worst.surface = std::max(worst.surface, deep);
  }
  return worst;
}

double largest_displacement(Touch& touch) {
  double most = 0.0;
  for (const voxel::VoxelId v : tissue(touch).lattice().surface()) {
    const dvec3 u = tissue(touch).state().at(v);
    if (!tests::finite(u)) return 1e9;
    most = std::max(most, glm::length(u));
  }
  return most;
}

TEST_F(BodyTissue, DISABLED_Explore) {
  for (const Shape& shape : shapes()) {
    for (const double along : {0.0, 8.0})
    for (const double speed : {10.0, 50.0, 200.0, 1000.0}) {
      for (const bool apart : {false, true}) {
      Touch touch(load(block() + pusher(shape, 6.0, along, speed)), kFarAway, apart);
      Depths worst; double moved = 0.0, violated = 0.0, us = 0.0, most_us = 0.0;
      const int ticks = static_cast<int>((9.0 + along + 9.0) / speed * 1e3) + 20;
      const int every = std::max(1, ticks / 300);
      int when = 0;
      for (int n = 0; n < ticks; ++n) {
        const auto felt = touch.at(kFarAway);
        us += felt.tick_us; most_us = std::max(most_us, felt.tick_us);
        if (n % every != 0) continue;
        const Depths d = deepest(touch);
        if (d.surface > worst.surface) when = n;
        worst.surface = std::max(worst.surface, d.surface);
        worst.all = std::max(worst.all, d.all);
        moved = std::max(moved, largest_displacement(touch));
      }
          violated =
              std::max(violated, voxel::worst_violation(tissue(touch).lattice(), tissue(touch).state()));
      int n = 0;
      for (; n < 3000 && !tissue(touch).asleep(); ++n) touch.at(kFarAway);
      std::printf("%-14s along %g %6g mm/s %s: surface %.4f (tick %d of %d) all %.4f moved %.2f mm; links %.1e; back to %.2e after %d; us mean %.0f max %.0f; near %zu faults %u\n", shape.name, along, speed, apart ? "apart" : "tick ",
         worst.surface, when, ticks, worst.all, 1e3*moved, violated, 1e3*largest_displacement(touch), n, us / ticks, most_us, touch.state().beside_bodies[0].near.size(), touch.state().faults);
    }
    }
  }
}


TEST_F(BodyTissue, DISABLED_Squeezed) {
  for (const double along : {0.0, 10.0})
  for (const double deep : {7.0, 8.5})
  for (const Shape& shape : shapes()) {
    for (const double speed : {20.0, 200.0, 1000.0}) {
      for (const bool apart : {false, true}) {
      const std::string slab = head() + 
          "[[soft]]\nname = \"slab\"\nformula = \"block\"\n"
          "size = [60, 40, 8]\nspacing = 2\nposition = [0, 0, -4]\nmaterial = \"gel\"\n"
          "[soft.anchors]\nfaces = [\"-x\"]\nrigid_within = 0\n" +
          tests::some_path;
      const std::string plate =
          "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [80, 60, 6]\nposition = [0, 0, -12]\n";
      Touch touch(load(slab + pusher(shape, deep, along, speed) + plate), kFarAway, apart);
      double body = 0.0, bone = 0.0, moved = 0.0, us = 0.0, most_us = 0.0;
      int when = 0, when_bone = 0;
      const int ticks = static_cast<int>((3.0 + deep + 10.0 + 3.0 + deep) / speed * 1e3) + 300;
      for (int n = 0; n < ticks; ++n) {
        const auto felt = touch.at(kFarAway);
        us += felt.tick_us; most_us = std::max(most_us, felt.tick_us);
        if (n % std::max(1, ticks / 300) != 0) continue;
        const double a = deepest(touch, 0).surface, b = deepest(touch, 1).surface;
        if (a > body) body = a, when = n;
        if (b > bone) bone = b, when_bone = n;
        moved = std::max(moved, largest_displacement(touch));
      }
      const double violated = voxel::worst_violation(tissue(touch).lattice(), tissue(touch).state());
      int n = 0;
      for (; n < 3000 && !tissue(touch).asleep(); ++n) touch.at(kFarAway);
      if (largest_displacement(touch) > 1e-3) { int shown = 0; for (const voxel::VoxelId v : tissue(touch).lattice().surface()) { const dvec3 u = tissue(touch).state().at(v); if (glm::length(u) < 0.9 * largest_displacement(touch) || ++shown > 4) continue; const dvec3 r = 1e3 * touch.world().soft[0].to_scene(tissue(touch).lattice().rest(v)), p = r + 1e3 * u; const auto& o = tissue(touch).obstacles()[tissue(touch).surface_number(v)]; std::printf("   (%.1f %.1f %.1f) -> (%.1f %.1f %.1f) obstacle n (%.2f %.2f %.2f) slack %.3f moving %d\n", r.x, r.y, r.z, p.x, p.y, p.z, o.normal.x, o.normal.y, o.normal.z, 1e3*(glm::dot(dvec3(o.normal), u) - o.bound), o.moving); } }
      std::printf("%-14s along %g deep %g %6g mm/s %s: body %.4f (%d of %d) bone %.4f (%d) moved %.2f mm; links %.1e; back to %.2e after %d; us mean %.0f max %.0f; faults %u\n", shape.name, along, deep, speed, apart ? "apart" : "tick ",
         body, when, ticks, bone, when_bone, 1e3*moved, violated, 1e3*largest_displacement(touch), n, us / ticks, most_us, touch.state().faults);
      }
    }
  }
}

TEST_F(BodyTissue, DISABLED_Blows) {
      const std::string slab = head() + 
          "[[soft]]\nname = \"slab\"\nformula = \"block\"\n"
          "size = [60, 40, 8]\nspacing = 2\nposition = [0, 0, -4]\nmaterial = \"gel\"\n"
          "[soft.anchors]\nfaces = [\"-x\"]\nrigid_within = 0\n" +
          tests::some_path;
      const std::string plate =
          "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [80, 60, 6]\nposition = [0, 0, -12]\n";
      Touch touch(load(slab + pusher(shapes()[0], std::atof(getenv("DEEP")), 10.0, std::atof(getenv("SPEED")), 5.0) + plate), kFarAway, false);
      std::signal(SIGFPE, [](int) { void* a[40]; const int c = backtrace(a, 40); backtrace_symbols_fd(a, c, 1); _exit(1); });
      for (int n = 0; n < 2000; ++n) {
        if (n == 100000) feenableexcept(FE_INVALID | FE_OVERFLOW | FE_DIVBYZERO);
        touch.at(kFarAway);
        const double d = largest_displacement(touch);
        if (n % 20 == 0 || d > 0.03) {
        }
        if (n > 340 && n % 2 == 0) { auto& mg = const_cast<voxel::Relaxation&>(tissue(touch).relaxation()).multigrid();
        std::printf("%d:", n);
        for (int l = 1; l < mg.levels(); ++l) { double most = 0; voxel::RowId w = 0; for (voxel::RowId r = 0; r < mg.grid(l).rows(); ++r) { const double m = mg.untold(l, r); if (m > most) most = m, w = r; } const auto c = mg.grid(l).row_coordinates(w); std::printf("  %d %.2e (%d,%d,%d of %d,%d,%d)", l, most, c[0], c[1], c[2], mg.grid(l).dims[0], mg.grid(l).dims[1], mg.grid(l).dims[2]); }
        std::printf("\n");
        }
        if (false) {
        double coarse[9] = {};
        std::printf("%d: moved %.3f mm, body %.4f bone %.4f, energy %.4g residual %.3g asleep %d near %zu\n", n, 1e3 * d, deepest(touch,0).surface, deepest(touch,1).surface, tissue(touch).energy_J(), tissue(touch).residual_N(), tissue(touch).asleep(), touch.state().beside_bodies[0].near.size());
        (void)coarse;
        }
        if (d > 1.0) break;
      }
}
}  // namespace
