// SPDX-License-Identifier: GPL-3.0-or-later
// The sweep kernel, compiled once for each width of registers.
#include "voxel/chain/sweep_kernel.h"

#include <array>

#include "voxel/chain/lanes16.h"
#include "voxel/chain/lanes8.h"
#include "voxel/lattice/simd_dispatch.h"

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

HYBRID_MULTIVERSIONED SweepResult sweep_raise8(const SweepTask& task, int most_visits, Moved* moves) {
  return kernel8::sweep_by_registers<true>(task, most_visits, moves);
}
HYBRID_MULTIVERSIONED SweepResult sweep_lower8(const SweepTask& task, int most_visits, Moved* moves) {
  return kernel8::sweep_by_registers<false>(task, most_visits, moves);
}

#if HYBRID_LANES16
constexpr std::array<SweepKernels, 2> kKernels{SweepKernels{sweep_raise8, sweep_lower8},
                                               SweepKernels{sweep_raise16, sweep_lower16}};
const std::size_t kCount = lanes16::has_lanes16() ? 2 : 1;
#else
constexpr std::array<SweepKernels, 1> kKernels{SweepKernels{sweep_raise8, sweep_lower8}};
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
