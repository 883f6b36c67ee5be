// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/files/file_bytes.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <new>
#include <system_error>
#include <vector>

#include "polygon/files/mesh_file.h"
#include "polygon/files/prescan.h"

namespace polygon {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what_and_remedy) {
  throw MeshError(file.string() + ": " + what_and_remedy);
}

std::string too_large(std::uint64_t max_bytes) {
  return "more than the limit of " + std::to_string(max_bytes) +
         " bytes; simplify the mesh, or raise max_bytes when the memory is there";
}

// Unpacked size that a gzip file announces in its last four bytes (RFC 1952), limited by the largest ratio of
// deflate. It is only a hint.
std::uint64_t announced_size(const std::filesystem::path& file) {
  constexpr std::uint64_t kMostPacked = 1032;  // largest ratio that deflate reaches
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  const std::streamoff packed = in.tellg();
  std::uint32_t size = 0;
  if (packed < static_cast<std::streamoff>(sizeof(size))) return 0;
  in.seekg(-static_cast<std::streamoff>(sizeof(size)), std::ios::end);
  in.read(reinterpret_cast<char*>(&size), sizeof(size));
  return in ? std::min<std::uint64_t>(size, static_cast<std::uint64_t>(packed) * kMostPacked) : 0;
}

std::string unpack(const std::filesystem::path& file, std::uint64_t max_bytes) {
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> in(gzopen(file.c_str(), "rb"), gzclose);
  if (in == nullptr) refuse(file, "cannot be opened; check that you may read it");
  gzbuffer(in.get(), 1U << 17U);
  std::string bytes;
  bytes.reserve(std::min(announced_size(file), max_bytes) + 1);
  std::vector<char> chunk(1U << 18U);  // small enough to stay in the cache
  for (;;) {
    const std::size_t before = bytes.size();
    const int got = gzread(in.get(), chunk.data(), static_cast<unsigned>(chunk.size()));
    int status = Z_OK;
    const char* message = gzerror(in.get(), &status);
    if (got < 0 || (status != Z_OK && status != Z_STREAM_END)) {
      refuse(file, std::string("the gzip data are damaged or cut short (") +
                       (status == Z_BUF_ERROR ? "the file ends too early" : message) + ", after " +
                       std::to_string(before) + " bytes unpacked); copy the file again");
    }
    bytes.append(chunk.data(), static_cast<std::size_t>(got));
    if (gzdirect(in.get()) != 0) refuse(file, "is named .gz but is not gzip; rename it, or pack it again");
    if (bytes.size() > max_bytes) refuse(file, "unpacks to " + too_large(max_bytes));
    if (got == 0) return bytes;
  }
}

}  // namespace

std::string_view other_kind(std::string_view first_bytes) {
  using namespace std::string_view_literals;
  struct Kind {
    std::string_view begins, is;
  };
  constexpr std::array<Kind, 14> kKinds{
      {{"version https://git-lfs.github.com/"sv,
        "is a Git LFS pointer, which stands for a file that was not fetched; run 'git lfs pull' in its "
        "repository"sv},
       {"<!DOCTYPE html"sv, "is a web page; download the file itself"sv},
       {"<!doctype html"sv, "is a web page; download the file itself"sv},
       {"<html"sv, "is a web page; download the file itself"sv},
       {"PK\x03\x04"sv,
        "is a ZIP file, as 3MF and workbooks (.xlsx, .ods) are; unpack it, or export it in another format"sv},
       {"BZh"sv, "is packed by bzip2; unpack it, or pack it by gzip"sv},
       {"\xFD"
        "7zXZ\0"sv,
        "is packed by xz; unpack it, or pack it by gzip"sv},
       {"\x28\xB5\x2F\xFD"sv, "is packed by zstd; unpack it, or pack it by gzip"sv},
       {"7z\xBC\xAF\x27\x1C"sv, "is packed by 7-Zip; unpack it"sv},
       {"Rar!"sv, "is packed by RAR; unpack it"sv},
       {"glTF"sv, "is a glTF file; export it in another format"sv},
       {"ISO-10303-21"sv, "is a STEP file, which has no triangles; export a mesh"sv},
       {"# vtk DataFile"sv, "is a VTK file; export it in another format"sv},
       {"<?xml"sv, "is an XML file, as VTP, X3D and COLLADA are; export it in another format"sv}}};
  first_bytes = without_byte_order_mark(first_bytes);
  for (const Kind& kind : kKinds) {
    if (first_bytes.starts_with(kind.begins)) return kind.is;
  }
  return {};
}

std::string read_file_bytes(const std::filesystem::path& file, bool packed, std::uint64_t max_bytes) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) refuse(file, "there is no such file; check the path");
  if (!std::filesystem::is_regular_file(status)) refuse(file, "is not a file; name a mesh file");
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error) refuse(file, "its size cannot be read (" + error.message() + "); check that you may read it");
  if (size > max_bytes) refuse(file, "has " + std::to_string(size) + " bytes, " + too_large(max_bytes));
  if (size == 0) refuse(file, "is empty (0 bytes); export the mesh again, or copy it again");
  try {
    std::ifstream in(file, std::ios::binary);
    if (!in) refuse(file, "cannot be opened; check that you may read it");
    std::array<char, 64> first{};
    in.read(first.data(), first.size());
    const std::string_view other = other_kind({first.data(), static_cast<std::size_t>(in.gcount())});
    if (!other.empty()) refuse(file, std::string(other));
    if (packed) return unpack(file, max_bytes);
    if (std::string_view(first.data(), 2) == "\x1F\x8B") {
      refuse(file, "is packed by gzip; let its name end in .gz, as in " + file.filename().string() + ".gz");
    }
    in.clear();
    in.seekg(0);
    std::string bytes(size, '\0');
    in.read(bytes.data(), static_cast<std::streamsize>(size));
    if (static_cast<std::uintmax_t>(in.gcount()) != size) {
      refuse(file, "could only be read up to byte " + std::to_string(in.gcount()) + " of " +
                       std::to_string(size) + "; check the disk, and that nothing is writing to it");
    }
    return bytes;
  } catch (const std::bad_alloc&) {
    refuse(file, "does not fit into memory; simplify the mesh");
  }
}

}  // namespace polygon
