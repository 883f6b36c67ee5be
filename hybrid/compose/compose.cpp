// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compose/compose.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "hybrid/base/file_ending.h"
#include "hybrid/compose/write_scene.h"
#include "hybrid/scene/table_reader.h"
#include "hybrid/session/session.h"
#include "voxel/volume/read_volume.h"

namespace hybrid {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScene = "scene.toml";
constexpr const char* kDraft = "draft.toml";
constexpr std::size_t kMostPlaces = 12;  // a segmentation with more objects gets no list of places

// The name without its extensions: "head" of "head.nii.gz" and of "head/".
std::string stem_of(const fs::path& file) {
  fs::path name = file.filename().empty() ? file.parent_path().filename() : file.filename();
  while (name.has_extension() && name.stem() != name) name = name.stem();
  return name.string();
}

void check_exists(const fs::path& file, const char* what) {
  std::error_code error;
  if (fs::exists(file, error)) return;
  throw ComposeError(fmt::format("{}: there is no such file; {}", file.string(), what));
}

struct Input {
  fs::path file;
  std::string name;
  bool mesh = false;
  Placement placement;
};

std::vector<double> numbers(std::string_view text) {
  std::vector<double> values;
  while (true) {
    const std::size_t end = std::min(text.find(','), text.size());
    double value = 0.0;
    const auto [at, error] = std::from_chars(text.data(), text.data() + end, value);
    if (error != std::errc() || at != text.data() + end || !std::isfinite(value)) return {};
    values.push_back(value);
    if (end == text.size()) return values;
    text.remove_prefix(end + 1);
  }
}

void place_inputs(const std::vector<std::string>& words, std::vector<Input>& inputs) {
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    const std::vector<double> v = equals == std::string::npos
                                      ? std::vector<double>{}
                                      : numbers(std::string_view(word).substr(equals + 1));
    if (v.size() != 3 && v.size() != 6) {
      throw ComposeError(fmt::format(
          "--place {}: must be NAME=x,y,z or NAME=x,y,z,rx,ry,rz, in mm and degrees, as in part=0,0,50",
          word));
    }
    const auto found =
        std::find_if(inputs.begin(), inputs.end(), [&](const Input& i) { return i.name == name; });
    if (found == inputs.end()) {
      std::vector<std::string_view> known;
      known.reserve(inputs.size());
      for (const Input& i : inputs) known.push_back(i.name);
      throw ComposeError(fmt::format("--place {}: no input has this name; {}", word,
                                     known.empty() ? std::string("there is none that can be placed")
                                                   : fmt::format("the nearest is \"{}\" (names here: {})",
                                                                 nearest_name(name, known), joined(known))));
    }
    found->placement.position_mm = {v[0], v[1], v[2]};
    if (v.size() == 6) found->placement.rotation_deg = {v[3], v[4], v[5]};
  }
}

std::string in_words(const voxel::VolumeHeader& h) {
  return fmt::format("{} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm from ({:.4g}, {:.4g}, {:.4g}) mm",
                     h.dims[0], h.dims[1], h.dims[2], h.spacing_m.x * 1e3, h.spacing_m.y * 1e3,
                     h.spacing_m.z * 1e3, h.origin_m.x * 1e3, h.origin_m.y * 1e3, h.origin_m.z * 1e3);
}

// The box around the centres of the outermost voxels, in the scene.
ObjectBox span_of(const voxel::VolumeHeader& h) {
  ObjectBox box{glm::dvec3(1e300), glm::dvec3(-1e300)};
  for (int corner = 0; corner < 8; ++corner) {
    glm::dvec3 at(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      if (((corner >> axis) & 1) != 0)
        at[axis] = (h.dims[static_cast<std::size_t>(axis)] - 1) * h.spacing_m[axis];
    }
    const glm::dvec3 in_scene = h.origin_m + h.rotation * at;
    box.low = glm::min(box.low, in_scene);
    box.high = glm::max(box.high, in_scene);
  }
  return box;
}

// If the labels have another grid than the scan, one of the two files is the wrong one. Formats may count the
// axes from different ends. So the places of the voxels and their numbers are compared, not the axes.
void check_grid(const fs::path& scan, const fs::path& labels) {
  const voxel::VolumeHeader a = voxel::read_volume_header(scan), b = voxel::read_volume_header(labels);
  const double near = 0.1 * std::min({a.spacing_m.x, a.spacing_m.y, a.spacing_m.z});
  const ObjectBox of_scan = span_of(a), of_labels = span_of(b);
  std::array<int, 3> n = a.dims, m = b.dims;
  std::sort(n.begin(), n.end());
  std::sort(m.begin(), m.end());
  if (n == m && glm::length(of_scan.low - of_labels.low) < near &&
      glm::length(of_scan.high - of_labels.high) < near)
    return;
  throw ComposeError(
      fmt::format("{}: has another grid than {}: {}, not {}; give the labels of this volume, or the labels "
                  "alone",
                  labels.string(), scan.string(), in_words(b), in_words(a)));
}

std::string label_fallback(int label) {
  return fmt::format("label_{}", label);
}

void compose_segmentation(const ComposeOptions& options, ComposeFolder& folder, SceneParts& parts,
                          const Progress& progress) {
  if (progress) progress(fmt::format("reading {}", options.labels.string()));
  voxel::LabelVolume fine = read_labels(options.labels, std::nullopt, parts.notes);
  LabelNames names = options.names.empty() ? LabelNames{} : read_label_names(options.names);
  const std::map<int, std::size_t> counts = label_counts(fine);
  if (counts.empty()) {
    throw ComposeError(fmt::format("{}: every voxel is 0, so nothing is labelled; give a segmentation",
                                   options.labels.string()));
  }
  std::set<int> present;
  std::size_t unnamed = 0;
  for (const auto& [label, count] : counts) {
    present.insert(label);
    if (names.try_emplace(label, label_fallback(label)).second) ++unnamed;
  }
  if (unnamed > 0) {
    parts.notes.push_back(
        fmt::format("{} labels have no name, so nothing tells bone from tissue among them; --names FILE "
                    "names them, --rigid and --soft "
                    "choose by number",
                    unnamed));
  }
  const Split split = split_labels(names, present, options.rigid, options.soft);
  std::vector<std::string_view> out;
  for (const int label : present) {
    if (!split.rigid.contains(label) && !split.soft.contains(label)) out.push_back(names.at(label));
  }
  if (!out.empty()) parts.notes.push_back("left out: " + joined(out));
  std::size_t filled = 0;
  for (const int label : split.soft) filled += counts.at(label);
  std::optional<double> spacing = options.spacing_m;
  if (!spacing && filled > 0) {
    std::string why;
    spacing = ready_spacing_m(fine, filled, why);
    if (spacing) {
      parts.notes.push_back(
          fmt::format("{}, read at {:.3g} mm along all axes; --spacing says otherwise", why, *spacing * 1e3));
    }
  }
  parts.of_a_body = voxel::read_volume_header(options.labels).directions_known;
  if (options.spacing_m && split.soft.empty())
    throw ComposeError(
        "--spacing has no effect: no label becomes tissue; remove it, or choose some with --soft");
  if (spacing && !split.soft.empty()) {
    const voxel::LabelVolume tissue = read_labels(options.labels, spacing, parts.notes);
    add_segmentation(fine, tissue, names, split, folder, parts, progress);
  } else {
    add_segmentation(fine, fine, names, split, folder, parts, progress);
  }
}

// Notes on the places of objects, on boxes that overlap, and on objects far from everything else. Each may be
// intended, or may come from a wrong unit or place. In a segmentation of many objects overlap is normal:
// bones overlap the body.
std::vector<std::string> places(const World& world, bool segmented) {
  std::vector<std::string> found;
  const std::size_t count = world.object_count();
  const auto name = [&](std::size_t o) {
    return o < world.rigid.size() ? world.rigid[o].name : world.soft[o - world.rigid.size()].name;
  };
  if (segmented && count > kMostPlaces) return found;
  for (std::size_t o = 0; o < count; ++o)
    found.push_back(fmt::format("{} lies in {}", name(o), in_words(object_box(world, o))));
  for (std::size_t a = 0; a < count; ++a) {
    const ObjectBox box_a = object_box(world, a);
    bool near = count == 1;
    for (std::size_t b = 0; b < count; ++b) {
      if (a == b) continue;
      const ObjectBox box_b = object_box(world, b);
      const glm::dvec3 shared = glm::min(box_a.high, box_b.high) - glm::max(box_a.low, box_b.low);
      const double gap = glm::length(glm::max(glm::dvec3(0.0), -shared));
      near = near || gap <= glm::length(box_a.high - box_a.low) + glm::length(box_b.high - box_b.low);
      if (b > a && shared.x > 0.0 && shared.y > 0.0 && shared.z > 0.0) {
        found.push_back(fmt::format("{} and {}: their boxes share {:.3g} x {:.3g} x {:.3g} mm", name(a),
                                    name(b), shared.x * 1e3, shared.y * 1e3, shared.z * 1e3));
      }
    }
    if (!near) {
      found.push_back(name(a) + " lies far from everything else; is its unit or --place right?");
    }
  }
  return found;
}

// A path for a scene that is only built: far from everything.
PressPath no_path() {
  PressPath path;
  path.points = {{glm::dvec3(0.0, 0.0, 1e3), 0.0, {}}, {glm::dvec3(0.0, 0.0, 1.001e3), 0.0, {}}};
  return path;
}

Composed compose_starter(const ComposeOptions& options) {
  if (!options.place.empty() || !options.rigid.empty() || !options.soft.empty() || !options.names.empty() ||
      options.range || options.spacing_m) {
    throw ComposeError(
        "--place, --rigid, --soft, --names, --range and --spacing need something to work on; give a mesh, a "
        "volume or --labels FILE");
  }
  ComposeFolder folder(options.out, options.force);
  folder.write_text(kScene, starter_scene());
  const Scene scene = load_scene(folder.staging() / kScene);
  Composed composed{.scene = folder.scene(), .path_s = scene_path(scene)->duration_s()};
  composed.tool_radius_m = scene.tool.radius_m;
  folder.keep();
  return composed;
}

}  // namespace

Composed compose(const ComposeOptions& options, const Progress& progress) {
  if (options.inputs.empty() && options.labels.empty()) return compose_starter(options);
  // Options and files that are known to be wrong are refused before anything is written.
  for (const fs::path& file : options.inputs)
    check_exists(file, "give a mesh, a volume or a folder of a DICOM series");
  if (!options.labels.empty()) check_exists(options.labels, "give the label volume of the segmentation");
  std::vector<Input> inputs;
  std::vector<fs::path> scans;
  for (const fs::path& file : options.inputs) {
    if (!options.labels.empty() && !is_mesh_name(file)) {
      scans.push_back(file);
    } else {
      inputs.push_back({file, {}, is_mesh_name(file), {}});
    }
  }
  if (scans.size() > 1) {
    throw ComposeError(fmt::format("{} and {}: --labels says what is in one volume; compose them one by one",
                                   scans[0].string(), scans[1].string()));
  }
  if (options.labels.empty() && (!options.names.empty() || !options.rigid.empty() || !options.soft.empty())) {
    throw ComposeError(
        "--names, --rigid and --soft choose among labels; give the segmentation with --labels FILE");
  }
  if (options.range && !((*options.range)[0] <= (*options.range)[1])) {
    throw ComposeError(fmt::format("--range {:.6g},{:.6g}: must be LO,HI with LO at most HI, as in 300,3000",
                                   (*options.range)[0], (*options.range)[1]));
  }
  const bool intensities = std::any_of(inputs.begin(), inputs.end(), [](const Input& i) { return !i.mesh; });
  if (options.range && !intensities) {
    throw ComposeError(
        "--range has no effect: it chooses intensities of a volume without labels, and there is none; remove "
        "it");
  }
  if (options.spacing_m && !intensities && options.labels.empty())
    throw ComposeError("--spacing has no effect: only meshes are given, and no tissue; remove it");
  for (const fs::path& scan : scans) check_grid(scan, options.labels);

  ComposeFolder folder(options.out, options.force);
  for (Input& input : inputs) input.name = folder.unused_name(stem_of(input.file));
  place_inputs(options.place, inputs);
  SceneParts parts;
  if (!options.labels.empty()) compose_segmentation(options, folder, parts, progress);
  for (const Input& input : inputs) {
    if (input.mesh) {
      add_mesh(input.file, input.name, input.placement, folder, parts, progress);
    } else {
      add_intensities(input.file, input.name, input.placement, options.range, options.spacing_m, folder,
                      parts, progress);
    }
  }
  if (!scans.empty()) {
    for (SoftPart& part : parts.soft) part.scan = fs::absolute(scans[0]);
  }
  SceneSettings settings = default_settings(parts);
  settings.title = stem_of(options.labels.empty() ? options.inputs.front()
                           : scans.empty()        ? options.labels
                                                  : scans[0]);

  // The scene is built once with a path that touches nothing. Its surfaces, after carving, show where a path
  // can touch.
  folder.write_text(kDraft, scene_text(parts, settings, no_path()));
  Composed composed{.scene = folder.scene(), .tool_radius_m = settings.tool_radius_m};
  {
    const BuiltScene built = build_scene(load_scene(folder.staging() / kDraft), progress);
    if (progress) progress("planning a path");
    composed.path = plan_presses(built, parts, settings.tool_radius_m);
    composed.places = places(*built.world, !options.labels.empty());
  }
  if (composed.path.points.empty()) {
    throw ComposeError(
        "nothing of this scene can be reached from outside along an axis; `hybrid check` the inputs");
  }
  folder.drop(kDraft);
  folder.write_text(kScene, scene_text(parts, settings, composed.path));
  composed.path_s = scene_path(load_scene(folder.staging() / kScene))->duration_s();
  composed.rows = std::move(parts.rows);
  composed.notes = std::move(parts.notes);
  folder.keep();
  return composed;
}

}  // namespace hybrid
