// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stress/fuzz_ticks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <random>

#include "device/loop/stop_signal.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/session/session.h"
#include "hybrid/session/tick_invariants.h"
#include "hybrid/stress/drive.h"
#include "hybrid/stress/scenes.h"
#include "hybrid/stress/scratch_folder.h"
#include "hybrid/tick/tissue/async_relaxation.h"

namespace hybrid {
namespace {

constexpr std::uint64_t kEpisode = 1000;   // ticks of random input, after which everything must come to rest
constexpr int kMostTicksToRest = 4000;     // greatest number of ticks until everything is at rest
constexpr std::size_t kMostFailures = 20;  // failures that are listed
constexpr double kUnit_m = 1e-3, kJump_m = 1.0;  // unit of the scene; size of a jump
// Depth in something rigid, and time of a tick, beyond which a failure is reported.
constexpr double kMostInside_m = 1e-9, kLongFuzzTick_us = 1e6;

constexpr const char* kMoving =
    R"(# Rigid objects that move, turn, fall on one another, are pushed, rub and are textured.
format = 1
[tool]
radius = 3
[safety]
soft_start = 0
[[rigid]]
name = "wheel"
primitive = "capsule"
radius = 5
length = 30
friction = [0.6, 0.4]
motion = "path"
[rigid.path]
kind = "lissajous"
centre = [0, 0, 0]
amplitude = [0, 0, 5]
frequency = 0.7
duration = 80000
[rigid.spin]
axis = [0, 1, 0]
rate = 90
[[rigid]]
name = "puck"
primitive = "box"
size = [20, 20, 8]
position = [25, 0, 0]
motion = "free"
density = 1000
drag = 2
angular_drag = 1e-4
gravity = [0, 0, -9.81]
friction = 0.4
[[rigid]]
name = "marble"
primitive = "ball"
radius = 6
position = [-8, 3, 25]
motion = "free"
density = 3000
gravity = [0, 0, -9.81]
[[rigid]]
name = "floor"
primitive = "plane"
size = 200
position = [0, 0, -45]
friction = 0.3
[[rigid]]
name = "plate"
mesh = "block.ply"
position = [0, 0, -25]
friction = 0.5
damping = 2
shading = true
texture = { pattern = "bumps", size = 4, height = 0.3 }
[path]
kind = "press"
from = [0, 0, 60]
to = [0, 0, 50]
)";

constexpr const char* kTwoSoft = R"(# Two soft blocks that meet under a punch.
format = 1
[tool]
shape = "punch"
radius = 6
[safety]
soft_start = 0
[material.soft]
young = 4000
[material.softer]
young = 2000
stretch = [0.8, 1.3]
shear = 0.3
[[soft]]
name = "lower"
formula = "block"
size = [30, 30, 10]
spacing = 2
material = "soft"
[[soft]]
name = "upper"
formula = "ball"
size = 18
spacing = 2
position = [0, 0, 15]
material = "softer"
anchors = { faces = ["+x"] }
[path]
kind = "press"
from = [0, 0, 60]
to = [0, 0, 50]
)";

struct FuzzScene {
  std::string name;
  std::string text;  // empty: the scene of `kind`
  SceneKind kind = SceneKind::rigid;
  bool still = true;  // nothing moves, rubs or damps, so the account of energy is defined
};

const std::vector<FuzzScene>& scenes() {
  static const std::vector<FuzzScene> kScenes{{"rigid", "", SceneKind::rigid},
                                              {"soft", "", SceneKind::soft},
                                              {"mixed", "", SceneKind::mixed},
                                              {"moving", kMoving, SceneKind::rigid, false},
                                              {"two soft", kTwoSoft, SceneKind::soft, true}};
  return kScenes;
}

// Random input of a device that may give anything.
class Input {
 public:
  explicit Input(std::uint64_t seed) : random_(seed) {}

  // Half of the episodes have only finite positions, so that inputs that are held back cannot hide an error.
  void begin_episode() {
    wild_ = chance(0.5);
    place_m_ = around(40.0 * kUnit_m);
  }

  device::DeviceState next() {
    const double kind = uniform(0.0, 1.0);
    device::DeviceState out;
    out.buttons = static_cast<std::uint32_t>(random_());
    if (wild_ && kind < 0.1) {
      out.position_m = no_position(random_());
    } else if (wild_ && kind < 0.15) {
      for (int d = 0; d < 3; ++d) out.position_m[d] = magnitude();
    } else {
      if (kind < 0.17) {
        place_m_ = around(kJump_m);
      } else if (kind < 0.3 || glm::length(place_m_) > 40.0 * kUnit_m) {
        place_m_ = around(25.0 * kUnit_m);
      } else if (kind < 0.9) {
        place_m_ += std::pow(10.0, uniform(-9.0, -2.0)) * around(1.0);
      }
      out.position_m = place_m_;
    }
    out.velocity_m_per_s = wild_ && chance(0.1) ? no_position(random_()) : around(1.0);
    return out;
  }

  double dt_s() {
    const double kind = uniform(0.0, 1.0);
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                     kInf = std::numeric_limits<double>::infinity();
    constexpr std::array<double, 8> kNone{0.0,  -0.0,  -1e-3,  kNan,
                                          kInf, -kInf, 1e-310, std::numeric_limits<double>::denorm_min()};
    if (kind < 0.05) return kNone[random_() % kNone.size()];
    if (wild_ && kind < 0.051) return 1e300;
    return std::pow(10.0, kind < 0.15 ? uniform(-3.0, -1.0) : uniform(-4.0, -2.0));
  }

 private:
  double uniform(double low, double high) {
    // std::uniform_real_distribution may differ between standard libraries for the same bits.
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1.0p-53);
  }
  bool chance(double p) { return uniform(0.0, 1.0) < p; }
  glm::dvec3 around(double reach) {
    const double x = uniform(-reach, reach), y = uniform(-reach, reach);
    return {x, y, uniform(-reach, reach)};
  }
  double magnitude() {
    const double exponent = uniform(-300.0, 300.0);
    return std::pow(10.0, exponent) * (chance(0.5) ? 1.0 : -1.0);
  }

  std::mt19937_64 random_;
  bool wild_ = false;
  glm::dvec3 place_m_{0.0};
};

class Fuzz {
 public:
  Fuzz(const FuzzScene& which, const std::filesystem::path& folder, std::uint64_t seed, bool apart)
      : which_(which),
        scene_(load_scene(write(which, folder))),
        built_(build_scene(scene_)),
        world_(*built_.world),
        state_(*built_.state),
        input_(seed) {
    result_.scene = which.name;
    if (apart) start_async_relaxation(state_, Arrival::counted);
  }

  FuzzResult run(std::uint64_t ticks) {
    set_flush_to_zero();
    begin_session(scene_, world_, state_, glm::dvec3(0.0, 0.0, 60.0 * kUnit_m));
    while (result_.ticks < ticks) {
      device::stop_if_asked();
      episode();
      recover();
    }
    result_.nonfinite = state_.nonfinite;
    result_.faults = state_.faults;
    result_.hash = hash_state(result_.hash, state_);
    return std::move(result_);
  }

 private:
  static std::filesystem::path write(const FuzzScene& which, const std::filesystem::path& folder) {
    SceneSetting setting;
    setting.kind = which.kind;
    std::filesystem::path file = write_scene(setting, folder);
    if (which.text.empty()) return file;
    std::filesystem::remove(file);
    std::ofstream(file, std::ios::binary) << which.text;
    return file;
  }

  void fail(const std::string& text) {
    if (result_.failures.size() < kMostFailures)
      result_.failures.push_back(fmt::format("{}, tick {}: {}", which_.name, result_.ticks, text));
  }

  TickResult tick(const device::DeviceState& input, double dt_s) {
    const TickResult felt = haptic_tick(world_, state_, input, dt_s);
    watch_->check_tick(state_, felt, dt_s);
    ++result_.ticks;
    if (felt.contacts != 0) ++result_.contact_ticks;
    return felt;
  }

  void judge() {
    watch_->check_state(state_);
    if (watch_->not_finite() > 0) fail(fmt::format("{} ticks not finite", watch_->not_finite()));
    if (watch_->over_force_N() > 0.0) fail(fmt::format("{:.3g} N over the limit", watch_->over_force_N()));
    if (watch_->over_slew_N() > 0.0) fail(fmt::format("{:.3g} N over the slew", watch_->over_slew_N()));
    if (watch_->slowest_us() > kLongFuzzTick_us)
      fail(fmt::format("a tick of {:.3g} ms", 1e-3 * watch_->slowest_us()));
    const bool infeasible = (state_.faults & fault_infeasible) != 0;  // bodies leave no room for the tool
    if (watch_->inside_m() > kMostInside_m && !infeasible)
      fail(fmt::format("{:.3g} um inside something rigid", 1e6 * watch_->inside_m()));
    if (which_.still && watch_->excess_J() > watch_->tolerance_J())
      fail(fmt::format("{:.3g} mJ given beyond what is allowed, {:.2g} % of the work done",
                       1e3 * watch_->excess_J(), 100.0 * watch_->excess_J() / watch_->moved_J()));
    result_.most_N = std::max(result_.most_N, watch_->most_N());
    result_.inside_m = std::max(result_.inside_m, watch_->inside_m());
    result_.slowest_us = std::max(result_.slowest_us, watch_->slowest_us());
    if (which_.still && watch_->moved_J() > 0.0)
      result_.excess_share = std::max(result_.excess_share, watch_->excess_J() / watch_->moved_J());
    result_.hash = result_.hash * 0x100000001B3ULL ^ watch_->hash();
  }

  void episode() {
    watch_.emplace(world_, state_);
    input_.begin_episode();
    for (std::uint64_t n = 0; n < kEpisode; ++n) {
      const device::DeviceState input = input_.next();
      tick(input, input_.dt_s());
    }
    judge();
  }

  void recover() {
    watch_.emplace(world_, state_);
    const auto calm = [this](const glm::dvec3& device_m) { return tick({.position_m = device_m}, 1e-3); };
    const glm::dvec3 away = lead_out(world_, state_, glm::dvec3(0.0), 2.0 * kReach * kUnit_m, calm);
    TickResult felt = calm(away);
    for (int n = 0; n < kMostTicksToRest && !all_asleep(state_); ++n) felt = calm(away);
    felt = calm(away);
    judge();
    const double moved = largest_displacement_m(state_);
    const bool rests = felt.force_N == glm::dvec3(0.0) && all_asleep(state_) && moved <= 0.02 * kUnit_m;
    if (rests) {
      ++result_.recoveries;
    } else if (which_.still) {  // a moving body may hold or meet the tool wherever the tool was led
      fail(fmt::format(
          "not at rest long after the tool left: {:.3g} N, {:.3g} um of displacement{}; the proxy "
          "is at ({:.3g}, {:.3g}, {:.3g}) mm, the device at ({:.3g}, {:.3g}, {:.3g})",
          glm::length(felt.force_N), 1e6 * moved, all_asleep(state_) ? "" : ", still moving",
          1e3 * felt.proxy_m.x, 1e3 * felt.proxy_m.y, 1e3 * felt.proxy_m.z, 1e3 * away.x, 1e3 * away.y,
          1e3 * away.z));
    }
  }

  const FuzzScene& which_;
  Scene scene_;
  BuiltScene built_;
  const World& world_;
  WorldState& state_;
  Input input_;
  std::optional<TickInvariants> watch_;
  FuzzResult result_;
};

}  // namespace

std::vector<FuzzResult> fuzz_ticks(const FuzzOptions& options) {
  const ScratchFolder folder("fuzz");
  std::vector<FuzzResult> results;
  for (const FuzzScene& which : scenes()) {
    if (!options.only.empty() && which.name != options.only) continue;
    if (options.progress) options.progress(fmt::format("fuzzing ticks: {}", which.name));
    results.push_back(Fuzz(which, folder.path(), options.seed, options.async_relaxation)
                          .run(std::max<std::uint64_t>(1, options.ticks / scenes().size())));
  }
  return results;
}

}  // namespace hybrid
