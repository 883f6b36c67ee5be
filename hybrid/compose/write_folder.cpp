// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compose/write_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): kill is POSIX
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <string_view>
#include <utility>

#include "hybrid/base/letters.h"
#include "hybrid/base/whole_file.h"
#include "hybrid/compose/label_names.h"

namespace hybrid {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kStaging = ".compose-";  // followed by the process id

// Removes the folders that killed processes left.
void remove_stale_staging(const fs::path& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kStaging)) continue;
    int process = 0;
    const char* const end = name.data() + name.size();
    const auto [at, wrong] = std::from_chars(name.data() + kStaging.size(), end, process);
    if (wrong == std::errc() && at == end && process > 0 && ::kill(process, 0) != 0 && errno == ESRCH)
      fs::remove_all(entry.path(), error);
  }
}

bool is_on_disk(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool done = ::fsync(descriptor) == 0;
  ::close(descriptor);
  return done;
}

std::string in_small_letters(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

}  // namespace

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
  remove_stale_staging(folder_);
  staging_ = folder_ / fmt::format("{}{}", kStaging, ::getpid());
  if (!fs::create_directory(staging_, error) && !fs::is_directory(staging_)) {
    throw ComposeError(fmt::format(
        "--out {}: nothing can be written there; look at the folder's permissions, or name another",
        folder_.string()));
  }
}

ComposeFolder::~ComposeFolder() {
  std::error_code error;
  fs::remove_all(staging_, error);
  if (made_) fs::remove(folder_, error);  // removes only an empty folder
}

fs::path ComposeFolder::claim(const std::string& name) {
  std::error_code error;
  const bool ours = std::find(written_.begin(), written_.end(), name) != written_.end();
  if (!ours && !force_ && fs::exists(folder_ / name, error)) {
    throw ComposeError(
        fmt::format("{}: is there already; name another folder with --out, or say --force to write over it",
                    (folder_ / name).string()));
  }
  if (!ours) written_.push_back(name);
  return staging_ / name;
}

void ComposeFolder::write_text(const std::string& name, const std::string& text) {
  save_text(claim(name), text);
}

void ComposeFolder::drop(const std::string& name) {
  std::error_code error;
  fs::remove(staging_ / name, error);
  std::erase(written_, name);
}

void ComposeFolder::copy(const fs::path& from, const std::string& name) {
  std::error_code error;
  const bool same = fs::equivalent(from, folder_ / name, error);
  const fs::path to = same ? staging_ / name : claim(name);
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, error);
  if (error) {
    throw ComposeError(
        fmt::format("{}: cannot be copied to {}: {}; look at the disk and the folder's permissions",
                    from.string(), (folder_ / name).string(), error.message()));
  }
}

void ComposeFolder::keep() {
  // The scene comes last, because it names all other files.
  std::stable_partition(written_.begin(), written_.end(),
                        [this](const std::string& name) { return folder_ / name != scene(); });
  for (const std::string& name : written_) {
    const fs::path file = staging_ / name;
    if (is_on_disk(file)) continue;
    throw ComposeError(fmt::format("{}: cannot be written; is the disk full?", (folder_ / name).string()));
  }
  for (const std::string& name : written_) {
    std::error_code error;
    fs::rename(staging_ / name, folder_ / name, error);
    if (!error) continue;
    throw ComposeError(fmt::format("{}: cannot be put in place: {}; look at the folder's permissions",
                                   (folder_ / name).string(), error.message()));
  }
}

std::string name_letters(std::string_view text) {
  constexpr std::size_t kMostBytes = 48;
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = printable_at(text, at);
    const bool ascii = length <= 1;
    const bool kept = !ascii || std::isalnum(static_cast<unsigned char>(text[at])) != 0 || text[at] == '-';
    out += kept ? text.substr(at, length) : "_";
    at += std::max<std::size_t>(character_at(text, at), 1);
  }
  return std::string(whole_characters(out, kMostBytes));
}

std::string ComposeFolder::unused_name(const std::string& wanted) {
  const std::string clean = wanted.empty() ? "object" : name_letters(wanted);
  std::string name = clean;
  for (int n = 2; !names_.insert(in_small_letters(name)).second; ++n) name = fmt::format("{}-{}", clean, n);
  return name;
}

}  // namespace hybrid
