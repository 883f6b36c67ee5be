// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/polygon/files/fuzz_target.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "polygon/files/mesh_file.h"
#include "polygon/mesh/triangle.h"
#include "polygon/repair/check.h"
#include "polygon/surface/mesh_surface.h"

namespace tests {
namespace {

using namespace polygon;

// Limit on the unpacked size: enough for every seed, but small enough that a file with a false size is
// refused.
constexpr std::uint64_t kMaxBytes = 4U << 20U;
// Fraction of the bounding box's diagonal. A triangle further than this from the repaired mesh counts as
// lost.
constexpr double kLost = 1e-5;

void must(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz: broken: %s\n", what);
  std::abort();
}

bool finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

struct Box {
  glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
};

Box box_of(const TriangleMesh& mesh) {
  Box box;
  for (const TriangleIndices& t : mesh.triangles) {
    for (const std::uint32_t corner : t) {
      box.low = glm::min(box.low, mesh.vertices[corner]);
      box.high = glm::max(box.high, mesh.vertices[corner]);
    }
  }
  return box;
}

void must_be_sound(const TriangleMesh& mesh) {
  for (const glm::dvec3& v : mesh.vertices) must(finite(v), "every vertex is finite");
  for (const TriangleIndices& t : mesh.triangles) {
    for (const std::uint32_t corner : t) must(corner < mesh.vertices.size(), "every corner is a vertex");
  }
}

void add(std::string& signature, const std::vector<Finding>& findings) {
  for (const Finding& f : findings) {
    must(f.count > 0 && !f.text.empty(), "a finding has a count and words");
    must(!f.place || (finite(f.place->first_m) && finite(f.place->lower_m) && finite(f.place->upper_m)),
         "a place is finite");
    signature += f.id.substr(0, 3);
    signature += f.count > 100 ? 'c' : f.count > 10 ? 'b' : 'a';
  }
}

void touch(const TriangleMesh& mesh, bool solid) {
  const auto surface = make_mesh_surface(mesh, solid);
  const glm::dvec3 low = surface->lower(), high = surface->upper();
  must(finite(low) && finite(high), "bounds are finite");
  const double size = glm::length(high - low);
  std::array<NearPoint, 64> near;
  for (int i = 0; i < 12; ++i) {
    const int column = i % 3, row = i / 3 % 2, layer = i / 6;
    const glm::dvec3 share(0.55 * column - 0.05, 0.5 * row + 0.25, 1.1 * layer - 0.05);
    const glm::dvec3 p = low + share * (high - low);
    NearPoint nearest;
    if (surface->nearest(p, 2.0 * size, nearest)) {
      must(finite(nearest.point) && nearest.distance >= 0.0 && nearest.distance <= 2.0 * size,
           "the nearest point is finite and within reach");
      must(nearest.element < mesh.triangles.size(), "the nearest element is a triangle");
    }
    const GatherResult gathered = surface->gather(p, 0.3 * size, near);
    must(gathered.count <= near.size(), "gather keeps to its buffer");
    for (std::uint32_t k = 0; k < gathered.count; ++k) {
      must(finite(near[k].point), "a gathered point is finite");
    }
    must(!surface->inside(p) || solid, "a sheet has no inside");
  }
}

// Checks that repair keeps every triangle that is not degenerate and not covered by another triangle.
void must_keep(const TriangleMesh& before, const TriangleMesh& after) {
  const Box box = box_of(before);
  const double lost = kLost * glm::length(box.high - box.low);
  const auto surface = make_mesh_surface(after, false);
  const std::size_t step = 1 + before.triangles.size() / 1000;
  for (std::size_t i = 0; i < before.triangles.size(); i += step) {
    const TriangleIndices& t = before.triangles[i];
    const glm::dvec3 &a = before.vertices[t[0]], &b = before.vertices[t[1]], &c = before.vertices[t[2]];
    if (is_degenerate(a, b, c)) continue;
    NearPoint nearest;
    must(surface->nearest((a + b + c) / 3.0, lost, nearest) || lost == 0.0, "repair loses no triangle");
  }
  const Box kept = box_of(after);
  for (int k = 0; k < 3; ++k) {
    must(kept.low[k] >= box.low[k] - lost && kept.high[k] <= box.high[k] + lost,
         "repair stays within the mesh's box");
  }
}

}  // namespace

FuzzOutcome fuzz_file(const std::filesystem::path& file) {
  FuzzOutcome outcome;
  MeshFile loaded;
  try {
    loaded = load_mesh(file, {.max_bytes = kMaxBytes});
  } catch (const MeshError& refusal) {
    const std::string words = refusal.what();
    must(words.starts_with(file.string()), "a refusal names the file");
    for (const char c : words.substr(file.string().size())) {
      const bool letter = std::isalpha(static_cast<unsigned char>(c)) != 0;
      // Only the first letters count, because later ones quote the file.
      if (letter && outcome.signature.size() < 40) outcome.signature += c;
    }
    return outcome;
  }
  outcome.loaded = true;
  outcome.size = loaded.mesh.triangles.size();
  must(!loaded.mesh.empty(), "a loaded mesh has triangles");
  must_be_sound(loaded.mesh);
  add(outcome.signature, loaded.findings);
  const MeshCheck before = check_mesh(loaded.mesh, true);
  add(outcome.signature, before.findings);
  must(!before.oriented || before.closed, "what is oriented is closed");
  touch(loaded.mesh, before.oriented);

  const RepairedMesh repaired = repair_mesh(loaded.mesh);
  add(outcome.signature, repaired.changes);
  must_be_sound(repaired.mesh);
  if (repaired.mesh.empty()) return outcome;
  must_keep(loaded.mesh, repaired.mesh);
  const MeshCheck after = check_mesh(repaired.mesh, true);
  add(outcome.signature, after.findings);
  const bool doubled = std::any_of(before.findings.begin(), before.findings.end(),
                                   [](const Finding& f) { return f.id.starts_with("M03"); });
  // If a sheet has two coincident faces, one for either side, repair keeps only one. By its edge counts the
  // mesh was closed, and repair makes it an open sheet.
  must(after.closed || !before.closed || doubled, "repair opens no closed mesh");
  touch(repaired.mesh, after.oriented);
  return outcome;
}

}  // namespace tests
