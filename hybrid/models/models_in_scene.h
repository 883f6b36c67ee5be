// SPDX-License-Identifier: GPL-3.0-or-later
// The models of each object of a scene side by side. Each variant of the scene is played whole, along the
// scene's path, by the engine of `run` on an ideal device. All are compared with one reference.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/tune/felt_stiffness.h"
#include "hybrid/tune/truth.h"

namespace hybrid {

struct ModelsOptions {
  std::string object{};           // the object that is varied; empty: all objects that the path touches
  std::filesystem::path cache{};  // folder that keeps the reference, shared with tune(); empty: not kept
  Progress progress{};
};

// Figures that a hand feels of the object along the path. Only ticks in which the object is touched count.
struct FeltModel {
  double force_p50_N = 0.0, force_max_N = 0.0;
  std::optional<double> onset_s{};                                 // first force above the floor of the JND
  std::optional<double> stiffness_N_per_m{};                       // felt_stiffness() at the first contact
  std::optional<double> direction_p50_deg{}, direction_p99_deg{};  // against the reference
  SettingError error{};                                            // against the reference; 0 for itself
};

struct ModelRow {
  std::string name{}, words{};  // these and the next two are as in Variant
  std::optional<Setting> setting{};
  std::string left_out{};  // why it was not played; empty if it was
  ForceCourse course{};    // CourseTick::soft: the object is touched
  FeltModel felt{};
  Percentiles tick_us{};  // over all ticks of the session; each is the median over the passes
  double load_s = 0.0;
  std::uint64_t memory_bytes = 0, soft_voxels = 0;
  std::vector<std::string> faults{};
  // Stiffness of the tool's coupling; empty: as the scene has it.
  [[nodiscard]] std::optional<double> coupling_N_per_m() const {
    return setting ? setting->coupling_N_per_m : std::nullopt;
  }
};

struct ObjectModels {
  std::string object{};
  bool rigid = false;            // the scene has it as [[rigid]]
  bool alone = true;             // the path touches nothing else
  std::vector<ModelRow> rows{};  // the first is the scene as given
  ForceCourse reference{};       // CourseTick::soft: the object is touched
  FeltModel reference_felt{};
  std::vector<double> depth_m{};  // depth of the tool's centre in the undeformed object, for each tick
  bool depth_from_proxy = true;   // false: travel of the device since the first touch, opposite to the force
  std::optional<TickRange> contact{};  // first contact with the object
  std::optional<StiffnessMatch> match{};
};

struct ModelsInScene {
  std::vector<ObjectModels> objects{};   // soft ones first
  std::vector<TunableObject> tunable{};  // soft objects, to which ModelRow::setting refers
  std::vector<std::string> untouched{};  // objects that the path does not touch
  std::optional<Truth> truth{};          // empty: nothing soft is touched, and the scene as given is exact
  double floor_N = 0.04, dt_s = 1e-3;
  double stiffness_N_per_m = 0.0;  // stiffness of the tool's coupling, as given
};

// `as_read`: from read_scene(). Throws SceneError. Throws std::runtime_error: the path touches nothing, or
// does not touch the object that was asked for.
ModelsInScene models_in_scene(const Scene& as_read, const ModelsOptions& options);

}  // namespace hybrid
