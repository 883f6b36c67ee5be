// SPDX-License-Identifier: GPL-3.0-or-later
// Relief on a smooth surface (thesis, Fig 4; Minsky et al. 1990; Morgenbesser & Srinivasan 1996). A periodic
// height map from an image or a formula is rendered as a force, which is added to the contact's own force.
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

// Placement of the map on an object, in the body's frame.
struct TextureMapping {
  TextureKind kind = TextureKind::height;
  // Axis of the projection. box: the axis nearest to the surface's normal, with a blend between axes.
  TextureAlong along = TextureAlong::box;
  // Period along u; the period along v follows from the image's shape, and a pattern is square.
  double size_m = 0.01;
  double height_m = 5e-4;  // height difference between the darkest and the brightest possible value
};

// Grey levels from 0 to 1; rows from the top.
struct GreyImage {
  int width = 0, height = 0;
  std::vector<float> grey;
};

inline constexpr int kMostTexturePixels = 4096;  // along each side

// Reads a PNG file of 8 or 16 bits, grey or coloured (then its luminance). Values are used as they are in the
// file, without gamma, because they are heights and not light. Transparent pixels are 0. Throws
// std::runtime_error with a message: not readable, not a PNG, damaged, larger than kMostTexturePixels along a
// side.
GreyImage load_grey_png(const std::filesystem::path& file);

struct HeightSample {
  double height = 0.0;    // 0 to 1
  glm::dvec2 slope{0.0};  // derivatives of the height with respect to u and v
};

class HeightTexture {
 public:
  // Throws std::invalid_argument: a size or height that is not above 0; an image without pixels or of the
  // wrong length.
  HeightTexture(GreyImage image, const TextureMapping& mapping);
  HeightTexture(TexturePattern pattern, const TextureMapping& mapping);

  [[nodiscard]] const TextureMapping& mapping() const noexcept { return mapping_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return image_.grey.capacity() * sizeof(float); }

  // The height at a point. The period is 1 along u. Along v it is 1 for a pattern, and height / width for an
  // image. An image is a uniform cubic B-spline (C2) with its pixels as control points. Its values stay
  // within the range of the pixels, whereas an interpolating spline overshoots at every step. It also rounds
  // the steps between 8-bit levels. Details finer than about four pixels are smoothed away. v grows downwards
  // in the image.
  [[nodiscard]] HeightSample sample(double u, double v) const noexcept;

 private:
  GreyImage image_;  // empty: a pattern
  TexturePattern pattern_ = TexturePattern::waves;
  TextureMapping mapping_;
};

// Height over the surface (m) and its gradient at a point, in the body's frame. The height is between
// −height_m and 0: the brightest places are the surface itself, and dark places are deeper. Places above the
// surface would make the force jump at first contact, because contact begins at the surface.
struct Relief {
  double height_m = 0.0;
  glm::dvec3 gradient{0.0};
};
Relief relief_at(const HeightTexture& texture, const glm::dvec3& point, const glm::dvec3& normal) noexcept;

struct TexturedContact {
  glm::dvec3 point{0.0};             // on the surface, body's frame
  glm::dvec3 normal{0.0, 0.0, 1.0};  // unit vector, outward, body's frame
  double depth_m = 0.0;              // depth of the device along the normal
  double stiffness_N_per_m = 0.0;    // stiffness of the coupling
};

// Texture force that is added to the contact's own force K·d·n (N, body's frame). d: depth, n: normal, h:
// relief times `share`, ∇h: its gradient along the surface.
//   height:  F = K·max(0, d + h)·(n − ∇h), the derivative of ½K·max(0, d + h)². So on a flat surface no
//            closed path gains or loses energy. The stiffness along the surface is K·(∇h² + (d + h)·h''),
//            so a finer or steeper texture needs a softer coupling.
//   shading: F = K·d·(n − ∇h)/|n − ∇h|. The direction changes, the size does not (thesis, Fig 4).
// Zero without contact, or if any input is not finite.
glm::dvec3 texture_force(const HeightTexture& texture, const TexturedContact& contact,
                         double share = 1.0) noexcept;

}  // namespace hybrid
