// SPDX-License-Identifier: GPL-3.0-or-later
// Finished evaluations on disk, so that a search that was ended goes on where it was. A record is found by
// all that its result depends on: the scene, the files that it reads, the program, the machine, and a text.
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
  // An empty folder keeps nothing. It is made where it is missing. Throws std::runtime_error: it cannot be
  // written, or a file of the scene cannot be read.
  EvaluationCache(std::filesystem::path folder, const Scene& scene);

  // The record of this text; empty if there is none, or if its file is damaged.
  [[nodiscard]] std::optional<nlohmann::json> find(const std::string& text) const;
  // Writes the record whole or not at all.
  void keep(const std::string& text, const nlohmann::json& record) const;

 private:
  [[nodiscard]] std::filesystem::path file_of(const std::string& key) const;

  std::filesystem::path folder_;
  std::string depends_on_;
};

// Files and folders that the scene reads, besides itself.
std::vector<std::filesystem::path> scene_files(const Scene& scene);

}  // namespace hybrid
