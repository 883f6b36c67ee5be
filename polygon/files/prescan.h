// SPDX-License-Identifier: GPL-3.0-or-later
// Prescan: validates a mesh file before OpenMesh reads it. OpenMesh's readers trust a file. They take memory
// for announced counts, read lists past the file's end, shift all later indices after an unreadable number,
// and round coordinates to floats. They also misread whole dialects silently: double or 16-bit PLY
// properties, unknown lists, comments in OFF, '\' in OBJ. The prescan walks the file once, rewrites it into
// the one dialect of its format that OpenMesh reads correctly, and keeps the coordinates as doubles, in the
// order of the vertices.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace polygon {

enum class MeshFormat : std::uint8_t { obj, ply, stl, off };

struct PrescannedFile {
  std::string dialect;                  // the rewritten file, for OpenMesh
  const char* openmesh_extension = "";  // selects OpenMesh's reader
  bool binary = false;                  // the STL is binary; OpenMesh's reader does not find out
  // One per vertex, in file units. Empty for STL, whose vertices come from OpenMesh as floats.
  std::vector<glm::dvec3> coordinates;
  std::size_t faces = 0;  // number of faces that OpenMesh must find
  // True: OpenMesh may find fewer faces. Its STL reader drops facets with repeated corners.
  bool may_drop = false;
  std::size_t short_faces = 0;        // faces left out: fewer than three corners
  std::string first_short_face;       // place of the first one
  std::size_t nonfinite_facets = 0;   // STL facets left out: a corner is not usable
  std::string first_nonfinite_facet;  // place of the first one
  std::size_t trailing_bytes = 0;     // bytes after the end of a binary file
};

// Prescans one format each. Throws MeshError for a malformed or truncated file, with the line or byte. In a
// text file the line ends are made uniform, in `bytes` itself.
PrescannedFile prescan_obj(const std::filesystem::path& file, std::span<char> bytes);
PrescannedFile prescan_ply(const std::filesystem::path& file, std::span<char> bytes);
PrescannedFile prescan_stl(const std::filesystem::path& file, std::span<char> bytes);
PrescannedFile prescan_off(const std::filesystem::path& file, std::span<char> bytes);

// ---- shared by the formats

[[noreturn]] void refuse_mesh(const std::filesystem::path& file, const std::string& what_and_remedy);

// The text without the byte-order mark of UTF-8 at its start.
[[nodiscard]] std::string_view without_byte_order_mark(std::string_view text);
// The bytes as a text without the byte-order mark. A line end "\r" alone is replaced by "\n" in `bytes`, so
// lines keep their numbers. Refuses UTF-16.
[[nodiscard]] std::string_view plain_text(const std::filesystem::path& file, std::span<char> bytes);
// Replaces each line end "\r" alone by "\n", in place.
void mend_line_ends(std::span<char> text);

// Writes the dialect as a binary PLY. OpenMesh reads its faces, and only counts its vertices: each vertex is
// one byte. `faces` holds, for each face, the number of corners and then their indices, as 32-bit integers.
void write_ply_dialect(PrescannedFile& prescanned, const std::string& faces);

// The words of a text, separated by white space, and the line on which they stand.
class TextCursor {
 public:
  explicit TextCursor(std::string_view text, std::size_t first_line = 1) : rest_(text), line_(first_line) {}
  [[nodiscard]] bool at_end() const { return rest_.empty(); }
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::size_t remaining() const { return rest_.size(); }
  std::string_view next_line();  // without the line end, "\r\n" included
  std::string_view next_word();  // empty at the end of the text

 private:
  std::string_view rest_;
  std::size_t line_;
};

// Removes and returns the first word of `line`; empty if there is none.
std::string_view take_word(std::string_view& line);
// The whole word must be a number. A magnitude too large for a double becomes infinite. A magnitude too small
// for a double becomes 0. "nan" and "inf" are numbers.
[[nodiscard]] bool parse_number(std::string_view word, double& value);
[[nodiscard]] bool parse_integer(std::string_view word, std::int64_t& value);

void append_integer(std::string& text, std::int64_t value);
template <typename Scalar>
void append_raw(std::string& bytes, Scalar value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace polygon
