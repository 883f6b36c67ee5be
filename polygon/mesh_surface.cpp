// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/mesh_surface.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "polygon/mesh_bounds.h"
#include "polygon/topology.h"
#include "polygon/triangle.h"
#include "polygon/vertex_normals.h"

namespace polygon {
namespace {

constexpr std::uint32_t kNone = 0xffffffffU;
constexpr double kFurthestQuery = 1e18;        // (unit: meter) its square still is a float
constexpr std::size_t kLargeMesh = 1U << 18U;  // elements
constexpr double kFarAway = 700.0;  // radii of the mesh: where the rounding of floats, and a lens, cost least
constexpr double kRelativeSlack = 1e-6;  // of the few float roundings in Embree's box test, each at most 6e-8

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

float rounded_down(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f : std::nextafterf(f, -std::numeric_limits<float>::infinity());
}

float rounded_up(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) >= x ? f : std::nextafterf(f, std::numeric_limits<float>::infinity());
}

// The better of two nearest points, so that which is found first does not matter.
bool nearer(const NearPoint& a, const NearPoint& b) {
  return a.distance < b.distance || (a.distance == b.distance && a.element < b.element);
}

class MeshSurface final : public RigidSurface {
 public:
  MeshSurface(std::shared_ptr<const TriangleMesh> mesh, const SurfaceOptions& options);
  MeshSurface(const MeshSurface&) = delete;
  MeshSurface& operator=(const MeshSurface&) = delete;
  MeshSurface(MeshSurface&&) = delete;
  MeshSurface& operator=(MeshSurface&&) = delete;
  ~MeshSurface() override;

  [[nodiscard]] GatherResult gather(const glm::dvec3& point, double radius,
                                    std::span<NearPoint> out) const noexcept override;
  [[nodiscard]] bool nearest(const glm::dvec3& point, double radius, NearPoint& out) const noexcept override;
  [[nodiscard]] GatherResult survey(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                    std::span<SeenElement> out) const noexcept override;
  [[nodiscard]] NearPoint closest(std::uint32_t element, const glm::dvec3& point) const noexcept override;
  [[nodiscard]] glm::dvec3 face_normal(std::uint32_t element) const noexcept override {
    return normal(element);
  }
  [[nodiscard]] double support(std::uint32_t element, const glm::dvec3& normal) const noexcept override;
  [[nodiscard]] std::array<std::uint32_t, 3> neighbours(std::uint32_t element) const noexcept override {
    return across_[element];
  }
  [[nodiscard]] glm::dvec3 shaded_normal(std::uint32_t element, const glm::dvec3& point,
                                         const glm::dvec3& away) const noexcept override;
  [[nodiscard]] bool inside(const glm::dvec3& point) const noexcept override;
  [[nodiscard]] bool solid() const noexcept override { return solid_; }
  [[nodiscard]] std::size_t element_count() const noexcept override { return triangles_.size(); }
  [[nodiscard]] glm::dvec3 lower() const noexcept override { return centre_ + lower_; }
  [[nodiscard]] glm::dvec3 upper() const noexcept override { return centre_ + upper_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept override;

 private:
  struct GatherQuery {
    const MeshSurface* surface;
    glm::dvec3 point;  // from centre_, as all geometry here
    double radius;
    float float_error;  // how far the float query point lies from `point`, and its slack
    std::span<NearPoint> out;
    GatherResult result;
  };
  struct SurveyQuery {
    const MeshSurface* surface;
    glm::dvec3 centre, view;  // from centre_
    double radius;
    std::span<SeenElement> out;
    GatherResult result;
  };
  struct NearestQuery {
    const MeshSurface* surface;
    glm::dvec3 point;
    float float_error;
    bool skip_degenerate;
    NearPoint best;
    TriangleFeature feature;
    bool found;
    glm::dvec3
        asked_from;  // where the hierarchy is asked: `point`, or for a far one somewhere on the way to it
    double lens;     // 0, or the share of the way that is left
  };
  // The sum of normals at a corner (from == to) or an edge, over the elements that have it.
  struct PseudonormalQuery {
    const MeshSurface* surface;
    glm::dvec3 from, to;
    glm::dvec3 sum{0.0};
    std::uint32_t elements = 0, flat = 0;
  };

  static void bounds_of(const RTCBoundsFunctionArguments* args);
  static bool on_gather(RTCPointQueryFunctionArguments* args);
  static bool on_survey(RTCPointQueryFunctionArguments* args);
  static bool on_nearest(RTCPointQueryFunctionArguments* args);
  static bool on_pseudonormal(RTCPointQueryFunctionArguments* args);
  static bool on_memory(void* self, ssize_t bytes, bool post);

  [[nodiscard]] TrianglePoint closest(const glm::dvec3& local, std::uint32_t triangle) const {
    const TriangleIndices& t = triangles_[triangle];
    return closest_on_triangle(local, vertex(t[0]), vertex(t[1]), vertex(t[2]));
  }
  [[nodiscard]] glm::dvec3 vertex(std::uint32_t i) const { return mesh_->vertices[i] - centre_; }
  [[nodiscard]] std::uint32_t element_of(std::uint32_t primitive) const {
    return elements_.empty() ? primitive : elements_[primitive];
  }
  [[nodiscard]] glm::dvec3 normal(std::uint32_t triangle) const;
  [[nodiscard]] bool prepare(const glm::dvec3& point, double radius, glm::dvec3& local, float& float_error,
                             RTCPointQuery& query) const;
  [[nodiscard]] double lens_radius(const NearPoint& x, const NearestQuery& query) const;
  [[nodiscard]] bool find_nearest(const glm::dvec3& point, double radius, NearestQuery& query) const;
  [[nodiscard]] PseudonormalQuery pseudonormal(const glm::dvec3& from, const glm::dvec3& to) const;
  void build_hierarchy();

  std::shared_ptr<const TriangleMesh> mesh_;
  std::span<const TriangleIndices> triangles_;  // of mesh_
  bool solid_;
  glm::dvec3 centre_{0.0};
  glm::dvec3 lower_{0.0}, upper_{0.0};     // from centre_
  std::vector<TriangleIndices> across_;    // [triangle][edge]
  std::vector<std::uint32_t> elements_;    // what the hierarchy holds: no duplicates; empty: all triangles
  std::vector<glm::vec3> vertex_normals_;  // only when asked for
  double slack_ = 0.0;                     // of taking coordinates from centre_ (unit: meter)
  std::atomic<std::int64_t> embree_bytes_{0};
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

// Float radius that is sure to reach what lies within `radius` of the true point.
float conservative(double radius, float float_error) {
  const double reach = (radius + static_cast<double>(float_error)) * (1.0 + kRelativeSlack) + 1e-30;
  return reach < kFurthestQuery ? rounded_up(reach) : std::numeric_limits<float>::infinity();
}

// Points the query, and returns how far the float point lies from the true one, and the slack.
float aim(const glm::dvec3& local, double radius, double slack, RTCPointQuery& query) {
  query.x = static_cast<float>(local.x);
  query.y = static_cast<float>(local.y);
  query.z = static_cast<float>(local.z);
  query.time = 0.0F;
  const float float_error = rounded_up(glm::length(local - glm::dvec3(query.x, query.y, query.z)) + slack);
  query.radius = conservative(radius, float_error);
  return float_error;
}

MeshSurface::MeshSurface(std::shared_ptr<const TriangleMesh> mesh, const SurfaceOptions& options)
    : mesh_(std::move(mesh)), solid_(options.solid) {
  if (mesh_ == nullptr) throw std::invalid_argument("there is no mesh; a surface needs one");
  const auto [low, high] = checked_bounds(*mesh_);
  triangles_ = mesh_->triangles;
  centre_ = 0.5 * (low + high);
  lower_ = low - centre_;
  upper_ = high - centre_;
  slack_ = 1e-15 * (glm::length(glm::max(glm::abs(low), glm::abs(high))) + glm::length(high - low));
  Connections connections = connect_triangles(*mesh_);
  elements_ = std::move(connections.distinct);
  across_ = std::move(connections.across);
  if (options.vertex_normals) vertex_normals_ = angle_weighted_normals(*mesh_);
  build_hierarchy();
}

void MeshSurface::build_hierarchy() {
  device_ = rtcNewDevice(nullptr);
  if (device_ == nullptr) {
    throw std::runtime_error("Embree cannot start on this machine (error " +
                             std::to_string(static_cast<int>(rtcGetDeviceError(nullptr))) +
                             "); Embree 3 needs a processor with SSE2 and free memory");
  }
  rtcSetDeviceMemoryMonitorFunction(device_, &MeshSurface::on_memory, this);
  scene_ = rtcNewScene(device_);
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  // Of a large mesh, queries wait for memory, and Embree's fast build is as quick to ask, takes a third of
  // the memory and half of the time; of a small one its looser boxes would cost a fifth of a query.
  const std::size_t elements = elements_.empty() ? triangles_.size() : elements_.size();
  rtcSetSceneBuildQuality(scene_, elements > kLargeMesh ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM);
  // User geometry, not Embree's triangles: its boxes are rounded outward here, which Embree's own float
  // vertices are not, and it holds no second copy of the vertices.
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(elements));
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, &MeshSurface::bounds_of, nullptr);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  const RTCError error = rtcGetDeviceError(device_);
  if (error != RTC_ERROR_NONE) {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
    throw std::runtime_error("Embree failed (error " + std::to_string(static_cast<int>(error)) +
                             ") to build a hierarchy of " + std::to_string(elements) +
                             " triangles; most likely memory ran out: use a coarser mesh");
  }
}

MeshSurface::~MeshSurface() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

glm::dvec3 MeshSurface::normal(std::uint32_t triangle) const {
  const TriangleIndices& t = triangles_[triangle];
  return unit_normal(vertex(t[0]), vertex(t[1]), vertex(t[2]));
}

void MeshSurface::bounds_of(const RTCBoundsFunctionArguments* args) {
  const auto* self = static_cast<const MeshSurface*>(args->geometryUserPtr);
  const TriangleIndices& t = self->triangles_[self->element_of(args->primID)];
  const glm::dvec3 a = self->vertex(t[0]), b = self->vertex(t[1]), c = self->vertex(t[2]);
  const glm::dvec3 low = glm::min(glm::min(a, b), c);
  const glm::dvec3 high = glm::max(glm::max(a, b), c);
  args->bounds_o->lower_x = rounded_down(low.x);
  args->bounds_o->lower_y = rounded_down(low.y);
  args->bounds_o->lower_z = rounded_down(low.z);
  args->bounds_o->upper_x = rounded_up(high.x);
  args->bounds_o->upper_y = rounded_up(high.y);
  args->bounds_o->upper_z = rounded_up(high.z);
}

bool MeshSurface::on_memory(void* self, ssize_t bytes, bool /*post*/) {
  static_cast<MeshSurface*>(self)->embree_bytes_ += bytes;
  return true;
}

// rtcPointQuery checks nothing, so everything is checked here. False: nothing can be found.
bool MeshSurface::prepare(const glm::dvec3& point, double radius, glm::dvec3& local, float& float_error,
                          RTCPointQuery& query) const {
  if (!is_finite(point) || !(radius >= 0.0)) return false;
  local = point - centre_;
  if (!(glm::length(local) < kFurthestQuery)) return false;
  const glm::dvec3 outside = glm::max(glm::max(lower_ - local, local - upper_), glm::dvec3(0.0));
  const double slack = slack_ + 1e-15 * glm::length(point);
  if (glm::length(outside) > radius * (1.0 + 1e-12) + slack) return false;
  float_error = aim(local, radius, slack, query);
  return true;
}

bool MeshSurface::on_gather(RTCPointQueryFunctionArguments* args) {
  auto& q = *static_cast<GatherQuery*>(args->userPtr);
  const std::uint32_t element = q.surface->element_of(args->primID);
  const TrianglePoint closest = q.surface->closest(q.point, element);
  const NearPoint found{closest.point, std::sqrt(closest.squared_distance), element};
  if (!(found.distance <= q.radius)) return false;
  if (q.result.count < q.out.size()) {
    q.out[q.result.count++] = found;
    if (q.result.count == q.out.size()) std::make_heap(q.out.begin(), q.out.end(), nearer);
    return false;
  }
  // Full: keep the nearest, and look no further than the furthest of them.
  q.result.complete = false;
  if (q.out.empty()) {
    args->query->radius = 0.0F;
    return true;
  }
  if (nearer(found, q.out.front())) {
    std::pop_heap(q.out.begin(), q.out.end(), nearer);
    q.out.back() = found;
    std::push_heap(q.out.begin(), q.out.end(), nearer);
  }
  args->query->radius = std::min(args->query->radius, conservative(q.out.front().distance, q.float_error));
  return true;
}

GatherResult MeshSurface::gather(const glm::dvec3& point, double radius,
                                 std::span<NearPoint> out) const noexcept {
  GatherQuery q{this, {}, radius, 0.0F, out, {}};
  RTCPointQuery query{};
  if (!prepare(point, radius, q.point, q.float_error, query)) return {};
  RTCPointQueryContext context{};
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_, &query, &context, &MeshSurface::on_gather, &q);
  const std::span<NearPoint> found = out.first(q.result.count);
  std::sort(found.begin(), found.end(),
            [](const NearPoint& a, const NearPoint& b) { return a.element < b.element; });
  for (NearPoint& p : found) p.point += centre_;
  return q.result;
}

bool MeshSurface::on_survey(RTCPointQueryFunctionArguments* args) {
  auto& q = *static_cast<SurveyQuery*>(args->userPtr);
  const MeshSurface& self = *q.surface;
  const std::uint32_t element = self.element_of(args->primID);
  const TriangleIndices& t = self.triangles_[element];
  TriangleSight sight;
  if (!see_triangle(q.centre, q.radius, q.view, self.vertex(t[0]), self.vertex(t[1]), self.vertex(t[2]),
                    sight))
    return false;
  if (q.result.count == q.out.size()) {
    q.result.complete = false;
    args->query->radius = 0.0F;
    return true;
  }
  q.out[q.result.count++] = {sight.normal, sight.reach + glm::dot(sight.normal, self.centre_), element};
  return false;
}

GatherResult MeshSurface::survey(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                 std::span<SeenElement> out) const noexcept {
  SurveyQuery q{this, {}, view - centre_, radius, out, {}};
  RTCPointQuery query{};
  float float_error = 0.0F;
  if (!prepare(centre, radius, q.centre, float_error, query)) return {};
  RTCPointQueryContext context{};
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_, &query, &context, &MeshSurface::on_survey, &q);
  return q.result;
}

NearPoint MeshSurface::closest(std::uint32_t element, const glm::dvec3& point) const noexcept {
  const TrianglePoint found = closest(point - centre_, element);
  return {found.point + centre_, std::sqrt(found.squared_distance), element};
}

double MeshSurface::support(std::uint32_t element, const glm::dvec3& normal) const noexcept {
  const TriangleIndices& t = triangles_[element];
  return glm::dot(normal, centre_) + std::max({glm::dot(normal, vertex(t[0])), glm::dot(normal, vertex(t[1])),
                                               glm::dot(normal, vertex(t[2]))});
}

glm::dvec3 MeshSurface::shaded_normal(std::uint32_t element, const glm::dvec3& point,
                                      const glm::dvec3& away) const noexcept {
  const TriangleIndices& t = triangles_[element];
  const glm::dvec3 face = normal(element);
  glm::dvec3 shaded = face;
  if (!vertex_normals_.empty() && face != glm::dvec3(0.0)) {
    // Barycentric coordinates by areas seen along the face's normal (Ericson, Real-Time Collision Detection,
    // 3.4).
    const glm::dvec3 a = vertex(t[0]), b = vertex(t[1]), c = vertex(t[2]);
    const glm::dvec3 p = point - centre_;
    const double wa = std::max(0.0, glm::dot(face, glm::cross(c - b, p - b)));
    const double wb = std::max(0.0, glm::dot(face, glm::cross(a - c, p - c)));
    const double wc = std::max(0.0, glm::dot(face, glm::cross(b - a, p - a)));
    const glm::dvec3 sum = wa * glm::dvec3(vertex_normals_[t[0]]) + wb * glm::dvec3(vertex_normals_[t[1]]) +
                           wc * glm::dvec3(vertex_normals_[t[2]]);
    if (glm::dot(sum, sum) > 0.0) shaded = glm::normalize(sum);
  }
  return glm::dot(shaded, away) < 0.0 ? -shaded : shaded;
}

bool MeshSurface::on_nearest(RTCPointQueryFunctionArguments* args) {
  auto& q = *static_cast<NearestQuery*>(args->userPtr);
  const std::uint32_t element = q.surface->element_of(args->primID);
  if (q.skip_degenerate) {
    const TriangleIndices& t = q.surface->triangles_[element];
    const MeshSurface& self = *q.surface;
    if (is_degenerate(self.vertex(t[0]), self.vertex(t[1]), self.vertex(t[2]))) return false;
  }
  const TrianglePoint closest = q.surface->closest(q.point, element);
  const NearPoint found{closest.point, std::sqrt(closest.squared_distance), element};
  if (q.lens > 0.0) {
    // Whether or not it is near enough to be an answer, nothing beyond it needs to be looked at.
    args->query->radius =
        std::min(args->query->radius, conservative(q.surface->lens_radius(found, q), q.float_error));
  }
  // best.distance starts as the radius, with an element above all others: the radius itself still counts.
  if (!nearer(found, q.best)) return q.lens > 0.0;
  q.best = found;
  q.feature = closest.feature;
  q.found = true;
  if (q.lens == 0.0) {
    args->query->radius = std::min(args->query->radius, conservative(found.distance, q.float_error));
  }
  return true;
}

// From far away the float distances of all triangles are equal, and the hierarchy would hand out every one of
// them. So it is asked from a place on the way, s from the centre where the point is S. Of the ball B about
// the mesh, of radius L, all that is as near to the point as x lies within
// √(|x − place|² + (L² − |x|²)(1 − s/S)) of that place (the ball around the point, written in terms of x and
// cut with B), which for s ≫ L is hardly more than x's own distance.
double MeshSurface::lens_radius(const NearPoint& x, const NearestQuery& q) const {
  const glm::dvec3 away = x.point - q.asked_from;
  const double within = glm::dot(upper_, upper_) - glm::dot(x.point, x.point);
  return std::sqrt(glm::dot(away, away) + std::max(0.0, within) * q.lens);
}

bool MeshSurface::find_nearest(const glm::dvec3& point, double radius, NearestQuery& q) const {
  q.surface = this;
  q.best = {{}, radius, kNone};
  q.found = false;
  RTCPointQuery query{};
  if (!prepare(point, radius, q.point, q.float_error, query)) return false;
  q.asked_from = q.point;
  q.lens = 0.0;
  const double distance = glm::length(q.point), far = kFarAway * glm::length(upper_);
  if (distance > far && far > 0.0) {
    q.asked_from = q.point * (far / distance);
    q.lens = 1.0 - far / distance;
    q.float_error = aim(q.asked_from, std::numeric_limits<double>::infinity(), slack_, query);
  }
  RTCPointQueryContext context{};
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_, &query, &context, &MeshSurface::on_nearest, &q);
  return q.found;
}

bool MeshSurface::nearest(const glm::dvec3& point, double radius, NearPoint& out) const noexcept {
  NearestQuery q{};
  if (!find_nearest(point, radius, q)) return false;
  out = q.best;
  out.point += centre_;
  return true;
}

bool MeshSurface::inside(const glm::dvec3& point) const noexcept {
  if (!solid_ || !is_finite(point)) return false;
  const glm::dvec3 local = point - centre_;
  if (glm::any(glm::lessThan(local, lower_)) || glm::any(glm::greaterThan(local, upper_))) return false;
  NearestQuery q{};
  q.skip_degenerate = true;
  if (!find_nearest(point, std::numeric_limits<double>::infinity(), q)) return false;
  if (q.best.distance == 0.0) return false;  // on the surface

  glm::dvec3 normal_here(0.0);
  const auto feature = static_cast<std::size_t>(q.feature);
  const TriangleIndices& t = triangles_[q.best.element];
  const std::vector<glm::dvec3>& v = mesh_->vertices;
  if (q.feature == TriangleFeature::face) {
    normal_here = normal(q.best.element);
  } else if (feature >= 3) {
    const PseudonormalQuery edge = pseudonormal(v[t[feature - 3]], v[t[(feature - 2) % 3]]);
    // A sliver across the edge has no normal to give, and neither side of it decides alone.
    if (edge.elements != 2 || edge.flat != 0) return winds_around(*mesh_, point);
    normal_here = edge.sum;
  } else {
    normal_here = pseudonormal(v[t[feature]], v[t[feature]]).sum;
  }
  const glm::dvec3 away = (local - q.best.point) / q.best.distance;
  const double side = glm::dot(away, normal_here);
  // At a fold so sharp that the normals cancel, the sign would be rounding.
  if (std::abs(side) < 1e-9) return winds_around(*mesh_, point);
  return side < 0.0;
}

// Angle-weighted pseudonormals (Baerentzen and Aanaes, Signed distance computation using the angle weighted
// pseudonormal, 2005): at an edge or a corner the sign of the distance must not depend on which of the
// triangles there was found first. They are found when they are needed: kept for every vertex and edge they
// would take as much memory as the mesh itself.
bool MeshSurface::on_pseudonormal(RTCPointQueryFunctionArguments* args) {
  auto& q = *static_cast<PseudonormalQuery*>(args->userPtr);
  const TriangleIndices& t = q.surface->triangles_[q.surface->element_of(args->primID)];
  const std::vector<glm::dvec3>& v = q.surface->mesh_->vertices;
  const glm::dvec3 &a = v[t[0]], &b = v[t[1]], &c = v[t[2]];
  if (a == b || b == c || c == a) return false;
  const auto has = [&](const glm::dvec3& corner) { return a == corner || b == corner || c == corner; };
  if (!has(q.from) || !has(q.to)) return false;
  const glm::dvec3 normal = unit_normal(a, b, c);
  ++q.elements;
  q.flat += normal == glm::dvec3(0.0) ? 1 : 0;
  if (q.from != q.to) {
    q.sum += normal;
  } else {
    q.sum += normal * (a == q.from   ? corner_angle(a, b, c)
                       : b == q.from ? corner_angle(b, c, a)
                                     : corner_angle(c, a, b));
  }
  return false;
}

MeshSurface::PseudonormalQuery MeshSurface::pseudonormal(const glm::dvec3& from, const glm::dvec3& to) const {
  PseudonormalQuery q{.surface = this, .from = from, .to = to};
  RTCPointQuery query{};
  glm::dvec3 local(0.0);
  float float_error = 0.0F;
  if (!prepare(from, 0.0, local, float_error, query)) return q;
  RTCPointQueryContext context{};
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_, &query, &context, &MeshSurface::on_pseudonormal, &q);
  return q;
}

std::size_t MeshSurface::memory_bytes() const noexcept {
  const auto embree = static_cast<std::size_t>(std::max<std::int64_t>(embree_bytes_.load(), 0));
  return sizeof(*this) + embree + mesh_->vertices.capacity() * sizeof(glm::dvec3) +
         (mesh_->triangles.capacity() + across_.capacity()) * sizeof(TriangleIndices) +
         elements_.capacity() * sizeof(std::uint32_t) + vertex_normals_.capacity() * sizeof(glm::vec3);
}

}  // namespace

std::unique_ptr<RigidSurface> make_mesh_surface(std::shared_ptr<const TriangleMesh> mesh,
                                                const SurfaceOptions& options) {
  return std::make_unique<MeshSurface>(std::move(mesh), options);
}

std::unique_ptr<RigidSurface> make_mesh_surface(const TriangleMesh& mesh, bool solid) {
  return make_mesh_surface(std::make_shared<const TriangleMesh>(mesh), {.solid = solid});
}

}  // namespace polygon
