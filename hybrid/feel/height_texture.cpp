// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/feel/height_texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr double kTau = 2.0 * std::numbers::pi;
constexpr int kLinePower = 8;  // exponent for the grid's lines; they are about a sixth of the period wide

void check(const TextureMapping& mapping) {
  if (!(mapping.size_m > 0.0) || !(mapping.height_m > 0.0) || !std::isfinite(mapping.size_m) ||
      !std::isfinite(mapping.height_m)) {
    throw std::invalid_argument("HeightTexture: size and height must lie above 0");
  }
}

struct Wave {
  double value, slope;
};
// A smooth hill with its maximum 1 at whole numbers, minimum 0.
Wave hill(double x) noexcept {
  return {0.5 + 0.5 * std::cos(kTau * x), -0.5 * kTau * std::sin(kTau * x)};
}
// A narrow hill: a line.
Wave line(double x) noexcept {
  const Wave h = hill(x);
  const double most = std::pow(h.value, kLinePower - 1);
  return {most * h.value, kLinePower * most * h.slope};
}

HeightSample sample_pattern(TexturePattern pattern, double u, double v) noexcept {
  switch (pattern) {
    case TexturePattern::bumps: {
      const Wave a = hill(u), b = hill(v);
      return {a.value * b.value, {a.slope * b.value, a.value * b.slope}};
    }
    case TexturePattern::grid: {  // about the larger of the two lines, without a crease where they cross
      const Wave a = line(u), b = line(v);
      return {1.0 - (1.0 - a.value) * (1.0 - b.value),
              {a.slope * (1.0 - b.value), b.slope * (1.0 - a.value)}};
    }
    case TexturePattern::waves:
    default: {
      const Wave a = hill(u);
      return {a.value, {a.slope, 0.0}};
    }
  }
}

// Weights of four neighbours in a uniform cubic B-spline, and their derivatives.
struct Spline {
  std::array<double, 4> weight, slope;
};
Spline spline(double t) noexcept {
  const double s = 1.0 - t;
  return {.weight = {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                     (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0, t * t * t / 6.0},
          .slope = {-0.5 * s * s, (3.0 * t * t - 4.0 * t) / 2.0, (4.0 * s - 3.0 * s * s) / 2.0, 0.5 * t * t}};
}

// A coordinate in pixels: the indices of its four neighbours, wrapped around, and its position between the
// middle two.
struct PixelPlace {
  std::array<std::size_t, 4> index{};
  double share = 0.0;
};
PixelPlace pixel_place(double unit, int count) noexcept {
  const double at = (unit - std::floor(unit)) * count - 0.5;  // pixel values are at pixel centres
  const double below = std::floor(at);
  PixelPlace place{.share = at - below};
  for (int i = 0; i < 4; ++i) {
    const int wrapped = (static_cast<int>(below) + i - 1) % count;
    place.index[static_cast<std::size_t>(i)] =
        static_cast<std::size_t>(wrapped < 0 ? wrapped + count : wrapped);
  }
  return place;
}

// The relief of the map projected along one axis. Seen from the axis's positive end, the map is upright.
// Height and gradient (m) are in the body's frame.
Relief relief_along(const HeightTexture& texture, const glm::dvec3& point, glm::length_t axis) noexcept {
  const glm::length_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  const TextureMapping& m = texture.mapping();
  const HeightSample s = texture.sample(point[u] / m.size_m, -point[v] / m.size_m);
  Relief relief{.height_m = m.height_m * (s.height - 1.0)};
  relief.gradient[u] = s.slope.x * m.height_m / m.size_m;
  relief.gradient[v] = -s.slope.y * m.height_m / m.size_m;
  return relief;
}

}  // namespace

HeightTexture::HeightTexture(GreyImage image, const TextureMapping& mapping)
    : image_(std::move(image)), mapping_(mapping) {
  check(mapping);
  if (image_.width < 1 || image_.height < 1 || image_.width > kMostTexturePixels ||
      image_.height > kMostTexturePixels ||
      image_.grey.size() !=
          static_cast<std::size_t>(image_.width) * static_cast<std::size_t>(image_.height)) {
    throw std::invalid_argument("HeightTexture: the pixels do not match the size");
  }
}

HeightTexture::HeightTexture(TexturePattern pattern, const TextureMapping& mapping)
    : pattern_(pattern), mapping_(mapping) {
  check(mapping);
}

HeightSample HeightTexture::sample(double u, double v) const noexcept {
  if (!std::isfinite(u) || !std::isfinite(v)) return {};
  if (image_.grey.empty()) return sample_pattern(pattern_, u - std::floor(u), v - std::floor(v));
  // u and v are in periods of u. Pixels are square, so v is scaled by the image's shape.
  const double shape = static_cast<double>(image_.width) / static_cast<double>(image_.height);
  const PixelPlace column = pixel_place(u, image_.width), row = pixel_place(v * shape, image_.height);
  const Spline x = spline(column.share), y = spline(row.share);
  HeightSample out;
  for (std::size_t j = 0; j < 4; ++j) {
    const float* pixels = image_.grey.data() + row.index[j] * static_cast<std::size_t>(image_.width);
    double value = 0.0, slope = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double grey = pixels[column.index[i]];
      value += x.weight[i] * grey;
      slope += x.slope[i] * grey;
    }
    out.height += y.weight[j] * value;
    out.slope.x += y.weight[j] * slope;
    out.slope.y += y.slope[j] * value;
  }
  out.slope *= image_.width;  // pixels per unit, the same in both directions
  return out;
}

Relief relief_at(const HeightTexture& texture, const glm::dvec3& point, const glm::dvec3& normal) noexcept {
  switch (texture.mapping().along) {
    case TextureAlong::x:
      return relief_along(texture, point, 0);
    case TextureAlong::y:
      return relief_along(texture, point, 1);
    case TextureAlong::z:
      return relief_along(texture, point, 2);
    case TextureAlong::box:
    default:
      break;
  }
  // Weights are fourth powers. With the normal between two axes, at 45° each has half of the weight. An axis
  // 60° from the normal has a tenth. The weights depend only on the normal. So they are constant on a flat
  // surface, and the gradient is exact there.
  const glm::dvec3 square = normal * normal, weight = square * square;
  const double whole = weight.x + weight.y + weight.z;
  Relief out;
  if (!(whole > 0.0)) return out;
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    const double share = weight[axis] / whole;
    if (share < 1e-6) continue;  // an axis-aligned face then needs one look-up
    const Relief one = relief_along(texture, point, axis);
    out.height_m += share * one.height_m;
    out.gradient += share * one.gradient;
  }
  return out;
}

glm::dvec3 texture_force(const HeightTexture& texture, const TexturedContact& contact,
                         double share) noexcept {
  const glm::dvec3 zero(0.0), &n = contact.normal;
  const double d = contact.depth_m, k = contact.stiffness_N_per_m;
  if (!(d > 0.0) || !(k > 0.0) || !std::isfinite(d) || !std::isfinite(k) ||
      !polygon::is_finite(contact.point) || !polygon::is_finite(n)) {
    return zero;
  }
  Relief relief = relief_at(texture, contact.point, n);
  relief.height_m *= share;
  relief.gradient *= share;
  const glm::dvec3 slope = relief.gradient - glm::dot(relief.gradient, n) * n;
  const glm::dvec3 turned = n - slope;
  const glm::dvec3 felt = texture.mapping().kind == TextureKind::height
                              ? (k * std::max(0.0, d + relief.height_m)) * turned
                              : (k * d / glm::length(turned)) * turned;
  const glm::dvec3 extra = felt - (k * d) * n;
  return polygon::is_finite(extra) ? extra : zero;
}

}  // namespace hybrid
