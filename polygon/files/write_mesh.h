// SPDX-License-Identifier: GPL-3.0-or-later
// Writes meshes as bytes in a file format. The caller's sink decides where the bytes go.
#pragma once

#include <functional>
#include <string_view>

#include "polygon/mesh/mesh.h"

namespace polygon {

using ByteSink = std::function<void(std::string_view bytes)>;

// Writes binary PLY, with doubles in meters.
void write_ply(const TriangleMesh& mesh, const ByteSink& sink);
// Writes binary STL, with floats in millimeters. STL has no unit of its own, so the header's text states it.
// Throws std::length_error for more than 2^32 - 1 triangles, the most that STL can count.
void write_stl_in_mm(const TriangleMesh& mesh, const ByteSink& sink);
// Writes OBJ text in millimeters, with all digits of a double. A comment states the unit.
void write_obj_in_mm(const TriangleMesh& mesh, const ByteSink& sink);

}  // namespace polygon
