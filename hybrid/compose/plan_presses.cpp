// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compose/plan_presses.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <optional>

namespace hybrid {
namespace {

constexpr double kPixels = 400.0;    // greatest number of pixels along the scene's longest side
constexpr double kSoftDepth = 0.8;   // depth of a press beyond first contact with tissue, in tool radii
constexpr double kBoneDepth = 0.25;  // the same on bone, which does not give way
// Height above the obstacles between two presses; at least the tool's diameter.
constexpr double kClearance_m = 0.01;
constexpr double kHold_s = 1.0;  // time for which a press is held
// Between two presses the tool strokes over the surface. Depth and spacing of the path's points are in tool
// radii. The tool is lifted where the surface falls or rises by more than kSteep times the step.
constexpr double kStrokeDepth = 0.25, kStrokeStep = 1.5, kSteep = 1.5;
constexpr double kFastest_m_per_s = 0.06;             // speed of a hand that explores
constexpr std::size_t kMostRigid = 8, kMostSoft = 8;  // greatest number of presses of each kind
constexpr double kNothing = -std::numeric_limits<double>::infinity();

// Something that is pressed once: a family of bones, a mesh, or a tissue.
struct Target {
  std::string name;
  bool rigid = false;
};

struct View {
  int axis = 0;
  double sign = 1.0;  // the tool comes from this end of the axis
  double weight = 1.0;
  const char* words = "";
};
// Views of a body, with a weight for each. The body lies on its back, so its front comes first. The ends of a
// scan come last, because the body is cut off there.
constexpr std::array<View, 6> kBodyViews{{{1, -1.0, 1.0, "from the front"},
                                          {0, 1.0, 0.95, "from its left"},
                                          {0, -1.0, 0.95, "from its right"},
                                          {1, 1.0, 0.9, "from the back"},
                                          {2, 1.0, 0.5, "from the head's end"},
                                          {2, -1.0, 0.45, "from the feet's end"}}};
constexpr std::array<View, 6> kPlainViews{{{2, 1.0, 1.0, "from above (+z)"},
                                           {1, -1.0, 0.95, "from -y"},
                                           {0, 1.0, 0.9, "from +x"},
                                           {0, -1.0, 0.9, "from -x"},
                                           {1, 1.0, 0.9, "from +y"},
                                           {2, -1.0, 0.6, "from below (-z)"}}};

struct Facet {
  std::array<glm::dvec3, 3> corner;
  std::uint32_t target = 0;
  std::uint32_t detail = 0;  // index into details: a bone or a label
};

// The triangles of all surfaces, each with its target and its detail.
struct Surfaces {
  std::vector<Facet> facets;
  std::vector<Target> targets;
  std::vector<std::string> details;
  glm::dvec3 low{1e300}, high{-1e300};

  std::uint32_t target(const std::string& name, bool rigid) {
    for (std::uint32_t t = 0; t < targets.size(); ++t) {
      if (targets[t].name == name && targets[t].rigid == rigid) return t;
    }
    targets.push_back({name, rigid});
    return static_cast<std::uint32_t>(targets.size() - 1);
  }
  void add(const Facet& facet) {
    facets.push_back(facet);
    for (const glm::dvec3& c : facet.corner) {
      low = glm::min(low, c);
      high = glm::max(high, c);
    }
  }
};

// The label of the voxel just below a triangle of the tissue's surface (volume's frame), or 0.
int label_below(const voxel::LabelVolume& volume, const std::array<glm::dvec3, 3>& t) {
  const glm::dvec3 across = glm::cross(t[1] - t[0], t[2] - t[0]);
  const double length = glm::length(across);
  if (!(length > 0.0)) return 0;
  const glm::dvec3 middle = (t[0] + t[1] + t[2]) / 3.0;
  for (const double depth : {0.5, 0.9, 0.2}) {
    const glm::dvec3 cell = glm::round(middle / volume.spacing_m - depth * across / length);
    bool inside = true;
    for (int a = 0; a < 3; ++a)
      inside = inside && cell[a] >= 0.0 && cell[a] < volume.dims[static_cast<std::size_t>(a)];
    if (!inside) continue;
    const int label = volume.labels[volume.index(static_cast<int>(cell.x), static_cast<int>(cell.y),
                                                 static_cast<int>(cell.z))];
    if (label != 0) return label;
  }
  return 0;
}

Surfaces gather(const World& world, const SceneParts& parts) {
  Surfaces all;
  for (std::size_t o = 0; o < world.rigid.size(); ++o) {
    const RigidObject& object = world.rigid[o];
    const std::uint32_t target = all.target(parts.rigid[o].family, true);
    all.details.push_back(parts.rigid[o].name);
    const auto& v = object.drawn->vertices;
    for (const polygon::TriangleIndices& t : object.drawn->triangles) {
      all.add({{object.to_scene(v[t[0]]), object.to_scene(v[t[1]]), object.to_scene(v[t[2]])},
               target,
               static_cast<std::uint32_t>(all.details.size() - 1)});
    }
  }
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    const SoftBody& body = world.soft[o];
    const SoftPart& part = parts.soft[o];
    std::map<int, std::pair<std::uint32_t, std::uint32_t>> of_label;
    for (const auto& [label, tissue] : part.materials) {
      const bool known = tissue != &unknown_tissue();
      all.details.push_back(part.label_names.at(label));
      of_label[label] = {all.target(known ? std::string(tissue->name) : part.label_names.at(label), false),
                         static_cast<std::uint32_t>(all.details.size() - 1)};
    }
    for (const polygon::TriangleIndices& t : body.drawn.triangles) {
      const std::array<glm::dvec3, 3> c{body.drawn.vertices[t[0]], body.drawn.vertices[t[1]],
                                        body.drawn.vertices[t[2]]};
      const auto found = of_label.find(label_below(part.volume, c));
      if (found == of_label.end()) continue;
      all.add({{body.to_scene(c[0]), body.to_scene(c[1]), body.to_scene(c[2])},
               found->second.first,
               found->second.second});
    }
  }
  return all;
}

// Height map along a view: heights of the surfaces, and heights of the tool's centre at first contact.
class HeightMap {
 public:
  HeightMap(const Surfaces& all, const View& view, double radius_m)
      : view_(view), radius_(radius_m), u_((view.axis + 1) % 3), v_((view.axis + 2) % 3) {
    const glm::dvec3 size = all.high - all.low;
    cell_ = std::max(radius_m / 3.0, std::max({size.x, size.y, size.z}) / kPixels);
    reach_ = static_cast<int>(std::floor(radius_m / cell_));
    low_ = all.low - (reach_ + 2) * cell_;
    nu_ = static_cast<int>(std::ceil(size[u_] / cell_)) + 2 * reach_ + 5;
    nv_ = static_cast<int>(std::ceil(size[v_] / cell_)) + 2 * reach_ + 5;
    top_.assign(static_cast<std::size_t>(nu_) * static_cast<std::size_t>(nv_), kNothing);
    facet_.assign(top_.size(), 0);
    for (std::uint32_t f = 0; f < all.facets.size(); ++f) draw(all.facets[f], f);
    dilate();
  }

  struct Spot {
    double score = 0.0;
    glm::dvec3 contact_m{0.0};  // the tool's centre at first contact
    std::uint32_t facet = 0;
  };
  // For each target, the place where most of the surface below the ball belongs to the target and is level.
  [[nodiscard]] std::vector<Spot> best(const Surfaces& all) const {
    std::vector<Spot> spots(all.targets.size());
    for (int v = reach_; v < nv_ - reach_; ++v) {
      for (int u = reach_; u < nu_ - reach_; ++u) {
        const std::size_t at = index(u, v);
        if (centre_[at] == kNothing) continue;
        const std::uint32_t target = all.facets[first_[at]].target;
        double own = 0.0, disc = 0.0, drop = 0.0;
        for_disc(u, v, [&](std::size_t near, double) {
          disc += 1.0;
          const double below = (centre_[at] - radius_ - top_[near]) / radius_;
          drop += std::min(2.0, below);
          if (top_[near] != kNothing && all.facets[facet_[near]].target == target) own += 1.0;
        });
        const double score = view_.weight * (own / disc) * (1.0 - 0.3 * std::max(0.0, drop / disc));
        if (score > spots[target].score) spots[target] = {score, place(u, v, centre_[at]), first_[at]};
      }
    }
    return spots;
  }

  // The least height at which the tool's centre can pass between two places without contact.
  [[nodiscard]] double clear_height(const glm::dvec3& from, const glm::dvec3& to) const {
    const double way = std::max(std::abs(to[u_] - from[u_]), std::abs(to[v_] - from[v_]));
    const int steps = std::max(1, static_cast<int>(std::ceil(2.0 * way / cell_)));
    double most = kNothing;
    for (int n = 0; n <= steps; ++n) {
      const glm::dvec3 p = from + (to - from) * (static_cast<double>(n) / steps);
      const int u = static_cast<int>(std::round((p[u_] - low_[u_]) / cell_));
      const int v = static_cast<int>(std::round((p[v_] - low_[v_]) / cell_));
      for (int dv = -1; dv <= 1; ++dv) {
        for (int du = -1; du <= 1; ++du) {
          if (u + du < 0 || v + dv < 0 || u + du >= nu_ || v + dv >= nv_) continue;
          most = std::max(most, centre_[index(u + du, v + dv)]);
        }
      }
    }
    return most;
  }
  // The height of the tool's centre at first contact at this place; kNothing where there is nothing.
  [[nodiscard]] double touching(const glm::dvec3& p) const {
    const int u = static_cast<int>(std::round((p[u_] - low_[u_]) / cell_));
    const int v = static_cast<int>(std::round((p[v_] - low_[v_]) / cell_));
    return u < 0 || v < 0 || u >= nu_ || v >= nv_ ? kNothing : centre_[index(u, v)];
  }
  // Distance between two places, measured across the view.
  [[nodiscard]] double across(const glm::dvec3& a, const glm::dvec3& b) const {
    return std::hypot(b[u_] - a[u_], b[v_] - a[v_]);
  }
  [[nodiscard]] double height_of(const glm::dvec3& p) const { return view_.sign * p[view_.axis]; }
  [[nodiscard]] glm::dvec3 at_height(glm::dvec3 p, double height) const {
    p[view_.axis] = view_.sign * height;
    return p;
  }

 private:
  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(nu_) + static_cast<std::size_t>(u);
  }
  [[nodiscard]] glm::dvec3 place(int u, int v, double height) const {
    glm::dvec3 p(0.0);
    p[u_] = low_[u_] + u * cell_;
    p[v_] = low_[v_] + v * cell_;
    p[view_.axis] = view_.sign * height;
    return p;
  }
  void mark(int u, int v, double height, std::uint32_t facet) {
    if (u < 0 || v < 0 || u >= nu_ || v >= nv_ || height <= top_[index(u, v)]) return;
    top_[index(u, v)] = height;
    facet_[index(u, v)] = facet;
  }

  // Draws the pixels that the triangle covers, and those of its corners, so that no triangle is lost.
  void draw(const Facet& f, std::uint32_t number) {
    std::array<glm::dvec2, 3> p{};
    std::array<double, 3> h{};
    for (std::size_t c = 0; c < 3; ++c) {
      p[c] = {(f.corner[c][u_] - low_[u_]) / cell_, (f.corner[c][v_] - low_[v_]) / cell_};
      h[c] = height_of(f.corner[c]);
      mark(static_cast<int>(std::round(p[c].x)), static_cast<int>(std::round(p[c].y)), h[c], number);
    }
    const double area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (p[1].y - p[0].y);
    if (std::abs(area) < 1e-12) return;
    const glm::dvec2 low = glm::min(p[0], glm::min(p[1], p[2])), high = glm::max(p[0], glm::max(p[1], p[2]));
    for (int v = static_cast<int>(std::ceil(low.y)); v <= static_cast<int>(high.y); ++v) {
      for (int u = static_cast<int>(std::ceil(low.x)); u <= static_cast<int>(high.x); ++u) {
        const double b = ((u - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (v - p[0].y)) / area;
        const double c = ((p[1].x - p[0].x) * (v - p[0].y) - (u - p[0].x) * (p[1].y - p[0].y)) / area;
        if (b < 0.0 || c < 0.0 || b + c > 1.0) continue;
        mark(u, v, h[0] + b * (h[1] - h[0]) + c * (h[2] - h[0]), number);
      }
    }
  }

  template <typename Visit>
  void for_disc(int u, int v, Visit&& visit) const {
    for (int dv = -reach_; dv <= reach_; ++dv) {
      for (int du = -reach_; du <= reach_; ++du) {
        const double away = cell_ * cell_ * (du * du + dv * dv);
        if (away > radius_ * radius_) continue;
        if (u + du < 0 || v + dv < 0 || u + du >= nu_ || v + dv >= nv_) continue;
        visit(index(u + du, v + dv), std::sqrt(radius_ * radius_ - away));
      }
    }
  }

  void dilate() {
    centre_.assign(top_.size(), kNothing);
    first_.assign(top_.size(), 0);
    for (int v = 0; v < nv_; ++v) {
      for (int u = 0; u < nu_; ++u) {
        const std::size_t at = index(u, v);
        for_disc(u, v, [&](std::size_t near, double above) {
          if (top_[near] == kNothing || top_[near] + above <= centre_[at]) return;
          centre_[at] = top_[near] + above;
          first_[at] = facet_[near];
        });
      }
    }
  }

  View view_;
  double radius_, cell_ = 0.0;
  int u_, v_, reach_ = 0, nu_ = 0, nv_ = 0;
  glm::dvec3 low_{0.0};
  std::vector<double> top_, centre_;
  std::vector<std::uint32_t> facet_, first_;
};

struct Chosen {
  std::size_t view = 0, target = 0;
  HeightMap::Spot spot;
};

// The path over the surface between two places of contact, without these two places. Where the surface is
// steep or missing, the tool is lifted over it by `lift_m`.
std::vector<glm::dvec3> stroke(const HeightMap& map, const glm::dvec3& from, const glm::dvec3& to,
                               double radius_m, double lift_m) {
  const double way = map.across(from, to);
  const int steps = static_cast<int>(std::ceil(way / (kStrokeStep * radius_m)));
  std::vector<glm::dvec3> points;
  double before = map.touching(from);
  for (int n = 1; n < steps; ++n) {
    const auto at = [&](int step) { return from + (to - from) * (static_cast<double>(step) / steps); };
    const double height = map.touching(at(n)), after = map.touching(at(n + 1));
    const double most = kSteep * way / steps;
    const bool gentle = height != kNothing && std::abs(height - before) <= most &&
                        (after == kNothing || std::abs(after - height) <= most);
    const double over = std::max({map.clear_height(at(n - 1), at(n + 1)), map.height_of(from)}) + lift_m;
    points.push_back(map.at_height(at(n), gentle ? height - kStrokeDepth * radius_m : over));
    before = height;
  }
  return points;
}

// The best place of each target over all views. Score 0: no view reaches the target.
std::vector<Chosen> best_places(const Surfaces& all, const std::vector<HeightMap>& maps) {
  std::vector<Chosen> best(all.targets.size());
  for (std::size_t view = 0; view < maps.size(); ++view) {
    const std::vector<HeightMap::Spot> spots = maps[view].best(all);
    for (std::size_t t = 0; t < spots.size(); ++t) {
      if (spots[t].score > best[t].spot.score) best[t] = {view, t, spots[t]};
    }
  }
  return best;
}

// The best places, at most kMostRigid and kMostSoft. They are in the order of visits: view after view, and
// within a view always the nearest place next.
std::vector<Chosen> choose(const Surfaces& all, std::vector<Chosen> best) {
  std::erase_if(best, [](const Chosen& c) { return c.spot.score <= 0.0; });
  std::stable_sort(best.begin(), best.end(),
                   [](const Chosen& a, const Chosen& b) { return a.spot.score > b.spot.score; });
  std::size_t rigid = 0, soft = 0;
  std::erase_if(best, [&](const Chosen& c) {
    return all.targets[c.target].rigid ? ++rigid > kMostRigid : ++soft > kMostSoft;
  });
  for (std::size_t n = 0; n < best.size(); ++n) {
    const auto rank = [&](const Chosen& c) {
      const bool same = n > 0 && best[n - 1].view == c.view;
      return std::pair{same ? std::size_t{0} : c.view + 1,
                       n > 0 ? glm::distance(c.spot.contact_m, best[n - 1].spot.contact_m) : -c.spot.score};
    };
    std::iter_swap(best.begin() + static_cast<std::ptrdiff_t>(n),
                   std::min_element(best.begin() + static_cast<std::ptrdiff_t>(n), best.end(),
                                    [&](const Chosen& a, const Chosen& b) { return rank(a) < rank(b); }));
  }
  return best;
}

}  // namespace

PressPath plan_presses(const BuiltScene& built, const SceneParts& parts, double tool_radius_m) {
  const Surfaces all = gather(*built.world, parts);
  PressPath path;
  if (all.facets.empty()) return path;
  const std::array<View, 6>& views = parts.of_a_body ? kBodyViews : kPlainViews;
  std::vector<HeightMap> maps;
  maps.reserve(views.size());
  for (const View& view : views) maps.emplace_back(all, view, tool_radius_m);
  const std::vector<Chosen> places = best_places(all, maps), presses = choose(all, places);
  const double clearance = std::max(kClearance_m, 2.0 * tool_radius_m);
  const auto outside = [&](const View& view) {  // height along the view
    return std::max(view.sign * all.low[view.axis], view.sign * all.high[view.axis]) + tool_radius_m +
           clearance;
  };
  const auto go = [&](const glm::dvec3& to, double hold = 0.0, const std::string& comment = {}) {
    path.points.push_back({to, hold, comment});
  };
  std::optional<std::size_t> last;
  for (const Chosen& press : presses) {
    const View& view = views[press.view];
    const HeightMap& map = maps[press.view];
    const Target& target = all.targets[press.target];
    const glm::dvec3& contact = press.spot.contact_m;
    const glm::dvec3 above = map.at_height(contact, outside(view));
    if (!last) {
      go(above);
    } else if (*last != press.view) {
      // Goes round the box: out at the old side, along it until beyond the new side, and in.
      const View& old = views[*last];
      glm::dvec3 p = maps[*last].at_height(path.points.back().at_m, outside(old));
      go(p, 0.0, "off, and round the outside");
      if (old.axis == view.axis) {
        const int side = (view.axis + 1) % 3;
        p[side] = all.high[side] + tool_radius_m + clearance;
        go(p);
        p[view.axis] = above[view.axis];
        go(p);
      } else {
        p[view.axis] = above[view.axis];
        go(p);
      }
      go(above);
    } else {
      for (const glm::dvec3& p :
           stroke(map, path.points.back().at_m, contact, tool_radius_m, 0.25 * clearance))
        go(p);
    }
    last = press.view;
    const double depth = (target.rigid ? kBoneDepth : kSoftDepth) * tool_radius_m;
    const std::string& detail = all.details[all.facets[press.spot.facet].detail];
    const std::string what = detail == target.name ? detail : fmt::format("{} ({})", target.name, detail);
    go(map.at_height(contact, map.height_of(contact) - depth), kHold_s,
       fmt::format("{}, {}", what, view.words));
    path.presses.push_back({what, view.words});
  }
  if (last) go(maps[*last].at_height(path.points.back().at_m, outside(views[*last])), 0.0, "off");
  for (std::size_t t = 0; t < all.targets.size(); ++t) {
    const bool pressed =
        std::any_of(presses.begin(), presses.end(), [&](const Chosen& c) { return c.target == t; });
    if (!pressed) path.not_pressed.push_back({all.targets[t].name, places[t].spot.score <= 0.0});
  }
  const glm::dvec3 size = all.high - all.low;
  path.speed_m_per_s = std::clamp(0.3 * std::max({size.x, size.y, size.z}), 0.01, kFastest_m_per_s);
  return path;
}

}  // namespace hybrid
