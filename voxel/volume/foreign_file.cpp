// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/foreign_file.h"

#include <array>
#include <cctype>
#include <fstream>
#include <string>

#include "voxel/volume/raw_volume.h"

namespace voxel {
namespace {

struct PackedKind {
  std::string start;
  const char* packer;
};

const std::array<PackedKind, 6>& packed_kinds() {
  using namespace std::string_literals;
  static const std::array<PackedKind, 6> kinds{{{"BZh"s, "bzip2"},
                                                {"\xFD"
                                                 "7zXZ\0"s,
                                                 "xz"},
                                                {"\x28\xB5\x2F\xFD"s, "zstd"},
                                                {"PK\x03\x04"s, "zip"},
                                                {"7z\xBC\xAF\x27\x1C"s, "7-Zip"},
                                                {"Rar!"s, "rar"}}};
  return kinds;
}

}  // namespace

void refuse_foreign_file(const std::filesystem::path& path, bool may_be_gzip) {
  constexpr std::size_t kFirstBytes = 512;  // bytes that are enough to recognise a format
  std::ifstream file(path, std::ios::binary);
  std::string start(kFirstBytes, '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(file.gcount()));
  const auto begins = [&](const std::string& with) { return start.compare(0, with.size(), with) == 0; };
  if (begins("version https://git-lfs") || begins("version https://hawser")) {
    refuse_volume(path,
                  "this is a Git LFS pointer, not the file itself; fetch the file with 'git lfs pull' in its "
                  "repository");
  }
  if (start.find("/annex/objects/") != std::string::npos && start.size() < kFirstBytes) {
    refuse_volume(path,
                  "this is a git-annex pointer, not the file itself; fetch the file with 'git annex get' (or "
                  "'datalad get') in its repository");
  }
  for (const PackedKind& kind : packed_kinds()) {
    if (begins(kind.start)) {
      refuse_volume(path, "the file is packed by ", kind.packer, ", which is not read; unpack it first");
    }
  }
  if (!may_be_gzip && begins("\x1F\x8B")) refuse_volume(path, "the file is packed by gzip; unpack it first");
  std::string lower = start.substr(
      start.find_first_not_of(" \t\r\n") == std::string::npos ? 0 : start.find_first_not_of(" \t\r\n"));
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (lower.rfind("<!doctype html", 0) == 0 || lower.rfind("<html", 0) == 0) {
    refuse_volume(path, "this is a web page, as a failed download leaves it; download the file itself again");
  }
}

}  // namespace voxel
