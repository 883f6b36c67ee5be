// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/files/write_mesh.h"

#include <unistd.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <system_error>

#include "polygon/files/mesh_file.h"
#include "polygon/files/prescan.h"

namespace polygon {
namespace {

constexpr double kPerMeter = 1e3;  // millimeters

// Collects small pieces, so that the sink is called rarely.
class Pieces {
 public:
  explicit Pieces(const ByteSink& sink) : sink_(sink) {}
  [[nodiscard]] std::string& bytes() { return bytes_; }
  void pass_on_when_many() {
    constexpr std::size_t kMany = std::size_t{1} << 16U;  // bytes
    if (bytes_.size() >= kMany) pass_on();
  }
  void pass_on() {
    sink_(bytes_);
    bytes_.clear();
  }

 private:
  const ByteSink& sink_;
  std::string bytes_;
};

// The shortest digits that read back as the same number, whatever the locale.
template <typename Number>
void append_digits(std::string& text, Number number) {
  std::array<char, 32> digits{};
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
}

}  // namespace

void write_ply(const TriangleMesh& mesh, const ByteSink& sink) {
  Pieces out(sink);
  // Writes doubles; OpenMesh would write floats.
  out.bytes() = "ply\nformat binary_little_endian 1.0\ncomment coordinates in meters\nelement vertex " +
                std::to_string(mesh.vertices.size()) +
                "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
                std::to_string(mesh.triangles.size()) +
                "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const glm::dvec3& v : mesh.vertices) {
    for (int i = 0; i < 3; ++i) append_raw(out.bytes(), v[i]);
    out.pass_on_when_many();
  }
  for (const TriangleIndices& t : mesh.triangles) {
    append_raw(out.bytes(), std::uint8_t{3});
    for (const std::uint32_t corner : t) append_raw(out.bytes(), corner);
    out.pass_on_when_many();
  }
  out.pass_on();
}

void write_stl_in_mm(const TriangleMesh& mesh, const ByteSink& sink) {
  constexpr std::size_t kHeaderBytes = 80;  // of the STL format; their content is free
  if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max())
    throw std::length_error("STL cannot count " + std::to_string(mesh.triangles.size()) +
                            " triangles; write PLY");
  Pieces out(sink);
  out.bytes() =
      "binary STL, coordinates in millimeters";  // must not begin with "solid", which marks a text STL
  out.bytes().resize(kHeaderBytes, ' ');
  append_raw(out.bytes(), static_cast<std::uint32_t>(mesh.triangles.size()));
  const auto append = [&out](const glm::dvec3& v) {
    for (int i = 0; i < 3; ++i) append_raw(out.bytes(), static_cast<float>(v[i]));
  };
  for (const TriangleIndices& t : mesh.triangles) {
    const glm::dvec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    const glm::dvec3 across = glm::cross(b - a, c - a);
    const double twice_area = glm::length(across);
    append(twice_area > 0.0 ? across / twice_area : glm::dvec3(0.0));
    for (const glm::dvec3* corner : {&a, &b, &c}) append(*corner * kPerMeter);
    append_raw(out.bytes(), std::uint16_t{0});
    out.pass_on_when_many();
  }
  out.pass_on();
}

void write_obj_in_mm(const TriangleMesh& mesh, const ByteSink& sink) {
  Pieces out(sink);
  out.bytes() = "# coordinates in millimeters\n";
  for (const glm::dvec3& v : mesh.vertices) {
    out.bytes() += 'v';
    for (int i = 0; i < 3; ++i) {
      out.bytes() += ' ';
      append_digits(out.bytes(), v[i] * kPerMeter);
    }
    out.bytes() += '\n';
    out.pass_on_when_many();
  }
  for (const TriangleIndices& t : mesh.triangles) {
    out.bytes() += 'f';
    for (const std::uint32_t corner : t) {
      out.bytes() += ' ';
      append_digits(out.bytes(), std::uint64_t{corner} + 1);  // OBJ counts from 1
    }
    out.bytes() += '\n';
    out.pass_on_when_many();
  }
  out.pass_on();
}

void save_ply(const std::filesystem::path& file, const TriangleMesh& mesh) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  const bool beside =
      !fs::exists(status) || fs::is_regular_file(status);  // a device file is written directly
  const fs::path to = beside ? fs::path(file.string() + ".part" + std::to_string(getpid())) : file;
  std::ofstream out(to, std::ios::binary);
  if (!out)
    throw MeshError(file.string() +
                    ": cannot be written; check that the folder exists and that you may write there");
  write_ply(mesh, [&out](std::string_view bytes) {
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  });
  out.close();
  if (out && beside) fs::rename(to, file, error);
  if (out && !error) return;
  if (beside) fs::remove(to, error);
  throw MeshError(file.string() + ": could not be written to the end; check the space on the disk");
}

}  // namespace polygon
