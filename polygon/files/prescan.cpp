// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/files/prescan.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>
#include <limits>

#include "polygon/files/mesh_file.h"
#include "polygon/mesh/mesh_bounds.h"

namespace polygon {
namespace {

static_assert(std::endian::native == std::endian::little,
              "OpenMesh's binary dialects are written in native order");

constexpr std::int64_t kMostElements =
    std::numeric_limits<std::int32_t>::max();  // OpenMesh's handles are ints

std::string at_line(std::size_t line) {
  return "line " + std::to_string(line);
}

// A word of the file, shortened and made printable for a message.
std::string quoted(std::string_view word) {
  std::string text = "'";
  for (const char c : word.substr(0, 24)) text += (c >= ' ' && c < 127) ? c : '?';
  return text + (word.size() > 24 ? "…'" : "'");
}

glm::dvec3 take_coordinates(const std::filesystem::path& file, std::string_view& line, std::size_t number) {
  glm::dvec3 v(0.0);
  for (int i = 0; i < 3; ++i) {
    const std::string_view word = take_word(line);
    double value = 0.0;
    if (!parse_number(word, value)) {
      refuse_mesh(file, at_line(number) + ": a vertex needs three numbers, but has " +
                            (word.empty() ? "only " + std::to_string(i) : quoted(word)) +
                            "; export the mesh again");
    }
    v[i] = value;
  }
  return v;
}

// ---- OBJ

// One line. If it ends with '\', the lines that continue it are appended, and `joined` holds the whole text.
std::string_view logical_line(TextCursor& text, std::string& joined) {
  std::string_view line = text.next_line();
  if (!line.ends_with('\\')) return line;
  joined.clear();
  while (line.ends_with('\\')) {
    line.remove_suffix(1);
    joined.append(line).push_back(' ');
    line = text.next_line();
  }
  joined.append(line);
  return joined;
}

}  // namespace

PrescannedFile prescan_obj(const std::filesystem::path& file, std::span<char> raw) {
  const std::string_view bytes = plain_text(file, raw);
  PrescannedFile prescanned;
  std::string joined;
  // The first pass reads the vertices, because a face may use vertices that come later in the file.
  for (TextCursor text(bytes); !text.at_end();) {
    const std::size_t number = text.line();
    std::string_view line = logical_line(text, joined);
    if (take_word(line) != "v") continue;
    prescanned.coordinates.push_back(take_coordinates(file, line, number));
  }
  const auto vertices = static_cast<std::int64_t>(prescanned.coordinates.size());
  if (vertices >= kMostElements) refuse_mesh(file, "has more than 2^31 - 1 vertices; split it");

  std::int64_t so_far = 0;  // vertices so far; negative indices count back from here
  // OpenMesh's OBJ reader drops faces with repeated corners, even if a polygon only repeats them where a cut
  // connects its rim to a hole. So the faces are passed on as PLY.
  std::string faces;
  for (TextCursor text(bytes); !text.at_end();) {
    const std::size_t number = text.line();
    std::string_view line = logical_line(text, joined);
    const std::string_view keyword = take_word(line);
    if (keyword == "v") ++so_far;
    if (keyword != "f" && keyword != "fo") continue;  // 'fo' is an older keyword for 'f'
    const std::size_t face_at = faces.size();
    append_raw(faces, std::int32_t{0});
    std::int32_t corners = 0;
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line), ++corners) {
      std::int64_t index = 0;
      if (word.front() == '#') break;
      if (!parse_integer(word.substr(0, word.find('/')), index)) {
        refuse_mesh(file,
                    at_line(number) + ": " + quoted(word) +
                        " is no corner of a face (vertex, vertex/texture/normal); export the mesh again");
      }
      if (index < 0) index += so_far + 1;
      const bool exists = index >= 1 && index <= vertices;
      append_raw(faces, static_cast<std::int32_t>(exists ? index - 1 : -1));
    }
    if (corners < 3) {
      if (prescanned.short_faces++ == 0) prescanned.first_short_face = at_line(number);
      faces.resize(face_at);
      continue;
    }
    std::memcpy(faces.data() + face_at, &corners, sizeof(corners));
    ++prescanned.faces;
  }
  write_ply_dialect(prescanned, faces);
  return prescanned;
}

// ---- OFF

PrescannedFile prescan_off(const std::filesystem::path& file, std::span<char> raw) {
  const std::string_view bytes = plain_text(file, raw);
  PrescannedFile prescanned;
  prescanned.openmesh_extension = "off";
  TextCursor text(bytes);
  std::size_t number = 0;
  // The next line that is not empty, without its comment.
  const auto content_line = [&]() -> std::string_view {
    while (!text.at_end()) {
      number = text.line();
      std::string_view line = text.next_line();
      line = line.substr(0, line.find('#'));
      std::string_view rest = line;
      if (!take_word(rest).empty()) return line;
    }
    return {};
  };

  std::string_view line = content_line();
  std::string_view kind = take_word(line);
  if (!kind.ends_with("OFF")) refuse_mesh(file, "does not begin with 'OFF'; is it another kind of file?");
  kind.remove_suffix(3);
  // Texture, colour and normal prefixes are harmless: these values follow the coordinates.
  for (const std::string_view extra : {"ST", "C", "N"}) {
    if (kind.starts_with(extra)) kind.remove_prefix(extra.size());
  }
  if (!kind.empty()) {
    refuse_mesh(file, "has vertices that are not three-dimensional ('" + std::string(kind.substr(0, 8)) +
                          "OFF'); export it as plain OFF");
  }
  std::string_view counts = line;
  std::string_view first = take_word(counts);
  if (first == "BINARY")
    refuse_mesh(file, "is binary OFF, which is not read; export it as text OFF or as PLY");
  if (first.empty()) line = content_line();
  std::array<std::int64_t, 2> count{};
  for (std::int64_t& c : count) {
    // A vertex takes at least six bytes and a face two. A count that the file cannot hold is refused.
    const std::string_view word = take_word(line);
    if (!parse_integer(word, c) || c < 0) {
      refuse_mesh(file, at_line(number) + ": " + quoted(word) +
                            " is no count; the numbers of vertices, faces and edges are needed");
    }
    if (c > static_cast<std::int64_t>(text.remaining())) {
      refuse_mesh(file, at_line(number) + ": announces " + std::to_string(count[0]) + " vertices and " +
                            std::to_string(count[1]) + " faces, more than its " +
                            std::to_string(bytes.size()) +
                            " bytes can hold; it is cut short or damaged: copy or export it again");
    }
  }
  if (count[0] >= kMostElements) refuse_mesh(file, "has more than 2^31 - 1 vertices; split it");
  prescanned.coordinates.reserve(static_cast<std::size_t>(count[0]));
  prescanned.dialect = "OFF\n";
  append_integer(prescanned.dialect, count[0]);
  prescanned.dialect.push_back(' ');
  const std::size_t face_count_at = prescanned.dialect.size();
  const auto cut_short = [&](const char* what, std::int64_t have, std::int64_t announced) {
    refuse_mesh(file, "ends after " + std::to_string(have) + " of the " + std::to_string(announced) + " " +
                          what + " it announces; it is cut short: copy or export it again");
  };
  for (std::int64_t i = 0; i < count[0]; ++i) {
    line = content_line();
    if (line.empty()) cut_short("vertices", i, count[0]);
    prescanned.coordinates.push_back(take_coordinates(file, line, number));
    prescanned.dialect += "0 0 0\n";
  }
  for (std::int64_t i = 0; i < count[1]; ++i) {
    line = content_line();
    if (line.empty()) cut_short("faces", i, count[1]);
    std::int64_t corners = 0;
    std::string_view word = take_word(line);
    if (!parse_integer(word, corners) || corners < 0) {
      refuse_mesh(file,
                  at_line(number) + ": " + quoted(word) + " is no number of corners; export the mesh again");
    }
    if (corners < 3) {
      if (prescanned.short_faces++ == 0) prescanned.first_short_face = at_line(number);
      continue;
    }
    append_integer(prescanned.dialect, corners);
    for (std::int64_t c = 0; c < corners; ++c) {
      std::int64_t index = 0;
      word = take_word(line);
      if (!parse_integer(word, index)) {
        refuse_mesh(file, at_line(number) + ": a face announces " + std::to_string(corners) +
                              " corners but has " +
                              (word.empty() ? "only " + std::to_string(c) : quoted(word)) +
                              "; export the mesh again");
      }
      prescanned.dialect.push_back(' ');
      append_integer(prescanned.dialect, index >= 0 && index < count[0] ? index : count[0]);
    }
    prescanned.dialect.push_back('\n');
    ++prescanned.faces;
  }
  std::string face_count;
  append_integer(face_count, static_cast<std::int64_t>(prescanned.faces));
  prescanned.dialect.insert(face_count_at, face_count + " 0\n");
  return prescanned;
}

// ---- STL

namespace {

constexpr std::size_t kStlHeader = 84;  // 80 unused bytes and the number of facets
constexpr std::size_t kStlFacet = 50;   // normal, three corners, two unused bytes

void begin_stl(PrescannedFile& prescanned) {
  prescanned.openmesh_extension = "stl";
  prescanned.may_drop = true;
  prescanned.binary = true;
  prescanned.dialect.assign(kStlHeader, '\0');
}

// OpenMesh welds corners in a search tree. A NaN would break its order, so facets with unusable corners are
// not passed on.
void add_facet(PrescannedFile& prescanned, const std::array<glm::dvec3, 3>& corners,
               const std::string& place) {
  if (!std::all_of(corners.begin(), corners.end(), is_usable)) {
    if (prescanned.nonfinite_facets++ == 0) prescanned.first_nonfinite_facet = place;
    return;
  }
  for (int i = 0; i < 3; ++i) append_raw(prescanned.dialect, 0.0F);
  for (const glm::dvec3& corner : corners) {
    for (int i = 0; i < 3; ++i) append_raw(prescanned.dialect, static_cast<float>(corner[i]));
  }
  append_raw(prescanned.dialect, std::uint16_t{0});
  ++prescanned.faces;
}

void end_stl(PrescannedFile& prescanned) {
  const auto count = static_cast<std::uint32_t>(prescanned.faces);
  std::memcpy(prescanned.dialect.data() + kStlHeader - sizeof(count), &count, sizeof(count));
}

void prescan_stl_text(const std::filesystem::path& file, std::string_view bytes, PrescannedFile& prescanned) {
  TextCursor text(bytes);
  std::array<glm::dvec3, 3> corners{};
  std::size_t have = 0;
  bool open = false;  // inside a facet
  bool ended = false;
  while (!text.at_end()) {
    const std::size_t number = text.line();
    std::string_view line = text.next_line();
    const std::string_view word = take_word(line);
    ended = ended || word == "endsolid" || word == "ENDSOLID";
    if (word == "facet" || word == "FACET") {
      open = true;
      have = 0;
    } else if (word == "vertex" || word == "VERTEX") {
      if (!open || have == 3) {
        refuse_mesh(
            file, at_line(number) + ": a vertex that belongs to no facet, or is its fourth; export it again");
      }
      corners[have++] = take_coordinates(file, line, number);
    } else if (word == "endfacet" || word == "ENDFACET") {
      if (!open || have != 3) {
        refuse_mesh(file, at_line(number) + ": a facet ends with " + std::to_string(have) +
                              " vertices where three are needed; export the mesh again");
      }
      add_facet(prescanned, corners, at_line(number));
      open = false;
    }
  }
  if (open || !ended) {
    refuse_mesh(file, "ends without 'endsolid' after " + std::to_string(prescanned.faces) +
                          " facets; it is cut short: copy or export it again");
  }
}

void prescan_stl_binary(std::string_view bytes, std::uint64_t count, PrescannedFile& prescanned) {
  prescanned.trailing_bytes = bytes.size() - kStlHeader - count * kStlFacet;
  prescanned.dialect.reserve(kStlHeader + count * kStlFacet);
  for (std::uint64_t i = 0; i < count; ++i) {
    const char* facet = bytes.data() + kStlHeader + i * kStlFacet + 3 * sizeof(float);
    std::array<glm::dvec3, 3> corners{};
    for (std::size_t c = 0; c < 9; ++c) {
      float value = 0.0F;
      std::memcpy(&value, facet + c * sizeof(float), sizeof(float));
      corners[c / 3][static_cast<int>(c % 3)] = value;
    }
    add_facet(prescanned, corners, "facet " + std::to_string(i + 1));
  }
}

}  // namespace

PrescannedFile prescan_stl(const std::filesystem::path& file, std::span<char> raw) {
  const std::string_view bytes(raw.data(), raw.size());
  PrescannedFile prescanned;
  begin_stl(prescanned);
  std::uint32_t count = 0;
  if (bytes.size() >= kStlHeader)
    std::memcpy(&count, bytes.data() + kStlHeader - sizeof(count), sizeof(count));
  const std::uint64_t expected = kStlHeader + static_cast<std::uint64_t>(count) * kStlFacet;
  std::string_view first_line = without_byte_order_mark(bytes.substr(0, 256));
  const std::string_view first_word = take_word(first_line);
  const bool says_solid = first_word == "solid" || first_word == "SOLID";
  // Many binary files begin with 'solid' too, so the size decides first. If the size does not fit, the bytes
  // decide. The header or the number of facets of a binary file holds a byte of value 0. Text holds none.
  const bool has_zero = bytes.substr(0, kStlHeader).find('\0') != std::string_view::npos;
  if (says_solid && expected != bytes.size() && !has_zero) {
    prescan_stl_text(file, plain_text(file, raw), prescanned);
  } else if (bytes.size() < kStlHeader) {
    (void)plain_text(file, raw);  // refuses UTF-16
    refuse_mesh(file,
                "has " + std::to_string(bytes.size()) +
                    " bytes, fewer than the header of a binary STL (84), and does not begin with 'solid'; "
                    "it is cut short or another kind of file");
  } else if (expected > bytes.size()) {
    refuse_mesh(file, "announces " + std::to_string(count) + " facets, which need " +
                          std::to_string(expected) + " bytes, but has " + std::to_string(bytes.size()) +
                          "; it is cut short or damaged: copy or export it again");
  } else {
    prescan_stl_binary(bytes, count, prescanned);
  }
  end_stl(prescanned);
  return prescanned;
}

}  // namespace polygon
