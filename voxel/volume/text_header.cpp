// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/text_header.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include "voxel/volume/number_at.h"
#include "voxel/volume/raw_volume.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

}  // namespace

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

bool starts_with(const std::string& text, const std::string& start) {
  return text.rfind(start, 0) == 0;
}

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string TextHeader::text(const std::string& key) const {
  const auto field = fields.find(key);
  return field == fields.end() ? "" : field->second;
}

double TextHeader::number(const std::string& key, double otherwise) const {
  const auto field = fields.find(key);
  if (field == fields.end()) return otherwise;
  const char* end = nullptr;
  const double value = number_at(field->second.c_str(), &end);
  return end == field->second.c_str() ? std::nan("") : value;
}

TextHeader read_text_header(const fs::path& path, char separator, const std::string& last_key) {
  // MetaIO reads a line into a buffer of 1,024 characters without checking its length. 3D Slicer writes NRRD
  // headers with lines of 2,000.
  const std::size_t longest_line = separator == '=' ? 1000 : 100'000;
  constexpr std::size_t kMostLines = 10'000;  // a header with more lines is broken
  std::ifstream file(path, std::ios::binary);
  TextHeader header;
  std::string line;
  for (std::size_t lines = 1; lines <= kMostLines && file; ++lines) {
    line.clear();
    for (int c = file.get(); c != '\n' && c != EOF; c = file.get()) {
      ++header.bytes;
      const bool text = c >= 0x20 || c == '\t' || c == '\r';
      if (!text || line.size() >= longest_line) {
        refuse_volume(path, "line ", lines, " of the header is ", text ? "longer than " : "not text",
                      text ? longest_line == 1000 ? "1,000 characters" : "100,000 characters" : "", "; ",
                      kDamaged);
      }
      line.push_back(static_cast<char>(c));
    }
    ++header.bytes;
    if (trimmed(line).empty()) break;
    const auto at = line.find(separator);
    if (at == std::string::npos || line[0] == '#') continue;
    // "key:=value" of NRRD is a remark of the program that wrote the file, whatever the key.
    if (separator == ':' && at + 1 < line.size() && line[at + 1] == '=') continue;
    std::string key = lower_case(line.substr(0, at));
    key.erase(std::remove_if(key.begin(), key.end(), [](char c) { return c == ' ' || c == '\t'; }),
              key.end());
    if (!header.fields.emplace(key, trimmed(line.substr(at + 1))).second) {
      refuse_volume(path, "the header gives '", key, "' twice; correct it");
    }
    if (key == last_key) break;
  }
  return header;
}

void find_data_file(const fs::path& header, const std::string& name, VoxelPlace& place) {
  const std::string word = lower_case(name);
  if (name.empty() || word == "local") return;
  // LIST and printf patterns name several files. The libraries pass patterns to printf unchecked.
  if (starts_with(word, "list") || name.find('%') != std::string::npos) {
    refuse_volume(header, "the voxels are spread over several files ('", name,
                  "'); save the volume as one file");
  }
  place.file = header.parent_path() / name;
  place.offset = 0;
  std::error_code error;
  if (!fs::is_regular_file(place.file, error)) {
    refuse_volume(header, "the voxels should be in '", place.file.string(),
                  "', which is not there; put it back beside the header");
  }
  place.file_bytes = size_of_file(place.file);
}

void check_axes(const fs::path& path, double axes) {
  if (axes >= 1.0 && axes <= 7.0 && axes == std::floor(axes))
    return;  // the format's reader checks later that the file holds one volume
  refuse_volume(path, "the header says ", axes, " axes; a volume has three. ", kDamaged);
}

std::uint64_t bytes_to_skip(const fs::path& path, const TextHeader& header, const std::string& key) {
  const double bytes = header.number(key, 0.0);
  if (!(bytes >= -1.0 && bytes <= 1e15)) {
    refuse_volume(path, "the header's '", key, "' is ", header.text(key), "; ", kDamaged);
  }
  return bytes > 0.0 ? static_cast<std::uint64_t>(bytes) : 0;
}

}  // namespace voxel
