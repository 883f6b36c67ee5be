// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stability/stability.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <set>
#include <tuple>
#include <utility>

#include "device/loop/stop_signal.h"
#include "hybrid/base/find_threshold.h"

namespace hybrid {
namespace {

constexpr std::array kDelays{0, 1, 2};  // of the loop (ticks)
constexpr std::array kGrips{std::pair{device::Grip::loose, "loose"},
                            std::pair{device::Grip::medium, "medium"}, std::pair{device::Grip::firm, "firm"}};
// a device that no hand holds
constexpr device::HandModel kNobody{.mass_kg = 0.0, .damping_N_s_per_m = 0.0, .stiffness_N_per_m = 0.0};

void add_theory(StabilityRow& row) {
  const LoopSetting& s = row.setting;
  if (row.kind == Boundary::buzz || s.damping_account) return;
  if (s.linear()) {
    const bool stable = row.kind == Boundary::stable;
    row.theory = stable ? device::largest_stable_stiffness(held_loop(s))
                        : device::largest_passive_stiffness(bare_loop(s));
    row.theory_name = stable ? "discrete eigenvalues" : "Colgate & Schenkel 1997, with the delay";
  } else if (s.delay_ticks == 0 && s.wall_damping_N_s_per_m == 0.0) {
    row.lower_bound = device::friction_and_quantisation_bound(row.damping_N_s_per_m(), s.period_s(),
                                                              s.friction_N(), s.encoder_m());
    row.theory_name = "Abbott & Okamura 2005, a lower bound";
  }
}

LoopSetting bare_setting(double viscous, double rate_hz, int delay) {
  LoopSetting setting;
  setting.mechanism.viscous_N_s_per_m = viscous;
  setting.hand = kNobody;
  setting.rate_hz = rate_hz;
  setting.delay_ticks = delay;
  return setting;
}

// ---- the plan: rows without measurements ----------------------------------------------------------------

class Plan {
 public:
  explicit Plan(const Scene& scene) : rate_hz_(scene.rate_hz) {
    const bool ideal = scene.device_model == device::DeviceModel::ideal;  // an ideal device has no dynamics
    model_ = ideal ? device::DeviceModel::premium_1_5 : scene.device_model;
  }

  void rigid() {
    for (const double b : {0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0}) {
      for (const int delay : kDelays) both(StabilitySweep::damping, bare_setting(b, rate_hz_, delay));
    }
    for (const int delay : kDelays) {
      LoopSetting setting = bare_setting(kDamping, rate_hz_, delay);
      for (const double wall : {0.5, 1.5, 2.5, 3.5}) {
        setting.wall_damping_N_s_per_m = wall;
        add(StabilitySweep::wall_damping, Boundary::passive, setting);
      }
      for (const double wall : {2.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 70.0}) {
        setting.wall_damping_N_s_per_m = wall;
        if (device::largest_stable_stiffness(held_loop(setting)) > 0.0)  // otherwise there is no stable K
          add(StabilitySweep::wall_damping, Boundary::stable, setting);
      }
    }
    for (const double rate : {500.0, 1000.0, 2000.0, 5000.0, 10'000.0}) {
      for (const int delay : kDelays) both(StabilitySweep::rate, bare_setting(kDampingOfRates, rate, delay));
    }
    grips();
    friction_and_encoder();
    for (const double wall : {1.5, 3.5}) {
      LoopSetting setting = bare_setting(kDamping, rate_hz_, 0);
      setting.wall_damping_N_s_per_m = wall;
      setting.damping_account = true;
      add(StabilitySweep::account, Boundary::passive, setting);
    }
    for (const auto model : {device::DeviceModel::premium_1_5, device::DeviceModel::touch}) held(model);
    curves();
  }

  // Two measurements: the stiffness of the coupling that buzzes at a given modulus, and the modulus that
  // buzzes under a stiff coupling. The second is needed because tissue and coupling are in series: on very
  // soft tissue no coupling buzzes. The modulus is that of the first soft object; the other objects keep
  // their ratio to it.
  void soft() {
    constexpr double kStiffCoupling_N_per_m = 20e3;  // buzzes on a rigid wall
    for (const double young : {1e3, 1e4, 1e5}) {
      for (const auto& [grip, name] : kGrips) {
        StabilityRow& row = add(StabilitySweep::tissue, Boundary::buzz, held_setting(model_, grip, 0));
        row.grip = name;
        row.device = device::device_name(model_);
        row.young_Pa = young;
      }
    }
    for (const auto& [grip, name] : kGrips) {
      StabilityRow& row = add(StabilitySweep::tissue, Boundary::buzz, held_setting(model_, grip, 0));
      row.grip = name;
      row.device = device::device_name(model_);
      row.coupling_N_per_m = kStiffCoupling_N_per_m;
    }
  }

  StabilityReport report;

 private:
  static constexpr double kDamping = 4.0, kDampingOfRates = 2.0;  // N·s/m

  StabilityRow& add(StabilitySweep sweep, Boundary kind, const LoopSetting& setting) {
    StabilityRow& row = report.rows.emplace_back();
    row.sweep = sweep;
    row.kind = kind;
    row.setting = setting;
    add_theory(row);
    return row;
  }
  void both(StabilitySweep sweep, const LoopSetting& setting) {
    add(sweep, Boundary::stable, setting);
    add(sweep, Boundary::passive, setting);
  }

  [[nodiscard]] LoopSetting held_setting(device::DeviceModel model, device::Grip grip, int delay) const {
    LoopSetting setting;
    setting.mechanism = device::mechanism(model);
    setting.hand = device::hand_of(grip);
    setting.rate_hz = rate_hz_;
    setting.delay_ticks = delay;
    return setting;
  }

  void grips() {
    for (const auto& [grip, name] : kGrips) {
      for (const int delay : kDelays) {
        LoopSetting setting = held_setting(model_, grip, delay);
        setting.mechanism.limits.friction_N = setting.mechanism.limits.resolution_m = 0.0;
        add(StabilitySweep::grip, Boundary::stable, setting).grip = name;
      }
    }
  }

  void friction_and_encoder() {
    struct Case {
      double viscous, friction, step;
    };
    for (const Case& c : {Case{2.0, 0.04, 30e-6}, Case{2.0, 0.02, 30e-6}, Case{1.0, 0.04, 30e-6},
                          Case{2.0, 0.04, 10e-6}, Case{8.0, 0.26, 55e-6}, Case{4.0, 0.26, 55e-6}}) {
      LoopSetting setting = bare_setting(c.viscous, rate_hz_, 0);
      setting.mechanism.limits.friction_N = c.friction;
      setting.mechanism.limits.resolution_m = c.step;
      both(StabilitySweep::quantisation, setting);
    }
  }

  void held(device::DeviceModel model) {
    const auto named = [&](StabilityRow& row, const char* grip) {
      row.grip = grip;
      row.device = device::device_name(model);
      row.nominal_N_per_m = device::device_limits(model).max_stiffness_N_per_m;
    };
    for (const auto& [grip, name] : kGrips) {
      named(add(StabilitySweep::device, Boundary::stable, held_setting(model, grip, 0)), name);
      for (const int delay : {0, 1})
        named(add(StabilitySweep::device, Boundary::buzz, held_setting(model, grip, delay)), name);
    }
  }

  template <class Setting>
  void curve(StabilitySweep sweep, const std::vector<Boundary>& kinds, double from, double to,
             Setting&& setting_at) {
    constexpr int kPoints = 80;  // points of a curve of theory
    for (const Boundary kind : kinds) {
      for (const int delay : kDelays) {
        TheoryCurve& c = report.curves.emplace_back();
        c.sweep = sweep;
        c.kind = kind;
        c.delay_ticks = delay;
        for (int n = 0; n <= kPoints; ++n) {
          StabilityRow row;
          row.kind = kind;
          c.x.push_back(from + (to - from) * n / kPoints);
          row.setting = setting_at(c.x.back(), delay);
          add_theory(row);
          c.stiffness_N_per_m.push_back(row.theory.value_or(0.0));
        }
      }
    }
  }
  void curves() {
    const std::vector<Boundary> all{Boundary::stable, Boundary::passive};
    curve(StabilitySweep::damping, all, 0.0, 8.5,
          [&](double b, int d) { return bare_setting(b, rate_hz_, d); });
    const auto with_wall = [&](double wall, int d) {
      LoopSetting setting = bare_setting(kDamping, rate_hz_, d);
      setting.wall_damping_N_s_per_m = wall;
      return setting;
    };
    curve(StabilitySweep::wall_damping, {Boundary::stable}, 0.0, 80.0, with_wall);
    curve(StabilitySweep::wall_damping, {Boundary::passive}, 0.0, kDamping, with_wall);
    curve(StabilitySweep::rate, all, 250.0, 10'250.0,
          [](double rate, int d) { return bare_setting(kDampingOfRates, rate, d); });
  }

  double rate_hz_;
  device::DeviceModel model_ = device::DeviceModel::premium_1_5;
};

// ---- measuring ------------------------------------------------------------------------------------------

// The scene with all materials scaled by one factor, so that the first soft object's modulus is `young_Pa`.
Scene with_young(Scene scene, double young_Pa) {
  scene.materials.try_emplace("");  // material of the objects that name none
  const double factor = young_Pa / scene.materials[scene.soft.front().material].young_Pa;
  for (auto& [name, material] : scene.materials) material.young_Pa *= factor;
  return scene;
}

// Measures the modulus at which the scene's tissue begins to buzz under a coupling of the row's stiffness.
void measure_modulus(const Scene& scene, StabilityRow& row) {
  constexpr double kSoftest_Pa = 1e3, kStiffest_Pa = 1e8;  // range of the search
  row.stiffest = kStiffest_Pa;
  row.measured = find_threshold(kSoftest_Pa, kStiffest_Pa, 1.6, 2e-2, [&](double young) {
    PressedScene pressed(with_young(scene, young));
    const Vibration now = pressed_vibration(pressed, row.setting, *row.coupling_N_per_m);
    if (now.felt > 1.0) row.vibration = now;
    return now.felt <= 1.0;
  });
}

void measure(PressedScene& scene, StabilityRow& row) {
  switch (row.kind) {
    case Boundary::stable:
      row.measured = measured_stable_stiffness(scene, row.setting);
      break;
    case Boundary::passive:
      row.measured = measured_passive_stiffness(scene, row.setting);
      break;
    case Boundary::buzz: {
      const Buzz buzz = measured_buzz(scene, row.setting);
      row.measured = buzz.begins_N_per_m;
      row.stiffest = buzz.stiffest_N_per_m;
      row.vibration = buzz.vibration;
      if (row.nominal_N_per_m)
        row.felt_at_nominal = pressed_vibration(scene, row.setting, *row.nominal_N_per_m).felt;
      break;
    }
  }
}

// Keeps the first row of each sweep and kind. Rows with a given coupling and rows with a varied one count as
// two kinds.
void keep_first_of_each(std::vector<StabilityRow>& rows) {
  std::set<std::tuple<StabilitySweep, Boundary, bool>> seen;
  std::erase_if(rows, [&seen](const StabilityRow& row) {
    return !seen.emplace(row.sweep, row.kind, row.coupling_N_per_m.has_value()).second;
  });
}

}  // namespace

std::string_view name_of(Boundary kind) noexcept {
  constexpr std::array<std::string_view, 3> kNames{"stable", "passive", "buzz"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string_view title_of(StabilitySweep sweep) noexcept {
  constexpr std::array<std::string_view, 8> kTitles{
      "damping of the mechanism, in nobody's hand",
      "damping of the wall",
      "rate",
      "grip, of the device without friction and encoder",
      "friction and encoder",
      "damping of the wall, with the account that the tick keeps of it",
      "devices as they are, in a hand",
      "tissue"};
  return kTitles[static_cast<std::size_t>(sweep)];
}

double StabilityRow::damping_N_s_per_m() const {
  return (kind == Boundary::passive ? bare_loop(setting) : held_loop(setting)).damping_N_s_per_m;
}

std::optional<double> StabilityRow::error() const {
  if (!measured || !theory || *theory <= 0.0) return std::nullopt;
  return *measured / *theory - 1.0;
}

StabilityReport measure_stability(const Scene& scene, const StabilityOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [start] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  const std::clock_t processor = std::clock();
  Plan plan(scene);
  if (scene.soft.empty()) {
    plan.rigid();
  } else {
    plan.soft();
  }
  StabilityReport report = std::move(plan.report);
  report.scene = scene.file.string();
  if (options.quick) keep_first_of_each(report.rows);
  std::unique_ptr<PressedScene> pressed;
  std::optional<double> built_with;
  std::size_t done = 0;
  try {
    for (; done < report.rows.size(); ++done) {
      StabilityRow& row = report.rows[done];
      if (options.progress) {
        const double left_s = done == 0 ? 0.0
                                        : seconds() * static_cast<double>(report.rows.size() - done) /
                                              static_cast<double>(done);
        options.progress(fmt::format("{} of {}: {}, {}{}", done + 1, report.rows.size(), name_of(row.kind),
                                     title_of(row.sweep),
                                     done == 0 ? "" : fmt::format("; about {:.0f} s left", left_s)));
      }
      if (row.coupling_N_per_m) {
        measure_modulus(scene, row);
        continue;
      }
      if (pressed == nullptr || row.young_Pa != built_with) {
        pressed = std::make_unique<PressedScene>(row.young_Pa ? with_young(scene, *row.young_Pa) : scene,
                                                 options.progress);
        built_with = row.young_Pa;
      }
      measure(*pressed, row);
    }
  } catch (const device::StopAsked& asked) {
    report.stopped_by = asked.signal;
    report.rows.resize(done);
  }
  report.seconds = seconds();
  report.processor_seconds = static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC;
  return report;
}

Agreement agreement(const StabilityReport& report, Boundary kind) {
  Agreement all;
  for (const StabilityRow& row : report.rows) {
    if (row.kind != kind || !row.error()) continue;
    ++all.rows;
    all.worst = std::max(all.worst, std::fabs(*row.error()));
  }
  return all;
}

int below_bound(const StabilityReport& report) {
  constexpr double kPrecision = 5e-3;  // of a measured stiffness (relative)
  return static_cast<int>(std::count_if(report.rows.begin(), report.rows.end(), [](const StabilityRow& row) {
    return row.lower_bound && row.measured && *row.measured < *row.lower_bound * (1.0 - kPrecision);
  }));
}

}  // namespace hybrid
