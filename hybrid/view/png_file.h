// SPDX-License-Identifier: GPL-3.0-or-later
// Writes PNG files. Only this file and height_image.cpp, which reads PNG files, know libpng.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace hybrid {

// `rgb`: rows from the top, three bytes (RGB) a pixel, 3·width·height in all. Throws std::runtime_error: not
// writable, disk full. A file that is not finished leaves what was there. Throws std::invalid_argument when
// the number of pixels does not match the size.
void save_png(const std::filesystem::path& file, int width, int height, std::span<const std::uint8_t> rgb);

}  // namespace hybrid
