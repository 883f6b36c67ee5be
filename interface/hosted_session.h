// SPDX-License-Identifier: GPL-3.0-or-later
// A session whose host moves the tool: another program calls the ticks, edits values and takes surfaces.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hybrid/base/spsc_ring.h"
#include "hybrid/session/force_error.h"
#include "hybrid/session/recording.h"
#include "hybrid/session/relaxation_thread.h"
#include "hybrid/session/session.h"
#include "hybrid/tick/tissue/work_budget.h"
#include "interface/hosted_surfaces.h"

namespace c_interface {

enum class Relaxation : std::uint8_t { in_call, thread, tick };

struct HostOptions {
  Relaxation relaxation = Relaxation::in_call;
  std::optional<double> rate_hz{};   // empty: that of the scene
  std::uint64_t recorded_ticks = 0;  // greatest number of ticks for a recording and for measure_error()
  double surfaces_hz = 30.0;         // with Relaxation::thread
  bool surfaces = true;              // keep surfaces for publish()
  bool error = false;                // keep the state at the start for measure_error()
};

// A scene and the text that it was read from.
struct SceneSource {
  hybrid::Scene scene;
  std::string text;
  // Path in recordings: the scene's file, or the folder of a scene that was given as text, ending in '/'.
  std::filesystem::path recorded_path;
};
// Both throw hybrid::SceneError.
SceneSource scene_from_file(const std::filesystem::path& file);
SceneSource scene_from_text(const std::string& text, const std::filesystem::path& folder);

class HostedSession {
 public:
  static constexpr std::size_t kEditsWaiting = 256, kMostEdits = 100'000;

  // Builds the world. The caller has switched flush-to-zero on. Throws hybrid::SceneError.
  HostedSession(SceneSource source, const HostOptions& options);

  // ---- constant after construction ----
  [[nodiscard]] const hybrid::World& world() const noexcept { return *built_.world; }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept { return notes_; }
  [[nodiscard]] std::span<const hybrid::EditableValue> editable() const noexcept { return editable_; }
  [[nodiscard]] double period_s() const noexcept { return period_s_; }
  [[nodiscard]] const HostedSurfaces* surfaces() const noexcept { return surfaces_ ? &*surfaces_ : nullptr; }
  [[nodiscard]] const std::string& name_of(std::size_t object) const;

  // ---- servo ----
  // Starts the session. Throws hybrid::SceneError if the tool is inside something. Then begin() may be called
  // again with another position.
  void begin(const glm::dvec3& device_m);
  [[nodiscard]] bool begun() const noexcept { return begun_; }
  // One tick. Call begin() before. The caller has switched flush-to-zero on.
  void tick(const glm::dvec3& device_m, double dt_s) noexcept;
  [[nodiscard]] const hybrid::TickResult& felt() const noexcept { return felt_; }
  [[nodiscard]] std::uint64_t ticks() const noexcept { return ticks_; }
  [[nodiscard]] std::uint64_t hash() const noexcept { return hash_; }
  [[nodiscard]] const hybrid::WorldState& state() const noexcept { return *built_.state; }
  // Hands the surfaces to the reader. Call it only if surfaces() is not null.
  void publish();
  // The reason why the session cannot be saved as a recording; empty if it can.
  [[nodiscard]] std::string not_recorded() const;
  // Call it only if not_recorded() is empty. Throws std::runtime_error if the file cannot be written.
  void save_recording(const std::filesystem::path& file) const;
  // ForceError::not_measured says why nothing was compared.
  [[nodiscard]] hybrid::ForceError measure_error() const;

  // ---- reader ----
  // Takes the newest published surfaces; false if there are none that are newer. Call it only if surfaces()
  // is not null.
  bool take_surfaces();

  // ---- editor ----
  // Queues an edit for the next tick. False if too many edits wait, or if the session had kMostEdits.
  bool edit(const hybrid::Edit& edit) noexcept;

 private:
  void take_edits() noexcept;
  void keep(double dt_s) noexcept;

  hybrid::SpscRing<hybrid::Edit> edits_{kEditsWaiting};
  std::uint64_t edits_sent_ = 0;  // of the editor

  SceneSource source_;
  HostOptions options_;
  double period_s_;
  hybrid::BuiltScene built_;
  std::vector<std::string> notes_;
  std::vector<hybrid::EditableValue> editable_;
  std::optional<HostedSurfaces> surfaces_;

  bool begun_ = false, live_ = false;
  hybrid::TickResult felt_;
  hybrid::WorkShare work_share_;
  std::uint64_t ticks_ = 0, hash_ = hybrid::kHashBegin;
  std::uint64_t unkept_ = 0, other_dt_ = 0;  // ticks beyond recorded_ticks; ticks with another dt
  glm::dvec3 start_m_{0.0};
  std::vector<hybrid::RecordedTick> recorded_;
  hybrid::ForceCourse course_;
  std::vector<hybrid::Edit> applied_;
  std::unique_ptr<hybrid::WorldState> at_start_;                 // null without HostOptions::error
  std::unique_ptr<hybrid::RelaxationThread> relaxation_thread_;  // destroyed before the state that it reads
};

}  // namespace c_interface
