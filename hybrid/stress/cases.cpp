// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stress/cases.h"

#include <fmt/format.h>

#include <stdexcept>

namespace hybrid {
namespace {

constexpr double kThousandKilometres = 1e6;  // m

bool has_soft(SceneKind kind) {
  return kind != SceneKind::rigid;
}
bool has_rigid(SceneKind kind) {
  return kind != SceneKind::soft;
}

class Cases {
 public:
  void add(const SceneSetting& scene, Motion motion, std::string setting) {
    list.push_back({scene, motion, std::move(setting)});
  }
  void add_same(const SceneSetting& scene, const SceneSetting& like, double same_N, std::string setting) {
    list.push_back({scene, Motion::path, std::move(setting), like, same_N});
  }
  std::vector<DriveCase> list;
};

// Crosses all values of stiffness, dt and motion with one another.
void cross_loops(Cases& cases, SceneKind kind) {
  for (const double stiffness : {1.0, 1e3, 25e3, 1e6}) {
    for (const double rate : {10e3, 1e3, 100.0}) {
      for (const Motion motion : kMotions) {
        SceneSetting s;
        s.kind = kind;
        s.stiffness_N_per_m = stiffness;
        s.rate_hz = rate;
        cases.add(s, motion, fmt::format("stiffness {:g} N/m, dt {:g} ms", stiffness, 1e3 / rate));
      }
    }
  }
}

// Loops with the passivity controller on.
void passive_loops(Cases& cases, SceneKind kind) {
  for (const double stiffness : {1e3, 25e3, 1e6}) {
    SceneSetting s;
    s.kind = kind;
    s.stiffness_N_per_m = stiffness;
    s.passivity = true;
    for (const Motion motion : {Motion::path, Motion::stalls, Motion::not_numbers})
      cases.add(s, motion, fmt::format("stiffness {:g} N/m, passivity control", stiffness));
  }
}

void materials(Cases& cases, SceneKind kind) {
  if (!has_soft(kind)) return;
  SceneSetting base;
  base.kind = kind;
  for (const Motion motion : {Motion::path, Motion::jumps}) {
    for (const double young : {1e-3, 1.0, 1e6, 1e9, 1e12}) {
      SceneSetting s = base;
      s.young_Pa = young;
      cases.add(s, motion, fmt::format("Young's modulus {:g} Pa", young));
    }
    SceneSetting s = base;
    s.stretch_min = s.stretch_max = 1.0;
    s.shear = 0.0;
    cases.add(s, motion, "no slack at all");
    s.shear = 0.6;
    cases.add(s, motion, "no slack along, some across");
    s.stretch_min = 0.99;
    s.stretch_max = 1.01;
    cases.add(s, motion, "a hundredth of slack along, some across");
    s.stretch_min = 0.4;
    s.stretch_max = 1.6;
    s.shear = 0.0;
    cases.add(s, motion, "no slack across, some along");
    s.shear = 0.01;
    cases.add(s, motion, "a hundredth of slack across, some along");
    s.stretch_min = 1e-3;
    s.stretch_max = 1e3;
    s.shear = 1e3;
    cases.add(s, motion, "a thousandfold slack");
  }
}

void sizes(Cases& cases, SceneKind kind) {
  for (const double spacing : {1e-6, 1e-4, 0.1, 10.0}) {
    SceneSetting s;
    s.kind = kind;
    s.unit_m = 0.5 * spacing;
    s.ideal_device = true;
    for (const Motion motion : {Motion::path, Motion::through})
      cases.add(s, motion, fmt::format("a spacing of {:g} m, a scene of {:g} m", spacing, 20.0 * spacing));
  }
  SceneSetting s;
  s.kind = kind;
  s.unit_m = 0.5e-6;
  cases.add(s, Motion::path, "a spacing of 1e-06 m under an encoder step of 3e-05 m");
  for (const BlockShape shape : {BlockShape::sheet, BlockShape::voxel}) {
    SceneSetting thin;
    thin.kind = kind;
    thin.shape = shape;
    for (const Motion motion : {Motion::path, Motion::jumps})
      cases.add(thin, motion,
                shape == BlockShape::sheet ? "a sheet one voxel thick" : "an object of one voxel");
  }
}

// Far away every coordinate is rounded to 1e-10 m, and the coupling turns this into a force.
void far_away(Cases& cases, SceneKind kind) {
  SceneSetting here;
  here.kind = kind;
  here.ideal_device = true;
  SceneSetting there = here;
  there.origin_m = {kThousandKilometres, -kThousandKilometres, kThousandKilometres};
  cases.add_same(there, here, 1e-3, "the scene 1,000 km from the origin");
  there.ideal_device = false;
  for (const Motion motion : {Motion::path, Motion::not_numbers, Motion::jumps, Motion::through})
    cases.add(there, motion, "the scene 1,000 km from the origin, a PHANToM");
}

void meshes(Cases& cases, SceneKind kind, bool quick) {
  if (!has_rigid(kind)) return;
  SceneSetting plain;
  plain.kind = kind;
  plain.ideal_device = true;
  struct Flaw {
    MeshFlaw flaw;
    const char* text;
  };
  for (const Flaw& f : {Flaw{MeshFlaw::slivers, "slivers: a third of all triangles 1e-7 as high as long"},
                        Flaw{MeshFlaw::zero_area, "three triangles without area to each with one"},
                        Flaw{MeshFlaw::duplicates, "every vertex three times and more"},
                        Flaw{MeshFlaw::coincident, "a million coincident triangles"}}) {
    if (quick && f.flaw == MeshFlaw::coincident) continue;
    SceneSetting s = plain;
    s.flaw = f.flaw;
    cases.add_same(s, plain, 1e-6, f.text);
    if (f.flaw != MeshFlaw::coincident) cases.add(s, Motion::jumps, f.text);
  }
  SceneSetting lines = plain;
  lines.flaw = MeshFlaw::all_flat;
  for (const Motion motion : {Motion::path, Motion::jumps})
    cases.add(lines, motion, "no triangle with an area at all");
}

// A mixed scene is left out: carving 134 million voxels would take a quarter of an hour and would show
// nothing new.
void large(Cases& cases, SceneKind kind) {
  if (kind == SceneKind::mixed) return;
  SceneSetting s;
  s.kind = kind;
  s.ideal_device = true;
  s.shape = BlockShape::large;
  cases.add(s, Motion::path,
            has_soft(kind) ? "an object of 512 x 512 x 512 voxels" : "a box of 512 x 512 squares a face");
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  if (at == std::string::npos) throw std::logic_error("no \"" + what + "\" in the scene");
  const std::size_t end = text.find('\n', at);
  return text.replace(at, end - at, by);
}

}  // namespace

std::vector<DriveCase> drive_cases(bool quick) {
  Cases cases;
  for (const SceneKind kind : kSceneKinds) {
    if (!quick) cross_loops(cases, kind);
    passive_loops(cases, kind);
    materials(cases, kind);
    sizes(cases, kind);
    far_away(cases, kind);
    meshes(cases, kind, quick);
  }
  for (const SceneKind kind : kSceneKinds) {
    if (!quick) large(cases, kind);  // comes last, because it takes long
  }
  return std::move(cases.list);
}

std::vector<RefusedCase> refused_cases() {
  std::vector<RefusedCase> cases;
  for (const SceneKind kind : kSceneKinds) {
    SceneSetting base;
    base.kind = kind;
    const std::string text = scene_text(base);
    const auto add = [&](const char* setting, const std::string& line, const std::string& by) {
      cases.push_back({kind, setting, replaced(text, line, by)});
    };
    add("a stiffness of 0", "stiffness = ", "stiffness = 0");
    add("a stiffness below 0", "stiffness = ", "stiffness = -1000");
    add("a stiffness that is no number", "stiffness = ", "stiffness = nan");
    add("an infinite stiffness", "stiffness = ", "stiffness = inf");
    add("a tool of no number", "radius = ", "radius = nan");
    add("a tool below 0", "radius = ", "radius = -1e-3");
    add("a rate of 0", "rate = ", "rate = 0");
    add("a rate of a gigahertz", "rate = ", "rate = 1e9");
    add("an object at no number", "position = ", "position = [nan, 0, 0]");
    add("an object beyond anything", "position = ", "position = [1e300, 0, 0]");
    add("a path at no speed", "speed = ", "speed = 0");
    add("a path that never ends", "speed = ", "speed = 1e-9");
    add("a path that begins inside",
        "points = ", kind == SceneKind::soft ? "points = []" : "points = [[0, 0, 0.014], [0, 0, 0.03]]");
    if (has_rigid(kind)) {
      add("a mesh that is not there", "mesh = \"ball.ply\"", "mesh = \"none.ply\"");
      add("a mesh of vertices that are no numbers", "mesh = \"ball.ply\"", "mesh = \"nan.ply\"");
      add("a mesh cut short", "mesh = \"ball.ply\"", "mesh = \"short.ply\"");
    }
    if (!has_soft(kind)) continue;
    add("min above max", "stretch = ", "stretch = [1.6, 0.4]");
    add("min above 1", "stretch = ", "stretch = [1.1, 1.6]");
    add("max below 1", "stretch = ", "stretch = [0.4, 0.9]");
    add("links that may vanish", "stretch = ", "stretch = [0, 1.6]");
    add("a slip below 0", "shear = ", "shear = -0.1");
    add("a Young's modulus of 0", "young = ", "young = 0");
    add("a spacing of 0", "spacing = ", "spacing = 0");
    add("a spacing larger than the object", "spacing = ", "spacing = 1");
    add("10,000 voxels along each axis", "spacing = ", "spacing = 2e-6");
    add("a tool that is a point", "radius = ", "radius = 0");
  }
  return cases;
}

}  // namespace hybrid
