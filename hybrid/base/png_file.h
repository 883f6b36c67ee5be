// SPDX-License-Identifier: GPL-3.0-or-later
// Writes PNG files. Only this file and height_image.cpp, which reads PNG files, know libpng.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace hybrid {

// Writes the whole file or, on an error, leaves an existing one as it was. `rgb`: rows from the top, three
// bytes (RGB) a pixel, 3·width·height in all. Throws std::runtime_error: not writable, disk full. Throws
// std::invalid_argument if the number of bytes does not match the size.
void save_png(const std::filesystem::path& file, int width, int height, std::span<const std::uint8_t> rgb);

}  // namespace hybrid
