// SPDX-License-Identifier: GPL-3.0-or-later
// Transforms that 3D Slicer and other programs on ITK write.
#pragma once

#include <filesystem>

#include "hybrid/geometry/pose.h"

namespace hybrid {

// Reads the pose that a transform file gives an object: text of ITK (.tfm, .txt). The file maps points of the
// parent, which is the scene, to the object. Its numbers are in millimeters, with x to the left, y to the
// back and z up (LPS). The pose is the inverse map, in meters. Reads AffineTransform,
// MatrixOffsetTransformBase and VersorRigid3DTransform. Throws std::runtime_error with the remedy for HDF5,
// several transforms, another kind, a map that stretches, shears or mirrors, and damaged files.
Pose load_itk_transform(const std::filesystem::path& file);

}  // namespace hybrid
