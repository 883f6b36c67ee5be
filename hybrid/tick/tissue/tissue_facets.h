// SPDX-License-Identifier: GPL-3.0-or-later
// The tool's centre never passes through the surface of tissue.
//
// Tissue is pressed as balls at its voxels. A tool about as large as a spacing may push four voxels of the
// surface apart, within the limits of their links, until it fits between the balls. The facets between the
// voxels close these gaps.
#pragma once

#include <cstddef>
#include <span>

#include "hybrid/world/world_state.h"

namespace hybrid {

// For a ball: writes half-spaces of facets (triangles of surface voxels) that face the tool's centre. The
// centre must stay outside the tissue's surface, which lies half a spacing outside each facet. `within`:
// largest distance of the centre from that surface (m). Only facets that bound a full cell of eight voxels
// count: others have no inner side. Returns how many were written; stops when `out` is full.
std::size_t facet_bounds(const voxel::SoftObject& object, const voxel::ToolInBody& tool, double within,
                         std::span<voxel::ToolBound> out) noexcept;

// Sets a fault if the tool's centre is in an object that the tool does not press.
void flag_lost_tool(const World& world, WorldState& state) noexcept;

}  // namespace hybrid
