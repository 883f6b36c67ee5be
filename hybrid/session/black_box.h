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
  std::uint64_t tick = 0;      // number of the tick within the session
  glm::dvec3 reported_m{0.0};  // position that the device reported, valid or not; scene's frame
  device::DeviceFault reported = device::DeviceFault::none;
  std::uint32_t faults = 0;     // all FaultBit flags of the session so far
  std::uint64_t nonfinite = 0;  // inputs and forces held back so far
  float late_us = 0.0F;         // delay with which the machine woke the loop
  TickResult felt{};
};

// A ring of rows, allocated in the constructor. add() allocates nothing and never waits, so the servo thread
// may call it. A fault is one of the device, one of a tick, or a number that is not finite. After the first
// fault the ring takes rows for a quarter of its length and then stops, so it holds ticks before and after
// the fault.
class BlackBox {
 public:
  static constexpr double kSeconds = 2.0;  // length of the kept record before a fault

  explicit BlackBox(double rate_hz);

  void add(const BlackBoxRow& row) noexcept;

  // The first fault in words, with its time. Empty if there was none.
  [[nodiscard]] std::optional<std::string> fault() const;
  // Writes one row a tick. Columns: t_s, x_m, y_m, z_m (the position that was used: the file can serve as the
  // path of a scene), said_*_m (the position that the device reported), proxy_*_m, force_*_N, rigid_N,
  // soft_N, contacts, device_fault, faults, nonfinite, late_us, tick_us, and a time for each stage. Returns
  // false if a part could not be written. Async-signal-safe.
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
  // Throws std::runtime_error if no file can be written at that path.
  BlackBoxFile(double rate_hz, const std::filesystem::path& file);

  [[nodiscard]] BlackBox& box() { return box_; }
  // If there was a fault, writes the file and returns a sentence with the fault and the file's name.
  // Otherwise returns an empty text.
  [[nodiscard]] std::string save_on_fault() const;

 private:
  static void save_now(void* self) noexcept;

  BlackBox box_;
  FilePlace place_;
  device::OnCrash on_crash_;
};

// Opens the file of a session's black box: `asked`, or SCENE-fault.csv in the current folder if `asked` is
// empty and the session is `live`. Returns null if `asked` is empty and the session is not live, because such
// a session can be run again.
std::unique_ptr<BlackBoxFile> open_black_box_file(const std::filesystem::path& asked,
                                                  const std::filesystem::path& scene, bool live,
                                                  double rate_hz);

}  // namespace hybrid
