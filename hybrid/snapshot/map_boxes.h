// SPDX-License-Identifier: GPL-3.0-or-later
// The occupied cells of the occupancy map near the tool, and the boxes of nested patches, for a window that
// shows them.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "hybrid/world/world.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

struct MapBox {
  enum class Kind : std::uint8_t {
    rigid,  // a cell with a rigid surface
    soft,   // a cell with surface voxels of tissue
    patch,  // a box of nodes, on which a contact with tissue is solved
  };
  Kind kind = Kind::rigid;
  std::uint32_t level = 0;   // of a patch: 0 is the finest
  glm::dvec3 corner_m{0.0};  // scene frame
  std::array<glm::dvec3, 3> edges_m{};
};

// Looks at no more than kCellsAlong cells along each axis, about the proxy. A cell may be listed twice, as
// rigid and as soft. Allocates; reads the state, so no tick may run meanwhile.
inline constexpr int kCellsAlong = 12;
[[nodiscard]] std::vector<MapBox> map_boxes(const World& world, const WorldState& state);

}  // namespace hybrid
