// SPDX-License-Identifier: GPL-3.0-or-later
// Work that may end its process, done in a process of its own. Internal to volume_file: GDCM, as Debian
// builds it, asserts where a DICOM file is damaged, and a loader must not take the session with it.
#pragma once

#include <cstddef>
#include <functional>

namespace voxel {

// Zeroed memory that a process started by run_apart writes to and the caller reads. Pages cost when touched.
class SharedMemory {
 public:
  explicit SharedMemory(std::size_t bytes);  // throws std::bad_alloc
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
  [[nodiscard]] std::byte* data() const { return data_; }

 private:
  std::byte* data_ = nullptr;
  std::size_t bytes_ = 0;
};

// Calls `call` in a copy of this process, silent and with at most `cpu_seconds` of processor time, and waits.
// Returns 0 when it came back, the signal that ended it, or -1 when no process could be started. `call` must
// not throw.
int run_apart(const std::function<void()>& call, unsigned cpu_seconds);

}  // namespace voxel
