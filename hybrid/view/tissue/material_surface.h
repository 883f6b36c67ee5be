// SPDX-License-Identifier: GPL-3.0-or-later
// The surface of one material of a soft object, also where other tissue covers it. Uses no graphics library.
#pragma once

#include <cstddef>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// The surface of all voxels of a material (index in DrawnInside::materials), at rest, in the scene's frame:
// closed, oriented outward. Empty if the object has no voxel of it.
[[nodiscard]] polygon::TriangleMesh surface_of_material(const DrawnInside& inside, std::size_t material);

}  // namespace hybrid
