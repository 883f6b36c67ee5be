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
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "polygon/topology.h"
#include "polygon/triangle.h"

namespace polygon {
namespace {

constexpr std::uint32_t kNone = 0xffffffffU;
constexpr double kFurthestVertex = 1e12;  // (unit: meter) keeps every square and product far from overflow
constexpr double kFurthestQuery = 1e18;   // (unit: meter) its square still is a float
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
  MeshSurface(const TriangleMesh& mesh, bool solid);
  MeshSurface(const MeshSurface&) = delete;
  MeshSurface& operator=(const MeshSurface&) = delete;
  MeshSurface(MeshSurface&&) = delete;
  MeshSurface& operator=(MeshSurface&&) = delete;
  ~MeshSurface() override;

  [[nodiscard]] GatherResult gather(const glm::dvec3& point, double radius,
                                    std::span<NearPoint> out) const noexcept override;
  [[nodiscard]] bool nearest(const glm::dvec3& point, double radius, NearPoint& out) const noexcept override;
  [[nodiscard]] bool inside(const glm::dvec3& point) const noexcept override;
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
  struct NearestQuery {
    const MeshSurface* surface;
    glm::dvec3 point;
    float float_error;
    bool skip_degenerate;
    NearPoint best;
    TriangleFeature feature;
    bool found;
  };

  static void bounds_of(const RTCBoundsFunctionArguments* args);
  static bool on_gather(RTCPointQueryFunctionArguments* args);
  static bool on_nearest(RTCPointQueryFunctionArguments* args);
  static bool on_memory(void* self, ssize_t bytes, bool post);

  [[nodiscard]] TrianglePoint closest(const glm::dvec3& local, std::uint32_t triangle) const {
    const TriangleIndices& t = triangles_[triangle];
    return closest_on_triangle(local, vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]);
  }
  [[nodiscard]] glm::dvec3 normal(std::uint32_t triangle) const;
  [[nodiscard]] bool prepare(const glm::dvec3& point, double radius, glm::dvec3& local, float& float_error,
                             RTCPointQuery& query) const;
  [[nodiscard]] bool find_nearest(const glm::dvec3& point, double radius, NearestQuery& query) const;
  [[nodiscard]] bool inside_by_winding(const glm::dvec3& local) const;
  void build_hierarchy();
  void build_normals(std::span<const TriangleIndices> welded, const WeldedVertices& points);

  bool solid_;
  glm::dvec3 centre_{0.0};
  glm::dvec3 lower_{0.0}, upper_{0.0};  // from centre_
  std::vector<glm::dvec3> vertices_;    // from centre_
  std::vector<TriangleIndices> triangles_;
  std::vector<std::uint32_t> elements_;                   // what the hierarchy holds: no duplicates
  std::vector<std::array<std::uint32_t, 3>> neighbours_;  // solid only: across each edge, or kNone
  std::vector<glm::dvec3> vertex_normals_;                // solid only: angle-weighted
  double slack_ = 0.0;                                    // of taking coordinates from centre_ (unit: meter)
  std::atomic<std::int64_t> embree_bytes_{0};
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

// Float radius that is sure to reach what lies within `radius` of the true point.
float conservative(double radius, float float_error) {
  const double reach = (radius + static_cast<double>(float_error)) * (1.0 + kRelativeSlack) + 1e-30;
  return reach < kFurthestQuery ? rounded_up(reach) : std::numeric_limits<float>::infinity();
}

MeshSurface::MeshSurface(const TriangleMesh& mesh, bool solid) : solid_(solid), triangles_(mesh.triangles) {
  if (mesh.triangles.empty()) {
    throw std::invalid_argument("the mesh has no triangle; a surface needs at least one");
  }
  if (mesh.triangles.size() >= kNone || mesh.vertices.size() >= kNone) {
    throw std::invalid_argument("the mesh has " + std::to_string(mesh.triangles.size()) +
                                " triangles, more than 2^32 - 2; split it");
  }
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high(-std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t corner : mesh.triangles[i]) {
      if (corner >= mesh.vertices.size()) {
        throw std::invalid_argument("triangle " + std::to_string(i) + " uses vertex " +
                                    std::to_string(corner) + " of " + std::to_string(mesh.vertices.size()) +
                                    "; leave it out");
      }
      const glm::dvec3& v = mesh.vertices[corner];
      if (!is_finite(v) || glm::any(glm::greaterThan(glm::abs(v), glm::dvec3(kFurthestVertex)))) {
        throw std::invalid_argument("vertex " + std::to_string(corner) +
                                    " is not finite, or beyond 1e12 m; leave out the triangles that use it");
      }
      low = glm::min(low, v);
      high = glm::max(high, v);
    }
  }
  centre_ = 0.5 * (low + high);
  lower_ = low - centre_;
  upper_ = high - centre_;
  slack_ = 1e-15 * (glm::length(glm::max(glm::abs(low), glm::abs(high))) + glm::length(high - low));
  vertices_.reserve(mesh.vertices.size());
  for (const glm::dvec3& v : mesh.vertices) vertices_.push_back(v - centre_);

  {
    const WeldedVertices points = weld_vertices(mesh.vertices);
    const std::vector<TriangleIndices> welded = welded_triangles(mesh, points);
    const std::vector<std::uint32_t> first = first_duplicates(welded, points.points);
    elements_.reserve(first.size());
    for (std::uint32_t i = 0; i < first.size(); ++i) {
      if (first[i] == i) elements_.push_back(i);
    }
    elements_.shrink_to_fit();
    if (solid_) build_normals(welded, points);
  }
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
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
  // User geometry, not Embree's triangles: its boxes are rounded outward here, which Embree's own float
  // vertices are not, and it holds no second copy of the vertices.
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(elements_.size()));
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
                             ") to build a hierarchy of " + std::to_string(elements_.size()) +
                             " triangles; most likely memory ran out: use a coarser mesh");
  }
}

MeshSurface::~MeshSurface() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

// Angle-weighted pseudonormals (Baerentzen and Aanaes, Signed distance computation using the angle weighted
// pseudonormal, 2005): at an edge or a corner the sign of the distance must not depend on which of the
// triangles there was found first.
void MeshSurface::build_normals(std::span<const TriangleIndices> welded, const WeldedVertices& points) {
  std::vector<glm::dvec3> point_normals(points.points, glm::dvec3(0.0));
  for (std::uint32_t i = 0; i < welded.size(); ++i) {
    const glm::dvec3 n = normal(i);
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::dvec3& here = vertices_[triangles_[i][c]];
      const glm::dvec3 to_next = vertices_[triangles_[i][(c + 1) % 3]] - here;
      const glm::dvec3 to_last = vertices_[triangles_[i][(c + 2) % 3]] - here;
      const double angle = std::atan2(glm::length(glm::cross(to_next, to_last)), glm::dot(to_next, to_last));
      point_normals[welded[i][c]] += angle * n;
    }
  }
  vertex_normals_.reserve(vertices_.size());
  for (const std::uint32_t point : points.point_of) vertex_normals_.push_back(point_normals[point]);

  neighbours_.assign(welded.size(), {kNone, kNone, kNone});
  const std::vector<EdgeUse> edges = sorted_edges(welded, points.points);
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    const EdgeUse& a = edges[i];
    const EdgeUse& b = edges[i + 1];
    if (a.low != b.low || a.high != b.high) continue;
    neighbours_[a.triangle][a.edge] = b.triangle;
    neighbours_[b.triangle][b.edge] = a.triangle;
  }
}

// Unit normal; zero for a degenerate triangle, whose normal would be rounding.
glm::dvec3 MeshSurface::normal(std::uint32_t triangle) const {
  const TriangleIndices& t = triangles_[triangle];
  const glm::dvec3 &a = vertices_[t[0]], &b = vertices_[t[1]], &c = vertices_[t[2]];
  if (is_degenerate(a, b, c)) return glm::dvec3(0.0);
  // Scaled first: the cross product of two nanometer edges would have a length whose square is denormal.
  const glm::dvec3 n = glm::cross(glm::normalize(b - a), glm::normalize(c - a));
  return glm::normalize(n);
}

void MeshSurface::bounds_of(const RTCBoundsFunctionArguments* args) {
  const auto* self = static_cast<const MeshSurface*>(args->geometryUserPtr);
  const TriangleIndices& t = self->triangles_[self->elements_[args->primID]];
  const glm::dvec3 &a = self->vertices_[t[0]], &b = self->vertices_[t[1]], &c = self->vertices_[t[2]];
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
  query.x = static_cast<float>(local.x);
  query.y = static_cast<float>(local.y);
  query.z = static_cast<float>(local.z);
  query.time = 0.0F;
  float_error = rounded_up(glm::length(local - glm::dvec3(query.x, query.y, query.z)) + slack);
  query.radius = conservative(radius, float_error);
  return true;
}

bool MeshSurface::on_gather(RTCPointQueryFunctionArguments* args) {
  auto& q = *static_cast<GatherQuery*>(args->userPtr);
  const std::uint32_t element = q.surface->elements_[args->primID];
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

bool MeshSurface::on_nearest(RTCPointQueryFunctionArguments* args) {
  auto& q = *static_cast<NearestQuery*>(args->userPtr);
  const std::uint32_t element = q.surface->elements_[args->primID];
  if (q.skip_degenerate) {
    const TriangleIndices& t = q.surface->triangles_[element];
    const std::vector<glm::dvec3>& v = q.surface->vertices_;
    if (is_degenerate(v[t[0]], v[t[1]], v[t[2]])) return false;
  }
  const TrianglePoint closest = q.surface->closest(q.point, element);
  const NearPoint found{closest.point, std::sqrt(closest.squared_distance), element};
  // best.distance starts as the radius, with an element above all others: the radius itself still counts.
  if (!nearer(found, q.best)) return false;
  q.best = found;
  q.feature = closest.feature;
  q.found = true;
  args->query->radius = std::min(args->query->radius, conservative(found.distance, q.float_error));
  return true;
}

bool MeshSurface::find_nearest(const glm::dvec3& point, double radius, NearestQuery& q) const {
  q.surface = this;
  q.best = {{}, radius, kNone};
  q.found = false;
  RTCPointQuery query{};
  if (!prepare(point, radius, q.point, q.float_error, query)) return false;
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

  glm::dvec3 pseudonormal(0.0);
  const auto feature = static_cast<std::size_t>(q.feature);
  if (q.feature == TriangleFeature::face) {
    pseudonormal = normal(q.best.element);
  } else if (feature >= 3) {
    const std::uint32_t across = neighbours_[q.best.element][feature - 3];
    const glm::dvec3 n = across == kNone ? glm::dvec3(0.0) : normal(across);
    // A sliver across the edge has no normal to give, and neither side of it decides alone.
    if (n == glm::dvec3(0.0)) return inside_by_winding(local);
    pseudonormal = normal(q.best.element) + n;
  } else {
    pseudonormal = vertex_normals_[triangles_[q.best.element][feature]];
  }
  const glm::dvec3 away = (local - q.best.point) / q.best.distance;
  const double side = glm::dot(away, pseudonormal);
  // At a fold so sharp that the normals cancel, the sign would be rounding.
  if (std::abs(side) < 1e-9) return inside_by_winding(local);
  return side < 0.0;
}

// The solid angle of the whole mesh (van Oosterom and Strackee 1983): right whatever the nearest triangles
// look like, but it visits them all, so it only decides where the pseudonormal cannot.
bool MeshSurface::inside_by_winding(const glm::dvec3& local) const {
  double half_angle = 0.0;
  for (const TriangleIndices& t : triangles_) {
    const glm::dvec3 a = vertices_[t[0]] - local, b = vertices_[t[1]] - local, c = vertices_[t[2]] - local;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    half_angle += std::atan2(glm::dot(a, glm::cross(b, c)),
                             la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return half_angle > std::numbers::pi;  // half of the full 2π
}

std::size_t MeshSurface::memory_bytes() const noexcept {
  const auto embree = static_cast<std::size_t>(std::max<std::int64_t>(embree_bytes_.load(), 0));
  return sizeof(*this) + embree + vertices_.capacity() * sizeof(glm::dvec3) +
         triangles_.capacity() * sizeof(TriangleIndices) + elements_.capacity() * sizeof(std::uint32_t) +
         neighbours_.capacity() * sizeof(neighbours_[0]) + vertex_normals_.capacity() * sizeof(glm::dvec3);
}

}  // namespace

std::unique_ptr<RigidSurface> make_mesh_surface(const TriangleMesh& mesh, bool solid) {
  return std::make_unique<MeshSurface>(mesh, solid);
}

}  // namespace polygon
