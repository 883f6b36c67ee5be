// SPDX-License-Identifier: GPL-3.0-or-later
// What is far from a contact, on a composite grid: taken along before a cycle, and fitted after it.
//
// Cycles alone are slow to tell what is far away: what moves with its bound stands still as coarser levels
// see it, and of what pulls at its neighbours half goes to it on every level, so that of what displacements
// lack there each cycle leaves 0.6 or so. But all of it lacks nearly the same share. So after a cycle one
// number is found: by how much what is free goes along itself, for the least energy.
#include <algorithm>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"

namespace voxel {
namespace {

// Of the way to the least energy. What a cycle leaves is more than what lies along the mode: near the edge of
// what is held it is a constant, and holds the rest back. (1: twice the error in tissue that a tool is drawn
// out of; from 2 on energy may grow.)
constexpr double kOverrelaxation = 1.5;
// … where what is new in a box was interpolated, and pulls at its surroundings for that: with all of it a
// tool that slid at 0.1 m/s felt a step of 0.09 of what is just noticeable each time.
constexpr double kAfterMove = 0.5;
constexpr double kMaxStep = 0.5;  // of displacements, in one cycle

}  // namespace

void CompositeGrid::extrapolate(std::size_t a, double share, double most_m) noexcept {
  const auto by = static_cast<float>(share), most = static_cast<float>(most_m);
  for (Level& level : levels_) {
    float* const u = level.u[a].data() + level.first_row();
    for (std::size_t n = 0; n < level.floats(); ++n) u[n] += std::clamp(by * u[n], -most, most);
  }
}

// A line search, once per axis and cycle, along how far each node is beyond its bound: all of a displacement
// far away, nothing of what is held. (ModeResponse the displacements of whatever is not held, links at its edge
// would be all that is felt of it.)
void CompositeGrid::fit_far_field(std::size_t a) noexcept {
  composite::ModeResponse sum;
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    Level& level = levels_[l];
    Index3 finer_first{0, 0, 0}, finer_last{-1, -1, -1};
    if (l > 0) {
      inject_from_finer(l, a);
      for (std::size_t d = 0; d < 3; ++d) {
        finer_first[d] = levels_[l - 1].line[d].coarse_first;
        finer_last[d] = levels_[l - 1].line[d].coarse_last;
      }
    }
    const composite::LevelView v = view(l, a);
    float* const beyond = level.old.data() + level.first_row();
    composite::beyond_bounds(v.u, v.least, v.most_negative, beyond, level.floats());
    const composite::ModeResponse own = composite::mode_response(v, beyond, finer_first, finer_last);
    sum.pull += own.pull;
    sum.stiffness += own.stiffness;
  }
  if (!(sum.stiffness > 0.0)) return;
  const double part = patch_moved_ ? kAfterMove : kOverrelaxation;
  const auto by = static_cast<float>(std::clamp(part * sum.pull / sum.stiffness, -kMaxStep, kMaxStep));
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    Level& level = levels_[l];
    const composite::LevelView v = view(l, a);
    composite::step_along_mode(v.u, level.old.data() + level.first_row(), by, v.least, v.most_negative,
                        level.floats());
  }
}

}  // namespace voxel
