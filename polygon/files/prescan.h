// SPDX-License-Identifier: GPL-3.0-or-later
// What stands before OpenMesh's readers. They trust a file: counts are believed before memory is taken, lists
// are read without looking for the file's end, a number that cannot be read shifts all later indices,
// coordinates become floats, and whole dialects (double or 16-bit PLY properties, unknown lists, comments in
// OFF, '\' in OBJ) are read wrongly without a word. So each file is walked once here. What is walked is
// rewritten into the one dialect of its format that OpenMesh reads faultlessly, and coordinates are kept as
// doubles beside it, in order of the vertices.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace polygon {

enum class MeshFormat : std::uint8_t { obj, ply, stl, off };

struct ScreenedFile {
  std::string dialect;                  // for OpenMesh
  const char* openmesh_extension = "";  // which of its readers
  bool binary = false;                  // for its STL reader, which has to be told
  std::vector<glm::dvec3> coordinates;  // (file units) one a vertex; empty for STL, which holds floats
  std::size_t faces = 0;                // that OpenMesh is to find
  bool may_drop = false;                // its OBJ and STL readers leave out faces whose corners repeat
  std::size_t short_faces = 0;          // left out: fewer than three corners
  std::string first_short_face;         // where
  std::size_t nonfinite_facets = 0;     // STL, left out: a corner is not usable
  std::string first_nonfinite_facet;    // where
  std::size_t trailing_bytes = 0;       // after the end of a binary file
};

// Largest coordinate that is taken as one (file units, and meters after scaling): squares of it stay far from
// overflow, and it still is a float for OpenMesh.
inline constexpr double kLargestCoordinate = 1e12;
[[nodiscard]] bool is_usable(const glm::dvec3& coordinates);

// Throw MeshError: malformed or truncated, with the line or byte where.
ScreenedFile screen_obj(const std::filesystem::path& file, std::string_view bytes);
ScreenedFile screen_ply(const std::filesystem::path& file, std::string_view bytes);
ScreenedFile screen_stl(const std::filesystem::path& file, std::string_view bytes);
ScreenedFile screen_off(const std::filesystem::path& file, std::string_view bytes);

// ---- shared by the screens
// ---------------------------------------------------------------------------------------

[[noreturn]] void refuse_mesh(const std::filesystem::path& file, const std::string& what_and_remedy);

// Words of a text, with the line they stand on. Any white space separates.
class TextCursor {
 public:
  explicit TextCursor(std::string_view text, std::size_t first_line = 1) : rest_(text), line_(first_line) {}
  [[nodiscard]] bool at_end() const { return rest_.empty(); }
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::size_t remaining() const { return rest_.size(); }
  std::string_view next_line();  // without its end; "\r\n" too
  std::string_view next_word();  // empty at the end

 private:
  std::string_view rest_;
  std::size_t line_;
};

// The first word of `line`, which is removed from it; empty when there is none.
std::string_view take_word(std::string_view& line);
// Whole word a number. A magnitude too large for a double is infinite, one too small is 0; "nan" and "inf"
// are numbers.
[[nodiscard]] bool parse_number(std::string_view word, double& value);
[[nodiscard]] bool parse_integer(std::string_view word, std::int64_t& value);

void append_integer(std::string& text, std::int64_t value);
template <typename Scalar>
void append_raw(std::string& bytes, Scalar value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace polygon
