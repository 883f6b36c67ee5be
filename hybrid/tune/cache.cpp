// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>

#include "hybrid/base/whole_file.h"
#include "hybrid/session/report.h"

namespace hybrid {
namespace {

namespace fs = std::filesystem;

constexpr int kFormat = 3;  // of a record; records of another format are not found
// First value and factor of the 64-bit FNV hash.
constexpr std::uint64_t kFnvBegin = 0xCBF29CE484222325ULL, kFnvPrime = 0x100000001B3ULL;

std::uint64_t fnv(std::string_view bytes, std::uint64_t hash = kFnvBegin) {
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * kFnvPrime;
  return hash;
}

std::uint64_t hash_of_file(const fs::path& file, std::uint64_t hash) {
  std::ifstream in(file, std::ios::binary);
  std::array<char, 1U << 16U> bytes{};
  while (in) {
    in.read(bytes.data(), bytes.size());
    hash = fnv({bytes.data(), static_cast<std::size_t>(in.gcount())}, hash);
  }
  if (in.bad() || !in.eof())
    throw std::runtime_error(
        fmt::format("{}: cannot be read for the cache; leave --cache out", file.string()));
  return hash;
}

std::uint64_t hash_of(const fs::path& path) {
  if (!fs::is_directory(path)) return hash_of_file(path, kFnvBegin);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(path)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::uint64_t hash = kFnvBegin;
  for (const fs::path& file : files) hash = hash_of_file(file, fnv(file.filename().string(), hash));
  return hash;
}

// Identifies program and machine. The program is identified by the hash of its file, because two builds of
// one version may give different forces.
std::string program_text() {
  const nlohmann::ordered_json head = report_head("tune");
  return fmt::format("{} {} {:016x}", head.at("version").get<std::string>(),
                     head.at("machine").get<std::string>(), hash_of("/proc/self/exe"));
}

void add_source(const SoftSource& source, std::vector<fs::path>& files) {
  if (const auto* volume = std::get_if<VolumeSource>(&source)) files.push_back(volume->file);
  if (const auto* mesh = std::get_if<ClosedMeshSource>(&source)) files.push_back(mesh->mesh.file);
}

void add_path(const device::PathDescription& path, std::vector<fs::path>& files) {
  if (const auto* csv = std::get_if<device::CsvPath>(&path)) files.push_back(csv->file);
}

}  // namespace

std::vector<fs::path> scene_files(const Scene& scene) {
  std::vector<fs::path> files;
  for (const RigidDescription& rigid : scene.rigid) {
    if (const auto* mesh = std::get_if<MeshSource>(&rigid.source)) files.push_back(mesh->file);
    if (const auto* volume = std::get_if<VolumeSurfaceSource>(&rigid.source)) files.push_back(volume->file);
    if (rigid.feel.texture && !rigid.feel.texture->image.empty()) files.push_back(rigid.feel.texture->image);
    if (const auto* motion = std::get_if<PathMotion>(&rigid.motion); motion != nullptr && motion->path)
      add_path(*motion->path, files);
  }
  for (const SoftDescription& soft : scene.soft) add_source(soft.source, files);
  add_path(scene.path, files);
  return files;
}

EvaluationCache::EvaluationCache(fs::path folder, const Scene& scene) : folder_(std::move(folder)) {
  if (folder_.empty()) return;
  require_writable(folder_ / "record.json");
  depends_on_ = fmt::format("format {}\n{}\n{:016x}", kFormat, program_text(), hash_of(scene.file));
  for (const fs::path& file : scene_files(scene))
    depends_on_ += fmt::format("\n{} {:016x}", file.string(), hash_of(file));
}

fs::path EvaluationCache::file_of(const std::string& key) const {
  return folder_ / fmt::format("{:016x}.json", fnv(key));
}

std::optional<nlohmann::json> EvaluationCache::find(const std::string& text) const {
  if (folder_.empty()) return std::nullopt;
  const std::string key = depends_on_ + "\n" + text;
  std::ifstream in(file_of(key));
  if (!in) return std::nullopt;
  const nlohmann::json kept = nlohmann::json::parse(in, nullptr, false);
  if (!kept.is_object() || !kept.contains("record") || !kept.contains("key") || kept["key"] != key)
    return std::nullopt;
  return kept.at("record");
}

void EvaluationCache::keep(const std::string& text, const nlohmann::json& record) const {
  if (folder_.empty()) return;
  const std::string key = depends_on_ + "\n" + text;
  save_text(file_of(key), nlohmann::json{{"key", key}, {"record", record}}.dump() + '\n');
}

}  // namespace hybrid
