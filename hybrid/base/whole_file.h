// SPDX-License-Identifier: GPL-3.0-or-later
// Files that are written whole or not at all. The bytes go to a file without a name in the same folder, which
// takes the place of the target once all is on the disk: a full disk or a kill leaves what was there.
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace hybrid {

// Where the bytes for a path go. Links are followed, so that a link stays and its target is replaced. A
// device, a named pipe or an open descriptor ("-" and /dev/stdout: standard output) has no other name to be
// written under, and is written at once. Throws std::runtime_error in words: a folder, no folder to write
// into.
struct FilePlace {
  explicit FilePlace(const std::filesystem::path& file);

  std::filesystem::path asked;  // as it was given, for messages
  std::string target;           // the file itself, behind all links
  std::string folder;           // of the target
  std::string temporary;        // a name in the folder that nobody has
  int descriptor = -1;          // of an open descriptor
  bool at_once = false;         // no ordinary file
};

// One file on its way, without allocation: safe in a signal handler. Functions return false and leave errno
// on failure.
class FileOnItsWay {
 public:
  explicit FileOnItsWay(const FilePlace& place) noexcept : place_(place) {}
  ~FileOnItsWay();  // what was not kept is gone
  FileOnItsWay(const FileOnItsWay&) = delete;
  FileOnItsWay& operator=(const FileOnItsWay&) = delete;
  FileOnItsWay(FileOnItsWay&&) = delete;
  FileOnItsWay& operator=(FileOnItsWay&&) = delete;

  bool open() noexcept;
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  bool keep() noexcept;
  // After a keep() that failed: all bytes are in FilePlace::temporary, and stay there.
  [[nodiscard]] bool left_beside() const noexcept { return left_beside_; }

 private:
  const FilePlace& place_;
  int descriptor_ = -1;
  bool named_ = false, left_beside_ = false;
};

// The same as a stream. Each member throws std::runtime_error with file, reason and remedy.
class WholeFile {
 public:
  explicit WholeFile(const std::filesystem::path& file);
  ~WholeFile();
  WholeFile(const WholeFile&) = delete;
  WholeFile& operator=(const WholeFile&) = delete;
  WholeFile(WholeFile&&) = delete;
  WholeFile& operator=(WholeFile&&) = delete;

  void write(const void* bytes, std::size_t count);
  void write(std::string_view text) { write(text.data(), text.size()); }
  // For libraries that write themselves; their errors are found by keep().
  [[nodiscard]] std::FILE* stream() { return stream_; }
  // The file is complete: it takes its place.
  void keep();

 private:
  [[noreturn]] void refuse(int reason) const;

  FilePlace place_;
  FileOnItsWay way_;
  std::FILE* stream_ = nullptr;
};

// Text as a whole file.
void save_text(const std::filesystem::path& file, std::string_view text);

// Makes the folders of the file where they are missing, and throws as WholeFile does if no file can be
// written there. Leaves no file.
void require_writable(const std::filesystem::path& file);

}  // namespace hybrid
