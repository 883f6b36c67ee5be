// SPDX-License-Identifier: GPL-3.0-or-later
// The last seconds of a session: always kept in memory, and written to a file after a fault.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "device/loop/servo_loop.h"
#include "device/loop/stop_signal.h"
#include "hybrid/base/whole_file.h"
#include "hybrid/tick/tick.h"

namespace hybrid {

// One tick: the input of the device, and the answer.
struct BlackBoxRow {
  std::uint64_t tick = 0;      // of the session
  glm::dvec3 reported_m{0.0};  // position that the device reported, valid or not; scene frame
  device::DeviceFault reported = device::DeviceFault::none;
  std::uint32_t faults = 0;     // FaultBit, of the session so far
  std::uint64_t nonfinite = 0;  // inputs and forces held back so far
  float late_us = 0.0F;         // how late the machine woke the loop
  TickResult felt{};
};

// A ring of rows, allocated in the constructor. add() allocates nothing and never waits, so the servo thread
// may call it. At the first fault (of the device, of a tick, or a non-finite number) the ring records for a
// quarter of its length more, and then stops. So it holds the ticks before the fault and those after it.
class BlackBox {
 public:
  static constexpr double kSeconds = 2.0;

  explicit BlackBox(double rate_hz);

  void add(const BlackBoxRow& row) noexcept;

  // The first fault in words, with its time; none: there was none.
  [[nodiscard]] std::optional<std::string> fault() const;
  // Columns t_s, x_m, y_m, z_m (the position that was used, so that the file can be felt again as a path),
  // said_*_m (the position that the device reported), proxy_*_m, force_*_N, rigid_N, soft_N, contacts,
  // device_fault, faults, nonfinite, late_us, tick_us, and a column for each stage. Returns false when not
  // all was written. Async-signal-safe.
  bool write_to(int descriptor) const noexcept;

 private:
  enum class Cause : std::uint8_t { none, device, tick, nonfinite };
  [[nodiscard]] Cause cause_of(const BlackBoxRow& row) const noexcept;

  double dt_s_;
  std::vector<BlackBoxRow> rows_;
  std::uint64_t added_ = 0, left_;  // rows added, and rows that are still recorded after a fault
  Cause cause_ = Cause::none;
  BlackBoxRow at_fault_{};
  std::uint32_t faults_ = 0;
  std::uint64_t nonfinite_ = 0;
};

// A black box and its file. A crash writes it from the signal handler, a fault at the end of the session.
class BlackBoxFile {
 public:
  // Throws std::runtime_error: no file can be written there.
  BlackBoxFile(double rate_hz, const std::filesystem::path& file);

  [[nodiscard]] BlackBox& box() { return box_; }
  // After a fault writes the file and returns its name; empty without a fault.
  [[nodiscard]] std::string save_on_fault() const;

 private:
  static void save_now(void* self) noexcept;

  BlackBox box_;
  FilePlace place_;
  device::OnCrash on_crash_;
};

// The file of a session that cannot be run again: `asked`, or SCENE-fault.csv in the current folder when
// `asked` is empty and the session is `live`. None for a session that can be run again.
std::unique_ptr<BlackBoxFile> open_black_box_file(const std::filesystem::path& asked,
                                                  const std::filesystem::path& scene, bool live,
                                                  double rate_hz);

}  // namespace hybrid
