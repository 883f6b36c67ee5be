// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the keys that all objects have in common, and the [[rigid]] tables.
#include "hybrid/scene/read_objects.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <set>

#include "hybrid/base/letters.h"
#include "hybrid/scene/itk_transform.h"
#include "hybrid/scene/read_feel.h"
#include "hybrid/scene/read_motion.h"

namespace hybrid {
namespace {

constexpr std::size_t longest_name = 64;
constexpr std::size_t most_labels = 254;

constexpr UnsupportedKey rigid_later[] = {
    {"model", "remove it; what may be felt either way is a [[soft]] object with model = \"auto\""},
};

bool usable_name(const std::string& name) {
  const bool is_blank = name.find_first_not_of(' ') == std::string::npos;
  return !is_blank && name.size() <= longest_name && is_printable(name);
}

// Rotation about the scene's x axis, then about its y axis, then about its z axis.
glm::dquat rotation_from_degrees(const glm::dvec3& degrees) {
  const glm::dvec3 half = degrees * (glm::pi<double>() / 360.0);
  const glm::dquat about_x(std::cos(half.x), std::sin(half.x), 0.0, 0.0);
  const glm::dquat about_y(std::cos(half.y), 0.0, std::sin(half.y), 0.0);
  const glm::dquat about_z(std::cos(half.z), 0.0, 0.0, std::sin(half.z));
  return about_z * about_y * about_x;
}

// The keys of one kind of source, and the keys that every rigid object may have.
std::vector<std::string_view> with_common(std::span<const std::string_view> keys) {
  std::vector<std::string_view> all(keys.begin(), keys.end());
  const auto motion = motion_keys();
  all.insert(all.end(), motion.begin(), motion.end());
  const auto feel = feel_keys();
  all.insert(all.end(), feel.begin(), feel.end());
  return all;
}

RigidSource read_primitive(const TableReader& table, std::size_t shape) {
  const Quantity size = table.source().size();
  switch (shape) {
    case 0:
      return BallPrimitive{table.number("radius", size)};
    case 1:
      return BoxPrimitive{table.number_or_vector("size", size)};
    case 2:
      return PlanePrimitive{table.number("size", size)};
    default:
      return CapsulePrimitive{table.number("radius", size), table.number("length", size)};
  }
}

std::vector<CutPlane> read_cuts(const TableReader& table) {
  static constexpr std::string_view keys[] = {"normal", "offset"};
  std::vector<CutPlane> cuts;
  if (!table.has("cut")) return cuts;
  for (const TableReader& cut : table.tables("cut", "[{ normal = [0, 0, 1], offset = 40 }]")) {
    cut.allow(keys);
    const Quantity component{"a number", "1", 1.0, -1e6, 1e6};
    const glm::dvec3 normal = cut.vector("normal", component);
    const double length = glm::length(normal);
    if (!(length > 1e-9)) {
      cut.refuse("normal", words("'normal' in ", cut.what(), " has no direction"),
                 "write e.g. normal = [0, 0, 1]");
    }
    cuts.push_back({normal / length, cut.number("offset", cut.source().length(), 0.0)});
  }
  return cuts;
}

VolumeSurfaceSource read_volume_surface(const TableReader& table) {
  VolumeSurfaceSource out;
  out.file = table.file("volume", true);
  out.rules = read_label_rules(table, false);
  out.between_voxels = table.has("range") && out.rules.front().lower < out.rules.front().upper;
  if (table.has("spacing")) out.spacing_m = table.number("spacing", table.source().size());
  out.grow_m = table.number("grow", table.source().distance(), out.grow_m);
  out.smooth = static_cast<int>(table.integer("smooth", 0, 1000, out.smooth));
  out.largest = table.boolean("largest", out.largest);
  if (table.has("unit")) out.unit_m = table.unit("unit", 1e-3);
  out.cuts = read_cuts(table);
  return out;
}

}  // namespace

TableReader object_table(const SceneSource& source, const TreeNode& table, const std::string& kind,
                         std::size_t number) {
  const std::string nameless = words(kind, " (number ", number, ")");
  TableReader reader(source, table, table.place, nameless);
  const TreeEntry* name = reader.find("name");
  if (name == nullptr || name->value.kind != TreeNode::Kind::string) return reader;
  return {source, table, table.place, words(kind, " '", printable(name->value.text, longest_name), "'")};
}

std::string read_name(const TableReader& table) {
  std::string name = table.text("name", "skull");
  if (!usable_name(name)) {
    table.refuse("name", words("'name' in ", table.what(), " is empty, too long or not printable"),
                 words("use 1 to ", longest_name, " letters, digits or signs"));
  }
  return name;
}

// The pose in a transform file. Other keys for the pose are refused beside it.
Pose read_transform(const TableReader& table) {
  for (const std::string_view other : {"position", "rotation"}) {
    if (table.has(other))
      table.refuse(other, words("'transform' and '", other, "' both say where ", table.what(), " lies"),
                   "keep one of them");
  }
  const std::filesystem::path file = table.file("transform", false);
  if (file.empty()) return {};  // refused already
  Pose pose;
  std::string wrong;
  try {
    pose = load_itk_transform(file);
  } catch (const std::runtime_error& error) {
    wrong = error.what();
  }
  const std::string name = words("'transform' in ", table.what(), ": '", printable(file.string(), 300), "' ");
  const std::size_t remedy = wrong.find("; ");
  if (!wrong.empty()) table.refuse("transform", name + wrong.substr(0, remedy), wrong.substr(remedy + 2));
  const double most = table.source().length().upper;
  if (glm::length(pose.position_m) > most)
    table.refuse("transform", words(name, "moves by more than ", in_words(most), " m"), "correct it");
  return pose;
}

Pose read_pose(const TableReader& table) {
  if (table.has("transform")) return read_transform(table);
  Pose pose;
  pose.position_m = table.vector("position", table.source().length(), pose.position_m);
  const Quantity angle{"an angle in degrees", "90", 1.0, -36000.0, 36000.0};
  pose.rotation = rotation_from_degrees(table.vector("rotation", angle, glm::dvec3(0.0)));
  return pose;
}

MeshSource read_mesh_source(const TableReader& table) {
  MeshSource mesh;
  mesh.file = table.file("mesh", false);
  mesh.unit_m = table.unit("unit", table.source().unit_m);
  mesh.repair = table.boolean("repair", mesh.repair);
  return mesh;
}

std::vector<voxel::LabelRule> read_label_rules(const TableReader& table, bool keep_labels) {
  static constexpr std::string_view choices[] = {"labels", "range", "ranges"};
  static constexpr std::string_view range_keys[] = {"range", "label"};
  std::string_view given;
  for (const std::string_view key : choices) {
    if (!table.has(key)) continue;
    if (!given.empty()) {
      table.refuse(key, words("'", given, "' and '", key, "' both say which voxels belong to ", table.what()),
                   "keep one of them");
    }
    given = key;
  }
  std::vector<voxel::LabelRule> rules;
  if (given == "labels") {
    const std::vector<std::int64_t> listed =
        table.integers("labels", 1, std::numeric_limits<std::int32_t>::max(), "[1, 2]");
    const std::set<std::int64_t> labels(listed.begin(), listed.end());
    if (keep_labels && *labels.rbegin() > 255) {
      table.refuse("labels", words("label ", *labels.rbegin(), " in ", table.what(), " is above 255"),
                   words("give it a smaller one: ranges = [{ range = [", *labels.rbegin(), ", ",
                         *labels.rbegin(), "], label = 1 }]"));
    }
    for (const std::int64_t label : labels) {
      const auto value = static_cast<double>(label);
      rules.push_back({value, value, keep_labels ? static_cast<std::uint8_t>(label) : std::uint8_t{1}});
    }
  } else if (given == "range") {
    const auto [lower, upper] = table.range("range");
    rules.push_back({lower, upper, 1});
  } else if (given == "ranges") {
    for (const TableReader& entry : table.tables("ranges", "[{ range = [100, 2000], label = 1 }]")) {
      entry.allow(range_keys);
      const auto [lower, upper] = entry.range("range");
      rules.push_back({lower, upper, static_cast<std::uint8_t>(entry.integer("label", 1, 255))});
    }
  }
  std::set<std::uint8_t> distinct;
  for (const voxel::LabelRule& rule : rules) distinct.insert(rule.label);
  if (distinct.size() > most_labels) {
    table.refuse(given, words(table.what(), " has ", distinct.size(), " labels"),
                 words("an object may have at most ", most_labels,
                       "; merge some with ranges = [{ range = [lo, hi], label = n }]"));
  }
  return rules;
}

std::string_view source_key(const TableReader& table, std::span<const std::string_view> keys) {
  std::string_view given;
  for (const std::string_view key : keys) {
    if (!table.has(key)) continue;
    if (!given.empty()) {
      table.refuse(key, words(table.what(), " names two sources, '", given, "' and '", key, "'"),
                   "keep one, or make two objects");
    }
    given = key;
  }
  if (given.empty()) {
    table.source().refuse(table.place(), words(table.what(), " does not say what it is made of"),
                          words("add one of these keys: ", joined(keys)));
  }
  return given;
}

RigidDescription read_rigid(const SceneSource& source, const TreeNode& table, std::size_t number) {
  static constexpr std::string_view of_all[] = {"name",     "mesh",      "primitive", "volume", "position",
                                                "rotation", "transform", "unit",      "repair", "radius",
                                                "size",     "length",    "labels",    "range",  "spacing",
                                                "grow",     "smooth",    "largest",   "cut"};
  static constexpr std::string_view of_mesh[] = {"name",     "mesh",     "unit",     "repair",
                                                 "position", "rotation", "transform"};
  static constexpr std::string_view of_ball[] = {"name",     "primitive", "radius",
                                                 "position", "rotation",  "transform"};
  static constexpr std::string_view of_box[] = {"name",     "primitive", "size",
                                                "position", "rotation",  "transform"};
  static constexpr std::string_view of_capsule[] = {"name",     "primitive", "radius",   "length",
                                                    "position", "rotation",  "transform"};
  static constexpr std::string_view of_volume[] = {"name",     "volume",   "unit",     "labels",  "range",
                                                   "spacing",  "grow",     "smooth",   "largest", "cut",
                                                   "position", "rotation", "transform"};
  static constexpr std::string_view sources[] = {"mesh", "primitive", "volume"};
  static constexpr std::string_view shapes[] = {"ball", "box", "plane", "capsule"};
  static constexpr std::span<const std::string_view> of_shape[] = {of_ball, of_box, of_box, of_capsule};

  const std::vector<std::string_view> all = with_common(of_all);
  const TableReader reader = object_table(source, table, "[[rigid]]", number);
  reader.allow(all, rigid_later);
  const std::string_view kind = source_key(reader, sources);
  RigidDescription out;
  out.place = reader.place();
  out.source_place = reader.place_of(kind);
  out.name = read_name(reader);
  if (kind == "mesh") {
    reader.allow(with_common(of_mesh), {}, all, "mesh");
    out.source = read_mesh_source(reader);
  } else if (kind == "primitive") {
    const std::size_t shape = reader.choice("primitive", shapes);
    reader.allow(with_common(of_shape[shape]), {}, all, words("primitive = \"", shapes[shape], "\""));
    out.source = read_primitive(reader, shape);
  } else {
    reader.allow(with_common(of_volume), {}, all, "volume");
    out.source = read_volume_surface(reader);
  }
  out.pose = read_pose(reader);
  out.feel = read_feel(reader);
  out.motion = read_motion(reader, out.pose);
  out.motion_place = reader.place_of("motion");
  return out;
}

}  // namespace hybrid
