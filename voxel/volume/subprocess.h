// SPDX-License-Identifier: GPL-3.0-or-later
// Runs a call in a child process, so that a crash of the call does not end the caller. Internal to the
// readers (read_volume.h). GDCM as Debian builds it aborts on an assertion when a DICOM file is damaged.
// Results return through shared memory.
#pragma once

#include <cstddef>
#include <functional>

namespace voxel {

// Zeroed memory that a child of run_in_subprocess writes and the caller reads. A page takes memory once it is
// touched.
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

// Calls `call` in a child process (fork) and waits. The child's output is discarded, and its CPU time is
// limited to `cpu_seconds`. Returns 0 if `call` returned, the signal that ended the child, or -1 if no child
// could be started. `call` must not throw.
int run_in_subprocess(const std::function<void()>& call, unsigned cpu_seconds);

}  // namespace voxel
