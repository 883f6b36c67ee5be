// SPDX-License-Identifier: GPL-3.0-or-later
// Files that are written whole or not at all. The bytes go to a file without a name in the same folder. When
// all bytes are on the disk, this file replaces the target. So a full disk or a kill leaves the old file as
// it was.
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace hybrid {

// The place to which the bytes for a path go. Links are followed: a link stays, and its target is replaced. A
// device, a named pipe or an open descriptor ("-" and /dev/stdout: standard output) cannot be replaced and is
// written directly. Throws std::runtime_error in words if the path is a folder, or if there is no folder to
// write into.
struct FilePlace {
  explicit FilePlace(const std::filesystem::path& file);

  std::filesystem::path asked;  // the path as it was given, for messages
  std::string target;           // the file after all links
  std::string folder;           // of the target
  std::string temporary;        // an unused name in the folder
  int descriptor = -1;          // the open descriptor that the path names; −1: none
  bool at_once = false;         // true: no ordinary file, written directly
};

// A file that is being written. It allocates nothing, so it is safe in a signal handler. Functions return
// false on failure and set errno.
class FileOnItsWay {
 public:
  explicit FileOnItsWay(const FilePlace& place) noexcept : place_(place) {}
  ~FileOnItsWay();  // removes a file that was not kept
  FileOnItsWay(const FileOnItsWay&) = delete;
  FileOnItsWay& operator=(const FileOnItsWay&) = delete;
  FileOnItsWay(FileOnItsWay&&) = delete;
  FileOnItsWay& operator=(FileOnItsWay&&) = delete;

  bool open() noexcept;
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  bool keep() noexcept;
  // Returns true after a failed keep(): all bytes are in FilePlace::temporary, which stays.
  [[nodiscard]] bool left_beside() const noexcept { return left_beside_; }

 private:
  void note_name() noexcept;
  void forget_name() noexcept;

  const FilePlace& place_;
  int descriptor_ = -1;
  bool named_ = false, left_beside_ = false;
};

// Removes the temporary names of all files on their way. For a signal handler that ends the process.
void remove_unfinished_files() noexcept;

// A whole file with a stream. Each member throws std::runtime_error with file, reason and remedy.
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
  // For libraries that write to a stream. keep() finds their errors.
  [[nodiscard]] std::FILE* stream() { return stream_; }
  // Call when the file is complete. It then replaces the target.
  void keep();

 private:
  [[noreturn]] void refuse(int reason) const;

  FilePlace place_;
  FileOnItsWay way_;
  std::FILE* stream_ = nullptr;
};

// Writes a text as a whole file.
void save_text(const std::filesystem::path& file, std::string_view text);

// Makes missing folders of the file's path. Throws as WholeFile does if no file can be written there. Leaves
// no file.
void require_writable(const std::filesystem::path& file);

}  // namespace hybrid
