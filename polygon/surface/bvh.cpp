// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/surface/bvh.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <string>

namespace polygon {
namespace {

constexpr std::size_t kLargeTree = 1U << 18U;  // boxes

float rounded_down(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f : std::nextafterf(f, -std::numeric_limits<float>::infinity());
}

using BoxOf = std::function<BoxTree::Box(std::uint32_t)>;

struct Build {
  const BoxOf& box_of;
};
void bounds_of(const RTCBoundsFunctionArguments* args) {
  const BoxTree::Box box = static_cast<const Build*>(args->geometryUserPtr)->box_of(args->primID);
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

struct Asked {
  BoxTree::Visit visit;
  void* asker;
};
bool hand_on(RTCPointQueryFunctionArguments* args) {
  const Asked& asked = *static_cast<const Asked*>(args->userPtr);
  return asked.visit(asked.asker, args->primID, args->query->radius);
}

// The thread sanitizer does not see how Embree's threads wait for one another, as neither it nor oneTBB is
// built with it: every box that one of them read would be a race with whoever wrote it.
#ifdef __SANITIZE_THREAD__
constexpr const char* kDevice = "threads=1";
#else
constexpr const char* kDevice = nullptr;
#endif

}  // namespace

BoxTree::BoxTree(std::size_t count, const BoxOf& box_of) {
  device_ = rtcNewDevice(kDevice);
  if (device_ == nullptr) {
    throw std::runtime_error("Embree cannot start on this machine (error " +
                             std::to_string(static_cast<int>(rtcGetDeviceError(nullptr))) +
                             "); Embree 3 needs a processor with SSE2 and free memory");
  }
  rtcSetDeviceMemoryMonitorFunction(device_, &count_memory, &embree_bytes_);
  scene_ = rtcNewScene(device_);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  // Of a large mesh, queries wait for memory, and Embree's fast build is as quick to ask, takes a third of
  // the memory and half of the time; of a small one its looser boxes would cost a fifth of a query.
  rtcSetSceneBuildQuality(scene_, count > kLargeTree ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM);
  // User geometry, not Embree's triangles: its boxes are rounded outward here, which Embree's own float
  // vertices are not, and it holds no second copy of the vertices.
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

BoxTree::~BoxTree() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

float BoxTree::aim(const glm::dvec3& point, double radius, double slack, Query& query) {
  query.x = static_cast<float>(point.x);
  query.y = static_cast<float>(point.y);
  query.z = static_cast<float>(point.z);
  const float float_error = rounded_up(glm::length(point - glm::dvec3(query.x, query.y, query.z)) + slack);
  query.radius = conservative(radius, float_error);
  return float_error;
}

void BoxTree::ask(const Query& query, Visit visit, void* asker) const noexcept {
  RTCPointQuery at{};
  at.x = query.x;
  at.y = query.y;
  at.z = query.z;
  at.radius = query.radius;
  RTCPointQueryContext context{};
  rtcInitPointQueryContext(&context);
  Asked asked{visit, asker};
  rtcPointQuery(scene_, &at, &context, &hand_on, &asked);
}

std::size_t BoxTree::memory_bytes() const noexcept {
  return static_cast<std::size_t>(std::max<std::int64_t>(embree_bytes_.load(), 0));
}

}  // namespace polygon
