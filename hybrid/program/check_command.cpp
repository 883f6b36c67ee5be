// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "hybrid/base/file_ending.h"
#include "hybrid/base/process_memory.h"
#include "hybrid/program/commands.h"
#include "hybrid/scene/table_reader.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"
#include "hybrid/session/scene_cost.h"
#include "polygon/files/mesh_file.h"
#include "polygon/repair/check.h"
#include "polygon/surface/mesh_surface.h"
#include "voxel/volume/read_volume.h"

namespace hybrid {
namespace {

using Json = nlohmann::ordered_json;

const char* word(polygon::Severity severity) {
  switch (severity) {
    case polygon::Severity::info:
      return "info";
    case polygon::Severity::warning:
      return "warning";
    case polygon::Severity::error:
      return "error";
  }
  return "error";
}

Json to_json(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}

Json to_json(const polygon::Finding& f) {
  Json json{{"id", f.id}, {"severity", word(f.severity)}, {"count", f.count}, {"text", f.text}};
  if (f.place) {
    json["place"] = {{"first_m", to_json(f.place->first_m)},
                     {"lower_m", to_json(f.place->lower_m)},
                     {"upper_m", to_json(f.place->upper_m)}};
    if (f.place->triangle) json["place"]["triangle"] = *f.place->triangle;
  }
  return json;
}

void add_finding(Json& file, const polygon::Finding& f) {
  file["findings"].push_back(to_json(f));
}

// A finding of a mesh as JSON. Its text begins with the count, because it is worded to follow one.
Json counted(polygon::Finding f) {
  f.text = fmt::format("{} {}", f.count, f.text);
  return to_json(f);
}

// The changes that `repair = true` would make, and the findings that remain after it.
Json would_repair(const polygon::TriangleMesh& mesh, bool deep) {
  const polygon::RepairedMesh repaired = polygon::repair_mesh(mesh);
  const polygon::MeshCheck checked = polygon::check_mesh(repaired.mesh, deep);
  Json json{{"changes", Json::array()},
            {"after", Json::array()},
            {"vertices", repaired.mesh.vertices.size()},
            {"triangles", repaired.mesh.triangles.size()},
            {"closed", checked.closed},
            {"oriented", checked.oriented},
            {"volume_m3", checked.volume_m3}};
  for (const polygon::Finding& f : repaired.changes) json["changes"].push_back(counted(f));
  for (const polygon::Finding& f : checked.findings) json["after"].push_back(counted(f));
  json["summary"] = fmt::format("{} vertices, {} triangles, {}", repaired.mesh.vertices.size(),
                                repaired.mesh.triangles.size(), polygon::touched_as(checked));
  return json;
}

void print_findings(std::FILE* out, const Json& findings, const char* indent) {
  for (const Json& f : findings) {
    fmt::print(out, "{}{} {}: {}\n", indent, f["severity"].get<std::string>(), f["id"].get<std::string>(),
               f["text"].get<std::string>());
  }
}

std::string unit_in_words(double unit_m) {
  for (const auto& [name, value_m] : length_units()) {
    if (value_m == unit_m) return name;
  }
  return fmt::format("{:g} m", unit_m);
}

void check_mesh_file(const std::filesystem::path& path, const CheckCommand& command, Json& file) {
  file["kind"] = "mesh";
  polygon::MeshFile loaded =
      polygon::load_mesh(path, {.scale = command.unit_m, .max_bytes = usable_memory_bytes() / 4});
  const polygon::MeshCheck checked = polygon::check_mesh(loaded.mesh, command.deep);
  for (const polygon::Finding& f : loaded.findings) file["findings"].push_back(counted(f));
  for (const polygon::Finding& f : checked.findings) file["findings"].push_back(counted(f));
  if (command.repair) file["repair"] = would_repair(loaded.mesh, command.deep);
  file["vertices"] = loaded.mesh.vertices.size();
  file["triangles"] = loaded.mesh.triangles.size();
  file["closed"] = checked.closed;
  file["oriented"] = checked.oriented;
  const auto mesh = std::make_shared<const polygon::TriangleMesh>(std::move(loaded.mesh));
  const auto surface = polygon::make_mesh_surface(mesh, {.solid = checked.oriented});
  const glm::dvec3 low = surface->lower(), high = surface->upper();
  file["lower_m"] = to_json(low);
  file["upper_m"] = to_json(high);
  file["volume_m3"] = checked.volume_m3;
  file["touch_bytes"] = surface->memory_bytes();
  file["summary"] = fmt::format(
      "{} vertices, {} triangles, {:.4g} x {:.4g} x {:.4g} mm where the file's unit is {}, {}; "
      "{:.1f} MB to touch",
      mesh->vertices.size(), mesh->triangles.size(), 1e3 * (high.x - low.x), 1e3 * (high.y - low.y),
      1e3 * (high.z - low.z), unit_in_words(command.unit_m), polygon::touched_as(checked),
      static_cast<double>(surface->memory_bytes()) / 1e6);
}

void check_volume_file(const std::filesystem::path& path, Json& file) {
  file["kind"] = "volume";
  const voxel::VolumeHeader h = voxel::read_volume_header(path);
  for (const std::string& note : h.notes) add_finding(file, {"V01", polygon::Severity::warning, 1, note});
  file["format"] = h.format;
  file["component"] = h.component;
  file["dims"] = h.dims;
  file["spacing_m"] = {h.spacing_m.x, h.spacing_m.y, h.spacing_m.z};
  const voxel::VolumeStatistics s = voxel::read_volume_statistics(path, usable_memory_bytes() / 4);
  if (s.not_numbers > 0) {
    file["findings"].push_back(
        counted({"V02", polygon::Severity::warning, s.not_numbers,
                 "voxels are not numbers (NaN): they are in no range, and count as empty"}));
  }
  file["minimum"] = s.minimum;
  file["maximum"] = s.maximum;
  Json labels = Json::object();
  for (const auto& [label, count] : s.label_counts) labels[std::to_string(label)] = count;
  if (!s.label_counts.empty()) file["labels"] = labels;
  const std::uint64_t bytes = soft_load_bytes(h.dims);
  file["touch_bytes"] = bytes;
  file["summary"] = fmt::format(
      "{}, {} x {} x {} {}, {:.3g} x {:.3g} x {:.3g} mm, {:.6g} to {:.6g}{}; about {:.1f} MB to touch as it "
      "is, {:.0f} MB where it has been touched everywhere",
      h.format, h.dims[0], h.dims[1], h.dims[2], h.component, h.spacing_m.x * 1e3, h.spacing_m.y * 1e3,
      h.spacing_m.z * 1e3, s.minimum, s.maximum,
      s.label_counts.empty() ? "" : fmt::format(", {} labels", s.label_counts.size()),
      static_cast<double>(bytes) / 1e6, static_cast<double>(soft_touched_bytes(h.dims)) / 1e6);
}

Json to_json(const SceneCost& cost) {
  return {{"load_s", cost.load_s},
          {"held_memory_bytes", cost.held_bytes},
          {"touched_memory_bytes", cost.touched_bytes},
          {"tick_us", cost.tick_us ? hybrid::to_json(*cost.tick_us) : Json(nullptr)},
          {"ticks", cost.ticks},
          {"places", cost.places},
          {"period_us", cost.period_us}};
}

void check_scene_file(const std::filesystem::path& path, Json& file) {
  file["kind"] = "scene";
  const Scene scene = load_scene(path);
  const Progress progress = progress_on_terminal();
  BuiltScene built = build_scene(scene, progress);
  note_relaxation(scene, built, true);
  progress("measuring ticks at places of contact");
  const SceneCost cost = measure_cost(scene, built);
  end_progress();
  std::uint64_t bytes = built.state->map.memory_bytes();
  for (const BuildNote& note : built.notes) {
    add_finding(file, {"S01", note.severity, 1,
                       fmt::format("{}{}{}", note.object, note.object.empty() ? "" : ": ", note.text)});
  }
  const std::shared_ptr<const device::Path> hand_path = scene_path(scene);
  for (const std::string& note : hand_path->notes()) {
    add_finding(file, {"S03", polygon::Severity::info, 1, "path: " + note});
  }
  file["objects"] = Json::array();
  for (const RigidObject& o : built.world->rigid) {
    file["objects"].push_back(
        {{"name", o.name}, {"kind", "rigid"}, {"triangles", o.drawn->triangles.size()}});
    bytes += o.memory_bytes();
  }
  for (std::size_t o = 0; o < built.state->soft.size(); ++o) {
    const voxel::SoftObject& object = *built.state->soft[o];
    file["objects"].push_back({{"name", built.world->soft[o].name},
                               {"kind", "soft"},
                               {"voxels", object.lattice().voxel_count()},
                               {"surface_voxels", object.lattice().surface().size()},
                               {"anchored", object.lattice().anchored_count()},
                               {"thinned_voxels", built.world->soft[o].thinned}});
    bytes += object.memory_bytes();
  }
  for (std::size_t o = 0; o < built.world->object_count(); ++o) {
    const std::string place = in_words(object_box(*built.world, o));
    file["objects"][o]["place"] = place;
    add_finding(file,
                {"S02", polygon::Severity::info, 1,
                 fmt::format("\"{}\" lies in {}", file["objects"][o]["name"].get<std::string>(), place)});
  }
  file["touch_bytes"] = bytes;
  file["build_s"] = built.seconds;
  file["cost"] = to_json(cost);
  const bool slow = cost.tick_us && cost.tick_us->p99 > cost.period_us;
  add_finding(file, {"S04", slow ? polygon::Severity::warning : polygon::Severity::info, 1,
                     "cost: " + in_words(cost) + (slow ? "; use a coarser spacing or a smaller tool" : "")});
  file["summary"] = fmt::format(
      "{} rigid and {} soft objects, {} occupied cells of {:.3g} mm; {:.1f} MB to touch, built in {:.2f} s",
      built.world->rigid.size(), built.world->soft.size(), built.state->map.occupied_cells(),
      built.state->map.cell_m() * 1e3, static_cast<double>(bytes) / 1e6, built.seconds);
}

}  // namespace

int check(const CheckCommand& command) {
  Outputs outputs;
  outputs.ask_json(command.json);
  Json report = report_head("check");
  report["files"] = Json::array();
  std::FILE* words = outputs.words();
  int status = 0;
  for (const std::filesystem::path& path : command.files) {
    Json file{{"file", path.string()}, {"kind", "unknown"}, {"findings", Json::array()}};
    try {
      if (lower_ending(path) == ".toml") {
        check_scene_file(path, file);
      } else if (is_mesh_name(path)) {
        check_mesh_file(path, command, file);
      } else if (is_volume_name(path) || !std::filesystem::is_regular_file(path)) {
        check_volume_file(path, file);
      } else {
        throw std::runtime_error(
            path.string() +
            ": its name has the ending of no scene (.toml), mesh (.obj, .ply, .stl, .off) or "
            "volume (.nii, .nrrd, .nhdr, .mha, .mhd); rename it, or export it in one of these");
      }
      fmt::print(words, "{}: {}\n", path.string(), file["summary"].get<std::string>());
    } catch (const std::exception& e) {
      end_progress();
      status = 1;
      add_finding(file, {"E00", polygon::Severity::error, 1, e.what()});
      fmt::print(words, "{}: refused\n", path.string());
    }
    print_findings(words, file["findings"], "  ");
    if (file.contains("repair")) {
      fmt::print(words, "  repair would make it {}, by:\n", file["repair"]["summary"].get<std::string>());
      print_findings(words, file["repair"]["changes"], "    ");
      if (!file["repair"]["after"].empty()) fmt::print(words, "  and a check would then find:\n");
      print_findings(words, file["repair"]["after"], "    ");
    }
    report["files"].push_back(file);
  }
  outputs.write_json(command.json, report);
  return outputs.failed() ? 1 : status;
}

}  // namespace hybrid
