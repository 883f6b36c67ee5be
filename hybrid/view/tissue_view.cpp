// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/tissue_view.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "hybrid/view/palette.h"
#include "hybrid/view/tissue/material_surface.h"

namespace hybrid {
namespace {

// Displacements below this share of the tool's radius do not start a scale, so that rounding does not show as
// a pattern.
constexpr double kLeastMoved = 1e-3;
constexpr double kLeastStrain = 0.01;  // least end of the scale of strain
constexpr double kLeast_jnd = 1.0;     // least end of the scale of differences: below it nothing is felt
// The scales of strain and difference end at this percentile of the places with more than the least values.
// At the rim of a contact single links have several times the strain of the tissue around them. Differences
// at edges are similar.
constexpr double kEndShare = 0.98;
constexpr float kNoStrain = 1e-3F, kNo_jnd = 0.02F;

bool needs_field(TissueColour colour) {
  return colour == TissueColour::strain || colour == TissueColour::limits;
}

// Raises the end of a scale of these values, if they go beyond it.
void raise_end(double& end, double least_end, float least, std::vector<float> values) {
  std::erase_if(values, [least](float value) { return !(value >= least); });
  if (values.empty()) return;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(kEndShare * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  const auto size = static_cast<double>(*at);
  if (size > std::max(end, least_end)) end = palette::scale_end(size);
}

// Equal settings give equal numbers, in every view of a scene; never 0.
std::uint64_t number_of(const ViewSettings& view) {
  std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a
  const auto add = [&hash](std::uint64_t word) {
    for (int byte = 0; byte < 8; ++byte) hash = (hash ^ (word >> (8 * byte) & 0xFFU)) * 1099511628211ULL;
  };
  add(needs_field(view.colour) ? 1 : 0);
  for (const SlicePlane& slice : view.slices) add(slice.on ? std::bit_cast<std::uint64_t>(slice.share) : 1);
  for (std::size_t o = 0; o < view.material_looks.size(); ++o) {
    if (!view.separates_materials(o)) continue;
    add(o);
    for (const auto& [name, look] : view.material_looks[o]) {
      if (!look.shows()) add(std::hash<std::string>{}(name));
    }
  }
  return std::max<std::uint64_t>(hash, 1);
}

}  // namespace

TissueView::TissueView(const DrawnScene& scene, const glm::dvec3& origin_m)
    : scene_(scene),
      origin_m_(origin_m),
      box_(soft_box(scene)),
      objects_(scene.objects.size()),
      painted_grey_(scene.objects.size(), 0) {}

void TissueView::set(const ViewSettings& view) {
  const bool planes = fresh_ || view.slices != view_.slices;
  const bool field = fresh_ || needs_field(view.colour) != needs_field(view_.colour);
  const bool materials = fresh_ || view.material_looks != view_.material_looks;
  const bool colour = view.colour != view_.colour;
  if (differs_ && view.colour != TissueColour::difference) {
    differs_ = false;
    for (Object& object : objects_) {
      object.values.clear();
      object.values_number = ++number_;
    }
  }
  fresh_ = false;
  view_ = view;
  for (std::size_t o = 0; o < objects_.size(); ++o) {
    if (!scene_.objects[o].soft) continue;
    if (planes) make_slices(o);
    if (materials) make_materials(o);
    if (planes || field || materials) make_fields(o, field);
    paint(o);
  }
  if (planes || field || materials) {
    ask();
  } else if (colour) {
    for (std::size_t o = 0; o < objects_.size(); ++o) {
      if (objects_[o].taken) take(o, objects_[o].answer);
    }
  }
}

void TissueView::make_slices(std::size_t o) {
  Object& object = objects_[o];
  object.slices.clear();
  painted_grey_[o] = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!view_.slices[axis].on || box_.empty) continue;
    SectionPlane plane{box_.low_m, glm::dvec3(0.0)};
    plane.point_m[static_cast<int>(axis)] = box_.place_m(axis, view_.slices[axis].share);
    plane.normal[static_cast<int>(axis)] = 1.0;
    TissueSlice slice;
    slice.section = make_section(scene_.objects[o], plane);
    if (slice.section.indices.empty()) continue;
    slice.mesh = move_section(slice.section, {}, {}, false, origin_m_);
    slice.shape_number = slice.moved_number = ++number_;
    object.slices.push_back(std::move(slice));
  }
}

void TissueView::make_materials(std::size_t o) {
  Object& object = objects_[o];
  object.materials.clear();
  if (!view_.separates_materials(o)) return;
  const DrawnInside& inside = scene_.objects[o].inside;
  object.made.resize(inside.materials.size());
  for (std::size_t m = 0; m < inside.materials.size(); ++m) {
    if (!view_.material_look_of(o, inside.materials[m]).shows()) continue;
    if (!object.made[m]) object.made[m] = surface_of_material(inside, m);
    if (object.made[m]->triangles.empty()) continue;
    MaterialSurface surface{.material = m, .at_rest_m = object.made[m]->vertices, .mesh = {}};
    surface.mesh = make_moving_mesh(*object.made[m], origin_m_);
    surface.shape_number = surface.moved_number = ++number_;
    object.materials.push_back(std::move(surface));
  }
}

// `surface`: the field of the object's surface, too.
void TissueView::make_fields(std::size_t o, bool surface) {
  Object& object = objects_[o];
  const DrawnObject& drawn = scene_.objects[o];
  const bool wanted = needs_field(view_.colour);
  if (surface) {
    object.surface.reset();
    object.values.clear();
    object.values_number = ++number_;
    if (wanted) object.surface.emplace(drawn.inside, drawn.surface.vertices);
  }
  object.nets.assign(object.slices.size(), {});
  for (std::size_t s = 0; wanted && s < object.slices.size(); ++s)
    object.nets[s].emplace(drawn.inside, object.slices[s].section.in_tissue);
  object.material_fields.assign(object.materials.size(), {});
  for (std::size_t m = 0; wanted && m < object.materials.size(); ++m)
    object.material_fields[m].emplace(drawn.inside, object.materials[m].at_rest_m);
}

// With view_.grey, slices show the scan as soon as it has been read. Otherwise they show materials.
void TissueView::paint(std::size_t o) {
  Object& object = objects_[o];
  if (object.slices.empty()) return;
  const ScanVolume* const scan = view_.grey ? scans_.of(o, scene_.objects[o]) : nullptr;
  const bool grey = scan != nullptr;
  if (object.slices.front().image_number != 0 && (painted_grey_[o] != 0) == grey) return;
  painted_grey_[o] = grey ? 1 : 0;
  const std::vector<glm::vec3> colours = palette::of_inside(scene_, o);
  for (TissueSlice& slice : object.slices) {
    slice.image = grey ? paint_grey(slice.section, *scan) : paint_materials(slice.section, colours);
    slice.image_number = ++number_;
  }
}

void TissueView::ask() {
  auto asked = std::make_shared<AskedPoints>();
  asked->number = number_of(view_);
  asked->at_rest_m.resize(objects_.size());
  bool any = false;
  for (std::size_t o = 0; o < objects_.size(); ++o) {
    Object& object = objects_[o];
    object.taken = false;
    std::vector<glm::dvec3>& points = asked->at_rest_m[o];
    const auto add = [&points](const std::vector<glm::dvec3>& more) {
      points.insert(points.end(), more.begin(), more.end());
    };
    if (object.surface) add(object.surface->points_m());
    for (std::size_t s = 0; s < object.slices.size(); ++s) {
      add(object.slices[s].section.in_tissue);
      if (object.nets[s]) add(object.nets[s]->points_m());
    }
    for (std::size_t m = 0; m < object.materials.size(); ++m) {
      add(object.materials[m].at_rest_m);
      if (object.material_fields[m]) add(object.material_fields[m]->points_m());
    }
    any = any || !points.empty();
  }
  asked_ = any ? std::move(asked) : nullptr;
}

void TissueView::take(const Snapshot& snapshot) {
  if (view_.colour == TissueColour::difference) take_difference(snapshot.difference.get());
  for (std::size_t o = 0; o < objects_.size(); ++o) {
    if (view_.colour == TissueColour::displacement && o < snapshot.soft_moved_m.size()) {
      float most = 0.0F;
      for (const glm::vec3& by : snapshot.soft_moved_m[o]) most = std::max(most, glm::dot(by, by));
      if (std::isfinite(most)) note_moved(std::sqrt(most));
    }
    if (asked_ == nullptr || snapshot.asked.number != asked_->number || o >= snapshot.asked.moved_m.size())
      continue;
    const std::vector<glm::vec3>& moved_m = snapshot.asked.moved_m[o];
    if (moved_m.empty() || moved_m.size() != asked_->at_rest_m[o].size()) continue;
    if (objects_[o].taken && objects_[o].answer == moved_m) continue;
    objects_[o].answer = moved_m;
    objects_[o].taken = true;
    take(o, moved_m);
  }
}

void TissueView::take(std::size_t o, const std::vector<glm::vec3>& moved_m) {
  Object& object = objects_[o];
  const std::span<const glm::vec3> all(moved_m);
  std::size_t at = 0;
  const auto next = [&](std::size_t count) {
    at += count;
    return all.subspan(at - count, count);
  };
  if (object.surface) {
    object.values = object.surface->values(view_.colour, next(object.surface->points_m().size()));
    object.values_number = ++number_;
    if (view_.colour == TissueColour::strain) raise_end(most_strain_, kLeastStrain, kNoStrain, object.values);
  }
  for (std::size_t s = 0; s < object.slices.size(); ++s) {
    TissueSlice& slice = object.slices[s];
    const std::span<const glm::vec3> nodes = next(slice.section.in_tissue.size());
    const auto at_field = object.nets[s] ? next(object.nets[s]->points_m().size()) : all.first(0);
    const std::vector<float> values = values_within(object.nets[s], nodes, at_field);
    slice.mesh = move_section(slice.section, nodes, values, false, origin_m_);
    slice.moved_number = ++number_;
  }
  for (std::size_t m = 0; m < object.materials.size(); ++m) {
    MaterialSurface& surface = object.materials[m];
    const std::optional<TissueField>& field = object.material_fields[m];
    const std::span<const glm::vec3> by = next(surface.at_rest_m.size());
    const std::vector<float> values =
        values_within(field, by, field ? next(field->points_m().size()) : all.first(0));
    surface.most_moved_m = move_vertices(surface.mesh, surface.at_rest_m, by, origin_m_);
    for (std::size_t v = 0; v < values.size(); ++v) surface.mesh.vertices[v].value = values[v];
    surface.moved_number = ++number_;
  }
}

// The values at places within the tissue, and raises the end of their scale. Without a field they are
// displacements. A difference of models is known on the surfaces of whole objects alone, so it is 0 there.
std::vector<float> TissueView::values_within(const std::optional<TissueField>& field,
                                             std::span<const glm::vec3> at_places,
                                             std::span<const glm::vec3> at_field) {
  std::vector<float> values;
  if (field) {
    values = field->values(view_.colour, at_field);
  } else {
    const bool differs = view_.colour == TissueColour::difference;
    for (const glm::vec3& by : at_places) values.push_back(differs ? 0.0F : glm::length(by));
  }
  if (view_.colour == TissueColour::strain) raise_end(most_strain_, kLeastStrain, kNoStrain, values);
  if (view_.colour == TissueColour::displacement) {
    for (const float value : values) note_moved(value);
  }
  return values;
}

void TissueView::note_moved(float moved_m) {
  const auto size = static_cast<double>(moved_m);
  if (std::isfinite(size) && size > std::max(most_moved_m_, kLeastMoved * scene_.tool_radius_m))
    most_moved_m_ = palette::scale_end(size);
}

// Where nothing is known tissue has its own colour. Elsewhere a value is at least the beginning of the ramp.
void TissueView::take_difference(const FeltDifference* difference) {
  const std::uint64_t number = difference != nullptr ? difference->number : 0;
  if (difference_ == number && differs_) return;
  differs_ = true;
  difference_ = number;
  if (difference != nullptr && std::exchange(comparison_, difference->comparison) != difference->comparison)
    most_jnd_ = 0.0;
  for (std::size_t o = 0; o < objects_.size(); ++o) {
    std::vector<float>& values = objects_[o].values;
    values.assign(scene_.objects[o].surface.vertices.size(), 0.0F);
    objects_[o].values_number = ++number_;
    if (difference == nullptr || difference->object != o || difference->jnd.size() != values.size()) continue;
    for (std::size_t v = 0; v < values.size(); ++v)
      values[v] = std::isnan(difference->jnd[v]) ? 0.0F : difference->jnd[v];
    raise_end(most_jnd_, kLeast_jnd, kNo_jnd, values);
    const float least = palette::kRampAtOnce.ramp_from * static_cast<float>(std::max(most_jnd_, kLeast_jnd));
    for (std::size_t v = 0; v < values.size(); ++v) {
      if (!std::isnan(difference->jnd[v])) values[v] = std::max(values[v], least);
    }
  }
}

std::string TissueView::in_words() const {
  if (view_.colour == TissueColour::difference && difference_ == 0)
    return "No two models are compared yet. Begin in the panel: Difference of two models.";
  return view_.grey ? scans_.in_words() : std::string();
}

ColourScale TissueView::scale() const {
  switch (view_.colour) {
    case TissueColour::material:
      return {TissueColour::material, 0.0};
    case TissueColour::displacement:
      return {TissueColour::displacement, most_moved_m_};
    case TissueColour::strain:
      return {TissueColour::strain, std::max(most_strain_, kLeastStrain)};
    case TissueColour::limits:
      return {TissueColour::limits, 1.0};
    case TissueColour::difference:
      return {TissueColour::difference, difference_ == 0 ? 0.0 : std::max(most_jnd_, kLeast_jnd)};
  }
  return {};
}

}  // namespace hybrid
