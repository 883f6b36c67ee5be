// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/chain/sweep_kernel.h"

#include <array>

#include "voxel/chain/lanes8.h"
#include "voxel/chain/lanes16.h"
#include "voxel/lattice/simd_dispatch.h"

namespace voxel {
namespace {

namespace narrow {
using namespace lanes;
#include "voxel/chain/sweep_kernel_body.h"
}  // namespace narrow

#if HYBRID_LANES_512
#undef HYBRID_INLINE
#define HYBRID_INLINE HYBRID_INLINE_512
namespace wide {
using namespace lanes_512;
#include "voxel/chain/sweep_kernel_body.h"
}  // namespace wide

HYBRID_FOR_512 Pulled raise_pulled_512(const Pull& pull, int most_visits, Moved* moves) {
  return wide::pulled_by_registers<true>(pull, most_visits, moves);
}
HYBRID_FOR_512 Pulled lower_pulled_512(const Pull& pull, int most_visits, Moved* moves) {
  return wide::pulled_by_registers<false>(pull, most_visits, moves);
}
#endif

HYBRID_WIDE Pulled raise_pulled_narrow(const Pull& pull, int most_visits, Moved* moves) {
  return narrow::pulled_by_registers<true>(pull, most_visits, moves);
}
HYBRID_WIDE Pulled lower_pulled_narrow(const Pull& pull, int most_visits, Moved* moves) {
  return narrow::pulled_by_registers<false>(pull, most_visits, moves);
}

#if HYBRID_LANES_512
constexpr std::array<PullKernels, 2> kKernels{PullKernels{raise_pulled_narrow, lower_pulled_narrow},
                                              PullKernels{raise_pulled_512, lower_pulled_512}};
const std::size_t kCount = lanes_512::has_lanes_512() ? 2 : 1;
#else
constexpr std::array<PullKernels, 1> kKernels{PullKernels{raise_pulled_narrow, lower_pulled_narrow}};
constexpr std::size_t kCount = 1;
#endif

}  // namespace

std::span<const PullKernels> pull_kernels() noexcept {
  return std::span(kKernels).first(kCount);
}
Pulled raise_pulled(const Pull& pull, int most_visits, Moved* moves) noexcept {
  return kKernels[kCount - 1].raise(pull, most_visits, moves);
}
Pulled lower_pulled(const Pull& pull, int most_visits, Moved* moves) noexcept {
  return kKernels[kCount - 1].lower(pull, most_visits, moves);
}

}  // namespace voxel
