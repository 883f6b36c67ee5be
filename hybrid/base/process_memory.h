// SPDX-License-Identifier: GPL-3.0-or-later
// Memory use of the whole program, and the memory of the machine.
#pragma once

#include <cstdint>

namespace hybrid {

// Resident memory now (bytes); 0 if the system does not report it.
[[nodiscard]] std::uint64_t resident_memory_bytes();
// Peak of the resident memory (bytes).
[[nodiscard]] std::uint64_t peak_memory_bytes();

// Physical memory that the program may use at all (bytes).
[[nodiscard]] std::uint64_t usable_memory_bytes();

// Memory that the machine could give now without swapping (bytes); 0 if the system does not report it.
[[nodiscard]] std::uint64_t available_memory_bytes();

// Returns freed memory to the system; call after a large step of loading. Otherwise the C library would keep
// it, and the next step would need its memory in addition.
void return_freed_memory();

}  // namespace hybrid
