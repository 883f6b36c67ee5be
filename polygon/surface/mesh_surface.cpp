// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/surface/mesh_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "polygon/mesh/is_finite.h"
#include "polygon/mesh/mesh_bounds.h"
#include "polygon/mesh/topology.h"
#include "polygon/mesh/triangle.h"
#include "polygon/mesh/vertex_normals.h"
#include "polygon/surface/bvh.h"

namespace polygon {
namespace {

// Distance of the query that replaces one from further away (lens_radius()), in radii of the mesh. At this
// distance the rounding of floats and the lens together cost least.
constexpr double kFarAway = 700.0;

class MeshSurface final : public RigidSurface {
 public:
  MeshSurface(std::shared_ptr<const TriangleMesh> mesh, const SurfaceOptions& options);
  MeshSurface(const MeshSurface&) = delete;
  MeshSurface& operator=(const MeshSurface&) = delete;
  MeshSurface(MeshSurface&&) = delete;
  MeshSurface& operator=(MeshSurface&&) = delete;
  ~MeshSurface() override = default;

  [[nodiscard]] GatherResult gather(const glm::dvec3& point, double radius,
                                    std::span<NearPoint> out) const noexcept override;
  [[nodiscard]] bool nearest(const glm::dvec3& point, double radius, NearPoint& out) const noexcept override;
  [[nodiscard]] GatherResult survey(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                    std::span<ElementPlane> out) const noexcept override;
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
    glm::dvec3 point;  // relative to centre_, as all geometry here
    double radius;
    float float_error;  // distance of the float query point from `point`, plus slack
    std::span<NearPoint> out;
    GatherResult result;
  };
  struct SurveyQuery {
    const MeshSurface* surface;
    glm::dvec3 centre, view;  // relative to centre_
    double radius;
    std::span<ElementPlane> out;
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
    glm::dvec3 query_origin;  // `point`, or for a far point a place on the line to it
    double lens;              // 0, or the fraction of the line that lies beyond query_origin
  };
  // Sum of the normals at a corner (from == to) or an edge, over the elements that share it.
  struct PseudonormalQuery {
    const MeshSurface* surface;
    glm::dvec3 from, to;
    glm::dvec3 sum{0.0};
    std::uint32_t elements = 0, flat = 0;
  };

  static bool on_gather(void* user, std::uint32_t box, float& radius);
  static bool on_survey(void* user, std::uint32_t box, float& radius);
  static bool on_nearest(void* user, std::uint32_t box, float& radius);
  static bool on_pseudonormal(void* user, std::uint32_t box, float& radius);

  [[nodiscard]] TrianglePoint closest(const glm::dvec3& local, std::uint32_t triangle) const {
    const TriangleIndices& t = triangles_[triangle];
    return closest_on_triangle(local, vertex(t[0]), vertex(t[1]), vertex(t[2]));
  }
  [[nodiscard]] glm::dvec3 vertex(std::uint32_t i) const { return mesh_->vertices[i] - centre_; }
  [[nodiscard]] std::uint32_t element_of(std::uint32_t box) const {
    return elements_.empty() ? box : elements_[box];
  }
  [[nodiscard]] glm::dvec3 normal(std::uint32_t triangle) const;
  [[nodiscard]] bool prepare(const glm::dvec3& point, double radius, glm::dvec3& local, float& float_error,
                             Bvh::Query& query) const;
  [[nodiscard]] double lens_radius(const NearPoint& x, const NearestQuery& query) const;
  [[nodiscard]] bool find_nearest(const glm::dvec3& point, double radius, NearestQuery& query) const;
  [[nodiscard]] PseudonormalQuery pseudonormal(const glm::dvec3& from, const glm::dvec3& to) const;

  std::shared_ptr<const TriangleMesh> mesh_;
  std::span<const TriangleIndices> triangles_;  // of mesh_
  bool solid_;
  glm::dvec3 centre_{0.0};
  glm::dvec3 lower_{0.0}, upper_{0.0};     // relative to centre_
  std::vector<TriangleIndices> across_;    // [triangle][edge]
  std::vector<std::uint32_t> elements_;    // [box] its element; duplicates left out; empty: every triangle is
                                           // an element
  std::vector<glm::vec3> vertex_normals_;  // only if asked for
  double slack_ = 0.0;                     // rounding error of coordinates relative to centre_ (unit: meter)
  std::optional<Bvh> tree_;                // of elements; always set
};

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
  tree_.emplace(elements_.empty() ? triangles_.size() : elements_.size(), [this](std::uint32_t box) {
    const TriangleIndices& t = triangles_[element_of(box)];
    const glm::dvec3 a = vertex(t[0]), b = vertex(t[1]), c = vertex(t[2]);
    return Bvh::Box{glm::min(glm::min(a, b), c), glm::max(glm::max(a, b), c)};
  });
}

glm::dvec3 MeshSurface::normal(std::uint32_t triangle) const {
  const TriangleIndices& t = triangles_[triangle];
  return unit_normal(vertex(t[0]), vertex(t[1]), vertex(t[2]));
}

// Embree checks nothing, so every argument is checked here. False: nothing can be found.
bool MeshSurface::prepare(const glm::dvec3& point, double radius, glm::dvec3& local, float& float_error,
                          Bvh::Query& query) const {
  if (!is_finite(point) || !(radius >= 0.0)) return false;
  local = point - centre_;
  if (!(glm::length(local) < kFurthestQuery)) return false;
  const glm::dvec3 outside = glm::max(glm::max(lower_ - local, local - upper_), glm::dvec3(0.0));
  const double slack = slack_ + 1e-15 * glm::length(point);
  if (glm::length(outside) > radius * (1.0 + 1e-12) + slack) return false;
  float_error = Bvh::set_query(local, radius, slack, query);
  return true;
}

bool MeshSurface::on_gather(void* user, std::uint32_t box, float& radius) {
  auto& q = *static_cast<GatherQuery*>(user);
  const std::uint32_t element = q.surface->element_of(box);
  const TrianglePoint closest = q.surface->closest(q.point, element);
  const NearPoint found{closest.point, std::sqrt(closest.squared_distance), element};
  if (!(found.distance <= q.radius)) return false;
  if (q.result.count < q.out.size()) {
    q.out[q.result.count++] = found;
    if (q.result.count == q.out.size()) std::make_heap(q.out.begin(), q.out.end(), nearer);
    return false;
  }
  // Full: keep the nearest, and shrink the radius to the furthest of them.
  q.result.complete = false;
  if (q.out.empty()) {
    radius = 0.0F;
    return true;
  }
  if (nearer(found, q.out.front())) {
    std::pop_heap(q.out.begin(), q.out.end(), nearer);
    q.out.back() = found;
    std::push_heap(q.out.begin(), q.out.end(), nearer);
  }
  radius = std::min(radius, conservative(q.out.front().distance, q.float_error));
  return true;
}

GatherResult MeshSurface::gather(const glm::dvec3& point, double radius,
                                 std::span<NearPoint> out) const noexcept {
  GatherQuery q{this, {}, radius, 0.0F, out, {}};
  Bvh::Query query;
  if (!prepare(point, radius, q.point, q.float_error, query)) return {};
  tree_->visit_near(query, &MeshSurface::on_gather, &q);
  const std::span<NearPoint> found = out.first(q.result.count);
  std::sort(found.begin(), found.end(),
            [](const NearPoint& a, const NearPoint& b) { return a.element < b.element; });
  for (NearPoint& p : found) p.point += centre_;
  return q.result;
}

bool MeshSurface::on_survey(void* user, std::uint32_t box, float& radius) {
  auto& q = *static_cast<SurveyQuery*>(user);
  const MeshSurface& self = *q.surface;
  const std::uint32_t element = self.element_of(box);
  const TriangleIndices& t = self.triangles_[element];
  TrianglePlane plane;
  if (!triangle_plane_within(q.centre, q.radius, q.view, self.vertex(t[0]), self.vertex(t[1]),
                             self.vertex(t[2]), plane))
    return false;
  if (q.result.count == q.out.size()) {
    q.result.complete = false;
    radius = 0.0F;
    return true;
  }
  q.out[q.result.count++] = {plane.normal, plane.support + glm::dot(plane.normal, self.centre_), element};
  return false;
}

GatherResult MeshSurface::survey(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                 std::span<ElementPlane> out) const noexcept {
  SurveyQuery q{this, {}, view - centre_, radius, out, {}};
  Bvh::Query query;
  float float_error = 0.0F;
  if (!prepare(centre, radius, q.centre, float_error, query)) return {};
  tree_->visit_near(query, &MeshSurface::on_survey, &q);
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
    // Barycentric coordinates by areas projected along the face's normal (Ericson, Real-Time Collision
    // Detection, 3.4).
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

bool MeshSurface::on_nearest(void* user, std::uint32_t box, float& radius) {
  auto& q = *static_cast<NearestQuery*>(user);
  const std::uint32_t element = q.surface->element_of(box);
  if (q.skip_degenerate) {
    const TriangleIndices& t = q.surface->triangles_[element];
    const MeshSurface& self = *q.surface;
    if (is_degenerate(self.vertex(t[0]), self.vertex(t[1]), self.vertex(t[2]))) return false;
  }
  const TrianglePoint closest = q.surface->closest(q.point, element);
  const NearPoint found{closest.point, std::sqrt(closest.squared_distance), element};
  if (q.lens > 0.0) {
    // Elements further away than this one need no visit, whether or not it is within the search radius.
    radius = std::min(radius, conservative(q.surface->lens_radius(found, q), q.float_error));
  }
  // best.distance starts as the radius, with an element number above all others, so an element at exactly
  // that distance counts.
  if (!nearer(found, q.best)) return q.lens > 0.0;
  q.best = found;
  q.feature = closest.feature;
  q.found = true;
  if (q.lens == 0.0) {
    radius = std::min(radius, conservative(found.distance, q.float_error));
  }
  return true;
}

// Radius of the query that replaces a query from far away. From afar the float distances of all triangles are
// equal, and Embree would return every triangle. So a far point at distance S from the centre is replaced by
// a place on the line to it, at distance s. The mesh lies in a ball B of radius L. The points of B that are
// as near to the far point as x form a lens, the intersection of two balls. That lens lies within √(|x −
// place|² + (L² − |x|²)(1 − s/S)) of the place, which for s ≫ L hardly exceeds |x − place|.
double MeshSurface::lens_radius(const NearPoint& x, const NearestQuery& q) const {
  const glm::dvec3 away = x.point - q.query_origin;
  const double within = glm::dot(upper_, upper_) - glm::dot(x.point, x.point);
  return std::sqrt(glm::dot(away, away) + std::max(0.0, within) * q.lens);
}

bool MeshSurface::find_nearest(const glm::dvec3& point, double radius, NearestQuery& q) const {
  q.surface = this;
  q.best = {{}, radius, kNoElement};
  q.found = false;
  Bvh::Query query;
  if (!prepare(point, radius, q.point, q.float_error, query)) return false;
  q.query_origin = q.point;
  q.lens = 0.0;
  const double distance = glm::length(q.point), far = kFarAway * glm::length(upper_);
  if (distance > far && far > 0.0) {
    q.query_origin = q.point * (far / distance);
    q.lens = 1.0 - far / distance;
    q.float_error = Bvh::set_query(q.query_origin, std::numeric_limits<double>::infinity(), slack_, query);
  }
  tree_->visit_near(query, &MeshSurface::on_nearest, &q);
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
    // A degenerate triangle at the edge has no normal, and the other one alone does not decide the sign.
    if (edge.elements != 2 || edge.flat != 0) return winds_around(*mesh_, point);
    normal_here = edge.sum;
  } else {
    normal_here = pseudonormal(v[t[feature]], v[t[feature]]).sum;
  }
  const glm::dvec3 away = (local - q.best.point) / q.best.distance;
  const double side = glm::dot(away, normal_here);
  // At a fold so sharp that the normals cancel, the sign would be rounding error.
  if (std::abs(side) < 1e-9) return winds_around(*mesh_, point);
  return side < 0.0;
}

// Angle-weighted pseudonormals (Baerentzen & Aanaes, Signed distance computation using the angle weighted
// pseudonormal, 2005). At an edge or a corner the sign of the distance must not depend on which triangle was
// found first. The pseudonormals are computed on demand. Stored ones, for every vertex and edge, would take
// as much memory as the mesh.
bool MeshSurface::on_pseudonormal(void* user, std::uint32_t box, float& /*radius*/) {
  auto& q = *static_cast<PseudonormalQuery*>(user);
  const TriangleIndices& t = q.surface->triangles_[q.surface->element_of(box)];
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
  Bvh::Query query;
  glm::dvec3 local(0.0);
  float float_error = 0.0F;
  if (!prepare(from, 0.0, local, float_error, query)) return q;
  tree_->visit_near(query, &MeshSurface::on_pseudonormal, &q);
  return q;
}

std::size_t MeshSurface::memory_bytes() const noexcept {
  return sizeof(*this) + tree_->memory_bytes() + mesh_->vertices.capacity() * sizeof(glm::dvec3) +
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
