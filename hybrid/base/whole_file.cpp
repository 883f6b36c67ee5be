// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/base/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <random>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace hybrid {
namespace {

namespace fs = std::filesystem;

constexpr int kMostLinks = 40;  // greatest number of links in a row, as in the system itself
constexpr std::string_view kOpenFiles = "/proc/self/fd/";

[[noreturn]] void refuse_file(const fs::path& file, const std::string& why) {
  throw std::runtime_error(file.string() + ": cannot be written (" + why +
                           "); name a file in a folder that exists and that you may write to");
}

// The open descriptor that the path names, such as -, /dev/stdout, /dev/fd/3 or /proc/self/fd/3; −1 if none.
int descriptor_of(const fs::path& path) {
  const std::string text = path.lexically_normal().string();
  if (text == "-" || text == "/dev/stdout") return STDOUT_FILENO;
  if (text == "/dev/stderr") return STDERR_FILENO;
  for (const std::string_view folder : {std::string_view("/dev/fd/"), kOpenFiles}) {
    if (!text.starts_with(folder)) continue;
    int number = -1;
    const char* const end = text.data() + text.size();
    const auto [at, error] = std::from_chars(text.data() + folder.size(), end, number);
    if (error == std::errc() && at == end) return number;
  }
  return -1;
}

std::string unused_name() {
  std::random_device random;
  std::array<char, 32> text{};
  const std::uint64_t number = (std::uint64_t{random()} << 32U) | random();
  const char* const end = std::to_chars(text.data(), text.data() + text.size(), number, 16).ptr;
  return ".hybrid-" + std::string(std::as_const(text).data(), end) + ".part";
}

// Temporary names that are, or are about to be, in a folder. A signal handler reads them.
constexpr std::size_t kMostNames =
    16;  // further files at the same time stay behind if a signal ends the process
std::array<std::atomic<const char*>, kMostNames> names_in_folders{};

void replace_name(const char* from, const char* to) noexcept {
  for (auto& place : names_in_folders) {
    const char* expected = from;
    if (place.compare_exchange_strong(expected, to)) return;
  }
}

}  // namespace

void remove_unfinished_files() noexcept {
  for (const auto& place : names_in_folders) {
    if (const char* const name = place.load()) ::unlink(name);
  }
}

FilePlace::FilePlace(const fs::path& file) : asked(file) {
  fs::path path = file;
  std::error_code error;
  for (int n = 0; n <= kMostLinks; ++n) {
    descriptor = descriptor_of(path);
    if (descriptor >= 0) {
      at_once = true;
      return;
    }
    if (!fs::is_symlink(fs::symlink_status(path, error))) break;
    if (n == kMostLinks) refuse_file(asked, "its links go round in a circle");
    const fs::path to = fs::read_symlink(path, error);
    path = to.is_absolute() ? to : path.parent_path() / to;
  }
  target = path.string();
  const fs::file_status status = fs::status(path, error);
  if (fs::is_directory(status)) refuse_file(asked, "it is a folder");
  at_once = fs::exists(status) && !fs::is_regular_file(status);
  const fs::path parent = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!at_once && !fs::is_directory(parent, error))
    refuse_file(asked, "there is no folder " + parent.string());
  folder = parent.string();
  temporary = (parent / unused_name()).string();
}

FileOnItsWay::~FileOnItsWay() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (named_ && !left_beside_) ::unlink(place_.temporary.c_str());
  forget_name();
}

void FileOnItsWay::note_name() noexcept {
  replace_name(nullptr, place_.temporary.c_str());
}

void FileOnItsWay::forget_name() noexcept {
  replace_name(place_.temporary.c_str(), nullptr);
}

bool FileOnItsWay::open() noexcept {
  constexpr mode_t kMode = 0666;  // the umask is subtracted
  if (place_.descriptor >= 0) {
    descriptor_ = ::fcntl(place_.descriptor, F_DUPFD_CLOEXEC, 0);
    return descriptor_ >= 0;
  }
  if (place_.at_once) {
    descriptor_ = ::open(place_.target.c_str(), O_WRONLY | O_CLOEXEC);
    return descriptor_ >= 0;
  }
  struct stat old {};
  const bool replaces = ::stat(place_.target.c_str(), &old) == 0;
  if (replaces && ::access(place_.target.c_str(), W_OK) != 0) return false;  // the owner protects the file
  // A file without a name vanishes with the process. keep() gives it a name by way of /proc. A file system
  // without such files (NFS) gets a temporary name instead.
  if (::access(kOpenFiles.data(), X_OK) == 0)
    descriptor_ = ::open(place_.folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, kMode);
  if (descriptor_ < 0) {
    note_name();
    descriptor_ = ::open(place_.temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMode);
    named_ = descriptor_ >= 0;
  }
  if (descriptor_ < 0) return false;
  if (replaces) {  // keep owner and permissions if that is allowed
    [[maybe_unused]] const int owned = ::fchown(descriptor_, old.st_uid, old.st_gid);
    [[maybe_unused]] const int allowed = ::fchmod(descriptor_, old.st_mode & 07777U);
  }
  return true;
}

bool FileOnItsWay::keep() noexcept {
  if (place_.at_once) {
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    return closed == 0;
  }
  if (::fsync(descriptor_) != 0) return false;
  if (!named_) {
    std::array<char, 32> name{};
    kOpenFiles.copy(name.data(), kOpenFiles.size());
    std::to_chars(name.data() + kOpenFiles.size(), name.data() + name.size() - 1, descriptor_);
    note_name();
    if (::linkat(AT_FDCWD, name.data(), AT_FDCWD, place_.temporary.c_str(), AT_SYMLINK_FOLLOW) != 0)
      return false;
    named_ = true;
  }
  const int closed = ::close(descriptor_);
  descriptor_ = -1;
  if (closed != 0) return false;
  if (::rename(place_.temporary.c_str(), place_.target.c_str()) != 0) {
    left_beside_ = true;
    forget_name();
    return false;
  }
  named_ = false;
  forget_name();
  // Writes the new name to the disk too. Where a file system refuses this, the file is in place all the same.
  const int folder = ::open(place_.folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder >= 0) {
    ::fsync(folder);
    ::close(folder);
  }
  return true;
}

WholeFile::WholeFile(const fs::path& file) : place_(file), way_(place_) {
  if (!way_.open()) refuse_file(file, std::strerror(errno));
  const int own = ::fcntl(way_.descriptor(), F_DUPFD_CLOEXEC, 0);
  stream_ = own < 0 ? nullptr : ::fdopen(own, "wb");
  if (stream_ == nullptr) {
    const int reason = errno;
    if (own >= 0) ::close(own);
    refuse_file(file, std::strerror(reason));
  }
}

WholeFile::~WholeFile() {
  if (stream_ != nullptr) std::fclose(stream_);
}

void WholeFile::refuse(int reason) const {
  if (way_.left_beside()) {
    throw std::runtime_error(place_.asked.string() + ": could not be replaced (" + std::strerror(reason) +
                             "); what was written is whole in " + place_.temporary);
  }
  throw std::runtime_error(place_.asked.string() + ": could not be written to its end (" +
                           std::strerror(reason) + "); see that the disk has room");
}

void WholeFile::write(const void* bytes, std::size_t count) {
  if (std::fwrite(bytes, 1, count, stream_) != count) refuse(errno);
}

void WholeFile::keep() {
  errno = 0;
  const bool written = std::ferror(stream_) == 0 && std::fflush(stream_) == 0;
  const int reason = errno != 0 ? errno : EIO;
  const bool closed = std::fclose(std::exchange(stream_, nullptr)) == 0;
  if (!written) refuse(reason);
  if (!closed || !way_.keep()) refuse(errno);
}

void save_text(const fs::path& file, std::string_view text) {
  WholeFile out(file);
  out.write(text);
  out.keep();
}

void require_writable(const fs::path& file) {
  std::error_code error;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), error);
  const FilePlace place(file);
  if (place.at_once) {  // opening a pipe would wait for a reader
    if (place.descriptor < 0 && ::access(place.target.c_str(), W_OK) != 0)
      refuse_file(file, std::strerror(errno));
    return;
  }
  FileOnItsWay way(place);
  if (!way.open()) refuse_file(file, std::strerror(errno));
}

}  // namespace hybrid
