// SPDX-License-Identifier: GPL-3.0-or-later
// Relief on a smooth surface: a periodic height map from an image or a formula, as a force that is added to
// the contact's own (thesis, Fig 4; Minsky et al. 1990; Morgenbesser & Srinivasan 1996).
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

namespace hybrid {

enum class TextureKind : std::uint8_t { height, shading };
enum class TextureAlong : std::uint8_t { x, y, z, box };
enum class TexturePattern : std::uint8_t { waves, grid, bumps };

// Placement of the map on an object, in its body frame.
struct TextureMapping {
  TextureKind kind = TextureKind::height;
  // Projected along this axis; box: along the axis nearest to the surface's normal, blended between them.
  TextureAlong along = TextureAlong::box;
  double size_m = 0.01;    // period along u; along v by the image's shape (a pattern is square)
  double height_m = 5e-4;  // between the darkest and the brightest possible value
};

// Grey levels from 0 to 1, rows from the top.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<float> grey;
};

inline constexpr int kMostTexturePixels = 4096;  // along each side

// Reads a PNG of 8 or 16 bits, grey or coloured (then its luminance). Values are used as they are in the
// file, without gamma, because a height is no light. Transparent pixels are 0. Throws std::runtime_error with
// a message: not readable, not a PNG, damaged, larger than kMostTexturePixels along a side.
GreyImage load_grey_png(const std::filesystem::path& file);

struct HeightSample {
  double height = 0.0;    // 0 to 1
  glm::dvec2 slope{0.0};  // its derivatives by u and v
};

class HeightTexture {
 public:
  // Throws std::invalid_argument: a size that is not above 0, an image without pixels or of the wrong length.
  HeightTexture(GreyImage image, const TextureMapping& mapping);
  HeightTexture(TexturePattern pattern, const TextureMapping& mapping);

  [[nodiscard]] const TextureMapping& mapping() const noexcept { return mapping_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return image_.grey.capacity() * sizeof(float); }

  // Over the unit square, repeated periodically. An image is a uniform cubic B-spline through its pixels. Its
  // slope is continuous (C2), its values stay within the range of the pixels (an interpolating spline
  // overshoots at every step), and steps between 8-bit levels are rounded. Details finer than about four
  // pixels are smoothed away. v grows downward in the image.
  [[nodiscard]] HeightSample sample(double u, double v) const noexcept;

 private:
  GreyImage image_;  // for an image; empty: a pattern
  TexturePattern pattern_ = TexturePattern::waves;
  TextureMapping mapping_;
};

// Height over the surface (m) and its gradient at a point, body frame. The height is between −height_m and 0:
// the brightest places are the surface itself, dark places lie deeper. Raising bright places above the
// surface instead would make the force jump at first contact, because contact begins at the surface.
struct Relief {
  double height_m = 0.0;
  glm::dvec3 gradient{0.0};
};
Relief relief_at(const HeightTexture& texture, const glm::dvec3& point, const glm::dvec3& normal) noexcept;

struct TexturedContact {
  glm::dvec3 point{0.0};             // on the surface, body frame
  glm::dvec3 normal{0.0, 0.0, 1.0};  // unit, outward, body frame
  double depth_m = 0.0;              // of the device along the normal
  double stiffness_N_per_m = 0.0;    // of the coupling
};

// Texture force, added to the contact's own force K·d·n (N, body frame).
//   height:  F = K·max(0, d + h)·(n − ∇h), ∇h within the surface: the derivative of ½K·max(0, d + h)², so on
//            a flat surface no closed path gains or loses anything. Sideways it is as stiff as
//            K·(∇h² + (d + h)·h''): finer or steeper texture needs a softer coupling.
//   shading: F = K·d·(n − ∇h)/|n − ∇h|: the direction turns, the size stays (thesis, Fig 4).
// h is the relief times `share`. Zero without contact or if any input is not finite.
glm::dvec3 texture_force(const HeightTexture& texture, const TexturedContact& contact,
                         double share = 1.0) noexcept;

}  // namespace hybrid
