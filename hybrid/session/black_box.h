// SPDX-License-Identifier: GPL-3.0-or-later
// The last seconds of a session, always kept, and written when something went wrong.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "device/loop/servo_loop.h"
#include "device/loop/stop_signal.h"
#include "hybrid/tick/tick.h"

namespace hybrid {

// One tick, as said by the device and as answered.
struct BlackBoxRow {
  std::uint64_t tick = 0;  // of the session
  glm::dvec3 said_m{0.0};  // by the device, be it a place or not; scene frame
  device::DeviceFault said = device::DeviceFault::none;
  std::uint32_t faults = 0;     // FaultBit, of the session so far
  std::uint64_t nonfinite = 0;  // inputs and forces held back so far
  float late_us = 0.0F;         // how late the machine woke the loop
  TickResult felt{};
};

// A ring of rows in a room that is there from the start: add() allocates nothing and waits for nobody, so it
// belongs to the servo thread. At the first fault (the device's, a tick's, or a number that is none) it goes
// on for a quarter of the time and then stands still, so that it holds what led there and what came of it.
class BlackBox {
 public:
  static constexpr double kSeconds = 2.0;

  explicit BlackBox(double rate_hz);

  void add(const BlackBoxRow& row) noexcept;

  // The first fault in words, with its time; none: there was none.
  [[nodiscard]] std::optional<std::string> fault() const;
  // Columns t_s, x_m, y_m, z_m (where the device was taken to be: the file is a path that can be felt again),
  // said_*_m (where it said to be), proxy_*_m, force_*_N, rigid_N, soft_N, contacts, device_fault, faults,
  // nonfinite, late_us, tick_us, and a column for each stage. Returns false: not all was written. What a
  // signal handler may do.
  bool write_to(int descriptor) const noexcept;

 private:
  enum class Cause : std::uint8_t { none, device, tick, nonfinite };
  [[nodiscard]] Cause cause_of(const BlackBoxRow& row) const noexcept;

  double dt_s_;
  std::vector<BlackBoxRow> rows_;
  std::uint64_t added_ = 0, left_;  // rows, and how many more after a fault
  Cause cause_ = Cause::none;
  BlackBoxRow at_fault_{};
  std::uint32_t faults_ = 0;
  std::uint64_t nonfinite_ = 0;
};

// A box, and the file that it goes to: on a crash from its handler, after a fault when the session has ended.
class KeptBox {
 public:
  KeptBox(double rate_hz, std::filesystem::path file);

  [[nodiscard]] BlackBox& box() { return box_; }
  // Writes the file when there was a fault, and says so; empty: there was none, and no file.
  [[nodiscard]] std::string save_on_fault() const;

 private:
  static void save_now(void* self) noexcept;

  BlackBox box_;
  std::filesystem::path file_;
  device::OnCrash on_crash_;
};

// What cannot be run again to look closer is kept: `asked`, or where that is empty and the session is `live`,
// SCENE-fault.csv in the current folder. None: a session that can be run again.
std::unique_ptr<KeptBox> keep_box(const std::filesystem::path& asked, const std::filesystem::path& scene,
                                  bool live, double rate_hz);

}  // namespace hybrid
