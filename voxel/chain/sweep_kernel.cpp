// SPDX-License-Identifier: GPL-3.0-or-later
// The sweep kernel, compiled once for each width of registers.
#include "voxel/chain/sweep_kernel.h"

#include <array>

#include "voxel/chain/lanes16.h"
#include "voxel/chain/lanes8.h"

namespace voxel {
namespace {

namespace kernel8 {
using namespace lanes8;
#include "voxel/chain/sweep_kernel_body.h"
}  // namespace kernel8

#if HYBRID_LANES16
#undef HYBRID_INLINE
#define HYBRID_INLINE HYBRID_INLINE_512
namespace kernel16 {
using namespace lanes16;
#include "voxel/chain/sweep_kernel_body.h"
}  // namespace kernel16

HYBRID_TARGET_512 SweepResult sweep_raise16(const SweepTask& task, int most_visits, Moved* moves) {
  return kernel16::sweep_by_registers<true>(task, most_visits, moves);
}
HYBRID_TARGET_512 SweepResult sweep_lower16(const SweepTask& task, int most_visits, Moved* moves) {
  return kernel16::sweep_by_registers<false>(task, most_visits, moves);
}
#endif

// For any processor. Without AVX2 nothing permutes eight floats by an index, so limits are read from memory.
SweepResult sweep_raise_any(const SweepTask& task, int most_visits, Moved* moves) {
  return kernel8::sweep_rows<true, 0>(task, most_visits, moves);
}
SweepResult sweep_lower_any(const SweepTask& task, int most_visits, Moved* moves) {
  return kernel8::sweep_rows<false, 0>(task, most_visits, moves);
}

#if HYBRID_LANES16
__attribute__((target("avx2"))) SweepResult sweep_raise8(const SweepTask& task, int most_visits,
                                                         Moved* moves) {
  return kernel8::sweep_by_registers<true>(task, most_visits, moves);
}
__attribute__((target("avx2"))) SweepResult sweep_lower8(const SweepTask& task, int most_visits,
                                                         Moved* moves) {
  return kernel8::sweep_by_registers<false>(task, most_visits, moves);
}
constexpr std::array<SweepKernels, 3> kKernels{SweepKernels{sweep_raise_any, sweep_lower_any},
                                               SweepKernels{sweep_raise8, sweep_lower8},
                                               SweepKernels{sweep_raise16, sweep_lower16}};
const std::size_t kCount = lanes16::has_lanes16() ? 3 : __builtin_cpu_supports("avx2") != 0 ? 2 : 1;
#else
constexpr std::array<SweepKernels, 1> kKernels{SweepKernels{sweep_raise_any, sweep_lower_any}};
constexpr std::size_t kCount = 1;
#endif

}  // namespace

std::span<const SweepKernels> sweep_kernels() noexcept {
  return std::span(kKernels).first(kCount);
}
SweepResult sweep_raise(const SweepTask& task, int most_visits, Moved* moves) noexcept {
  return kKernels[kCount - 1].raise(task, most_visits, moves);
}
SweepResult sweep_lower(const SweepTask& task, int most_visits, Moved* moves) noexcept {
  return kKernels[kCount - 1].lower(task, most_visits, moves);
}

}  // namespace voxel
