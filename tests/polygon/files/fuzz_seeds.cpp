// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/polygon/files/fuzz_seeds.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <glm/common.hpp>
#include <sstream>
#include <string_view>

#include "polygon/mesh/mesh.h"
#include "polygon/surface/primitives.h"

namespace tests {
namespace {

using namespace polygon;

constexpr std::size_t kMaxInput = 48U << 10U;

void append(TriangleMesh& mesh, const TriangleMesh& other, const glm::dvec3& offset) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const glm::dvec3& v : other.vertices) mesh.vertices.push_back(v + offset);
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({base + a, base + b, base + c});
}

std::ostringstream text_stream() {
  std::ostringstream out;
  out.precision(9);
  return out;
}

std::string obj_of(const TriangleMesh& mesh) {
  std::ostringstream out = text_stream();
  out << "# small\no thing\n";
  for (const glm::dvec3& v : mesh.vertices) out << "v " << v.x << ' ' << v.y << ' ' << v.z << '\n';
  out << "vn 0 0 1\nvt 0 0\n";
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    if (i % 7 == 3) {
      out << "f " << a + 1 << "//1 " << b + 1 << "/1/1 \\\n -" << mesh.vertices.size() - c << "//1\n";
    } else {
      out << "f " << a + 1 << ' ' << b + 1 << ' ' << c + 1 << '\n';
    }
  }
  return out.str();
}

void faces_as_text(std::ostringstream& out, const TriangleMesh& mesh) {
  for (const glm::dvec3& v : mesh.vertices) out << v.x << ' ' << v.y << ' ' << v.z << '\n';
  for (const auto& [a, b, c] : mesh.triangles) out << "3 " << a << ' ' << b << ' ' << c << '\n';
}

std::string off_of(const TriangleMesh& mesh) {
  std::ostringstream out = text_stream();
  out << "OFF\n" << mesh.vertices.size() << ' ' << mesh.triangles.size() << " 0\n";
  faces_as_text(out, mesh);
  return out.str();
}

std::string ply_header(const TriangleMesh& mesh, const char* format, const char* real) {
  std::ostringstream out;
  out << "ply\nformat " << format << " 1.0\nelement vertex " << mesh.vertices.size() << "\nproperty " << real
      << " x\nproperty " << real << " y\nproperty " << real << " z\nelement face " << mesh.triangles.size()
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  return out.str();
}

std::string ply_text_of(const TriangleMesh& mesh) {
  std::ostringstream out = text_stream();
  out << ply_header(mesh, "ascii", "float");
  faces_as_text(out, mesh);
  return out.str();
}

template <typename T>
void append_value(std::string& bytes, T value, bool swapped) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  if (swapped) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

template <typename Real>
std::string ply_binary_of(const TriangleMesh& mesh, bool big_endian) {
  static_assert(std::endian::native == std::endian::little);
  std::string bytes = ply_header(mesh, big_endian ? "binary_big_endian" : "binary_little_endian",
                                 sizeof(Real) == 8 ? "double" : "float");
  for (const glm::dvec3& v : mesh.vertices) {
    for (int k = 0; k < 3; ++k) append_value(bytes, static_cast<Real>(v[k]), big_endian);
  }
  for (const TriangleIndices& t : mesh.triangles) {
    append_value(bytes, std::uint8_t{3}, big_endian);
    for (const std::uint32_t corner : t) append_value(bytes, corner, big_endian);
  }
  return bytes;
}

std::string stl_text_of(const TriangleMesh& mesh) {
  std::ostringstream out = text_stream();
  out << "solid s\n";
  for (const TriangleIndices& t : mesh.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (const std::uint32_t i : t) {
      const glm::dvec3& v = mesh.vertices[i];
      out << "vertex " << v.x << ' ' << v.y << ' ' << v.z << '\n';
    }
    out << "endloop\nendfacet\n";
  }
  out << "endsolid s\n";
  return out.str();
}

std::string stl_binary_of(const TriangleMesh& mesh) {
  std::string bytes(80, 'h');
  append_value(bytes, static_cast<std::uint32_t>(mesh.triangles.size()), false);
  for (const TriangleIndices& t : mesh.triangles) {
    bytes.append(12, '\0');
    for (const std::uint32_t corner : t) {
      for (int k = 0; k < 3; ++k) append_value(bytes, static_cast<float>(mesh.vertices[corner][k]), false);
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

std::vector<TriangleMesh> small_meshes() {
  std::vector<TriangleMesh> meshes{make_ball_mesh(0.03, 1), make_box_mesh({0.01, 0.02, 0.03}, 2),
                                   make_plane_mesh(0.05, 4)};
  TriangleMesh crossing = make_box_mesh(glm::dvec3(0.5), 1);
  append(crossing, make_box_mesh(glm::dvec3(0.5), 1), {0.3, 0.2, 0.1});
  meshes.push_back(crossing);
  TriangleMesh soup;  // separate triangles of a closed mesh: one missing, one repeated, one turned over
  const TriangleMesh ball = make_ball_mesh(1.0, 1);
  for (std::size_t i = 1; i < ball.triangles.size(); ++i) {
    const TriangleIndices& t = ball.triangles[i];
    for (int copy = 0; copy < (i == 7 ? 2 : 1); ++copy) {
      const auto base = static_cast<std::uint32_t>(soup.vertices.size());
      for (const std::uint32_t corner : t) soup.vertices.push_back(ball.vertices[corner]);
      if (i == 9) std::swap(soup.vertices[base], soup.vertices[base + 1]);
      soup.triangles.push_back({base, base + 1, base + 2});
    }
  }
  meshes.push_back(soup);
  return meshes;
}

class Mutator {
 public:
  explicit Mutator(std::mt19937_64& random) : random_(random) {}

  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>(random_() % std::max<std::size_t>(n, 1));
  }

  void one_change(std::string& bytes, const std::string& other) {
    if (bytes.empty()) return;
    // Half of the changes go to the first 200 bytes, where the headers are.
    const std::size_t at = below(below(2) == 0 ? std::min<std::size_t>(200, bytes.size()) : bytes.size());
    switch (below(16)) {
      case 0:
        bytes.resize(at);
        break;
      case 1:
        bytes[at] = static_cast<char>(random_());
        break;
      case 2:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random_() % 8)));
        break;
      case 3:
        bytes.erase(at, 1 + below(8));
        break;
      case 4:
        bytes.insert(at, std::string(1 + below(3), "0123456789-. \n/\\e\xff"[below(18)]));
        break;
      case 5:
        bytes.insert(at, bytes.substr(below(bytes.size()), below(60)));
        break;
      case 6:
        bytes.insert(at, other.substr(below(other.size()), below(200)));
        break;
      case 7:  // append the end of another file
        bytes.replace(at, std::string::npos, other.substr(std::min(at, other.size())));
        break;
      case 8:
      case 9:
        word(bytes, at);
        break;
      case 10:
      case 11:
        line(bytes);
        break;
      default:
        token(bytes, other);
    }
  }

 private:
  // Overwrites some bytes by a special binary value, or by bytes from elsewhere in the file.
  void word(std::string& bytes, std::size_t at) {
    static constexpr std::array<std::uint32_t, 12> kWords{0,           1,           3,           0x7fffffffU,
                                                          0x80000000U, 0xffffffffU, 0x7fc00000U, 0x7f800000U,
                                                          0xff800000U, 0x00000001U, 0x5368d4a5U, 0x7f7fffffU};
    if (bytes.size() < 16) return;
    at = std::min(at, bytes.size() - 12);
    if (below(2) == 0) {
      const std::uint32_t value = kWords[below(kWords.size())];
      std::memcpy(bytes.data() + at, &value, 4);
    } else {  // copies 1 to 12 bytes to another place
      static constexpr std::array<std::size_t, 4> kLengths{1, 4, 8, 12};
      const std::size_t length = kLengths[below(4)];
      const std::string copy = bytes.substr(below(bytes.size() - length), length);
      bytes.replace(at, length, copy);
    }
  }

  // Removes a line, repeats it, or puts it in place of another. Most lines are vertices or faces, and each
  // stays well-formed.
  void line(std::string& bytes) {
    const auto around = [&](std::size_t at) {
      const std::size_t before = bytes.rfind('\n', at == 0 ? 0 : at - 1);
      const std::size_t begin = before == std::string::npos ? 0 : before + 1;
      const std::size_t end = bytes.find('\n', at);
      return std::pair(std::min(begin, at), end == std::string::npos ? bytes.size() : end + 1);
    };
    const auto [begin, end] = around(below(bytes.size()));
    const std::string text = bytes.substr(begin, end - begin);
    switch (below(3)) {
      case 0:
        bytes.erase(begin, end - begin);
        break;
      case 1:
        bytes.insert(begin, text);
        break;
      default: {
        const auto [begin2, end2] = around(below(bytes.size()));
        bytes.replace(begin2, end2 - begin2, text);
      }
    }
  }

  // Replaces one number or word by another.
  void token(std::string& bytes, const std::string& other) {
    static constexpr std::array<std::string_view, 24> kTokens{
        "nan", "-inf",  "1e308",      "-1e12",      "1e13",       "1e-320",     "0",
        "-0",  "-1",    "1",          "2",          "3",          "4",          "7",
        "255", "65536", "2147483647", "2147483648", "4294967295", "4294967296", "99999999999999999999",
        "1e",  "0x10",  "f"};
    const auto around = [](const std::string& text, std::size_t at) {
      constexpr const char* kSpaces = " \n\t\r";
      const std::size_t begin = text.find_first_not_of(kSpaces, at);
      if (begin == std::string::npos) return std::pair(text.size(), text.size());
      const std::size_t end = text.find_first_of(kSpaces, begin);
      return std::pair(begin, end == std::string::npos ? text.size() : end);
    };
    const auto [begin, end] = around(bytes, below(bytes.size()));
    std::string text;
    switch (below(4)) {
      case 0:
        text = kTokens[below(kTokens.size())];
        break;
      case 1: {
        const auto [from, to] = around(other, below(other.size()));
        text = other.substr(from, to - from);
        break;
      }
      case 2: {
        const auto [from, to] = around(bytes, below(bytes.size()));
        text = bytes.substr(from, to - from);
        break;
      }
      default: {  // changes the last digit, which may open a crack
        text = bytes.substr(begin, end - begin);
        if (!text.empty() && text.back() >= '0' && text.back() <= '9')
          text.back() = static_cast<char>('0' + below(10));
      }
    }
    bytes.replace(begin, std::min<std::size_t>(end - begin, 4096), text);
  }

  std::mt19937_64& random_;
};

}  // namespace

std::vector<FuzzInput> fuzz_seeds() {
  std::vector<FuzzInput> seeds;
  for (const TriangleMesh& mesh : small_meshes()) {
    seeds.push_back({obj_of(mesh), ".obj"});
    seeds.push_back({off_of(mesh), ".off"});
    seeds.push_back({ply_text_of(mesh), ".ply"});
    seeds.push_back({ply_binary_of<double>(mesh, false), ".ply"});
    seeds.push_back({ply_binary_of<float>(mesh, true), ".PLY"});
    seeds.push_back({stl_text_of(mesh), ".stl"});
    seeds.push_back({stl_binary_of(mesh), ".STL"});
    seeds.push_back({obj_of(mesh), ".obj", true});
    seeds.push_back({stl_binary_of(mesh), ".stl", true});
  }
  return seeds;
}

FuzzInput mutated(FuzzInput input, const FuzzInput& other, std::mt19937_64& random) {
  Mutator mutator(random);
  const std::size_t changes = 1 + mutator.below(mutator.below(4) == 0 ? 16 : 4);
  for (std::size_t i = 0; i < changes; ++i) mutator.one_change(input.bytes, other.bytes);
  if (input.bytes.size() > kMaxInput) input.bytes.resize(kMaxInput);
  if (input.bytes.empty()) input.bytes = "\n";
  return input;
}

std::string packed_bytes(const std::string& bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, 1, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) return {};
  std::string packed(deflateBound(&stream, static_cast<uLong>(bytes.size())) + 64, '\0');
  std::string copy = bytes;  // zlib takes its input as non-const
  stream.next_in = reinterpret_cast<Bytef*>(copy.data());
  stream.avail_in = static_cast<uInt>(copy.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

}  // namespace tests
