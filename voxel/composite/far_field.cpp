// SPDX-License-Identifier: GPL-3.0-or-later
// Displacements far from the contact: extrapolated before a cycle, fitted after it.
//
// Far from the contact, a cycle reduces the error only to about 0.6 of its size. The reason is that active
// nodes (row_kernels.h) do not move on coarser levels and hold the free nodes linked to them. But the error
// is nearly the same share of the displacement everywhere. So after each cycle a multiple of one fixed
// pattern of displacements, the mode, is added to u on each axis. The mode is the part of u that bounds do
// not prescribe (beyond_bounds()). The multiple is that of least energy, times a factor (kOverrelaxation).
#include <algorithm>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"

namespace voxel {
namespace {

// Step along the mode, relative to the step to the least energy. It exceeds 1, because a part of the error is
// not along the mode and holds the rest back: near the edge of the active nodes the error is constant. From 2
// on the energy may grow.
constexpr double kOverrelaxation = 1.5;
// Replaces kOverrelaxation after a patch has moved. The patch's new nodes are interpolated, and their
// residual is not an error of the far field. A sliding tool would feel a full step.
constexpr double kAfterMove = 0.5;
constexpr double kMaxStep = 0.5;  // largest step in one cycle, relative to the mode

}  // namespace

void CompositeGrid::extrapolate(std::size_t a, double share, double most_m) noexcept {
  const auto by = static_cast<float>(share), most = static_cast<float>(most_m);
  for (Level& level : levels_) {
    float* const u = level.u[a].data() + level.first_row();
    for (std::size_t n = 0; n < level.floats(); ++n) u[n] += std::clamp(by * u[n], -most, most);
  }
}

// Line search along beyond_bounds(), which equals u far from the contact and is 0 at a bound. Masking u to
// the free nodes would not do: the links at the edge of the mask would dominate the response.
void CompositeGrid::fit_far_field(std::size_t a) noexcept {
  composite::ModeResponse sum;
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    Level& level = levels_[l];
    Index3 finer_first{0, 0, 0}, finer_last{-1, -1, -1};
    if (l > 0) {
      inject_from_finer(l, a);
      for (std::size_t d = 0; d < 3; ++d) {
        finer_first[d] = levels_[l - 1].nodes[d].coarse_first;
        finer_last[d] = levels_[l - 1].nodes[d].coarse_last;
      }
    }
    const composite::LevelView v = view(l, a);
    float* const beyond = level.restricted_u.data() + level.first_row();
    composite::beyond_bounds(v.u, v.lower, v.negated_upper, beyond, level.floats());
    const composite::ModeResponse own = composite::mode_response(v, beyond, finer_first, finer_last);
    sum.force += own.force;
    sum.stiffness += own.stiffness;
  }
  if (!(sum.stiffness > 0.0)) return;
  const double part = patch_moved_ ? kAfterMove : kOverrelaxation;
  const auto by = static_cast<float>(std::clamp(part * sum.force / sum.stiffness, -kMaxStep, kMaxStep));
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    Level& level = levels_[l];
    const composite::LevelView v = view(l, a);
    composite::step_along_mode(v.u, level.restricted_u.data() + level.first_row(), by, v.lower,
                               v.negated_upper, level.floats());
  }
}

}  // namespace voxel
