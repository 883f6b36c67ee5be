// SPDX-License-Identifier: GPL-3.0-or-later
// Finished evaluations on disk, so that a search that was stopped can continue. A record is found by all that
// its result depends on: the scene, the files that the scene reads, the program, the machine, and a text.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "hybrid/scene/scene.h"

namespace hybrid {

class EvaluationCache {
 public:
  // An empty path: nothing is kept. Makes the folder if it is missing. Throws std::runtime_error: the folder
  // cannot be written, or a file of the scene cannot be read.
  EvaluationCache(std::filesystem::path folder, const Scene& scene);

  // The record of this text; empty if there is none, or if its file is damaged.
  [[nodiscard]] std::optional<nlohmann::json> find(const std::string& text) const;
  // Writes the whole record or nothing.
  void keep(const std::string& text, const nlohmann::json& record) const;

 private:
  [[nodiscard]] std::filesystem::path file_of(const std::string& key) const;

  std::filesystem::path folder_;
  std::string depends_on_;
};

// The files and folders that the scene reads, without the scene's own file.
std::vector<std::filesystem::path> scene_files(const Scene& scene);

}  // namespace hybrid
