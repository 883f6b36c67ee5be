// SPDX-License-Identifier: GPL-3.0-or-later
// Buffers of one tick. Nothing in them is read in a later tick, so copies and recordings of a state leave
// them out. They are sized when the world is built and never grow afterwards.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "hybrid/world/free_body.h"
#include "hybrid/world/world.h"
#include "polygon/proxy/minimise_on_planes.h"
#include "polygon/proxy/neighbourhood.h"
#include "polygon/surface/rigid_surface.h"
#include "voxel/object/soft_object.h"

namespace hybrid {

// One plane of the proxy's minimisation, and its owner.
struct ProxyPlane {
  std::uint32_t object = 0, element = 0;
  polygon::SeparatingPlane in_body;
  bool own_plane = true;  // the element's own plane may be used
  bool flat = false;      // the element's own plane is `in_body`, wherever the proxy is
  bool touching = false;  // the proxy is known to lie on it at the end of the last sweep
};
inline constexpr std::uint32_t kMaxProxyPlanes = 32;  // planes of one step of the sweep

// Range of one body's contacts in TickScratch::body_contacts; the first `springs` of them are springs (tool
// and tissue links).
struct OwnContacts {
  std::size_t first = 0, springs = 0;
};
// Free bodies that step together.
struct FreeBodyStep {
  std::vector<SteppedBody> stepped;
  std::vector<OwnContacts> own;          // [stepped]
  std::vector<std::uint32_t> object;     // [stepped] index of its rigid object
  std::vector<std::uint32_t> member;     // [rigid] index into `stepped`
  std::vector<BodyFrame> before, after;  // [rigid]
  std::vector<Pose> next;                // [rigid]
  std::vector<double> moves_m;           // [rigid]
  // [stepped] copy without gravity and drag, so that contacts alone act on it.
  std::vector<FreeBody> contacts_only;
  std::vector<SteppedBody> still;  // [stepped] body of contacts_only, with zero velocity
  BodySystem system;
};

// A surface voxel that is due for a distance query to a body; the smallest remaining travel comes first.
struct DueQuery {
  double left_m = 0.0;  // travel that remains before the body may be near
  std::uint32_t body = 0, surface_number = 0;
  bool operator<(const DueQuery& other) const noexcept {
    if (left_m != other.left_m) return left_m < other.left_m;
    return body != other.body ? body < other.body : surface_number < other.surface_number;
  }
};

struct TickScratch {
  // ---- proxy ----
  std::vector<polygon::NearPoint> near;
  std::array<ProxyPlane, kMaxProxyPlanes> proxy_planes{};
  std::vector<polygon::ContactPlane> planes;

  // ---- soft objects ----
  std::vector<voxel::ToolBound> bounds;
  std::vector<std::uint32_t> map_hits;               // entries that the last look-up in the map returned
  std::vector<std::vector<voxel::VoxelId>> touched;  // [soft] surface voxels near the tool
  std::vector<polygon::ContactPlane> stops;  // planes of soft objects that stopped the tool in this tick
  std::vector<glm::dmat3> soft_stiffness;    // [soft] stiffness on the tool (N/m); used by split_by_object()

  // ---- bodies that move ----
  std::vector<DueQuery> due;
  std::vector<std::uint32_t> in_the_way;            // surface voxels inside a body
  std::vector<BodyContact> body_contacts;           // all contacts of free bodies
  FreeBodyStep free_bodies;                         // free bodies on which these contacts act
  std::vector<std::uint32_t> body_surface_numbers;  // surface voxels of one object that press on a free body
  std::vector<voxel::VoxelId> body_voxels;          // voxels with these surface numbers
  std::vector<voxel::ContactLoad> body_loads;       // loads of these voxels
};

}  // namespace hybrid
