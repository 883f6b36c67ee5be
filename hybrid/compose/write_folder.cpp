// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compose/write_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <utility>

#include "hybrid/compose/label_names.h"

namespace hybrid {

namespace fs = std::filesystem;

ComposeFolder::ComposeFolder(fs::path folder, bool force) : folder_(std::move(folder)), force_(force) {
  std::error_code error;
  if (fs::exists(folder_, error) && !fs::is_directory(folder_, error)) {
    throw ComposeError(fmt::format("--out {}: is a file; name a folder", folder_.string()));
  }
  if (fs::exists(scene(), error) && !force_) {
    throw ComposeError(
        fmt::format("{}: is there already; name another folder with --out, or say --force to write over it",
                    scene().string()));
  }
  made_ = !fs::exists(folder_, error);
  fs::create_directories(folder_, error);
  const fs::path probe = folder_ / ".compose";
  const bool writable = static_cast<bool>(std::ofstream(probe));
  fs::remove(probe, error);
  if (!writable) {
    throw ComposeError(fmt::format(
        "--out {}: nothing can be written there; look at the folder's permissions, or name another",
        folder_.string()));
  }
}

ComposeFolder::~ComposeFolder() {
  if (kept_) return;
  std::error_code error;
  for (const fs::path& file : fresh_) fs::remove(file, error);
  if (made_) fs::remove(folder_, error);  // only when it is empty
}

fs::path ComposeFolder::claim(const std::string& name) {
  fs::path file = folder_ / name;
  std::error_code error;
  const bool ours = std::find(fresh_.begin(), fresh_.end(), file) != fresh_.end();
  if (!fs::exists(file, error)) {
    if (!ours) fresh_.push_back(file);
  } else if (!force_ && !ours) {
    throw ComposeError(
        fmt::format("{}: is there already; name another folder with --out, or say --force to write over it",
                    file.string()));
  }
  return file;
}

void ComposeFolder::write_text(const std::string& name, const std::string& text) {
  const fs::path file = claim(name);
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw ComposeError(fmt::format("{}: cannot be written; is the disk full?", file.string()));
}

void ComposeFolder::drop(const std::string& name) {
  std::error_code error;
  fs::remove(folder_ / name, error);
}

void ComposeFolder::copy(const fs::path& from, const std::string& name) {
  std::error_code error;
  if (fs::equivalent(from, folder_ / name, error)) return;
  const fs::path to = claim(name);
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, error);
  if (error) {
    throw ComposeError(
        fmt::format("{}: cannot be copied to {}: {}; look at the disk and the folder's permissions",
                    from.string(), to.string(), error.message()));
  }
}

std::string ComposeFolder::unused_name(const std::string& wanted) {
  std::string clean;
  for (const char c : wanted) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
    clean += plain ? c : '_';
  }
  clean.resize(std::min<std::size_t>(clean.size(), 48));
  if (clean.empty()) clean = "object";
  std::string name = clean;
  for (int n = 2; std::find(names_.begin(), names_.end(), name) != names_.end(); ++n)
    name = fmt::format("{}-{}", clean, n);
  names_.push_back(name);
  return name;
}

}  // namespace hybrid
