// SPDX-License-Identifier: GPL-3.0-or-later
// Writes meshes as bytes, to wherever the caller puts them: all but the format is the caller's.
#pragma once

#include <functional>
#include <string_view>

#include "polygon/mesh/mesh.h"

namespace polygon {

using ByteSink = std::function<void(std::string_view bytes)>;

// PLY, binary, doubles in meters.
void write_ply(const TriangleMesh& mesh, const ByteSink& sink);
// STL, binary, floats in millimeters; it has no unit of its own, so the header says it. Throws
// std::length_error: more triangles than it can count (2^32 - 1).
void write_stl_in_mm(const TriangleMesh& mesh, const ByteSink& sink);
// OBJ, text, in millimeters, with all digits of a double; a comment says the unit.
void write_obj_in_mm(const TriangleMesh& mesh, const ByteSink& sink);

}  // namespace polygon
