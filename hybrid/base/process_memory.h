// SPDX-License-Identifier: GPL-3.0-or-later
// What the whole program takes of the machine's memory, and how much there is.
#pragma once

#include <cstdint>

namespace hybrid {

// Resident now; 0 where the system does not say.
[[nodiscard]] std::uint64_t held_memory_bytes();
// The most that ever was resident.
[[nodiscard]] std::uint64_t peak_memory_bytes();

// Bytes of physical memory that can be used at all (what one object may take at most).
[[nodiscard]] std::uint64_t usable_memory_bytes();

// What the machine could give now without putting anything aside; 0 where the system does not say.
[[nodiscard]] std::uint64_t available_memory_bytes();

// After a large step of loading: what it freed goes back to the system. The C library would keep it for
// itself, and the next step's memory would come on top.
void give_back_freed_memory();

}  // namespace hybrid
