// SPDX-License-Identifier: GPL-3.0-or-later
// The [[soft]] tables of a scene file.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "hybrid/scene/read_objects.h"

namespace hybrid {
namespace {

constexpr UnsupportedKey soft_later[] = {
    {"sweeps", "remove it; budget = N bounds the work of a tick"},
    {"friction", "remove it: soft surfaces are smooth for now"},
    {"damping", "remove it: soft contact is quasi-static for now"},
    {"motion", "remove it: a soft object stays where position and rotation put it"},
};

constexpr UnsupportedKey energies_later[] = {
    {"eighteen-link", "write energy = \"trilinear\", which is as accurate"},
    {"18-link", "write energy = \"trilinear\", which is as accurate"},
};

// Largest number of voxels along one axis: indices stay far below the limit of an int, and a row fits into a
// cache.
constexpr double most_voxels_per_axis = 100'000.0;

voxel::Layer read_layer(const TableReader& table) {
  static constexpr std::string_view keys[] = {"thickness", "label"};
  table.allow(keys);
  return {table.number("thickness", table.source().size()),
          static_cast<std::uint8_t>(table.integer("label", 1, 255))};
}

voxel::Inclusion read_inclusion(const TableReader& table, const voxel::Formula& formula) {
  static constexpr std::string_view keys[] = {"shape", "centre", "size", "label"};
  static constexpr std::string_view shapes[] = {"box", "ball"};
  table.allow(keys);
  voxel::Inclusion out;
  const bool ball = table.choice("shape", shapes) == 1;
  out.shape = ball ? voxel::Inclusion::Shape::ball : voxel::Inclusion::Shape::box;
  out.centre_m = table.vector("centre", table.source().length(), out.centre_m);
  out.size_m = ball ? glm::dvec3(table.number("size", table.source().size()))
                    : table.number_or_vector("size", table.source().size());
  out.label = static_cast<std::uint8_t>(table.integer("label", 1, 255, out.label));
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    if (std::abs(out.centre_m[axis]) - 0.5 * out.size_m[axis] < 0.5 * formula.size_m[axis]) continue;
    table.refuse("centre",
                 words(table.what(), " lies outside its object along ", std::string(1, "xyz"[axis])),
                 "its centre is counted from the middle of the object; move it inside");
  }
  return out;
}

// Refuses a lattice that does not fit into memory or has no voxel, before anything is allocated for it.
void check_lattice(const TableReader& table, const voxel::Formula& formula) {
  const SceneSource& source = table.source();
  std::string lattice;
  double voxels = 1.0;
  bool too_long = false;
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    const double count = std::round(formula.size_m[axis] / formula.spacing_m[axis]);
    if (count < 1.0) {
      table.refuse("spacing",
                   words("the spacing ", in_words(formula.spacing_m[axis] / source.unit_m), " ",
                         source.unit_name, " of ", table.what(), " leaves no voxel in its size ",
                         in_words(formula.size_m[axis] / source.unit_m), " ", source.unit_name, " along ",
                         std::string(1, "xyz"[axis])),
                   "make the spacing smaller or the size larger");
    }
    too_long = too_long || count > most_voxels_per_axis;
    voxels *= count;
    lattice += (axis == 0 ? "" : " x ") + in_words(count);
  }
  const auto most = static_cast<double>(max_lattice_voxels());
  if (voxels <= most && !too_long) return;
  const double coarser = std::cbrt(voxels / most) *
                         glm::max(formula.spacing_m.x, glm::max(formula.spacing_m.y, formula.spacing_m.z));
  std::string remedy = "make it smaller, or the spacing larger";
  if (!too_long)
    remedy += words(" (about ", in_words(1.1 * coarser / source.unit_m), " ", source.unit_name, " fits)");
  table.refuse("spacing",
               words("the lattice of ", table.what(), " would have ", lattice, " = ", in_words(voxels),
                     " voxels, ", in_words(voxels * lattice_bytes_per_voxel), " bytes at ",
                     lattice_bytes_per_voxel, " a voxel; this machine can hold ", in_words(most),
                     " voxels, and ", in_words(most_voxels_per_axis), " along one axis"),
               remedy);
}

voxel::Formula read_formula(const TableReader& table, bool ball) {
  voxel::Formula out;
  const Quantity size = table.source().size();
  out.shape = ball ? voxel::Formula::Shape::ball : voxel::Formula::Shape::block;
  out.size_m = ball ? glm::dvec3(table.number("size", size)) : table.number_or_vector("size", size);
  out.spacing_m = table.number_or_vector("spacing", size);
  check_lattice(table, out);
  out.label = static_cast<std::uint8_t>(table.integer("label", 1, 255, out.label));
  if (table.has("layers")) {
    double height = 0.0;
    for (const TableReader& layer : table.tables("layers", "[{ thickness = 5, label = 2 }]")) {
      out.layers.push_back(read_layer(layer));
      height += out.layers.back().thickness_m;
      if (height <= out.size_m.z * (1.0 + 1e-9)) continue;
      const double unit = table.source().unit_m;
      layer.refuse("thickness",
                   words("the layers of ", table.what(), " add up to ", in_words(height / unit), " ",
                         table.source().unit_name, ", more than its height ", in_words(out.size_m.z / unit)),
                   "make them thinner or the block higher");
    }
  }
  if (table.has("inclusions")) {
    for (const TableReader& inclusion :
         table.tables("inclusions", "[{ shape = \"ball\", centre = [0, 0, 0], size = 10, label = 2 }]")) {
      out.inclusions.push_back(read_inclusion(inclusion, out));
    }
  }
  return out;
}

VolumeSource read_volume(const TableReader& table) {
  VolumeSource out;
  out.file = table.file("volume", true);
  out.rules = read_label_rules(table, true);
  if (table.has("spacing")) out.spacing_m = table.number_or_vector("spacing", table.source().size());
  out.largest = table.boolean("largest", out.largest);
  if (table.has("unit")) out.unit_m = table.unit("unit", 1e-3);
  if (table.has("scan")) {
    const std::filesystem::path scan = table.text("scan", "");
    out.scan = scan.is_relative() ? table.source().file.parent_path() / scan : scan;
  }
  return out;
}

// The labels that an object is known to have; empty if only the volume file can tell.
std::set<int> known_labels(const SoftSource& source) {
  std::set<int> labels;
  if (const auto* formula = std::get_if<voxel::Formula>(&source)) {
    labels.insert(formula->label);
    for (const voxel::Layer& layer : formula->layers) labels.insert(layer.label);
    for (const voxel::Inclusion& inclusion : formula->inclusions) labels.insert(inclusion.label);
  } else if (const auto* volume = std::get_if<VolumeSource>(&source)) {
    for (const voxel::LabelRule& rule : volume->rules) labels.insert(rule.label);
  } else {
    labels.insert(1);  // a voxelised mesh has one label
  }
  return labels;
}

void check_label(const TableReader& table, SourcePlace place, int label, const std::set<int>& known) {
  if (known.empty() || known.contains(label)) return;
  std::string list;
  for (const int one : known) list += (list.empty() ? "" : ", ") + std::to_string(one);
  table.source().refuse(place, words("no voxel of the object has label ", label, " (", table.what(), ")"),
                        words("use one of its labels: ", list));
}

std::map<std::uint8_t, std::string> read_materials(const TableReader& table, const TreeNode& entries,
                                                   const std::set<int>& known) {
  std::map<std::uint8_t, std::string> out;
  for (const TreeEntry& entry : entries.entries) {
    int label = 0;
    const char* end = entry.key.data() + entry.key.size();
    const auto [stop, error] = std::from_chars(entry.key.data(), end, label);
    if (error != std::errc() || stop != end || label < 1 || label > 255) {
      table.source().refuse(entry.place,
                            words(in_quotes(entry.key), " in ", table.what(), " is no label from 1 to 255"),
                            "write a label and a name: materials = { \"2\" = \"bone\" }");
    }
    check_label(table, entry.place, label, known);
    if (!out.emplace(static_cast<std::uint8_t>(label), table.text(entry.key, "bone")).second) {
      table.source().refuse(entry.place, words("label ", label, " stands twice in ", table.what()),
                            "keep one of the two");
    }
  }
  return out;
}

Anchors read_anchors(const TableReader& soft, const std::set<int>& known) {
  static constexpr std::string_view keys[] = {"faces", "labels", "rigid_within"};
  static constexpr std::string_view faces[] = {"-x", "+x", "-y", "+y", "-z", "+z"};
  Anchors out;
  if (!soft.has("anchors")) return out;
  const TableReader table = soft.table("anchors");
  table.allow(keys);
  out.faces.clear();  // named anchors replace the default
  const TreeEntry* listed_faces = table.find("faces");
  // An explicit empty list is refused below if nothing else holds the object.
  const bool no_faces = listed_faces != nullptr && listed_faces->value.kind == TreeNode::Kind::array &&
                        listed_faces->value.items.empty();
  if (listed_faces != nullptr && !no_faces) {
    for (const TreeNode& face : table.list("faces", "[\"-z\"]").items) {
      if (face.kind != TreeNode::Kind::string ||
          std::find(std::begin(faces), std::end(faces), face.text) == std::end(faces)) {
        table.source().refuse(face.place,
                              words("an entry of 'faces' in ", table.what(), " is no side of the object"),
                              words("write a sign and an axis in quotes, one of ", joined(faces)));
      }
      if (std::find(out.faces.begin(), out.faces.end(), face.text) == out.faces.end())
        out.faces.push_back(face.text);
    }
  }
  const TreeEntry* listed_labels = table.find("labels");
  const bool no_labels = listed_labels != nullptr && listed_labels->value.kind == TreeNode::Kind::array &&
                         listed_labels->value.items.empty();
  if (listed_labels != nullptr && !no_labels) {
    for (const std::int64_t label : table.integers("labels", 1, 255, "[2]")) {
      check_label(table, listed_labels->place, static_cast<int>(label), known);
      out.labels.push_back(static_cast<std::uint8_t>(label));
    }
  }
  out.rigid_within_m = table.number("rigid_within", table.source().distance(), 0.0);
  if (out.faces.empty() && out.labels.empty() && out.rigid_within_m == 0.0) {
    soft.refuse("anchors",
                words("nothing holds ", soft.what(), ". Such an object cannot balance the tool's force"),
                "hold it at a side, anchors = { faces = [\"-z\"] }, at labels, or where it touches bone "
                "(rigid_within)");
  }
  return out;
}

Thinning read_thinning(const TableReader& soft, const std::set<int>& known) {
  static constexpr std::string_view keys[] = {"labels", "above", "every", "shell"};
  const TableReader table = soft.table("thinning");
  table.allow(keys);
  Thinning out;
  out.place = soft.place_of("thinning");
  if (table.has("labels") == table.has("above")) {
    soft.refuse(
        "thinning", words(table.what(), " must say what is stiff, in one way"),
        "write labels = [2], or above = 1e6 for every material of that Young's modulus (Pa) and more");
  }
  if (table.has("labels")) {
    for (const std::int64_t label : table.integers("labels", 1, 255, "[2]")) {
      check_label(table, table.place_of("labels"), static_cast<int>(label), known);
      out.labels.push_back(static_cast<std::uint8_t>(label));
    }
  } else {
    out.above_Pa = table.number("above", {"Young's modulus above 0, in Pa", "1e6", 1.0, 1e-3, 1e13});
  }
  out.every = static_cast<int>(table.integer("every", 2, 64, out.every));
  out.shell = static_cast<int>(table.integer("shell", 1, 63, std::max(out.every - 1, 1)));
  return out;
}

SoftSource read_source(const TableReader& table, std::string_view kind) {
  static constexpr std::string_view of_mesh[] = {
      "name",   "mesh", "unit",  "repair",   "spacing", "energy",   "material", "materials", "anchors",
      "budget", "work", "patch", "thinning", "model",   "position", "rotation", "transform"};
  static constexpr std::string_view of_volume[] = {
      "name", "volume",  "unit",     "labels",   "range",     "ranges",   "largest",
      "scan", "spacing", "energy",   "material", "materials", "anchors",  "budget",
      "work", "patch",   "thinning", "model",    "position",  "rotation", "transform"};
  static constexpr std::string_view of_block[] = {
      "name",     "formula",  "size",      "spacing",  "label",    "layers", "inclusions",
      "energy",   "material", "materials", "anchors",  "budget",   "work",   "patch",
      "thinning", "model",    "position",  "rotation", "transform"};
  static constexpr std::string_view of_ball[] = {
      "name",    "formula", "size", "spacing", "label",    "inclusions", "energy",   "material", "materials",
      "anchors", "budget",  "work", "patch",   "thinning", "model",      "position", "rotation", "transform"};
  static constexpr std::string_view any[] = {"unit", "repair", "labels", "range",  "ranges",    "largest",
                                             "scan", "size",   "label",  "layers", "inclusions"};
  static constexpr std::string_view shapes[] = {"block", "ball"};
  if (kind == "mesh") {
    table.allow(of_mesh, {}, any, "mesh");
    const MeshSource mesh = read_mesh_source(table);
    return ClosedMeshSource{mesh, table.number_or_vector("spacing", table.source().size())};
  }
  if (kind == "volume") {
    table.allow(of_volume, {}, any, "volume");
    return read_volume(table);
  }
  const bool ball = table.choice("formula", shapes) == 1;
  table.allow(ball ? std::span<const std::string_view>(of_ball) : of_block, {}, any,
              ball ? "formula = \"ball\"" : "formula = \"block\"");
  return read_formula(table, ball);
}

}  // namespace

std::optional<Energy> read_energy(const TableReader& table) {
  static constexpr std::string_view energies[] = {"six-link", "trilinear"};
  if (!table.has("energy")) return std::nullopt;
  return table.choice("energy", energies, {}, energies_later) == 1 ? Energy::trilinear : Energy::six_link;
}

SoftDescription read_soft(const SceneSource& source, const TreeNode& table, std::size_t number) {
  static constexpr std::string_view all[] = {
      "name",   "mesh",       "volume",   "formula",   "unit",     "repair",   "spacing",
      "labels", "range",      "ranges",   "largest",   "scan",     "size",     "label",
      "layers", "inclusions", "material", "materials", "anchors",  "budget",   "work",
      "patch",  "thinning",   "energy",   "model",     "position", "rotation", "transform"};
  static constexpr std::string_view sources[] = {"volume", "mesh", "formula"};
  static constexpr std::string_view models[] = {"voxels", "proxy", "auto"};
  const TableReader reader = object_table(source, table, "[[soft]]", number);
  reader.allow(all, soft_later);
  const std::string_view kind = source_key(reader, sources);
  SoftDescription out;
  out.place = reader.place();
  out.source_place = reader.place_of(kind);
  out.name = read_name(reader);
  out.source = read_source(reader, kind);
  const std::set<int> known = known_labels(out.source);
  if (reader.has("material")) out.material = reader.text("material", "tissue");
  if (reader.has("materials")) {
    out.materials = read_materials(reader.table("materials"), reader.find("materials")->value, known);
  }
  out.anchors = read_anchors(reader, known);
  out.budget = static_cast<std::uint32_t>(reader.integer("budget", 1, 1'000'000'000, out.budget));
  if (reader.has("budget")) out.budget_place = reader.place_of("budget");
  out.work = reader.number("work", {words("a share from ", kLeastWork, " to 1"), "0.5", 1.0, kLeastWork, 1.0},
                           out.work);
  out.patch = static_cast<int>(reader.integer("patch", kLeastPatchMargin, kMostPatchMargin, out.patch));
  if (reader.has("thinning")) out.thinning = read_thinning(reader, known);
  if (const auto energy = read_energy(reader)) out.energy = *energy;
  static constexpr SoftModel kinds[] = {SoftModel::voxels, SoftModel::proxy, SoftModel::automatic};
  out.model = kinds[reader.choice("model", models, 0)];
  out.pose = read_pose(reader);
  return out;
}

}  // namespace hybrid
