// SPDX-License-Identifier: GPL-3.0-or-later
// The header of an NRRD file. Source: the format's definition at teem.sourceforge.net/nrrd/format.html.
#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <map>

#include "voxel/volume/check_header.h"
#include "voxel/volume/length_unit.h"
#include "voxel/volume/number_at.h"
#include "voxel/volume/text_header.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;

// Throws VolumeError: "the header cannot be read: …".
template <typename... Parts>
[[noreturn]] void refuse_header(const fs::path& path, const Parts&... parts) {
  refuse_volume(path, "the header cannot be read: ", parts..., "; ", kDamaged);
}

// Splits a text at blanks. A word in quotes or in round brackets may hold blanks; the quotes are dropped.
std::vector<std::string> words_between_blanks(const std::string& text) {
  std::vector<std::string> words;
  std::string word;
  bool any = false;
  char until = '\0';
  for (const char c : text) {
    if (until == '\0' && std::isspace(static_cast<unsigned char>(c)) != 0) {
      if (any) words.push_back(word);
      word.clear();
      any = false;
      continue;
    }
    any = true;
    if (until == '\0' && (c == '"' || c == '(')) {
      until = c == '"' ? '"' : ')';
      if (c == '(') word.push_back(c);
    } else if (c == until) {
      until = '\0';
      if (c == ')') word.push_back(c);
    } else {
      word.push_back(c);
    }
  }
  if (any) words.push_back(word);
  return words;
}

// The numbers of a vector such as "(1,0,0)". Throws VolumeError.
std::vector<double> vector_of(const fs::path& path, const std::string& key, const std::string& word) {
  std::vector<double> values;
  const char* at = word.c_str() + 1;
  while (word.size() > 2 && word.front() == '(') {
    const char* end = nullptr;
    const double value = number_at(at, &end);
    if (end == at) break;
    values.push_back(value);
    while (std::isspace(static_cast<unsigned char>(*end)) != 0) ++end;
    at = end + 1;
    if (*end == ')') return values;
    if (*end != ',') break;
  }
  refuse_header(path, "'", word, "' of '", key, "' is no vector");
}

double number_of(const fs::path& path, const std::string& key, const std::string& word) {
  const char* end = nullptr;
  const double value = number_at(word.c_str(), &end);
  if (end == word.c_str() || *end != '\0') refuse_header(path, "'", word, "' of '", key, "' is no number");
  return value;
}

// The directions of the three coordinates of a space, as factors that turn them into LPS coordinates.
struct NrrdSpace {
  glm::dvec3 to_lps{1.0};
  bool known = true;
};

// The space that a header names. Its name may be long or short, with blanks, hyphens or neither, and with or
// without time.
NrrdSpace space_of(const fs::path& path, const std::string& text, VoxelPlace& place) {
  std::string name;
  for (const char c : lower_case(text)) {
    if (c != '-' && c != '_' && c != ' ' && c != '\t') name.push_back(c);
  }
  static const std::map<std::string, NrrdSpace> spaces{
      {"rightanteriorsuperior", {{-1.0, -1.0, 1.0}}}, {"ras", {{-1.0, -1.0, 1.0}}},
      {"leftanteriorsuperior", {{1.0, -1.0, 1.0}}},   {"las", {{1.0, -1.0, 1.0}}},
      {"leftposteriorsuperior", {{1.0, 1.0, 1.0}}},   {"lps", {{1.0, 1.0, 1.0}}},
      {"scannerxyz", {{1.0, 1.0, 1.0}, false}},       {"3drighthanded", {{1.0, 1.0, 1.0}, false}},
      {"3dlefthanded", {{-1.0, 1.0, 1.0}, false}}};
  auto found = spaces.find(name);
  if (found == spaces.end() && ends_with(name, "time")) found = spaces.find(name.substr(0, name.size() - 4));
  if (found == spaces.end() && name.size() == 4 && name.back() == 't') found = spaces.find(name.substr(0, 3));
  if (found == spaces.end()) {
    refuse_volume(path, "the header's space '", text,
                  "' is none of NRRD's (such as right-anterior-superior, LPS, scanner-xyz); correct it");
  }
  if (!found->second.known) {
    std::string note = "the header's space '" + text +
                       "' does not say how the axes lie in the patient: "
                       "anatomical directions are unknown";
    if (found->second.to_lps.x < 0.0) note += "; the space is left-handed, so its x is mirrored";
    place.notes.push_back(note);
  }
  place.directions_known = found->second.known;
  return found->second;
}

// One axis of the file.
struct NrrdAxis {
  double size = 0.0;
  bool of_space = true;      // false for an axis of components or of time
  std::vector<double> step;  // space direction; empty if the header gives none
};

// False for an axis of components, colours or time. Source: the format's table of kinds.
bool is_kind_of_space(const std::string& kind) {
  const std::string word = lower_case(kind);
  return word == "space" || word == "domain" || word == "???" || word == "none" || word.empty();
}

std::vector<NrrdAxis> nrrd_axes(const fs::path& path, const TextHeader& header) {
  const double dimension = header.number("dimension", std::nan(""));
  check_axes(path, dimension);
  const auto count = static_cast<std::size_t>(dimension);
  std::vector<NrrdAxis> axes(count);
  const auto entries = [&](const char* key) {
    std::vector<std::string> words = words_between_blanks(header.text(key));
    if (!words.empty() && words.size() != count)
      refuse_header(path, "'", key, "' has ", words.size(), " entries for ", count, " axes");
    return words;
  };
  const std::vector<std::string> sizes = entries("sizes"), kinds = entries("kinds"),
                                 steps = entries("spacedirections");
  if (sizes.empty()) refuse_header(path, "there are no sizes");
  std::size_t places = 0;
  for (std::size_t n = 0; n < count; ++n) {
    axes[n].size = number_of(path, "sizes", sizes[n]);
    axes[n].of_space = kinds.empty() || is_kind_of_space(kinds[n]);
    if (!steps.empty()) {
      axes[n].of_space = lower_case(steps[n]) != "none";
      if (axes[n].of_space) axes[n].step = vector_of(path, "space directions", steps[n]);
      const std::vector<double>& v = axes[n].step;
      // In a space with time, an axis along time alone is no axis of the volume.
      if (v.size() == 4 && v[3] != 0.0) axes[n].of_space = v[0] != 0.0 || v[1] != 0.0 || v[2] != 0.0;
    }
    places += axes[n].of_space ? 1 : 0;
    if (axes[n].of_space && places <= 3) continue;
    axes[n].of_space = false;
    if (axes[n].size == 1.0) continue;
    if (!kinds.empty() || lower_case(steps.empty() ? "" : steps[n]) == "none") {
      refuse_volume(
          path, "axis ", n + 1, " of the file has ", axes[n].size,
          " entries and is no direction in space; save one channel, or one three-dimensional volume of it");
    }
    refuse_volume(path, "the file has ", count, " axes, the ", n + 1, "th with ", axes[n].size,
                  " entries; save one three-dimensional volume of it");
  }
  if (!steps.empty() && places < 3 && count >= 3)
    refuse_volume(path, "the header gives no direction for one of the volume's three axes; correct it");
  return axes;
}

Component nrrd_component(const fs::path& path, const TextHeader& header) {
  std::string type = lower_case(header.text("type"));
  type.erase(std::remove(type.begin(), type.end(), ' '), type.end());
  if (starts_with(type, "signed") && type != "signed") type.erase(0, 6);
  if (ends_with(type, "_t")) type.erase(type.size() - 2);
  static const std::map<std::string, Component> types{{"char", Component::int8},
                                                      {"int8", Component::int8},
                                                      {"uchar", Component::uint8},
                                                      {"unsignedchar", Component::uint8},
                                                      {"uint8", Component::uint8},
                                                      {"short", Component::int16},
                                                      {"shortint", Component::int16},
                                                      {"int16", Component::int16},
                                                      {"ushort", Component::uint16},
                                                      {"unsignedshort", Component::uint16},
                                                      {"unsignedshortint", Component::uint16},
                                                      {"uint16", Component::uint16},
                                                      {"int", Component::int32},
                                                      {"int32", Component::int32},
                                                      {"uint", Component::uint32},
                                                      {"unsignedint", Component::uint32},
                                                      {"uint32", Component::uint32},
                                                      {"longlong", Component::int64},
                                                      {"longlongint", Component::int64},
                                                      {"int64", Component::int64},
                                                      {"ulonglong", Component::uint64},
                                                      {"unsignedlonglong", Component::uint64},
                                                      {"unsignedlonglongint", Component::uint64},
                                                      {"uint64", Component::uint64},
                                                      {"float", Component::float32},
                                                      {"double", Component::float64}};
  const auto found = types.find(type);
  if (found == types.end()) refuse_header(path, "the type '", header.text("type"), "' is no kind of number");
  return found->second;
}

// The length units that a field lists: one for each axis, or for each coordinate of the space. Sets
// `place.stated_unit` to the first unit that is stated. Adds a note if one unit is known and another is not.
std::vector<std::optional<double>> nrrd_units(const TextHeader& header, const char* key, VoxelPlace& place) {
  std::vector<std::optional<double>> units;
  std::string unknown;
  for (const std::string& word : words_between_blanks(header.text(key))) {
    units.push_back(length_unit_m(word));
    if (word.empty() || word == "???" || lower_case(word) == "none") continue;
    if (place.stated_unit.empty()) place.stated_unit = word;
    if (!units.back()) unknown = word;
  }
  const bool any = std::any_of(units.begin(), units.end(), [](const auto& unit) { return unit.has_value(); });
  if (any && !unknown.empty()) {
    place.notes.push_back("the header gives an axis the unit '" + unknown +
                          "', which is no length known here; it is taken as mm");
  }
  return units;
}

// Factors for the three coordinates. They are 1 if all coordinates have one unit, which becomes the unit of
// the frame. Otherwise they turn the frame into millimeters.
struct NrrdScale {
  glm::dvec3 factor{1.0};
};

NrrdScale common_unit(const std::vector<double>& units_m, VoxelPlace& place) {
  constexpr double kMillimeter = 1e-3;
  NrrdScale scale;
  if (units_m.empty()) return scale;
  place.unit_m = units_m[0];
  if (std::all_of(units_m.begin(), units_m.end(), [&](double unit) { return unit == units_m[0]; }))
    return scale;
  place.unit_m = kMillimeter;
  for (std::size_t n = 0; n < std::min<std::size_t>(units_m.size(), 3); ++n)
    scale.factor[static_cast<int>(n)] = units_m[n] / kMillimeter;
  return scale;
}

// The units at the given entries of a list. An entry without a known unit counts as millimeters. Empty if no
// entry has a known unit.
std::vector<double> stated_units(const std::vector<std::optional<double>>& units,
                                 const std::vector<std::size_t>& entries) {
  std::vector<double> out;
  bool any = false;
  for (const std::size_t n : entries) {
    if (n >= units.size()) continue;
    any = any || units[n].has_value();
    out.push_back(units[n].value_or(1e-3));
  }
  return any ? out : std::vector<double>{};
}

// Reads axes that the header gives as vectors in a space.
void read_oriented_frame(const fs::path& path, const TextHeader& header, const std::vector<NrrdAxis>& axes,
                         const std::vector<std::size_t>& places, VoxelPlace& place) {
  NrrdSpace space{glm::dvec3(1.0), false};
  if (header.has("space")) {
    space = space_of(path, header.text("space"), place);
  } else {
    place.directions_known = false;
    place.notes.emplace_back(
        "the header names no space: anatomical directions are unknown, and the coordinates are taken for "
        "left, "
        "back and head");
  }
  std::vector<double> units = stated_units(nrrd_units(header, "spaceunits", place), {0, 1, 2});
  if (units.empty()) units = stated_units(nrrd_units(header, "units", place), places);
  const glm::dvec3 factor = common_unit(units, place).factor * space.to_lps;
  const auto in_lps = [&](const std::vector<double>& v) {
    glm::dvec3 out(0.0);
    for (std::size_t n = 0; n < std::min<std::size_t>(v.size(), 3); ++n) out[static_cast<int>(n)] = v[n];
    return out * factor;
  };
  for (std::size_t n = 0; n < places.size(); ++n) {
    const auto axis = static_cast<int>(n);
    const glm::dvec3 step = in_lps(axes[places[n]].step);
    const double length = glm::length(step);
    if (std::isnan(length))
      refuse_volume(path, "the header gives no voxel spacing along an axis (nan); correct it");
    place.frame.spacing[axis] = length;
    if (length > 0.0) place.frame.direction[axis] = step / length;
  }
  const std::string origin = header.text("spaceorigin");
  if (!origin.empty()) place.frame.origin = in_lps(vector_of(path, "space origin", origin));
  if (places.size() < 3) complete_axes(place.frame, places.size());
}

// Reads axes for which the header gives spacings alone and no directions.
void read_plain_frame(const fs::path& path, const TextHeader& header, const std::vector<std::size_t>& places,
                      VoxelPlace& place) {
  const std::vector<std::string> spacings = words_between_blanks(header.text("spacings")),
                                 thicknesses = words_between_blanks(header.text("thicknesses")),
                                 minima = words_between_blanks(header.text("axismins")),
                                 centers = words_between_blanks(lower_case(header.has("centers")
                                                                               ? header.text("centers")
                                                                               : header.text("centerings")));
  const std::vector<double> units = stated_units(nrrd_units(header, "units", place), places);
  const glm::dvec3 factor = common_unit(units, place).factor;
  for (std::size_t n = 0; n < places.size(); ++n) {
    const auto axis = static_cast<int>(n);
    const std::size_t entry = places[n];
    double spacing = 1.0;
    if (entry < spacings.size()) spacing = number_of(path, "spacings", spacings[entry]);
    // A single slice has a thickness, and no spacing to others.
    if (std::isnan(spacing) && place.frame.dims[n] == 1.0 && entry < thicknesses.size())
      spacing = number_of(path, "thicknesses", thicknesses[entry]);
    if (std::isnan(spacing))
      refuse_volume(path, "the header gives no voxel spacing along an axis (nan); correct it");
    place.frame.spacing[axis] = spacing * factor[axis];
    double first = entry < minima.size() ? number_of(path, "axis mins", minima[entry]) : 0.0;
    if (std::isnan(first)) first = 0.0;
    // The minimum of an axis is the border of the first voxel, unless its samples are nodes.
    const bool node = entry < centers.size() && centers[entry] == "node";
    if (entry < minima.size() && !node) first += 0.5 * spacing;
    place.frame.origin[axis] = first * factor[axis];
  }
  if (spacings.empty()) place.notes.emplace_back(kNoSpacing);
  place.directions_known = false;
  place.notes.emplace_back(
      "the header gives its axes no directions: anatomical directions are unknown, and the axes of the file "
      "are "
      "taken for left, back and head");
}

void read_nrrd_frame(const fs::path& path, const TextHeader& header, VoxelPlace& place) {
  const std::vector<NrrdAxis> axes = nrrd_axes(path, header);
  std::vector<std::size_t> places;
  for (std::size_t n = 0; n < axes.size(); ++n) {
    if (axes[n].of_space) places.push_back(n);
  }
  place.axes = places.size();
  place.frame.dims = {1.0, 1.0, 1.0};
  for (std::size_t n = 0; n < places.size(); ++n) place.frame.dims[n] = axes[places[n]].size;
  if (header.has("spacedirections")) {
    read_oriented_frame(path, header, axes, places, place);
  } else {
    read_plain_frame(path, header, places, place);
  }
}

void read_nrrd_encoding(const fs::path& path, const TextHeader& header, VoxelPlace& place) {
  using Packing = VoxelPlace::Packing;
  const std::map<std::string, Packing> packings{
      {"raw", Packing::raw},   {"gzip", Packing::deflate}, {"gz", Packing::deflate}, {"ascii", Packing::text},
      {"text", Packing::text}, {"txt", Packing::text},     {"hex", Packing::text}};
  const std::string encoding = lower_case(header.text("encoding"));
  const auto packing = packings.find(encoding);
  if (packing == packings.end()) {
    refuse_volume(path, "the voxels have the encoding '", header.text("encoding"), "'",
                  encoding == "bz2" || encoding == "bzip2" ? " (packed by bzip2)" : "",
                  ", which is not read; save the volume with the encoding raw or gzip");
  }
  place.packing = packing->second;
  bytes_to_skip(path, header, "lineskip");
  const std::uint64_t skipped = bytes_to_skip(path, header, "byteskip");
  (place.packing == Packing::deflate ? place.skipped : place.offset) += skipped;
  const std::string endian = lower_case(header.text("endian"));
  if (place.packing != Packing::text && size_of(*place.stored) > 1 && endian != "little" && endian != "big")
    refuse_header(path, "it does not say the byte order (endian) of its numbers");
  place.swapped = header.has("endian") && (endian == "big") == (std::endian::native == std::endian::little);
  if (header.has("lineskip") || header.number("byteskip", 0.0) < 0.0) place.as_they_are = false;
  if (header.has("lineskip") && place.packing == Packing::deflate) place.packing = Packing::other;
}

}  // namespace

void inspect_nrrd(const fs::path& path, VoxelPlace& place) {
  std::string magic(4, '\0');
  std::ifstream(path, std::ios::binary).read(magic.data(), 4);
  if (magic != "NRRD") refuse_volume(path, "this is not an NRRD file; ", kDamaged);
  const TextHeader header = read_text_header(path, ':', "");
  place.stored = nrrd_component(path, header);
  read_nrrd_frame(path, header, place);
  place.offset = header.bytes;
  find_data_file(path, header.text("datafile"), place);
  read_nrrd_encoding(path, header, place);
}

}  // namespace voxel
