// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of a scene from the labels of a segmentation. For meshes and volumes without labels see
// parts_from_files.cpp.
#include "hybrid/compose/parts_from_labels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "hybrid/base/letters.h"
#include "hybrid/base/process_memory.h"
#include "hybrid/base/whole_file.h"
#include "hybrid/geometry/surface_nets.h"
#include "hybrid/scene/table_reader.h"
#include "polygon/files/write_mesh.h"
#include "polygon/mesh/mesh_bounds.h"
#include "polygon/repair/check.h"
#include "voxel/volume/connected_components.h"
#include "voxel/volume/read_volume.h"
#include "voxel/volume/write_volume.h"

namespace hybrid {
namespace {

using voxel::LabelVolume;

constexpr std::size_t kLeastBoneVoxels = 8;    // a smaller bone is left out
constexpr std::size_t kLeastPieceVoxels = 27;  // smaller loose pieces of soft labels are left out
// Passes of smoothing; the default for surfaces from volumes in a scene.
constexpr int kSmoothing = 10;
// Spacings; voxels this near to bone are held, whether the bone is carved out or not.
constexpr double kHeldWithin = 1.6;

struct Box {
  std::array<int, 3> low{1 << 30, 1 << 30, 1 << 30}, high{-1, -1, -1};
  void add(int i, int j, int k) {
    low = {std::min(low[0], i), std::min(low[1], j), std::min(low[2], k)};
    high = {std::max(high[0], i), std::max(high[1], j), std::max(high[2], k)};
  }
  [[nodiscard]] glm::dvec3 size_m(const LabelVolume& volume) const {
    return glm::dvec3(high[0] - low[0] + 1, high[1] - low[1] + 1, high[2] - low[2] + 1) * volume.spacing_m;
  }
};

template <typename Visit>
void for_each_voxel(const LabelVolume& volume, Visit&& visit) {
  std::size_t at = 0;
  for (int k = 0; k < volume.dims[2]; ++k) {
    for (int j = 0; j < volume.dims[1]; ++j) {
      for (int i = 0; i < volume.dims[0]; ++i, ++at) visit(i, j, k, at);
    }
  }
}

std::array<Box, 256> label_boxes(const LabelVolume& volume) {
  std::array<Box, 256> boxes;
  for_each_voxel(volume, [&](int i, int j, int k, std::size_t at) { boxes[volume.labels[at]].add(i, j, k); });
  return boxes;
}

// The part of a volume within a box. A voxel keeps its label if `keep` returns true for it, otherwise it
// becomes empty.
template <typename Keep>
LabelVolume cropped(const LabelVolume& volume, const Box& box, Keep&& keep) {
  LabelVolume part;
  for (std::size_t axis = 0; axis < 3; ++axis) part.dims[axis] = box.high[axis] - box.low[axis] + 1;
  part.spacing_m = volume.spacing_m;
  part.rotation = volume.rotation;
  part.origin_m =
      volume.origin_m + volume.rotation * (glm::dvec3(box.low[0], box.low[1], box.low[2]) * volume.spacing_m);
  part.labels.resize(static_cast<std::size_t>(part.dims[0]) * static_cast<std::size_t>(part.dims[1]) *
                     static_cast<std::size_t>(part.dims[2]));
  for_each_voxel(part, [&](int i, int j, int k, std::size_t at) {
    const std::size_t from = volume.index(i + box.low[0], j + box.low[1], k + box.low[2]);
    part.labels[at] = keep(from) ? volume.labels[from] : std::uint8_t{0};
  });
  return part;
}

polygon::TriangleMesh in_scene(polygon::TriangleMesh mesh, const LabelVolume& volume) {
  for (glm::dvec3& v : mesh.vertices) v = volume.origin_m + volume.rotation * v;
  return mesh;
}

void add_bone(const LabelVolume& fine, int label, const std::string& label_name, const Box& box,
              ComposeFolder& folder, SceneParts& parts) {
  const LabelVolume part = cropped(fine, box, [&](std::size_t at) { return fine.labels[at] == label; });
  const auto voxels = static_cast<std::size_t>(
      std::count_if(part.labels.begin(), part.labels.end(), [](auto l) { return l != 0; }));
  if (voxels < kLeastBoneVoxels) {
    parts.notes.push_back(fmt::format("{}: left out, it has {} voxels", label_name, voxels));
    return;
  }
  const polygon::TriangleMesh mesh = in_scene(surface_from_labels(part, kSmoothing), part);
  const polygon::MeshCheck check = polygon::check_mesh(mesh);
  for (const polygon::Finding& f : check.findings) {
    if (f.severity != polygon::Severity::info)
      parts.notes.push_back(fmt::format("{}: {}: {} {}", label_name, f.id, f.count, f.text));
  }
  const std::string name = folder.unused_name(label_name);
  {
    WholeFile out(folder.claim(name + ".ply"));
    polygon::write_ply(mesh, [&out](std::string_view bytes) { out.write(bytes); });
    out.keep();
  }
  const Tissue* tissue = find_tissue(label_name);
  const polygon::MeshBounds bounds = polygon::checked_bounds(mesh);
  parts.rigid.push_back(
      {.name = name,
       .file = name + ".ply",
       .unit = "m",
       .family = std::string(tissue != nullptr ? tissue->name : std::string_view(label_name)),
       .comment = fmt::format("label {}, {} voxels", label, voxels),
       .placement = {}});
  parts.rows.push_back({.name = name,
                        .rigid = true,
                        .voxels = voxels,
                        .triangles = mesh.triangles.size(),
                        .size_m = bounds.high - bounds.low,
                        .source = check.oriented ? "closed surface" : "sheet"});
}

// Marks the pieces of soft labels that touch something rigid. A voxel touches its 26 neighbours.
std::vector<bool> held_pieces(const LabelVolume& tissue, const std::vector<bool>& rigid,
                              const voxel::ConnectedRuns& runs) {
  std::vector<bool> held(runs.pieces(), false);
  for_each_voxel(tissue, [&](int i, int j, int k, std::size_t at) {
    if (!rigid[tissue.labels[at]]) return;
    for (int dk = -1; dk <= 1; ++dk) {
      for (int dj = -1; dj <= 1; ++dj) {
        for (int di = -1; di <= 1; ++di) {
          const int x = i + di, y = j + dj, z = k + dk;
          if (x < 0 || y < 0 || z < 0 || x >= tissue.dims[0] || y >= tissue.dims[1] || z >= tissue.dims[2])
            continue;
          const auto row = static_cast<std::size_t>(z) * static_cast<std::size_t>(tissue.dims[1]) +
                           static_cast<std::size_t>(y);
          const std::uint32_t piece = runs.piece_of(x, row);
          if (piece != voxel::ConnectedRuns::kNone) held[piece] = true;
        }
      }
    }
  });
  return held;
}

// Treats tissue that no bone holds: without anchors it has no equilibrium. Small pieces are removed. In each
// other piece, the layer nearest to the body's back gets labels of its own. The scene anchors these labels,
// because the body lies on its back.
class LooseTissue {
 public:
  LooseTissue(LabelVolume& tissue, SoftPart& part, SceneParts& parts)
      : tissue_(tissue), part_(part), parts_(parts) {}

  void settle(const voxel::ConnectedRuns& runs, const std::vector<bool>& held) {
    std::vector<Piece> pieces(runs.pieces());
    const glm::dvec3 down =
        // Direction to the back, in the lattice's frame.
        glm::inverse(tissue_.rotation) * glm::dvec3(0.0, 1.0, 0.0);
    int axis = 0;
    for (int a = 1; a < 3; ++a) axis = std::abs(down[a]) > std::abs(down[axis]) ? a : axis;
    const int sign = down[axis] < 0.0 ? -1 : 1;
    const auto visit = [&](auto&& use) {
      for_each_voxel(tissue_, [&](int i, int j, int k, std::size_t at) {
        const std::uint32_t p =
            runs.piece_of(i, static_cast<std::size_t>(k) * static_cast<std::size_t>(tissue_.dims[1]) +
                                 static_cast<std::size_t>(j));
        if (p == voxel::ConnectedRuns::kNone || held[p]) return;
        use(pieces[p], sign * std::array{i, j, k}[static_cast<std::size_t>(axis)], tissue_.labels[at]);
      });
    };
    visit([](Piece& p, int depth, std::uint8_t&) {
      ++p.voxels;
      p.lowest = std::max(p.lowest, depth);
    });
    visit([&](Piece& p, int depth, std::uint8_t& label) {
      if (p.voxels < kLeastPieceVoxels) {
        ++specks_;
        label = 0;
      } else if (depth == p.lowest) {
        label = anchored_twin(label);
      }
    });
    say(pieces, held);
  }

 private:
  struct Piece {
    std::size_t voxels = 0;
    int lowest = -(1 << 30);
  };

  std::uint8_t anchored_twin(std::uint8_t label) {
    const auto known = twins_.find(label);
    if (known != twins_.end()) return known->second;
    int twin = 255;
    while (twin > 0 && part_.materials.contains(twin)) --twin;
    // All 255 labels are in use; the scene's loader will refuse the tissue and explain.
    if (twin == 0) return label;
    part_.materials[twin] = part_.materials.at(label);
    part_.label_names[twin] = part_.label_names.at(label);
    part_.anchor_labels.insert(twin);
    return twins_[label] = static_cast<std::uint8_t>(twin);
  }

  void say(const std::vector<Piece>& pieces, const std::vector<bool>& held) {
    if (specks_ > 0)
      parts_.notes.push_back(fmt::format("{}: {} voxels left out, loose specks of fewer than {} voxels each",
                                         part_.name, specks_, kLeastPieceVoxels));
    std::size_t loose = 0, voxels = 0;
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      if (held[p] || pieces[p].voxels < kLeastPieceVoxels) continue;
      ++loose;
      voxels += pieces[p].voxels;
    }
    if (loose > 0)
      parts_.notes.push_back(
          fmt::format("{}: {} of {} pieces ({} voxels) touch nothing rigid; the layer of each nearest to the "
                      "back holds it",
                      part_.name, loose, pieces.size(), voxels));
  }

  LabelVolume& tissue_;
  SoftPart& part_;
  SceneParts& parts_;
  std::map<std::uint8_t, std::uint8_t> twins_;
  std::size_t specks_ = 0;
};

std::vector<bool> as_flags(const std::set<int>& labels) {
  std::vector<bool> flags(256, false);
  for (const int label : labels) flags[static_cast<std::size_t>(label)] = true;
  return flags;
}

// The name of the object: the names of its labels if there are few, otherwise those of the two largest.
std::string name_of_tissue(const LabelVolume& tissue, const LabelNames& names, const std::set<int>& soft) {
  std::vector<std::pair<std::size_t, std::string>> largest;
  for (const auto& [label, count] : label_counts(tissue)) {
    if (soft.contains(label)) largest.emplace_back(count, names.at(label));
  }
  std::stable_sort(largest.begin(), largest.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  constexpr std::size_t kNamed = 2;  // labels that the name of an object contains
  std::string name;
  for (std::size_t n = 0; n < largest.size() && n < kNamed; ++n)
    name.append(name.empty() ? "" : "_and_").append(whole_characters(largest[n].second, 20));
  if (largest.size() > kNamed) name += fmt::format("_and_{}", largest.size() - kNamed);
  return name;
}

void add_tissue(const LabelVolume& tissue, const LabelNames& names, const Split& split, ComposeFolder& folder,
                SceneParts& parts) {
  const std::array<Box, 256> boxes = label_boxes(tissue);
  const std::vector<bool> soft = as_flags(split.soft);
  const auto missing = [&](int label) { return boxes[static_cast<std::size_t>(label)].high[0] < 0; };
  if (std::all_of(split.soft.begin(), split.soft.end(), missing))
    throw ComposeError("no soft label has a voxel at this spacing; give --spacing a smaller one");
  SoftPart part{.name = folder.unused_name(name_of_tissue(tissue, names, split.soft)),
                .file = {},
                .comment = {},
                .placement = {},
                .volume = {}};
  part.file = part.name + ".nii.gz";
  std::vector<std::string_view> unknown;
  for (const int label : split.soft) {
    if (missing(label)) {
      parts.notes.push_back(fmt::format("{}: no voxel is left of it at this spacing", names.at(label)));
      continue;
    }
    const Tissue* found = find_tissue(names.at(label));
    const Tissue* known = found == nullptr || found->bone ? &unknown_tissue() : found;
    if (known == &unknown_tissue()) unknown.push_back(names.at(label));
    part.materials[label] = known;
    part.label_names[label] = names.at(label);
  }
  if (!unknown.empty()) {
    parts.notes.push_back(fmt::format(
        "{}: no stiffness of such a tissue is known here; {} kPa is assumed. Correct `young` of the material "
        "with this name in the scene",
        joined(unknown), unknown_tissue().young_Pa / 1e3));
  }
  LabelVolume work = tissue;
  const voxel::ConnectedRuns runs(work, soft);
  LooseTissue(work, part, parts).settle(runs, held_pieces(tissue, as_flags(split.rigid), runs));
  const auto is_tissue = [&](std::size_t at) { return soft[tissue.labels[at]] && work.labels[at] != 0; };
  Box box;
  for_each_voxel(work, [&](int i, int j, int k, std::size_t at) {
    if (is_tissue(at)) box.add(i, j, k);
  });
  if (box.high[0] < 0)
    throw ComposeError(
        "the soft labels are loose specks of a few voxels each; choose others with --soft, or a smaller "
        "--spacing");
  part.volume = cropped(work, box, is_tissue);
  const std::map<int, std::size_t> kept = label_counts(part.volume);
  std::erase_if(part.materials, [&](const auto& label) { return !kept.contains(label.first); });
  std::erase_if(part.label_names, [&](const auto& label) { return !kept.contains(label.first); });
  const double h = std::max({tissue.spacing_m.x, tissue.spacing_m.y, tissue.spacing_m.z});
  if (!split.rigid.empty()) part.rigid_within_mm = kHeldWithin * h * 1e3;
  voxel::save_volume(folder.claim(part.file), part.volume);
  const std::map<int, std::size_t> counts = label_counts(tissue);
  for (const int label : split.soft) {
    if (!part.materials.contains(label)) continue;
    const Tissue& t = *part.materials.at(label);
    parts.rows.push_back({.name = names.at(label),
                          .voxels = counts.at(label),
                          .size_m = boxes[static_cast<std::size_t>(label)].size_m(tissue),
                          .young_Pa = t.young_Pa,
                          .poisson = t.poisson,
                          .source = std::string(t.source)});
  }
  parts.soft.push_back(std::move(part));
}

}  // namespace

std::map<int, std::size_t> label_counts(const LabelVolume& volume) {
  std::array<std::size_t, 256> count{};
  for (const std::uint8_t label : volume.labels) ++count[label];
  std::map<int, std::size_t> counts;
  for (int label = 1; label < 256; ++label) {
    if (count[static_cast<std::size_t>(label)] > 0) counts[label] = count[static_cast<std::size_t>(label)];
  }
  return counts;
}

namespace {

// Throws if the file can be read but does not hold labels.
void refuse_intensities(const std::filesystem::path& file) {
  const voxel::VolumeStatistics held = voxel::read_volume_statistics(file, usable_memory_bytes() / 4);
  if (!held.label_counts.empty()) return;
  throw ComposeError(
      fmt::format("--labels {}: holds intensities from {:.6g} to {:.6g}, not labels from 0 to 255; give the "
                  "file without --labels, and say with --range LO,HI which intensities are tissue",
                  file.string(), held.minimum, held.maximum));
}

}  // namespace

LabelVolume read_labels(const std::filesystem::path& file, std::optional<double> spacing_m,
                        std::vector<std::string>& notes) {
  voxel::VolumeFileOptions options;
  options.max_bytes = usable_memory_bytes() / 4;
  if (spacing_m) options.spacing_m = glm::dvec3(*spacing_m);
  std::vector<std::string> of_file;
  LabelVolume volume = [&] {
    try {
      return voxel::load_volume(file, options, &of_file);
    } catch (const voxel::VolumeError&) {
      refuse_intensities(file);
      throw;
    }
  }();
  for (const std::string& note : of_file) notes.push_back(fmt::format("{}: {}", file.string(), note));
  return volume;
}

Split split_labels(const LabelNames& names, const std::set<int>& present,
                   const std::vector<std::string>& rigid, const std::vector<std::string>& soft) {
  const std::vector<std::string> none{"none"};
  Split split;
  if (!rigid.empty() && rigid != none) split.rigid = chosen_labels(rigid, names, present, "--rigid");
  if (!soft.empty() && soft != none) split.soft = chosen_labels(soft, names, present, "--soft");
  for (const int label : split.rigid) {
    if (!split.soft.contains(label)) continue;
    throw ComposeError(
        fmt::format("{} ({}) is in --rigid and in --soft; take it out of one", names.at(label), label));
  }
  for (const int label : present) {
    const Tissue* tissue = find_tissue(names.at(label));
    const bool bone = tissue != nullptr && tissue->bone;
    if (rigid.empty() && bone && !split.soft.contains(label)) split.rigid.insert(label);
    if (soft.empty() && !bone && !split.rigid.contains(label)) split.soft.insert(label);
  }
  if (split.rigid.empty() && split.soft.empty()) {
    throw ComposeError("--rigid and --soft leave nothing of this volume; name at least one label");
  }
  return split;
}

void add_segmentation(const LabelVolume& fine, const LabelVolume& tissue, const LabelNames& names,
                      const Split& split, ComposeFolder& folder, SceneParts& parts,
                      const Progress& progress) {
  const std::array<Box, 256> boxes = label_boxes(fine);
  for (const int label : split.rigid) {
    if (progress) progress(fmt::format("surface of {}", names.at(label)));
    add_bone(fine, label, names.at(label), boxes[static_cast<std::size_t>(label)], folder, parts);
  }
  if (split.soft.empty()) return;
  if (progress) progress("tissue");
  add_tissue(tissue, names, split, folder, parts);
}

}  // namespace hybrid
