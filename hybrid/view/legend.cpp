// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/legend.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "hybrid/base/letters.h"
#include "hybrid/view/overlay.h"
#include "hybrid/view/palette.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr std::size_t kMostSingly = 6;  // if more rigid objects are untouched, they share one row
// Greatest number of rows for the materials of one object.
constexpr std::size_t kMostMaterials = palette::material.size() + 1;
constexpr std::size_t kMostStripes = 4;  // greatest number of colours of one swatch
constexpr std::size_t kMostPairs = 4;    // greatest number of rows for pairs of objects
// Characters of the two names of a pair: about as many as fit beside a force.
constexpr std::size_t kPairLetters = 22;

std::string and_more(std::size_t count) {
  return "and " + std::to_string(count) + " more";
}

ObjectFeel feel_of(const Snapshot& snapshot, std::size_t object) {
  return object < snapshot.feel.size() ? snapshot.feel[object] : ObjectFeel{};
}

// The first kMostStripes distinct colours.
std::vector<glm::vec3> stripes(std::span<const glm::vec3> colours) {
  std::vector<glm::vec3> few;
  for (const glm::vec3& c : colours) {
    if (few.size() < kMostStripes && std::ranges::find(few, c) == few.end()) few.push_back(c);
  }
  return few;
}

// Material of the surface vertex nearest to the tool; empty when the object is not touched.
std::optional<std::size_t> material_touched(const DrawnScene& scene, const Snapshot& snapshot,
                                            std::size_t object) {
  const DrawnObject& drawn = scene.objects[object];
  const auto& rest = drawn.surface.vertices;
  if (!feel_of(snapshot, object).contact || drawn.vertex_material.size() != rest.size()) return {};
  const bool moved =
      object < snapshot.soft_moved_m.size() && snapshot.soft_moved_m[object].size() == rest.size();
  std::optional<std::size_t> nearest;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < rest.size(); ++v) {
    const glm::dvec3 at = moved ? rest[v] + glm::dvec3(snapshot.soft_moved_m[object][v]) : rest[v];
    const glm::dvec3 way = at - snapshot.proxy_m;
    const double squared = glm::dot(way, way);
    if (!(squared < least)) continue;
    least = squared;
    nearest = drawn.vertex_material[v];
  }
  return nearest;
}

// The objects with a row of their own, in row order, and the rigid objects that share one row.
struct ShownObjects {
  std::vector<std::size_t> singly, grouped;
};

ShownObjects choose_objects(const DrawnScene& scene, const Snapshot& snapshot, std::size_t most) {
  ShownObjects shown;
  const auto untouched_rigid = [&](std::size_t i) {
    return !scene.objects[i].soft && !feel_of(snapshot, i).contact;
  };
  std::size_t quiet = 0;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) quiet += untouched_rigid(i) ? 1U : 0U;
  const bool group = quiet > kMostSingly || (quiet > 1 && scene.objects.size() > most);
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    (group && untouched_rigid(i) ? shown.grouped : shown.singly).push_back(i);
  if (!group && shown.singly.size() <= most) return shown;
  // If the list is cut off, touched objects come first, then soft ones.
  const auto rank = [&](std::size_t i) {
    return feel_of(snapshot, i).contact ? 0 : scene.objects[i].soft ? 1 : 2;
  };
  std::ranges::stable_sort(shown.singly, {}, rank);
  return shown;
}

void add_object(std::vector<LegendRow>& rows, const DrawnScene& scene, const Snapshot& snapshot,
                std::size_t object, std::size_t material_rows) {
  const DrawnObject& drawn = scene.objects[object];
  const ObjectFeel feel = feel_of(snapshot, object);
  const std::vector<glm::vec3> colours = palette::of_materials(scene, object);
  rows.push_back({.swatch = stripes(colours),
                  .name = drawn.name,
                  .kind = drawn.soft ? "soft" : "rigid",
                  .force = feel.contact ? force_text(feel.force_N) : "-",
                  .touched = feel.contact});
  // Materials that the surface hides and a cut shows.
  if (object < snapshot.inside.size() && snapshot.inside[object].used && drawn.hides_material()) {
    const std::vector<glm::vec3> within = palette::of_inside(scene, object);
    for (std::size_t m = std::max<std::size_t>(drawn.materials.size(), 1); m < within.size(); ++m) {
      if (material_rows == 0) break;
      --material_rows;
      rows.push_back(
          {.swatch = {within[m]}, .name = drawn.inside.materials[m] + " (inside)", .within = true});
    }
  }
  const std::size_t count = drawn.materials.size();
  const std::size_t listed =
      count <= material_rows ? count : material_rows - std::min<std::size_t>(material_rows, 1);
  if (listed == 0) return;
  // A touched material is always listed, if necessary in place of the last one.
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::optional<std::size_t> touched = material_touched(scene, snapshot, object);
  if (touched && *touched >= listed && *touched < count) std::swap(order[listed - 1], order[*touched]);
  for (std::size_t row = 0; row < listed; ++row) {
    const std::size_t m = order[row];
    rows.push_back(
        {.swatch = {colours[m]}, .name = drawn.materials[m], .touched = touched == m, .within = true});
  }
  if (count == listed) return;
  std::vector<glm::vec3> rest;
  for (std::size_t row = listed; row < count; ++row) rest.push_back(colours[order[row]]);
  rows.push_back({.swatch = stripes(rest), .name = and_more(count - listed), .within = true});
}

// The pairs that press on each other: the largest forces first, after those the pairs of unknown force.
std::vector<PairPress> pairs_by_force(const DrawnScene& scene, const Snapshot& snapshot) {
  std::vector<PairPress> pairs;
  for (const PairPress& pair : snapshot.presses) {
    const bool drawn = pair.soft < scene.objects.size() &&
                       (pair.other == PairPress::kAnchors || pair.other < scene.objects.size());
    const std::string force = pair.force_N ? force_text(*pair.force_N) : "";
    if (drawn && force != force_text(0.0)) pairs.push_back(pair);
  }
  std::ranges::stable_sort(pairs, std::ranges::greater{},
                           [](const PairPress& pair) { return pair.force_N.value_or(-1.0); });
  return pairs;
}

// Both names. The longer one is cut, because a row that is cut at its end would show only the first name.
std::string names_of_pair(const std::string& a, const std::string& b) {
  const auto beside = [](const std::string& other) {
    return kPairLetters - std::min(letters(other), kPairLetters / 2);
  };
  return shortened(a, beside(b)) + " – " + shortened(b, beside(a));
}

LegendRow pair_row(const DrawnScene& scene, const PairPress& pair) {
  const bool anchors = pair.other == PairPress::kAnchors;
  std::vector<glm::vec3> colours = palette::of_materials(scene, pair.soft);
  if (!anchors) colours = {colours.front(), palette::of_materials(scene, pair.other).front()};
  return {.swatch = stripes(colours),
          .name = names_of_pair(scene.objects[pair.soft].name,
                                anchors ? "its anchors" : scene.objects[pair.other].name),
          .force = pair.force_N ? force_text(*pair.force_N) : "not known",
          .within = true};
}

// At most `most` rows: a heading, the pairs, and a count of the pairs left out.
std::vector<LegendRow> pair_rows(const DrawnScene& scene, const Snapshot& snapshot, std::size_t most) {
  const std::vector<PairPress> pairs = pairs_by_force(scene, snapshot);
  most = std::min(most, kMostPairs + 1);
  if (pairs.empty() || most < std::min<std::size_t>(pairs.size() + 1, 3)) return {};
  std::vector<LegendRow> rows{{.name = "forces between objects"}};
  const std::size_t shown = pairs.size() < most ? pairs.size() : most - 2;
  for (std::size_t p = 0; p < shown; ++p) rows.push_back(pair_row(scene, pairs[p]));
  if (shown < pairs.size()) rows.push_back({.name = and_more(pairs.size() - shown), .within = true});
  return rows;
}

void add_tool(std::vector<LegendRow>& rows, const DrawnScene& scene, const Snapshot& snapshot) {
  const glm::dvec3 off = snapshot.device_m - snapshot.proxy_m;
  rows.push_back({.swatch = {palette::tool},
                  .name = scene.tool_is_punch ? "punch, as felt (proxy)" : "tool, as felt (proxy)"});
  rows.push_back({.swatch = {palette::device},
                  .name = "tool, at the device",
                  .force = polygon::is_finite(off) ? length_text(glm::length(off)) + " off" : "not finite",
                  .alpha = 0.45F});
  rows.push_back({.swatch = {palette::force},
                  .name = "force on the hand",
                  .force = force_text(glm::length(snapshot.force_N))});
}

// One row for several rigid objects, with the name of the first.
LegendRow grouped_row(const DrawnScene& scene, std::span<const std::size_t> objects) {
  std::vector<glm::vec3> colours;
  for (const std::size_t i : objects.first(std::min(objects.size(), 2 * palette::rigid.size())))
    colours.push_back(palette::of_object(scene, i));
  return {.swatch = stripes(colours),
          .name = scene.objects[objects.front()].name,
          .more = objects.size() > 1 ? " " + and_more(objects.size() - 1) : "",
          .kind = "rigid",
          .force = "-"};
}

}  // namespace

std::vector<LegendRow> legend_rows(const DrawnScene& scene, const Snapshot& snapshot, std::size_t most) {
  std::vector<LegendRow> rows, tool;
  add_tool(tool, scene, snapshot);
  const std::size_t room = std::max<std::size_t>(most, tool.size() + 1) - tool.size();
  const ShownObjects shown = choose_objects(scene, snapshot, room);
  const std::size_t group_rows = shown.grouped.empty() ? 0 : 1;
  std::size_t objects = shown.singly.size();
  if (objects + group_rows > room) objects = room - std::min(room, group_rows + 1);
  const bool cut = objects < shown.singly.size();
  std::size_t left = room - std::min(room, objects + group_rows + (cut ? 1 : 0));
  const std::vector<LegendRow> pairs = pair_rows(scene, snapshot, left);
  left -= pairs.size();
  for (std::size_t n = 0; n < objects; ++n) {
    const std::size_t before = rows.size() + 1;
    add_object(rows, scene, snapshot, shown.singly[n], std::min(left, kMostMaterials));
    left -= rows.size() - before;
  }
  if (group_rows > 0) rows.push_back(grouped_row(scene, shown.grouped));
  if (cut) rows.push_back({.name = and_more(shown.singly.size() - objects)});
  rows.insert(rows.end(), pairs.begin(), pairs.end());
  rows.insert(rows.end(), tool.begin(), tool.end());
  return rows;
}

}  // namespace hybrid
