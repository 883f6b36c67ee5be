// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/surface/bvh.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <string>

namespace polygon {
namespace {

constexpr std::size_t kLargeTree = 1U << 18U;  // boxes; above it the fast build is used

float rounded_down(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f : std::nextafterf(f, -std::numeric_limits<float>::infinity());
}

using BoxOf = std::function<Bvh::Box(std::uint32_t)>;

struct Build {
  const BoxOf& box_of;
};
void bounds_of(const RTCBoundsFunctionArguments* args) {
  const Bvh::Box box = static_cast<const Build*>(args->geometryUserPtr)->box_of(args->primID);
  args->bounds_o->lower_x = rounded_down(box.low.x);
  args->bounds_o->lower_y = rounded_down(box.low.y);
  args->bounds_o->lower_z = rounded_down(box.low.z);
  args->bounds_o->upper_x = rounded_up(box.high.x);
  args->bounds_o->upper_y = rounded_up(box.high.y);
  args->bounds_o->upper_z = rounded_up(box.high.z);
}

bool count_memory(void* bytes_held, ssize_t bytes, bool /*post*/) {
  *static_cast<std::atomic<std::int64_t>*>(bytes_held) += bytes;
  return true;
}

struct VisitContext {
  Bvh::Visit visit;
  void* user;
};
bool forward_to_visit(RTCPointQueryFunctionArguments* args) {
  const VisitContext& call = *static_cast<const VisitContext*>(args->userPtr);
  return call.visit(call.user, args->primID, args->query->radius);
}

// The thread sanitizer cannot see the synchronisation inside Embree and oneTBB, which are built without it,
// and would report every box as a race.
#ifdef __SANITIZE_THREAD__
constexpr const char* kDevice = "threads=1";
#else
constexpr const char* kDevice = nullptr;
#endif

}  // namespace

Bvh::Bvh(std::size_t count, const BoxOf& box_of) {
  device_ = rtcNewDevice(kDevice);
  if (device_ == nullptr) {
    throw std::runtime_error("Embree cannot start on this machine (error " +
                             std::to_string(static_cast<int>(rtcGetDeviceError(nullptr))) +
                             "); Embree 3 needs a processor with SSE2 and free memory");
  }
  rtcSetDeviceMemoryMonitorFunction(device_, &count_memory, &embree_bytes_);
  scene_ = rtcNewScene(device_);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  // Queries in a large tree wait for memory. There Embree's fast build is as quick to query, and takes less
  // memory and time to build. In a small tree its looser boxes would slow the queries.
  rtcSetSceneBuildQuality(scene_, count > kLargeTree ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM);
  // User geometry is used instead of Embree's triangles. Its boxes are rounded outwards, but Embree's float
  // vertices would not be. Embree would also store the vertices a second time.
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(count));
  Build build{box_of};
  rtcSetGeometryUserData(geometry, &build);
  rtcSetGeometryBoundsFunction(geometry, &bounds_of, nullptr);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  const RTCError error = rtcGetDeviceError(device_);
  if (error != RTC_ERROR_NONE) {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
    throw std::runtime_error("Embree failed (error " + std::to_string(static_cast<int>(error)) +
                             ") to build a hierarchy of " + std::to_string(count) +
                             " triangles; most likely memory ran out: use a coarser mesh");
  }
}

Bvh::~Bvh() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

float Bvh::set_query(const glm::dvec3& point, double radius, double slack, Query& query) {
  query.x = static_cast<float>(point.x);
  query.y = static_cast<float>(point.y);
  query.z = static_cast<float>(point.z);
  const float float_error = rounded_up(glm::length(point - glm::dvec3(query.x, query.y, query.z)) + slack);
  query.radius = conservative(radius, float_error);
  return float_error;
}

void Bvh::visit_near(const Query& query, Visit visit, void* user) const noexcept {
  RTCPointQuery at{};
  at.x = query.x;
  at.y = query.y;
  at.z = query.z;
  at.radius = query.radius;
  RTCPointQueryContext context{};
  rtcInitPointQueryContext(&context);
  VisitContext call{visit, user};
  rtcPointQuery(scene_, &at, &context, &forward_to_visit, &call);
}

std::size_t Bvh::memory_bytes() const noexcept {
  return static_cast<std::size_t>(std::max<std::int64_t>(embree_bytes_.load(), 0));
}

}  // namespace polygon
