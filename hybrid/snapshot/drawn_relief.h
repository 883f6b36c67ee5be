// SPDX-License-Identifier: GPL-3.0-or-later
// The relief of a rigid surface as a mesh, for graphics. The tick never reads it: there the relief is a force
// (feel/height_texture.h).
#pragma once

#include "hybrid/feel/height_texture.h"
#include "polygon/mesh/mesh.h"

namespace hybrid {

// Returns the mesh with its vertices moved inwards by the relief (body's frame). Before that, edges are
// halved until none is longer than a 24th of the texture's period, or until there are a quarter of a million
// triangles. Finer details are not drawn. Neighbours keep common vertices, so a closed mesh stays closed.
// `share`: factor on the texture's height. The direction of a texture of the kind `shading` has no height;
// its mesh is returned as it is.
[[nodiscard]] polygon::TriangleMesh with_relief(polygon::TriangleMesh mesh, const HeightTexture& texture,
                                                double share = 1.0);

}  // namespace hybrid
