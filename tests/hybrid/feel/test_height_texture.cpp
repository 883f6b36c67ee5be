// SPDX-License-Identifier: GPL-3.0-or-later
// Height maps as functions: wavelength, slope and energy. Every bad image is refused with a clear text.
#include "hybrid/feel/height_texture.h"

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::HeightTexture;
using hybrid::Relief;
using hybrid::TextureAlong;
using hybrid::TextureKind;
using hybrid::TextureMapping;
using hybrid::TexturePattern;

constexpr double kStiffness = 800.0, kPi = std::numbers::pi;
const glm::dvec3 up(0.0, 0.0, 1.0);

hybrid::GreyImage random_image(int width, int height) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> grey(0.0F, 1.0F);
  hybrid::GreyImage image{width, height, {}};
  for (int n = 0; n < width * height; ++n) image.grey.push_back(grey(random));
  return image;
}

std::vector<HeightTexture> textures(TextureKind kind, TextureAlong along) {
  const TextureMapping mapping{.kind = kind, .along = along, .size_m = 4e-3, .height_m = 3e-4};
  std::vector<HeightTexture> all;
  for (const TexturePattern pattern : {TexturePattern::waves, TexturePattern::grid, TexturePattern::bumps})
    all.emplace_back(pattern, mapping);
  all.emplace_back(random_image(7, 5), mapping);
  all.emplace_back(random_image(1, 1), mapping);
  return all;
}

TEST(HeightTexture, TheSlopeIsTheHeightsDerivative) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-3.0, 3.0);
  for (const HeightTexture& texture : textures(TextureKind::height, TextureAlong::z)) {
    for (int n = 0; n < 500; ++n) {
      const double u = unit(random), v = unit(random), e = 1e-5;
      const hybrid::HeightSample s = texture.sample(u, v);
      ASSERT_GE(s.height, 0.0);
      ASSERT_LE(s.height, 1.0);
      ASSERT_NEAR(s.slope.x, (texture.sample(u + e, v).height - texture.sample(u - e, v).height) / (2 * e),
                  1e-5);
      ASSERT_NEAR(s.slope.y, (texture.sample(u, v + e).height - texture.sample(u, v - e).height) / (2 * e),
                  1e-5);
    }
  }
}

TEST(HeightTexture, HeightAndSlopeRunOnAcrossPixelsAndPeriods) {
  const HeightTexture texture(random_image(7, 5), {.size_m = 1.0, .height_m = 1.0});
  const double e = 1e-9;
  for (int n = -14; n <= 14; ++n) {
    for (const double at : {n / 7.0, (n + 0.5) / 7.0}) {
      const auto a = texture.sample(at - e, 0.37), b = texture.sample(at + e, 0.37);
      EXPECT_NEAR(a.height, b.height, 1e-6);
      EXPECT_NEAR(a.slope.x, b.slope.x, 1e-5);
      EXPECT_NEAR(a.slope.y, b.slope.y, 1e-5);
    }
    EXPECT_NEAR(texture.sample(0.2 + n, 0.4).height, texture.sample(0.2, 0.4).height, 1e-12);
    // With seven by five pixels, the period along v is 5/7 of the period along u.
    EXPECT_NEAR(texture.sample(0.2, 0.4 + n * 5.0 / 7.0).height, texture.sample(0.2, 0.4).height, 1e-12);
  }
}

TEST(HeightTexture, AnImageOfAWaveIsThatWave) {
  const int pixels = 32;
  hybrid::GreyImage image{pixels, 1, {}};
  for (int i = 0; i < pixels; ++i)
    image.grey.push_back(static_cast<float>(0.5 + 0.5 * std::cos(2.0 * kPi * (i + 0.5) / pixels)));
  const HeightTexture texture(image, {.size_m = 1.0, .height_m = 1.0});
  const double kept =
      (2.0 + std::cos(2.0 * kPi / pixels)) / 3.0;  // fraction of the amplitude that the spline keeps: 0.994
  for (int n = 0; n < 100; ++n) {
    const double u = 0.01 * n;
    EXPECT_NEAR(texture.sample(u, 0.0).height, 0.5 + 0.5 * kept * std::cos(2.0 * kPi * u), 2e-5);
  }
}

TEST(HeightTexture, LiesUprightAndMirroredNowhere) {
  // The image is bright in the upper right quarter of one period. Seen from +z with x to the right, the
  // image's upper left corner is at the origin, and its rows follow one another towards −y.
  hybrid::GreyImage image{8, 8, std::vector<float>(64, 0.0F)};
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 4; column < 8; ++column) image.grey[row * 8 + column] = 1.0F;
  const HeightTexture texture(image, {.along = TextureAlong::z, .size_m = 1.0, .height_m = 1.0});
  EXPECT_NEAR(hybrid::relief_at(texture, {0.75, -0.25, 9.0}, up).height_m, 0.0, 0.01);
  EXPECT_NEAR(hybrid::relief_at(texture, {0.25, -0.25, 9.0}, up).height_m, -1.0, 0.01);
  EXPECT_NEAR(hybrid::relief_at(texture, {0.75, -0.75, 9.0}, up).height_m, -1.0, 0.01);
}

TEST(HeightTexture, TheGradientInTheBodyIsTheReliefsDerivative) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-0.01, 0.01);
  for (const TextureAlong along : {TextureAlong::x, TextureAlong::y, TextureAlong::z, TextureAlong::box}) {
    for (const HeightTexture& texture : textures(TextureKind::height, along)) {
      for (int n = 0; n < 100; ++n) {
        const glm::dvec3 p(unit(random), unit(random), unit(random));
        const glm::dvec3 normal = glm::normalize(glm::dvec3(unit(random), unit(random), unit(random)));
        const Relief relief = hybrid::relief_at(texture, p, normal);
        for (glm::length_t axis = 0; axis < 3; ++axis) {
          glm::dvec3 e(0.0);
          e[axis] = 1e-8;
          const double difference = hybrid::relief_at(texture, p + e, normal).height_m -
                                    hybrid::relief_at(texture, p - e, normal).height_m;
          ASSERT_NEAR(relief.gradient[axis], difference / 2e-8, 1e-5);
        }
      }
    }
  }
}

// Force of contact and texture together on the hand at x, over a plane through the origin with the given
// normal (N).
glm::dvec3 felt(const HeightTexture& texture, const glm::dvec3& x, const glm::dvec3& normal) {
  const double depth = -glm::dot(x, normal);
  if (depth <= 0.0) return glm::dvec3(0.0);
  const glm::dvec3 on = x + depth * normal;
  return (kStiffness * depth) * normal +
         hybrid::texture_force(
             texture, {.point = on, .normal = normal, .depth_m = depth, .stiffness_N_per_m = kStiffness});
}

TEST(HeightTexture, AFlatReliefIsConservative) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (const glm::dvec3& normal : {up, glm::normalize(glm::dvec3(1.0, -2.0, 1.5))}) {
    for (const HeightTexture& texture : textures(TextureKind::height, TextureAlong::box)) {
      const auto potential = [&](const glm::dvec3& x) {
        const double depth = -glm::dot(x, normal);
        if (depth <= 0.0) return 0.0;
        const double into =
            std::max(0.0, depth + hybrid::relief_at(texture, x + depth * normal, normal).height_m);
        return 0.5 * kStiffness * into * into;
      };
      for (int n = 0; n < 300; ++n) {  // checks force = −∇ potential
        const glm::dvec3 x = 2e-3 * glm::dvec3(unit(random), unit(random), unit(random)) - 1e-3 * normal;
        const glm::dvec3 f = felt(texture, x, normal);
        for (glm::length_t axis = 0; axis < 3; ++axis) {
          glm::dvec3 e(0.0);
          e[axis] = 1e-8;
          ASSERT_NEAR(f[axis], -(potential(x + e) - potential(x - e)) / 2e-8, 1e-5);
        }
      }
      // Work around a closed path, in and out of contact, by three-point Gauss-Legendre quadrature on short
      // pieces.
      const glm::dvec3 a = 3e-3 * glm::dvec3(unit(random), unit(random), unit(random)),
                       b = 3e-3 * glm::dvec3(unit(random), unit(random), unit(random));
      const auto at = [&](double s) {
        return -4e-4 * normal + std::cos(2 * kPi * s) * a + std::sin(4 * kPi * s) * b;
      };
      const int pieces = 20000;
      double work = 0.0, moved = 0.0;
      for (int n = 0; n < pieces; ++n) {
        const glm::dvec3 from = at(static_cast<double>(n) / pieces), to = at((n + 1.0) / pieces);
        const double g = 0.5 * std::sqrt(0.6);
        const glm::dvec3 mean = (5.0 * felt(texture, from + (0.5 - g) * (to - from), normal) +
                                 8.0 * felt(texture, 0.5 * (from + to), normal) +
                                 5.0 * felt(texture, from + (0.5 + g) * (to - from), normal)) /
                                18.0;
        work += glm::dot(mean, to - from);
        moved += std::fabs(glm::dot(mean, to - from));
      }
      EXPECT_LE(std::fabs(work), 1e-7 * moved);
    }
  }
}

TEST(HeightTexture, ContactBeginsWithoutAJump) {
  for (const TextureKind kind : {TextureKind::height, TextureKind::shading}) {
    for (const HeightTexture& texture : textures(kind, TextureAlong::z)) {
      for (int n = 0; n < 40; ++n) {
        const double x = 1e-4 * n;
        EXPECT_LT(glm::length(felt(texture, {x, 1e-3, -1e-9}, up)), 1e-5);
        EXPECT_EQ(felt(texture, {x, 1e-3, 1e-9}, up), glm::dvec3(0.0));
      }
    }
  }
}

TEST(HeightTexture, ShadingTurnsTheForceAndKeepsItsSize) {
  for (const HeightTexture& texture : textures(TextureKind::shading, TextureAlong::z)) {
    for (int n = 0; n < 24; ++n) {
      const double x = 1.7e-4 * n;
      const glm::dvec3 at(x, 0.3 * x, -2e-3), f = felt(texture, at, up);
      EXPECT_NEAR(glm::length(f), kStiffness * 2e-3, 1e-12);
      const glm::dvec3 slope = hybrid::relief_at(texture, {x, 0.3 * x, 0.0}, up).gradient;
      EXPECT_NEAR(f.x / f.z, -slope.x, 1e-9);
      EXPECT_NEAR(f.y / f.z, -slope.y, 1e-9);
    }
  }
}

// The strongest line in the force's spectrum during a slide is the texture's wavelength.
TEST(HeightTexture, TheForceHasTheTexturesWavelength) {
  for (const TextureKind kind : {TextureKind::height, TextureKind::shading}) {
    for (const double wavelength : {1e-3, 2.5e-3, 8e-3}) {
      const HeightTexture texture(
          TexturePattern::waves,
          {.kind = kind, .along = TextureAlong::z, .size_m = wavelength, .height_m = 2e-4});
      const double length = 40e-3;
      const int samples = 4000;
      std::vector<double> along(samples);
      for (int n = 0; n < samples; ++n) along[n] = felt(texture, {length * n / samples, 0.0, -1e-3}, up).x;
      double most = 0.0;
      int best = 0;
      for (int line = 1; line < 200; ++line) {
        std::complex<double> sum;
        for (int n = 0; n < samples; ++n) sum += along[n] * std::polar(1.0, -2.0 * kPi * line * n / samples);
        if (std::abs(sum) > most) {
          most = std::abs(sum);
          best = line;
        }
      }
      EXPECT_NEAR(length / best, wavelength, 0.01 * wavelength);
    }
  }
}

TEST(HeightTexture, NothingNotFiniteComesOut) {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (const HeightTexture& texture : textures(TextureKind::height, TextureAlong::box)) {
    for (const double bad : {inf, -inf, nan, 1e300, -1e300, 1e18}) {
      const hybrid::TexturedContact good{.depth_m = 1e-3, .stiffness_N_per_m = 800.0};
      hybrid::TexturedContact contact = good;
      contact.point.x = bad;
      const glm::dvec3 far = hybrid::texture_force(texture, contact);
      EXPECT_TRUE(std::isfinite(glm::length(far)));
      contact = good;
      contact.depth_m = bad;
      EXPECT_TRUE(std::isfinite(hybrid::texture_force(texture, contact).z));
      contact = good;
      contact.normal.y = bad;
      EXPECT_TRUE(std::isfinite(hybrid::texture_force(texture, contact).z));
    }
  }
  EXPECT_THROW(HeightTexture(TexturePattern::waves, {.size_m = 0.0}), std::invalid_argument);
  EXPECT_THROW(HeightTexture(TexturePattern::waves, {.height_m = nan}), std::invalid_argument);
  EXPECT_THROW(HeightTexture(hybrid::GreyImage{}, TextureMapping{}), std::invalid_argument);
}

// ---- images

class TextureImage : public tests::SceneFile {
 protected:
  template <typename Value>
  std::filesystem::path png(int width, int height, png_uint_32 format,
                            const std::vector<Value>& values) const {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width);
    image.height = static_cast<png_uint_32>(height);
    image.format = format;
    std::filesystem::path file = folder_ / "image.png";
    EXPECT_NE(png_image_write_to_file(&image, file.c_str(), 0, values.data(), 0, nullptr), 0)
        << image.message;
    return file;
  }
  std::string refusal_of(const std::filesystem::path& file) const {
    try {
      (void)hybrid::load_grey_png(file);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return {};
  }
  static std::string contents(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
};

TEST_F(TextureImage, GreyValuesAreTakenAsTheyStand) {
  const auto eight =
      hybrid::load_grey_png(png<std::uint8_t>(3, 2, PNG_FORMAT_GRAY, {0, 51, 102, 153, 204, 255}));
  ASSERT_EQ(eight.grey.size(), 6U);
  EXPECT_EQ(eight.width, 3);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(eight.grey[i], static_cast<double>(i) / 5.0, 1e-6);

  const auto sixteen =
      hybrid::load_grey_png(png<std::uint16_t>(2, 2, PNG_FORMAT_LINEAR_Y, {0, 257, 32768, 65535}));
  EXPECT_NEAR(sixteen.grey[1], 257.0 / 65535.0, 1e-7);
  EXPECT_NEAR(sixteen.grey[2], 32768.0 / 65535.0, 1e-7);
  EXPECT_EQ(sixteen.grey[3], 1.0F);
}

TEST_F(TextureImage, ColourBecomesItsLuminanceAndGreyColoursStay) {
  const auto colour = hybrid::load_grey_png(
      png<std::uint8_t>(4, 1, PNG_FORMAT_RGB, {100, 100, 100, 255, 0, 0, 0, 255, 0, 0, 0, 255}));
  EXPECT_NEAR(colour.grey[0], 100.0 / 255.0, 2.0 / 255.0);
  EXPECT_GT(colour.grey[2], colour.grey[1]);
  EXPECT_GT(colour.grey[1], colour.grey[3]);
  const auto clear = hybrid::load_grey_png(png<std::uint8_t>(2, 1, PNG_FORMAT_GA, {200, 255, 200, 0}));
  EXPECT_NEAR(clear.grey[0], 200.0 / 255.0, 1e-6);
  EXPECT_EQ(clear.grey[1], 0.0F);
}

TEST_F(TextureImage, WhatIsNoImageIsRefusedInWords) {
  EXPECT_NE(refusal_of(folder_ / "none.png").find("cannot be read"), std::string::npos);
  EXPECT_NE(refusal_of(write("empty.png", "")).find("not a PNG"), std::string::npos);
  EXPECT_NE(refusal_of(write("jpeg.png", "\xFF\xD8\xFF\xE0 and so on")).find("not a PNG"), std::string::npos);
  EXPECT_NE(refusal_of(folder_), "");
}

TEST_F(TextureImage, AnyDamageIsRefusedAndNothingCrashes) {
  std::vector<std::uint8_t> values(64 * 64);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint8_t>(i * 37);
  const std::string good = contents(png<std::uint8_t>(64, 64, PNG_FORMAT_GRAY, values));
  for (std::size_t length = 8; length + 20 < good.size(); length += 97)
    EXPECT_NE(refusal_of(write("cut.png", good.substr(0, length))).find("damaged"), std::string::npos);
  std::mt19937 random(9);
  int refused = 0;
  for (int n = 0; n < 400; ++n) {
    std::string bad = good;
    for (int k = 0; k < 3; ++k) bad[8 + random() % (bad.size() - 8)] = static_cast<char>(random());
    refused += refusal_of(write("bad.png", bad)).empty() ? 0 : 1;
  }
  EXPECT_GT(refused, 350);
}

TEST_F(TextureImage, ASizeBeyondTheLimitIsRefusedBeforeItIsAllocated) {
  std::string png_text = contents(png<std::uint8_t>(1, 1, PNG_FORMAT_GRAY, {7}));
  // Writes a width and height into the header, with a valid checksum.
  const auto claim = [&](std::uint32_t width, std::uint32_t height) {
    std::string text = png_text;
    const auto put = [&text](std::size_t at, std::uint32_t value) {
      for (int i = 0; i < 4; ++i)
        text[at + static_cast<std::size_t>(i)] = static_cast<char>(value >> (24 - 8 * i));
    };
    put(16, width);
    put(20, height);
    std::uint32_t crc = 0xFFFFFFFFU;
    for (std::size_t i = 12; i < 29; ++i) {
      crc ^= static_cast<unsigned char>(text[i]);
      for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
    }
    put(29, ~crc);
    return write("large.png", text);
  };
  EXPECT_NE(refusal_of(claim(4097, 16)).find("4097 x 16 pixels"), std::string::npos);
  EXPECT_NE(refusal_of(claim(900'000, 900'000)).find("smaller"), std::string::npos);
  EXPECT_NE(refusal_of(claim(0x7FFFFFFF, 0x7FFFFFFF)), "");
  EXPECT_NE(refusal_of(claim(0, 0)), "");
}

}  // namespace
