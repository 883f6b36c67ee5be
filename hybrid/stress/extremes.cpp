// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stress/extremes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <variant>

#include "hybrid/base/process_memory.h"
#include "hybrid/stress/cases.h"
#include "hybrid/stress/scratch_folder.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"

namespace hybrid {
namespace {

namespace fs = std::filesystem;

// Allowed on top of one tick's worst case, for rounding in the passivity controller.
constexpr double kPassiveRounding_J = 1e-7;
constexpr double kLongTick_us = 250e3;  // processor time; on any machine a longer tick is a hang
// Share of the spacing; tissue with a smaller displacement is back at rest.
constexpr double kBack = 0.01;
constexpr std::size_t kQuickEvery = 7;  // the quick run takes every seventh case

// Has the text the form "…scene.toml:12:8: what; what to do"?
bool says_where_what_and_remedy(const std::string& text) {
  constexpr std::string_view kFile = "scene.toml:";
  constexpr std::size_t kFewWords = 8;  // characters that a description, or a remedy, has at least
  std::size_t at = text.find(kFile);
  if (at == std::string::npos) return false;
  at += kFile.size();
  for (int number = 0; number < 2; ++number) {  // number of the line, then of the column
    const std::size_t end = text.find_first_not_of("0123456789", at);
    if (end == std::string::npos || end == at || text[end] != ':') return false;
    at = end + 1;
  }
  const std::size_t remedy = text.find("; ", at);
  return remedy != std::string::npos && remedy > at + kFewWords && text.size() > remedy + kFewWords;
}

// The text without the folder's name, which differs from run to run.
std::string without_folder(const std::string& text) {
  const std::size_t at = text.find("scene.toml");
  return at == std::string::npos ? text : text.substr(at);
}

void write_text(const fs::path& file, const std::string& text) {
  std::error_code none;
  fs::remove(file, none);  // some file systems wait for the disk when a file is overwritten
  std::ofstream(file, std::ios::binary) << text;
}

// Writes meshes from which no surface can be made.
void write_bad_meshes(const fs::path& folder) {
  const polygon::TriangleMesh ball = polygon::make_ball_mesh(6e-3, 1);
  polygon::TriangleMesh nan = ball;
  for (glm::dvec3& v : nan.vertices) v = glm::dvec3(std::numeric_limits<double>::quiet_NaN());
  polygon::save_ply(folder / "nan.ply", nan);
  polygon::save_ply(folder / "short.ply", ball);
  fs::resize_file(folder / "short.ply", fs::file_size(folder / "short.ply") / 2);
}

class Suite {
 public:
  explicit Suite(const ExtremesOptions& options) : options_(options) {}

  std::vector<ExtremeRow> run() {
    write_bad_meshes(folder_.path());
    const std::vector<DriveCase> cases = drive_cases(options_.quick);
    for (std::size_t n = 0; n < cases.size(); ++n) {
      if (options_.quick && n % kQuickEvery != 0 && !cheap_comparison(cases[n])) continue;
      if (options_.progress)
        options_.progress(fmt::format("extremes: case {} of {}, {} ({})", n + 1, cases.size(),
                                      cases[n].setting, name_of(cases[n].scene.kind)));
      drive_case(cases[n]);
    }
    for (const RefusedCase& c : refused_cases()) refused_case(c);
    if (!options_.scene.empty()) own_scene();
    return std::move(rows_);
  }

 private:
  static bool cheap_comparison(const DriveCase& c) {
    return c.same_N >= 0.0 && c.scene.kind == SceneKind::rigid;
  }
  void begin(SceneKind kind, std::string_view motion, const std::string& setting) {
    test_case_ = fmt::format("{}: {}", name_of(kind), motion);
    setting_ = setting;
  }
  void say(const char* oracle, bool ok, const std::string& outcome) {
    rows_.push_back({test_case_, setting_, oracle, outcome, ok});
    if (options_.on_row) options_.on_row(rows_.back());
  }

  DriveResult run_once(const SceneSetting& setting, Motion motion) const {
    const Scene scene = load_scene(write_scene(setting, folder_.path()));
    BuiltScene built = build_scene(scene);
    return drive(scene, built, motion, setting.origin_m, setting.unit_m);
  }

  void drive_case(const DriveCase& c) {
    begin(c.scene.kind, name_of(c.motion), c.setting);
    try {
      if (c.scene.shape == BlockShape::large && c.scene.kind != SceneKind::rigid && !enough_memory()) return;
      const DriveResult first = run_once(c.scene, c.motion);
      judge(c, first);
      if (c.same_N >= 0.0) judge_same(c, first);
      if (c.scene.shape == BlockShape::large) return;  // one run takes minutes
      const DriveResult second = run_once(c.scene, c.motion);
      judge_hash(first, second);
    } catch (const SceneError& e) {
      say("refused", says_where_what_and_remedy(e.what()), without_folder(e.what()));
    } catch (const std::exception& e) {
      say("refused", false, fmt::format("not a scene's refusal: {}", e.what()));
    }
  }

  // Is there enough free memory for the case? A test must not fill a machine that others use. A case that
  // will be refused always runs.
  bool enough_memory() {
    const double free = static_cast<double>(available_memory_bytes());
    const double takes = static_cast<double>(soft_touched_bytes({512, 512, 512}));
    if (static_cast<double>(soft_load_bytes({512, 512, 512})) > static_cast<double>(usable_memory_bytes()))
      return true;  // it will be refused
    if (takes * 1.1 < free) return true;
    say("time", true,
        fmt::format("not built: it takes {:.1f} GB, of which {:.1f} GB are free now", 1e-9 * takes,
                    1e-9 * free));
    return false;
  }

  void judge_any(const DriveResult& r) {
    say("finite", r.not_finite == 0,
        r.not_finite == 0 ? fmt::format("{} ticks", r.ticks)
                          : fmt::format("{} ticks of {} had a number that is none", r.not_finite, r.ticks));
    say("limits", r.over_force_N <= 0.0 && r.over_slew_N <= 0.0,
        fmt::format("at most {:.3g} N{}", r.most_N,
                    r.over_slew_N > 0.0 ? fmt::format(", {:.3g} N over the slew", r.over_slew_N) : ""));
  }

  void judge_hash(const DriveResult& first, const DriveResult& second) {
    say("hash", first.hash == second.hash,
        first.hash == second.hash ? fmt::format("{} ticks alike, to the bit", first.ticks)
                                  : "a second run ended elsewhere");
  }

  void judge_time(const DriveResult& r) {
    say("time", r.slowest_us < kLongTick_us,
        fmt::format("slowest tick {:.3g} ms{}", 1e-3 * r.slowest_us,
                    r.faults != 0 ? fmt::format(", faults {:#x}", r.faults) : ""));
  }

  void judge_energy(const DriveResult& r) {
    std::string energy =
        fmt::format("{:.3g} mJ given to the hand, {:.3g} mJ allowed", 1e3 * r.given_J, 1e3 * r.allowed_J);
    if (r.excess_J > r.tolerance_J || (r.moved_J > 0.0 && r.excess_J > 1e-6 * r.moved_J))
      energy += fmt::format("; {:.3g} mJ beyond on the way, {:.2g} % of the work done", 1e3 * r.excess_J,
                            100.0 * r.excess_J / r.moved_J);
    say("energy", r.excess_J <= r.tolerance_J, energy);
  }

  void judge(const DriveCase& c, const DriveResult& r) {
    judge_any(r);
    judge_energy(r);
    if (c.scene.kind != SceneKind::soft) {
      const double rounding = 1e-6 * c.scene.unit_m + 64.0 * 1e-16 * glm::length(c.scene.origin_m);
      say("outside", r.inside_m <= rounding, fmt::format("{:.3g} um inside at most", 1e6 * r.inside_m));
    }
    if (c.scene.passivity) {
      say("passive", r.most_given_J <= r.worst_tick_J + kPassiveRounding_J,
          fmt::format("at most {:.3g} mJ given out beyond what was taken in, one tick's worst {:.3g} mJ",
                      1e3 * r.most_given_J, 1e3 * r.worst_tick_J));
    }
    if (c.motion == Motion::through) judge_held(c, r);
    judge_settled(c, r);
    judge_time(r);
  }

  void judge_held(const DriveCase& c, const DriveResult& r) {
    const bool soft = c.scene.kind != SceneKind::rigid;
    // Tissue yields down to its lowest layer of voxels, which is held. The centres of these voxels are at −9.
    const double least = (soft ? -9.0 : kTouchHeight) * c.scene.unit_m -
                         (1e-6 * c.scene.unit_m + 64.0 * 1e-16 * glm::length(c.scene.origin_m));
    say("held", r.lowest_m >= least,
        fmt::format("lowest at {:.4g} of {}", r.lowest_m / c.scene.unit_m,
                    soft ? "-9, where the held voxels are" : "13, where they touch"));
  }

  void judge_settled(const DriveCase& c, const DriveResult& r) {
    const bool back = r.left_moved_m <= kBack * 2.0 * c.scene.unit_m;
    if (c.scene.kind == SceneKind::rigid) {
      say("settled", r.unbalanced_N == 0.0,
          fmt::format("{:.3g} N left, of {:.3g}", r.unbalanced_N, r.most_N));
      return;
    }
    // Relaxing 512 voxels a side takes long, and the budget bounds the work of a tick. So it is enough that
    // most of the displacement has gone.
    const bool rests =
        c.scene.shape == BlockShape::large ? r.left_moved_m < 0.1 * r.most_moved_m : r.asleep && back;
    say("settled", r.unbalanced_N == 0.0 && rests,
        fmt::format("{:.3g} N left; {:.3g} spacings left of {:.3g}{}", r.unbalanced_N,
                    r.left_moved_m / (2.0 * c.scene.unit_m), r.most_moved_m / (2.0 * c.scene.unit_m),
                    r.asleep ? "" : ", still moving"));
  }

  void judge_same(const DriveCase& c, const DriveResult& r) {
    const std::string like = scene_text(c.like);
    if (like != like_) {
      like_forces_ = run_once(c.like, c.motion).force_N;
      like_ = like;
    }
    double apart = like_forces_.size() == r.force_N.size() ? 0.0 : std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n < std::min(r.force_N.size(), like_forces_.size()); ++n)
      apart = std::max(apart, glm::length(r.force_N[n] - like_forces_[n]));
    say("same", apart <= c.same_N,
        fmt::format("forces apart by {:.3g} N of {:.3g} at most", apart, r.most_N));
  }

  // A scene of the user's own is judged only by the oracles that hold for any scene. The tool's place at the
  // end is unknown, and so is the motion of the objects unless `still`.
  void own_scene() {
    const Scene scene = load_scene(options_.scene);
    const bool still = std::none_of(scene.rigid.begin(), scene.rigid.end(), [](const RigidDescription& d) {
      return d.feel.any() || !std::holds_alternative<std::monostate>(d.motion);
    });
    for (const Motion motion : {Motion::path, Motion::stalls, Motion::not_numbers}) {
      test_case_ = fmt::format("{}: {}", options_.scene.filename().string(), name_of(motion));
      setting_ = "as it is written";
      std::array<DriveResult, 2> runs;
      for (DriveResult& r : runs) {
        BuiltScene built = build_scene(scene);
        r = drive(scene, built, motion, glm::dvec3(0.0), built.world->extent_m / kReach);
      }
      judge_any(runs[0]);
      if (still) judge_energy(runs[0]);
      judge_time(runs[0]);
      judge_hash(runs[0], runs[1]);
    }
  }

  void refused_case(const RefusedCase& c) {
    begin(c.kind, "on load", c.setting);
    try {
      SceneSetting base;
      base.kind = c.kind;
      const fs::path file = write_scene(base, folder_.path());
      write_text(file, c.scene);
      const Scene scene = load_scene(file);
      BuiltScene built = build_scene(scene);
      drive(scene, built, Motion::path, base.origin_m, base.unit_m);
      say("refused", false, "it was not refused");
    } catch (const SceneError& e) {
      say("refused", says_where_what_and_remedy(e.what()), without_folder(e.what()));
    } catch (const std::exception& e) {
      say("refused", false, fmt::format("without a place in the scene: {}", e.what()));
    }
  }

  const ExtremesOptions& options_;
  ScratchFolder folder_{"extremes"};
  std::vector<ExtremeRow> rows_;
  std::string test_case_, setting_;
  std::string like_;  // text of the scene that has like_forces_
  std::vector<glm::dvec3> like_forces_;
};

}  // namespace

std::vector<ExtremeRow> run_extremes(const ExtremesOptions& options) {
  return Suite(options).run();
}

nlohmann::ordered_json to_json(const ExtremeRow& row) {
  return {{"case", row.test_case},
          {"setting", row.setting},
          {"oracle", row.oracle},
          {"outcome", row.outcome},
          {"ok", row.ok}};
}

std::string extremes_text(const std::vector<ExtremeRow>& rows) {
  std::map<std::string, std::array<std::size_t, 2>> counts;
  std::string text;
  for (const ExtremeRow& row : rows) {
    ++counts[row.oracle][row.ok ? 0 : 1];
    if (!row.ok)
      text +=
          fmt::format("FELL SHORT  {} | {} | {}: {}\n", row.test_case, row.setting, row.oracle, row.outcome);
  }
  text += fmt::format("{:<9} {:>6} {:>11}\n", "oracle", "held", "fell short");
  for (const auto& [oracle, count] : counts)
    text += fmt::format("{:<9} {:>6} {:>11}\n", oracle, count[0], count[1]);
  return text;
}

}  // namespace hybrid
