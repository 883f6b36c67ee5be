// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/view_changes.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <limits>

#include "hybrid/view/palette.h"

namespace hybrid {
namespace {

// A part of a mesh is not drawn again while its motion is less than kShareOfFastest of the fastest motion in
// the frame, and less than kMostUndrawn_px. A motion below kLeastSeen_px is never seen.
constexpr float kShareOfFastest = 0.25F;
constexpr float kMostUndrawn_px = 1.0F, kLeastSeen_px = 0.1F;
// The same for values that give a colour: share of the scale.
constexpr float kMostUncoloured = 1.0F / 200.0F;
constexpr int kRim_px = 2;  // rounding, and the samples that a triangle touches

PixelRect grown(const PixelRect& r, const PixelRect& within) {
  if (r.empty()) return {};
  return common({r.x - kRim_px, r.y - kRim_px, r.width + 2 * kRim_px, r.height + 2 * kRim_px}, within);
}

// Greatest number of samples that a metre covers, at the near side of a ball.
float samples_per_m(const Ball& ball, const Projection& projection) {
  const glm::vec4 depth = glm::row(projection.clip, 3);
  const float distance = glm::dot(glm::vec3(depth), ball.centre) + depth.w - ball.radius;
  const float per_m = 0.5F * static_cast<float>(projection.pixels.height) *
                      glm::length(glm::vec3(glm::row(projection.clip, 1)));
  return distance > 0.0F ? per_m / distance : std::numeric_limits<float>::infinity();
}

bool is_in_view(const Ball& ball, const std::array<glm::vec4, 6>& planes) {
  return std::ranges::none_of(planes, [&](const glm::vec4& plane) {
    return glm::dot(glm::vec3(plane), ball.centre) + plane.w < -ball.radius;
  });
}

// A ball that contains the part at its present place and at the place where it was drawn last.
Ball ball_of(const MeshPart& part, const PartMove& since) {
  return {part.centre, part.radius + since.moved_m};
}

}  // namespace

PixelRect covered_by(const Ball& ball, const Projection& projection) {
  glm::vec2 low(std::numeric_limits<float>::max()), high(-low);
  for (unsigned corner = 0; corner < 8; ++corner) {
    const auto side = [corner](unsigned bit) { return (corner & bit) != 0 ? 1.0F : -1.0F; };
    const glm::vec3 at = ball.centre + ball.radius * (side(1) * projection.right + side(2) * projection.up +
                                                      side(4) * projection.to);
    const glm::vec4 clip = projection.clip * glm::vec4(at, 1.0F);
    if (!(clip.w > 0.0F)) return projection.pixels;
    low = glm::min(low, glm::vec2(clip) / clip.w);
    high = glm::max(high, glm::vec2(clip) / clip.w);
  }
  const glm::vec2 size(projection.pixels.width, projection.pixels.height);
  const glm::vec2 from = glm::floor((0.5F * glm::clamp(low, -1.0F, 1.0F) + 0.5F) * size);
  const glm::vec2 to = glm::ceil((0.5F * glm::clamp(high, -1.0F, 1.0F) + 0.5F) * size);
  return grown({static_cast<int>(from.x), static_cast<int>(from.y), static_cast<int>(to.x - from.x),
                static_cast<int>(to.y - from.y)},
               projection.pixels);
}

glm::mat4 whole_from_part(const PixelRect& part, const PixelRect& view) {
  glm::mat4 whole(1.0F);
  const glm::vec2 size(view.width, view.height);
  const glm::vec2 first = 2.0F * glm::vec2(part.x, part.y) / size - 1.0F;
  const glm::vec2 last = 2.0F * glm::vec2(part.x + part.width, part.y + part.height) / size - 1.0F;
  for (int d = 0; d < 2; ++d) {
    whole[d][d] = 2.0F / (last[d] - first[d]);
    whole[3][d] = -(last[d] + first[d]) / (last[d] - first[d]);
  }
  return whole;
}

ViewKey view_key(const SceneMeshes& meshes, const glm::mat4& clip, const ViewSettings& settings,
                 const ColourScale& scale) {
  ViewKey key{.clip = clip, .settings = settings, .scale = scale};
  for (const SceneMesh& mesh : meshes.all()) {
    key.placed.push_back(mesh.placed);
    key.cut = key.cut || mesh.face.mesh.count > 0;
    for (const SceneMesh& material : mesh.materials)
      key.numbers.insert(key.numbers.end(), {material.shape_number, material.moved_number});
    for (const GlSection& slice : mesh.slices)
      key.numbers.insert(key.numbers.end(), {slice.image_number, slice.shape_number, slice.moved_number});
  }
  return key;
}

float ShownView::tolerance_px(const SceneMeshes& meshes, const Projection& projection) const {
  const std::array<glm::vec4, 6> planes = planes_of_view(projection.clip);
  float fastest = 0.0F;
  for (const SceneMesh& mesh : meshes.all()) {
    for (std::size_t p = 0; p < mesh.moves.size(); ++p) {
      const Ball ball = ball_of(mesh.mesh.parts[p], mesh.moves[p]);
      if (mesh.moves[p].moved_m > 0.0F && is_in_view(ball, planes))
        fastest = std::max(fastest, mesh.moves[p].moved_m * samples_per_m(ball, projection));
    }
  }
  return std::clamp(kShareOfFastest * fastest, kLeastSeen_px, kMostUndrawn_px);
}

PixelRect ShownView::next(const ViewKey& key, const ShownTool& tool, const SceneMeshes& meshes,
                          const Projection& projection) {
  const std::vector<SceneMesh>& all = meshes.all();
  if (!known_ || key.cut || key != key_) {
    known_ = true;
    key_ = key;
    tool_ = tool;
    stale_.assign(all.size(), {});
    for (std::size_t i = 0; i < all.size(); ++i) stale_[i].assign(all[i].mesh.parts.size(), {});
    return projection.pixels;
  }
  PixelRect part;
  if (!tool.is_as(tool_)) part = united(tool.covers, tool_.covers);
  tool_ = tool;
  const float tolerance = tolerance_px(meshes, projection);
  const float most_uncoloured = kMostUncoloured * static_cast<float>(key.scale.end);
  const std::array<glm::vec4, 6> planes = planes_of_view(projection.clip);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!key.settings.look_of(i).visible) continue;
    for (std::size_t p = 0; p < all[i].moves.size(); ++p) stale_[i][p] += all[i].moves[p];
    for (std::size_t p = 0; all[i].soft && p < stale_[i].size(); ++p) {
      const PartMove& since = stale_[i][p];
      const Ball ball = ball_of(all[i].mesh.parts[p], since);
      const bool seen = since.moved_m * samples_per_m(ball, projection) > tolerance ||
                        (key.scale.end > 0.0 && since.recoloured > most_uncoloured);
      if (seen && is_in_view(ball, planes)) part = united(part, covered_by(ball, projection));
    }
  }
  if (part.empty()) return part;
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t p = 0; all[i].soft && p < stale_[i].size(); ++p) {
      PartMove& since = stale_[i][p];
      if (since.moved_m == 0.0F && since.recoloured == 0.0F) continue;
      if (part.contains(covered_by(ball_of(all[i].mesh.parts[p], since), projection))) since = {};
    }
  }
  return part;
}

}  // namespace hybrid
