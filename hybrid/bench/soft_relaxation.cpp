// SPDX-License-Identifier: GPL-3.0-or-later
// A ball is pressed ten spacings deep into a block, in steps and without relaxation. Then the time is
// measured until the force on the ball is within 1 % of its final value.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/bench/soft.h"
#include "hybrid/bench/soft_engines.h"
#include "hybrid/bench/timer.h"
#include "hybrid/session/session.h"
#include "voxel/baseline/thesis_chainmail.h"
#include "voxel/object/shadow_object.h"
#include "voxel/object/soft_object.h"

namespace hybrid::bench {
namespace {

constexpr double kDepth = 10.0, kRadius = 10.0;  // unit: spacing
constexpr int kSweepsNear = 2;                   // cycles of relax_near() in a tick
constexpr double kConverged = 0.01;              // error of the force, as a share of the reference
constexpr double kAsked_us = 100e3;              // working time after which the force's error is stated
constexpr int kMostRounds = 4000;                // a measurement ends after this many rounds
constexpr double kCalm = 1e-4;   // share of the force; a round is calm if the force changes by no more
constexpr int kCalmRounds = 30;  // number of calm rounds in a row that ends the measurement
constexpr double kReferenceTolerance = 1e-6;  // share of the lattice's force scale
constexpr int kReferenceCycles = 200;         // cycles of the reference, at most

constexpr const char* kWideReference = "the same press, after 400 ticks on a grid of boxes 24 nodes wide";
constexpr int kTicks = 400;           // of a press on nested patches
constexpr double kTightSlack = 0.15;  // share of the rest length
constexpr voxel::LinkMaterial tight_tissue(double young_Pa) {
  return {.young_Pa = young_Pa,
          .stretch_min = 1.0 - kTightSlack,
          .stretch_max = 1.0 + kTightSlack,
          .shear = kTightSlack};
}
constexpr voxel::LinkMaterial kFirm = tight_tissue(20e3), kLimp = tight_tissue(5e3);  // of 20 and of 5 kPa

struct Limits {
  const char* name;
  double slack;                   // unit: spacing; of the tightest material
  voxel::LinkMaterial top, base;  // of the upper 40 %; of the rest
};

const std::array<Limits, 6>& all_limits() {
  constexpr voxel::LinkMaterial tissue{}, bricks{.bricks = true}, full{.poisson = 0.45, .bricks = true};
  constexpr voxel::LinkMaterial loose{.stretch_min = 0.05, .stretch_max = 10.0, .shear = 10.0};
  constexpr voxel::LinkMaterial tight{.stretch_min = 1.0, .stretch_max = 1.0, .shear = 0.0};
  static const std::array<Limits, 6> kLimits{
      Limits{"limits", 0.6, tissue, tissue},    Limits{"no limits", 0.95, loose, loose},
      Limits{"slack 0", 0.0, tight, tissue},    Limits{"tight, by links", kTightSlack, kFirm, kLimp},
      Limits{"trilinear", 0.6, bricks, bricks}, Limits{"trilinear, 0.45", 0.6, full, full}};
  return kLimits;
}

voxel::LabelVolume cube(int edge) {
  voxel::LabelVolume volume;
  volume.dims = {edge, edge, edge};
  const auto side = static_cast<std::size_t>(edge);
  volume.labels.assign(side * side * side, 1);
  return volume;
}

// A cube whose upper 40 % has label 2.
voxel::LabelVolume layered_cube(int edge) {
  voxel::LabelVolume volume = cube(edge);
  const std::size_t base = volume.index(0, 0, edge * 6 / 10);
  std::fill(volume.labels.begin() + static_cast<std::ptrdiff_t>(base), volume.labels.end(), std::uint8_t{2});
  return volume;
}

void say_error_when_asked(SoftRow& row, double force_N, double reference_N) {
  row.force_error_N = std::fabs(force_N - reference_N);
  row.force_error_jnd = jnd_of(glm::dvec3(force_N, 0.0, 0.0), glm::dvec3(reference_N, 0.0, 0.0), kJndFloor_N);
  row.note += "; error after 100 ms";
}

class Pressed {
 public:
  enum class Relaxed : std::uint8_t { apart, here };

  Pressed(int edge, const Limits& limits, Relaxed relaxed = Relaxed::apart) {
    const voxel::LabelVolume volume = layered_cube(edge);
    voxel::LatticeOptions options;
    options.materials[1] = limits.base;
    options.materials[2] = limits.top;
    options.anchor_faces = {"-z"};
    object_ = std::make_unique<voxel::SoftObject>(std::make_shared<voxel::Lattice>(volume, options));
    if (relaxed == Relaxed::apart) replica_ = std::make_unique<voxel::ShadowObject>(*object_);
    const double middle = 0.5 * (edge - 1) * kSoftSpacing_m, top = (edge - 1) * kSoftSpacing_m;
    tool_.radius = kRadius * kSoftSpacing_m;
    const double from = top + object_->reach(tool_.radius);
    constexpr int steps = 40;
    for (int n = 1; n <= steps; ++n) {
      tool_.centre = {middle, middle, from - kDepth * kSoftSpacing_m * n / steps};
      touch();
      if (n > 1) object_->follow({0.0, 0.0, -kDepth * kSoftSpacing_m / steps});
      object_->push_out(tool_);
    }
  }

  // Lists the voxels near the tool, as a tick does first.
  void touch() {
    near_.clear();
    for (const voxel::VoxelId v : object_->lattice().surface()) {
      if (glm::distance(object_->position(v), tool_.centre) < object_->reach(tool_.radius) + kSoftSpacing_m)
        near_.push_back(v);
    }
    object_->touch(near_);
  }

  [[nodiscard]] voxel::SoftObject& object() { return *object_; }
  [[nodiscard]] voxel::ShadowObject& shadow() { return *replica_; }
  [[nodiscard]] const voxel::ToolInBody& tool() const { return tool_; }
  [[nodiscard]] double force_N() { return glm::length(object_->reaction(tool_).force_N); }

 private:
  std::unique_ptr<voxel::SoftObject> object_;
  std::unique_ptr<voxel::ShadowObject>
      replica_;  // made before the press, as in a session, so that it has to follow the press
  voxel::ToolInBody tool_;
  std::vector<voxel::VoxelId> near_;
};

// Final force, by whole cycles on a separate object. There is no other thread here, so the coarse levels know
// the whole state.
double settled_force_N(int edge, const Limits& limits) {
  Pressed pressed(edge, limits, Pressed::Relaxed::here);
  const double tolerance_N = kReferenceTolerance * pressed.object().lattice().force_scale_N();
  for (int n = 0; n < kReferenceCycles; ++n) {
    pressed.touch();  // other voxels are near now than at first
    if (pressed.object().settle(pressed.tool(), tolerance_N, 1)) break;
  }
  return pressed.force_N();
}

// Runs the work of the tick and that of its relaxation thread in turns on one core. The object stays pressed.
// The run ends when nothing is left to relax. `at_rest_N`: the final force, if it is known from another
// measurement. This is needed where a chain is tight, because there whole cycles stall. If it is empty, the
// final force is found by whole cycles.
SoftRow relax_row(int edge, const Limits& limits, std::optional<double> at_rest_N) {
  const TickTimer timer;
  Pressed pressed(edge, limits);
  voxel::SoftObject& object = pressed.object();
  struct Moment {
    double us, force_N;
  };
  std::vector<Moment> moments;
  std::uint64_t updates = 0;
  double us = 0.0, background_us = 0.0;
  voxel::ShadowObject& shadow = pressed.shadow();
  int calm = 0;
  for (int n = 0;
       n < kMostRounds && (n == 0 || voxel::ShadowObject::wanted(object)) && us < 60e6 && calm < kCalmRounds;
       ++n) {
    pressed.touch();
    const std::uint64_t before = TickTimer::begin();
    object.push_out(pressed.tool());
    object.relax_near(pressed.tool(), kSweepsNear);
    const double force = pressed.force_N();
    const std::uint64_t between = TickTimer::begin();
    if (voxel::ShadowObject::wanted(object)) {
      shadow.submit(object);
      shadow.relax();
      shadow.apply_near(object);
      while (!shadow.all_applied()) shadow.apply_far(object, object.lattice().grid().rows());
      updates += shadow.work() * voxel::kRow;
    }
    const std::uint64_t after = TickTimer::end();
    calm = !moments.empty() && std::fabs(force - moments.back().force_N) <= kCalm * force ? calm + 1 : 0;
    moments.push_back({us + timer.us(between - before), force});
    us += timer.us(after - before);
    background_us += timer.us(after - between);
  }
  const double reference = at_rest_N ? *at_rest_N : settled_force_N(edge, limits);
  SoftRow row{.test_case = "relax",
              .voxels = object.lattice().voxel_count(),
              .material = limits.name,
              .depth_spacings = kDepth,
              .slack = limits.slack};
  row.reference =
      at_rest_N ? kWideReference
                : "the same press, relaxed by whole cycles until no voxel feels a force, or 200 of them";
  const auto off = [reference](const Moment& m) {
    return std::fabs(m.force_N - reference) > kConverged * reference;
  };
  const auto last_off = std::find_if(moments.rbegin(), moments.rend(), off);
  if (!(reference > 0.0)) {
    row.note = "nothing pressed back, neither at first nor at rest";
    return row;
  }
  if (last_off == moments.rbegin()) {
    row.note = fmt::format("not within 1 % of {:.4f} N when relaxation ended, after {:.0f} ms: {:.4f} N",
                           reference, 1e-3 * us, moments.back().force_N);
  } else {
    const double reached = last_off.base()->us;  // the moment after the last one with an error above 1 %
    row.time_us = Percentiles{reached, reached, reached, reached};
    row.note = fmt::format("until within 1 % of {:.4f} N", reference);
  }
  const auto asked =
      std::find_if(moments.rbegin(), moments.rend(), [](const Moment& m) { return m.us <= kAsked_us; });
  if (asked != moments.rend()) say_error_when_asked(row, asked->force_N, reference);
  if (updates > 0) row.ns_per_voxel_update = 1e3 * background_us / static_cast<double>(updates);
  row.bytes_per_voxel = static_cast<double>(object.memory_bytes()) / static_cast<double>(row.voxels);
  return row;
}

// The same press where the chain is tight from the ball to two thirds of the way to the anchors. It is
// measured on the composite grid, as `run` uses it for tissue that only the tool touches. All work is done in
// the tick, and none is left to another thread.
struct TightRow {
  SoftRow row;
  double reference_N = 0.0;
};
TightRow tight_row(int edge, bool layered) {
  constexpr double kSlack = kTightSlack;
  const double depth = std::min(kDepth, 0.7 * kSlack * (edge - 1));  // in a small cube the chain ends sooner
  const TickTimer timer;
  const voxel::LabelVolume volume = layered ? layered_cube(edge) : cube(edge);
  voxel::LatticeOptions options;
  options.materials[1] = layered ? kLimp : tight_tissue(voxel::LinkMaterial{}.young_Pa);
  options.materials[2] = kFirm;
  options.anchor_faces = {"-z"};
  const auto lattice = std::make_shared<const voxel::Lattice>(volume, options);
  const double middle = 0.5 * (edge - 1) * kSoftSpacing_m, top = (edge - 1) * kSoftSpacing_m;
  voxel::ToolInBody tool{.centre = {middle, middle, 0.0}, .radius = kRadius * kSoftSpacing_m};
  const auto pressed = [&](bool wide, const auto& look) {
    voxel::SoftObject object(lattice);
    std::string obstacle = object.use_composite_grid(tool, kPatchMargin);
    if (!obstacle.empty()) return obstacle;
    if (wide) object.widen_patches();
    tool.centre.z = top + object.reach(tool.radius) - depth * kSoftSpacing_m;
    std::vector<voxel::VoxelId> near(lattice->surface().begin(), lattice->surface().end());
    for (int n = 0; n < kTicks; ++n) {
      // Lists the voxels that are near or may come near, as a tick does first.
      const double away = object.reach(tool.radius) + kSoftSpacing_m;
      if (object.patches_in_use() != nullptr)
        near.assign(object.near_on_grid().begin(), object.near_on_grid().end());
      std::erase_if(near,
                    [&](voxel::VoxelId v) { return glm::distance(object.position(v), tool.centre) >= away; });
      const std::uint64_t before = TickTimer::begin();
      object.touch(near);
      object.push_out(tool);
      object.relax_near(tool, kSweepsNear);
      const double force_N = glm::length(object.reaction(tool).force_N);
      look(timer.us(TickTimer::end() - before), force_N);
    }
    return obstacle;
  };
  SoftRow row{.test_case = "relax",
              .voxels = lattice->voxel_count(),
              .material = layered ? "tight, layers" : "tight",
              .depth_spacings = depth,
              .slack = kSlack};
  double reference_N = 0.0, us = 0.0, reached_us = 0.0;
  std::optional<double> at_asked_N;
  std::string obstacle = pressed(true, [&](double, double force_N) { reference_N = force_N; });
  if (obstacle.empty()) {
    obstacle = pressed(false, [&](double tick_us, double force_N) {
      us += tick_us;
      if (std::fabs(force_N - reference_N) > kConverged * reference_N) reached_us = us;
      if (us <= kAsked_us) at_asked_N = force_N;
    });
  }
  if (!obstacle.empty() || !(reference_N > 0.0)) {
    row.note = obstacle.empty() ? "nothing pressed back at rest" : obstacle;
    return {row, 0.0};
  }
  row.reference = kWideReference;
  if (reached_us < us) {
    row.time_us = Percentiles{reached_us, reached_us, reached_us, reached_us};
    row.note = fmt::format("until within 1 % of {:.4f} N", reference_N);
  } else {
    row.note = fmt::format("not within 1 % of {:.4f} N after {:.0f} ms", reference_N, 1e-3 * us);
  }
  if (at_asked_N) say_error_when_asked(row, *at_asked_N, reference_N);
  return {row, reference_N};
}

// The thesis's relaxation never ends (Fig 22), so the time of one round is measured.
SoftRow classic_row(int edge) {
  const TickTimer timer;
  const voxel::LabelVolume volume = cube(edge);
  voxel::LatticeOptions options;
  options.anchor_faces = {"-z"};
  voxel::ThesisChainMail object(volume, options);
  const auto source = object.at(edge / 2, edge / 2, edge - 1);
  const glm::vec3 move(0.0F, 0.0F, static_cast<float>(-kDepth * kSoftSpacing_m));
  object.move({&source, 1}, {&move, 1});
  std::vector<double> us;
  for (int n = 0; n < 5; ++n) {
    const std::uint64_t before = TickTimer::begin();
    object.relax_all();
    us.push_back(timer.us(TickTimer::end() - before));
  }
  SoftRow row{.test_case = "relax",
              .engine = SoftEngine::classic,
              .voxels = volume.voxel_count(),
              .material = "homogeneous",
              .depth_spacings = kDepth};
  row.repeats = us.size();
  row.time_us = percentiles(us);
  row.ns_per_voxel_update = 1e3 * row.time_us->p50 / static_cast<double>(row.voxels);
  row.bytes_per_voxel = static_cast<double>(object.memory_bytes()) / static_cast<double>(row.voxels);
  row.note = "one round; it has no end";
  return row;
}

}  // namespace

void bench_relaxation(const SoftBenchOptions& options, const std::vector<SoftEngine>& engines,
                      const AddRow& add) {
  const int edge = options.quick ? 40 : 100;
  for (const SoftEngine engine : engines) {
    if (engine == SoftEngine::classic) {
      add(classic_row(edge));
      continue;
    }
    add(tight_row(edge, false).row);
    const TightRow layered = tight_row(edge, true);
    add(layered.row);
    for (const Limits& limits : all_limits()) {
      if (limits.slack > 0.0 && limits.slack * (edge - 1) < kDepth) continue;  // the chain would end sooner
      if (options.progress)
        options.progress(fmt::format("relaxation of {0} voxels an edge, {1}", edge, limits.name));
      std::optional<double> at_rest_N;
      if (limits.slack == kTightSlack && layered.reference_N > 0.0) at_rest_N = layered.reference_N;
      add(relax_row(edge, limits, at_rest_N));
    }
  }
}

}  // namespace hybrid::bench
