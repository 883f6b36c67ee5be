// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a scene file into a Scene: tables that occur once, and checks that involve several tables.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <set>
#include <utility>

#include "hybrid/scene/ranges.h"
#include "hybrid/scene/read_material.h"
#include "hybrid/scene/read_objects.h"
#include "hybrid/scene/read_path.h"
#include "hybrid/scene/read_scene_text.h"
#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"
#include "hybrid/scene/toml_tree.h"
#include "hybrid/scene/unused_keys.h"

namespace hybrid {
namespace {

constexpr UnsupportedKey device_later[] = {
    {"delay", "say it in ticks: delay_ticks = 1"},
    {"watchdog", "say it in ms: watchdog_ms = 20"},
};
constexpr UnsupportedKey models_later[] = {
    {"mouse", "use model = \"ideal\" and a [path]"},
    {"replay", "use [path] kind = \"csv\" to follow a recorded motion"},
};
constexpr UnsupportedKey tool_later[] = {
    {"damping", "remove it: the coupling has no damping for now"},
    {"friction", "remove it: friction is a key of [[rigid]] objects"},
};

void check_format(const SceneSource& source, const TreeNode& root) {
  const TableReader table(source, root, {1, 1}, "the scene");
  const TreeEntry* format = table.find("format");
  if (format == nullptr) {
    source.refuse({1, 1}, "the key 'format' is missing", "write format = 1 as the first key of the scene");
  }
  if (format != root.entries.data()) {
    source.refuse(format->place, "'format' must be the first key", "move format = 1 to the top of the file");
  }
  if (format->value.kind != TreeNode::Kind::integer || format->value.integer != 1) {
    source.refuse(format->place, "this program reads scenes of format 1", "write format = 1");
  }
}

void read_units(SceneSource& source, const TableReader& root) {
  source.unit_m = root.unit("units", source.unit_m);
  if (root.has("units")) source.unit_name = root.find("units")->value.text;
}

// The tables of `key`: [[key]], or key = [{...}, ...].
const std::vector<TreeNode>& object_tables(const TableReader& root, std::string_view key) {
  static const std::vector<TreeNode> none;
  const TreeEntry* entry = root.find(key);
  if (entry == nullptr) return none;
  const std::string name(key);
  if (entry->value.kind == TreeNode::Kind::table) {
    root.refuse(key, words("[", name, "] stands in single brackets"),
                words("write [[", name, "]], as there may be several"));
  }
  for (const TreeNode& item : root.list(key, "[{ name = \"a\" }]").items) {
    if (item.kind == TreeNode::Kind::table) continue;
    root.source().refuse(item.place, words("an entry of '", name, "' is ", kind_in_words(item.kind)),
                         words("write each object as a table [[", name, "]]"));
  }
  return entry->value.items;
}

// Reads a table that occurs once: calls `read` with it if it is present.
template <typename Read>
void read_once(const TableReader& root, std::string_view key, const Read& read) {
  const TreeEntry* entry = root.find(key);
  if (entry == nullptr) return;
  const std::string name = words("[", key, "]");
  if (entry->value.kind == TreeNode::Kind::array) {
    root.source().gather([&] {
      root.refuse(key, words(name, " stands in double brackets or is a list"),
                  words("write ", name, " once, as there is only one"));
    });
    return;
  }
  root.source().gather([&] { read(TableReader(root.source(), entry->value, entry->place, name)); });
}

Tool read_tool(const TableReader& table) {
  static constexpr std::string_view keys[] = {"shape", "radius", "stiffness"};
  static constexpr std::string_view shapes[] = {"ball", "punch"};
  table.allow(keys, tool_later);
  Tool out;
  out.shape = table.choice("shape", shapes, 0) == 0 ? Tool::Shape::ball : Tool::Shape::punch;
  const bool ball = out.shape == Tool::Shape::ball;
  out.radius_m =
      table.number("radius", ball ? table.source().distance() : table.source().size(), out.radius_m);
  const Quantity stiffness{"a stiffness above 0 in N/m", "1000", 1.0, kCouplingRange_N_per_m.low,
                           kCouplingRange_N_per_m.high};
  out.stiffness_N_per_m = table.number("stiffness", stiffness, out.stiffness_N_per_m);
  return out;
}

RealDevice read_real_device(const TableReader& table) {
  RealDevice out;
  out.place = table.place_of("model");
  if (table.has("name")) out.name = table.text("name", "\"Default Device\"");
  const TreeEntry* scale = table.find("scale");
  if (scale != nullptr && scale->value.kind == TreeNode::Kind::string) {
    static constexpr std::string_view words_for_it[] = {"fit"};
    (void)table.choice("scale", words_for_it);
    out.scale.reset();
  } else {
    const Quantity ratio{"a ratio above 0, or \"fit\"", "1", 1.0, 1e-3, 1e3};
    out.scale = table.number("scale", ratio, out.scale);
  }
  return out;
}

void read_device(const TableReader& table, Scene& scene) {
  static constexpr std::string_view keys[] = {"model", "rate", "name", "scale", "delay_ticks", "watchdog_ms"};
  static constexpr std::string_view of_simulated[] = {"delay_ticks", "watchdog_ms"};
  static constexpr std::string_view of_real[] = {"name", "scale"};
  static constexpr std::string_view names[] = {"ideal", "premium-1.5", "touch", "phantom"};
  static constexpr device::DeviceModel models[] = {
      device::DeviceModel::ideal, device::DeviceModel::premium_1_5, device::DeviceModel::touch};
  table.allow(keys, device_later);
  if (table.has("model")) {
    const std::size_t model = table.choice("model", names, {}, models_later);
    if (model < std::size(models)) {
      scene.device_model = models[model];
    } else {
      scene.real_device = read_real_device(table);
    }
  }
  const auto refuse_where_without_meaning = [&](std::span<const std::string_view> unused, const char* model) {
    for (const std::string_view key : unused) {
      if (!table.has(key)) continue;
      table.refuse(key, words("'", key, "' has no meaning with ", model), "remove it, or change the model");
    }
  };
  if (!scene.real_device) refuse_where_without_meaning(of_real, "a simulated model");
  if (scene.real_device) refuse_where_without_meaning(of_simulated, "a real device: it has its own");
  if (is_ideal(scene)) refuse_where_without_meaning(of_simulated, "the ideal device, which no force moves");
  const Quantity rate{"a servo rate in Hz", "1000", 1.0, 100.0, 20'000.0};
  scene.rate_hz = table.number("rate", rate, scene.rate_hz);
  scene.delay_ticks = static_cast<int>(table.integer("delay_ticks", 0, device::kMaxDelayTicks, 0));
  if (table.has("watchdog_ms"))
    scene.watchdog_s = table.number("watchdog_ms", {"a time above 0 in ms", "20", 1e-3, 1e-6, 3600.0});
}

device::HandModel read_hand(const TableReader& table, Scene& scene) {
  static constexpr std::string_view keys[] = {"grip",      "mass",      "damping",
                                              "stiffness", "tremor_mm", "tremor_hz"};
  static constexpr std::string_view names[] = {"loose", "medium", "firm"};
  static constexpr device::Grip grips[] = {device::Grip::loose, device::Grip::medium, device::Grip::firm};
  table.allow(keys);
  device::HandModel out = device::hand_of(grips[table.choice("grip", names, 1)]);
  out.mass_kg = table.number("mass", {"a mass above 0 in kg", "0.006", 1.0, 1e-6, 1e3}, out.mass_kg);
  out.damping_N_s_per_m =
      table.number("damping", {"a damping in N s/m, 0 or more", "5", 1.0, 0.0, 1e6}, out.damping_N_s_per_m);
  out.stiffness_N_per_m =
      table.number("stiffness", {"a stiffness above 0 in N/m", "600", 1.0, 1e-6, 1e9}, out.stiffness_N_per_m);
  scene.tremor.amplitude_m =
      table.number("tremor_mm", {"an amplitude in mm, 0 or more", "0.1", 1e-3, 0.0, 0.1}, 0.0);
  scene.tremor.frequency_hz = table.number("tremor_hz", {"a frequency above 0 in Hz", "10", 1.0, 1e-3, 100.0},
                                           scene.tremor.frequency_hz);
  return out;
}

void read_safety(const TableReader& table, Scene& scene) {
  static constexpr std::string_view keys[] = {"max_force",  "max_slew",      "soft_start", "deadline_periods",
                                              "max_energy", "energy_window", "passivity"};
  table.allow(keys);
  device::ForceLimits& out = scene.safety;
  out.max_force_N = table.number(
      "max_force", {"a force above 0 in N", "8.5", 1.0, kMaxForceRange_N.low, kMaxForceRange_N.high},
      out.max_force_N);
  out.max_slew_N_per_s =
      table.number("max_slew", {"a rate above 0 in N/s", "50000", 1.0, 1e-3, 1e9}, out.max_slew_N_per_s);
  out.soft_start_s =
      table.number("soft_start", {"a time in s, 0 or more", "0.05", 1.0, 0.0, 3600.0}, out.soft_start_s);
  scene.max_force_given = table.has("max_force");
  scene.deadline_periods =
      table.number("deadline_periods", {"periods of the servo rate, above 1", "10", 1.0, 1.001, 1e6},
                   scene.deadline_periods);
  out.max_energy_J =
      table.number("max_energy", {"an energy above 0 in J", "0.5", 1.0, 1e-9, 1e9}, out.max_energy_J);
  scene.max_energy_given = table.has("max_energy");
  out.energy_window_s =
      table.number("energy_window", {"a time above 0 in s", "0.1", 1.0, 1e-3, 3600.0}, out.energy_window_s);
  scene.passivity = table.boolean("passivity", false);
  if (scene.passivity && is_ideal(scene)) {
    table.refuse("passivity", "'passivity' has no meaning with the ideal device, which no force moves",
                 "remove it, or use [device] model = \"premium-1.5\" or \"touch\"");
  }
}

void check_names(const SceneSource& source, const Scene& scene) {
  std::map<std::string, SourcePlace> taken;
  const auto take = [&](const std::string& name, SourcePlace place) {
    const auto [first, fresh] = taken.emplace(name, place);
    if (fresh) return;
    const SourcePlace later =
        std::max(place, first->second, [](SourcePlace a, SourcePlace b) { return a.line < b.line; });
    const SourcePlace earlier =
        std::min(place, first->second, [](SourcePlace a, SourcePlace b) { return a.line < b.line; });
    source.gather([&] {
      source.refuse(
          later, words("two objects are called ", in_quotes(name), ", the other one at line ", earlier.line),
          "give each object a name of its own");
    });
  };
  for (const RigidDescription& rigid : scene.rigid) take(rigid.name, rigid.place);
  for (const SoftDescription& soft : scene.soft) take(soft.name, soft.place);
}

// Refuses an object that is held only near rigid objects, if the scene has no rigid objects.
void check_anchors(const TableReader& table, const Scene& scene, const SoftDescription& soft) {
  const bool only_by_rigid = soft.anchors.faces.empty() && soft.anchors.labels.empty();
  if (!only_by_rigid || !scene.rigid.empty()) return;
  table.refuse("anchors",
               words(table.what(),
                     " is held only where it is near to rigid objects, and the scene has none. Such an "
                     "object cannot balance the tool's force"),
               "add a face or a label to its anchors, or a [[rigid]] object");
}

// The tool must be large enough to touch a voxel: voxels are felt as balls, and a point touches none.
void check_point_tool(const SceneSource& source, const Scene& scene, SourcePlace place) {
  if (scene.tool.radius_m > 0.0 || scene.soft.empty()) return;
  source.refuse(place, "a tool of radius 0 is a point, which cannot press soft objects",
                words("give it a radius of about two spacings of \"", scene.soft.front().name, "\""));
}

// `materials`: true if all materials could be read; only then a material that is missing is an error.
void read_soft_object(const SceneSource& source, const TreeNode& table, bool materials, Scene& scene) {
  scene.soft.push_back(read_soft(source, table, scene.soft.size() + 1));
  const SoftDescription& soft = scene.soft.back();
  const TableReader reader = object_table(source, table, "[[soft]]", scene.soft.size());
  if (materials) {
    check_material(source, scene, soft, soft.material, reader.place_of("material"));
    if (reader.has("materials")) {
      for (const TreeEntry& entry : reader.find("materials")->value.entries) {
        source.gather([&] { check_material(source, scene, soft, entry.value.text, entry.place); });
      }
    }
  }
  check_anchors(reader, scene, soft);
}

void read_objects(const SceneSource& source, const TableReader& root, bool materials, Scene& scene) {
  const std::size_t before = source.found();
  source.gather([&] {
    for (const TreeNode& table : object_tables(root, "rigid"))
      source.gather([&] { scene.rigid.push_back(read_rigid(source, table, scene.rigid.size() + 1)); });
  });
  source.gather([&] {
    for (const TreeNode& table : object_tables(root, "soft"))
      source.gather([&] { read_soft_object(source, table, materials, scene); });
  });
  if (source.found() != before) return;  // the checks below involve all objects
  if (scene.rigid.empty() && scene.soft.empty()) {
    source.refuse({1, 1}, "the scene has no objects",
                  "add a [[rigid]] or a [[soft]] table (see scenes/README.md)");
  }
  check_names(source, scene);
}

// Throws all errors as one, with a line for each, in the order of the file.
[[noreturn]] void throw_all(const std::filesystem::path& file, std::vector<ReaderError>& errors) {
  std::stable_sort(errors.begin(), errors.end(), [](const ReaderError& a, const ReaderError& b) {
    return std::pair(a.place.line, a.place.column) < std::pair(b.place.line, b.place.column);
  });
  std::string text = errors.front().text;
  for (std::size_t n = 1; n < errors.size(); ++n) text += words("\n", errors[n].what());
  throw SceneError(file, errors.front().place, text);
}

Scene read_whole(const TreeNode& tree, const std::filesystem::path& file) {
  static constexpr std::string_view keys[] = {"format",   "units",  "title", "overlap", "occupancy",
                                              "tool",     "device", "hand",  "safety",  "path",
                                              "material", "rigid",  "soft"};
  static constexpr std::string_view overlaps[] = {"carve", "refuse"};
  std::vector<ReaderError> errors;
  SceneSource source{file};
  check_format(source, tree);
  source.errors = &errors;
  const TableReader root(source, tree, {1, 1}, "the scene");
  root.allow(keys);
  source.gather([&] { read_units(source, root); });

  Scene scene;
  scene.file = file;
  scene.unit_m = source.unit_m;
  scene.title = root.has("title") ? root.text("title", "A soft block") : file.stem().string();
  source.gather(
      [&] { scene.overlap = root.choice("overlap", overlaps, 0) == 0 ? Overlap::carve : Overlap::refuse; });
  read_once(root, "occupancy", [&](const TableReader& table) {
    static constexpr std::string_view occupancy_keys[] = {"cell"};
    table.allow(occupancy_keys);
    if (table.has("cell")) scene.occupancy_cell_m = table.number("cell", source.size());
    scene.occupancy_place = table.place_of("cell");
  });
  SourcePlace tool_radius;
  read_once(root, "tool", [&](const TableReader& table) {
    scene.tool = read_tool(table);
    tool_radius = table.place_of("radius");
  });
  read_once(root, "device", [&](const TableReader& table) { read_device(table, scene); });
  read_once(root, "hand", [&](const TableReader& table) { scene.hand = read_hand(table, scene); });
  read_once(root, "safety", [&](const TableReader& table) { read_safety(table, scene); });
  const std::size_t before = source.found();
  read_once(root, "material", [&](const TableReader& table) { read_materials(table, scene); });
  const bool materials = source.found() == before;
  source.gather([&] { read_objects(source, root, materials, scene); });
  if (source.found() == 0) source.gather([&] { check_point_tool(source, scene, tool_radius); });
  source.gather([&] {
    if (root.has("path")) return;
    source.refuse({1, 1}, "the scene has no [path], so the hand would not move",
                  "add [path] with kind = \"press\", from and to (see scenes/README.md)");
  });
  read_once(root, "path", [&](const TableReader& table) {
    scene.path = read_path(table);
    scene.path_place = table.place();
  });
  if (!errors.empty()) throw_all(file, errors);
  note_unused_keys(root, scene);
  return scene;
}

std::string with_place(const std::filesystem::path& file, SourcePlace place, const std::string& what) {
  std::string out = printable(file.string(), 1000);
  if (place.line > 0) out += words(":", place.line, ":", place.column);
  return words(out, ": ", what);
}

}  // namespace

SceneError::SceneError(const std::filesystem::path& file, SourcePlace place,
                       const std::string& what_and_remedy)
    : std::runtime_error(with_place(file, place, what_and_remedy)) {}

std::size_t max_lattice_voxels() {
  const long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGESIZE);
  // If the system does not report its memory, assumes 4 GiB, as in the smallest machines of today.
  const double bytes = pages > 0 && page_bytes > 0
                           ? static_cast<double>(pages) * static_cast<double>(page_bytes)
                           : 4.0 * 1024 * 1024 * 1024;
  // VoxelId has 32 bits. Half of the numbers are left to the lattice's empty border.
  constexpr double most = 2147483647.0;
  return static_cast<std::size_t>(std::min(most, bytes / static_cast<double>(lattice_bytes_per_voxel)));
}

namespace {

// Reads the tree that `tree_of` makes. Every failure becomes a SceneError.
template <class TreeOf>
Scene read_from(const std::filesystem::path& file, const TreeOf& tree_of) {
  try {
    return read_whole(tree_of(), file);
  } catch (const std::bad_alloc&) {
    throw SceneError(file, {},
                     "the file needs more memory than there is; name meshes and volumes by their file");
  } catch (const std::filesystem::filesystem_error& error) {
    throw SceneError(file, {}, words(printable(error.what()), "; check the path"));
  }
}

}  // namespace

Scene read_scene(const std::filesystem::path& file) {
  return read_from(file, [&file] { return read_tree(file); });
}

Scene read_scene_text(std::string_view text, const std::filesystem::path& file) {
  return read_from(file, [&] { return parse_tree(text, file); });
}

}  // namespace hybrid
