// SPDX-License-Identifier: GPL-3.0-or-later
// The thesis's Figures 18 to 22 as scenarios: a block or a sheet, a tool that does something to it, and a
// count of what should not happen. Each runs with the thesis's own algorithm (ClassicTissue) and with the
// product's (SoftTissue); both are driven through the same small interface.
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <memory>
#include <numbers>
#include <vector>

#include "tests/voxel/lattice_scenes.h"
#include "voxel/classic.h"
#include "voxel/soft_object.h"

namespace tests {

struct Felt {
  bool contact = false;
  glm::dvec3 force_N{0.0};
};

// What one tick of a tool at `centre` (volume frame) is: contact, force, and a share of relaxation.
class Tissue {
 public:
  Tissue() = default;
  Tissue(const Tissue&) = delete;
  Tissue& operator=(const Tissue&) = delete;
  Tissue(Tissue&&) = delete;
  Tissue& operator=(Tissue&&) = delete;
  virtual ~Tissue() = default;
  virtual Felt tick(const glm::dvec3& centre) = 0;
  // Where voxel (i, j, k) of the volume is.
  [[nodiscard]] virtual glm::dvec3 place(int i, int j, int k) const = 0;
};
using MakeTissue = std::unique_ptr<Tissue> (*)(const voxel::LabelVolume&, const voxel::LatticeOptions&,
                                               double tool_radius);

// The haptic thread once, and meanwhile the relaxation thread through a tenth of the object, which is kind:
// one that had a core to itself would go round several times. (It decides: at a hundredth, the six points
// let no stroke bounce through, and half of the slides slip; at a tenth nearly all do both.)
class ClassicTissue : public Tissue {
 public:
  ClassicTissue(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options, double tool_radius)
      : object_(volume, options), radius_(tool_radius), voxels_(volume.labels.size() / 10) {}
  Felt tick(const glm::dvec3& centre) override {
    const auto touch = object_.touch(centre, radius_);
    object_.relax_in_turn(voxels_);
    return {touch.contact, touch.force_N};
  }
  [[nodiscard]] glm::dvec3 place(int i, int j, int k) const override {
    return object_.position(object_.at(i, j, k));
  }

 private:
  voxel::ClassicObject object_;
  double radius_;
  std::uint64_t voxels_;
};

// What hybrid/tick.cpp does with a soft object, without a coupling: the tool goes in steps that no voxel is
// missed by.
class SoftTissue : public Tissue {
 public:
  SoftTissue(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options, double tool_radius)
      : object_(std::make_shared<voxel::Lattice>(volume, options)) {
    tool_.radius = tool_radius;
  }
  Felt tick(const glm::dvec3& centre) override {
    const double step = 0.25 * object_.lattice().min_spacing_m();
    const glm::dvec3 from = started_ ? tool_.centre : centre;
    started_ = true;
    const int steps = std::max(1, static_cast<int>(std::ceil(glm::distance(from, centre) / step)));
    for (int n = 1; n <= steps; ++n) {
      const glm::dvec3 next = from + (static_cast<double>(n) / steps) * (centre - from);
      const glm::dvec3 delta = next - tool_.centre;
      tool_.centre = next;
      near_.clear();
      const double reach = object_.reach(tool_.radius) + 2.0 * step;
      for (const voxel::VoxelId v : object_.lattice().surface()) {
        if (glm::distance(object_.position(v), next) < reach) near_.push_back(v);
      }
      object_.touch(near_);
      if (n > 1) object_.follow(delta);
      object_.push_out(tool_);
      object_.relax_near(tool_, 2);
    }
    const voxel::Reaction reaction = object_.reaction(tool_);
    object_.relax_background(kBudget);
    return {reaction.pressed > 0, reaction.force_N};
  }
  [[nodiscard]] glm::dvec3 place(int i, int j, int k) const override {
    return object_.position(voxel_at(object_.lattice(), i, j, k));
  }

 private:
  static constexpr std::uint64_t kBudget = 4'000;  // voxel updates: about two cycles of the block
  voxel::SoftObject object_;
  voxel::ToolInBody tool_;
  std::vector<voxel::VoxelId> near_;
  bool started_ = false;
};

template <class T>
std::unique_ptr<Tissue> make_tissue(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options,
                                    double tool_radius) {
  return std::make_unique<T>(volume, options, tool_radius);
}

// A block of tissue and a ball of three spacings.
struct Stroke {
  static constexpr double kSpacing = 1e-3, kRadius = 3e-3, kTick = 1e-3;
  static constexpr std::array<int, 3> kDims{17, 17, 7};
  static constexpr double kTop = (kDims[2] - 1) * kSpacing;
  static glm::dvec2 middle() { return {8.0 * kSpacing, 8.0 * kSpacing}; }
  static voxel::LabelVolume volume() { return block(kDims, glm::dvec3(kSpacing)); }
  static voxel::LatticeOptions options() {
    return made_of({.young_Pa = 1e5, .poisson = 0.3, .stretch_min = 0.4, .stretch_max = 1.6, .shear = 0.6});
  }
  // The tool's centre lies under a voxel of the top: it has fallen through the surface.
  static bool fell_through(const Tissue& tissue, const glm::dvec3& centre) {
    for (int j = 0; j < kDims[1]; ++j) {
      for (int i = 0; i < kDims[0]; ++i) {
        const glm::dvec3 p = tissue.place(i, j, kDims[2] - 1);
        if (p.z > centre.z + 0.5 * kSpacing &&
            glm::length(glm::dvec2(p) - glm::dvec2(centre)) < 0.75 * kSpacing)
          return true;
      }
    }
    return false;
  }
};

// Fig 20. A hand pushes a device of 75 g onto the top, with a force that shakes. True: at some tick the tool
// was under a voxel that it had come from above, although the hand had only pressed.
inline bool bounces_through(MakeTissue make, Random& random) {
  const auto tissue = make(Stroke::volume(), Stroke::options(), Stroke::kRadius);
  constexpr double mass_kg = 0.075, damping_N_s_per_m = 2.0;
  const glm::dvec2 at =
      Stroke::middle() + Stroke::kSpacing * glm::dvec2(random.between(-2.0, 2.0), random.between(-2.0, 2.0));
  const double push_N = random.between(0.1, 0.6), shake = random.between(0.0, 0.5);
  double z = Stroke::kTop + Stroke::kRadius + 0.6 * Stroke::kSpacing, speed = -random.between(0.0, 0.2);
  for (int tick = 0; tick < 120; ++tick) {
    const glm::dvec3 centre(at, z);
    const Felt felt = tissue->tick(centre);
    if (Stroke::fell_through(*tissue, centre)) return true;
    const double hand_N = -push_N * (1.0 + random.between(-shake, shake));
    speed += Stroke::kTick / mass_kg * (hand_N + felt.force_N.z - damping_N_s_per_m * speed);
    z += Stroke::kTick * speed;
  }
  return false;
}

// Fig 21. The tool is pressed a little into the top and then drawn sideways. True: contact was lost on the
// way, or the tool came under a voxel of the top, although its depth never changed.
inline bool slips_through(MakeTissue make, Random& random) {
  const auto tissue = make(Stroke::volume(), Stroke::options(), Stroke::kRadius);
  const double depth = random.between(0.5, 1.5) * Stroke::kSpacing, speed = random.between(0.02, 0.3);
  const double angle = random.between(0.0, 2.0 * std::numbers::pi);
  const glm::dvec2 from =
      Stroke::middle() + Stroke::kSpacing * glm::dvec2(random.between(-1.0, 1.0), random.between(-1.0, 1.0));
  const double low = Stroke::kTop + Stroke::kRadius - depth;
  double z = low + 1.5 * Stroke::kSpacing, gone = 0.0;
  while (z > low) {
    tissue->tick({from, z});
    z -= Stroke::kTick * 0.1;
  }
  for (int n = 0; n < 20; ++n) tissue->tick({from, low});
  while (gone < 4.0 * Stroke::kSpacing) {
    gone += Stroke::kTick * speed;
    const glm::dvec3 centre(from + gone * glm::dvec2(std::cos(angle), std::sin(angle)), low);
    if (!tissue->tick(centre).contact || Stroke::fell_through(*tissue, centre)) return true;
  }
  return false;
}

// Figs 18 and 19, for voxels: a tool pressed at `speed` (m/s) against a sheet one voxel thick that is held at
// its edges, and kept there. True: it ended behind the sheet, or was pulled on instead of pushed back.
inline bool falls_through_sheet(MakeTissue make, double speed, double offset) {
  constexpr double h = 1e-3, radius = 2e-3, depth = 2.5e-3;
  constexpr int n = 21;
  voxel::LatticeOptions options = made_of(
      {.young_Pa = 1e5, .poisson = 0.3, .stretch_min = 0.4, .stretch_max = 1.6, .shear = 0.6}, nullptr);
  options.anchor_faces = {"-x", "+x", "-y", "+y"};
  const auto tissue = make(block({n, n, 1}, glm::dvec3(h)), options, radius);
  const glm::dvec2 at(0.5 * (n - 1) * h, 0.5 * (n - 1) * h);
  double z = radius + 4.0 * h + offset;
  for (int tick = 0; tick < 60; ++tick) {
    const Felt felt = tissue->tick({at, z});
    const glm::dvec3 under = tissue->place(n / 2, n / 2, 0);
    if (under.z > z || felt.force_N.z < 0.0) return true;
    z = std::max(z - 1e-3 * speed, radius - depth);
  }
  return false;
}

}  // namespace tests
