// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/base/file_ending.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <system_error>

namespace hybrid {
namespace {

constexpr std::array<std::string_view, 4> kMeshEndings{".obj", ".ply", ".stl", ".off"};
constexpr std::array<std::string_view, 7> kVolumeEndings{".nii", ".nrrd", ".nhdr", ".mha",
                                                         ".mhd", ".dcm",  ".ima"};
// Endings of the formats that the program reads or writes.
constexpr std::array<std::string_view, 18> kKnownEndings{".toml", ".json", ".csv",  ".txt", ".traj", ".svg",
                                                         ".png",  ".obj",  ".ply",  ".stl", ".off",  ".gz",
                                                         ".nii",  ".nrrd", ".nhdr", ".mha", ".mhd",  ".dcm"};

[[noreturn]] void refuse_ending(std::string_view option, const std::filesystem::path& file,
                                const std::string& known) {
  throw std::runtime_error(std::string(option) + " " + file.string() + ": '" + file.extension().string() +
                           "' names another format than what is written there; use a name with " + known);
}

// The ending of the file that a .gz holds.
std::string unpacked_ending(const std::filesystem::path& file) {
  const std::string last = lower_ending(file);
  return last == ".gz" ? lower_ending(file.stem()) : last;
}

}  // namespace

std::string lower_ending(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return ending;
}

bool is_mesh_name(const std::filesystem::path& file) {
  const std::string ending = unpacked_ending(file);
  return std::find(kMeshEndings.begin(), kMeshEndings.end(), ending) != kMeshEndings.end();
}

bool is_volume_name(const std::filesystem::path& file) {
  const std::string ending = unpacked_ending(file);
  return std::find(kVolumeEndings.begin(), kVolumeEndings.end(), ending) != kVolumeEndings.end();
}

void require_ending(std::string_view option, const std::filesystem::path& file,
                    std::initializer_list<std::string_view> endings) {
  if (file.empty() || file.extension().empty()) return;
  if (std::find(endings.begin(), endings.end(), lower_ending(file)) != endings.end()) return;
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status) &&
      !std::filesystem::is_directory(status))
    return;
  std::string known;
  for (const std::string_view ending : endings) known += (known.empty() ? "" : ", ") + std::string(ending);
  refuse_ending(option, file, known);
}

void require_ending_of_none(std::string_view option, const std::filesystem::path& file) {
  const std::string ending = lower_ending(file);
  if (std::find(kKnownEndings.begin(), kKnownEndings.end(), ending) != kKnownEndings.end())
    refuse_ending(option, file, ".rec");
}

}  // namespace hybrid
