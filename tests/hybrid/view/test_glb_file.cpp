// SPDX-License-Identifier: GPL-3.0-or-later
// Binary glTF, read by a parser that follows the specification (glTF 2.0, Khronos Group) and shares no code
// with the writer.
#include "hybrid/view/glb_file.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <iterator>
#include <nlohmann/json.hpp>

#include "hybrid/view/palette.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/hybrid/view/picture_fixture.h"

namespace {

using nlohmann::json;

struct GlbMesh {
  std::string name;
  json material;
  std::vector<glm::dvec3> points{}, normals{}, colours{};  // as stored; colours may be empty
  std::vector<std::uint32_t> indices{};
  glm::dvec3 shift{0.0};  // translation of the mesh's node
};
struct GlbScene {
  json gltf;
  glm::dquat turn{1.0, 0.0, 0.0, 0.0};  // rotation of the top node
  std::vector<GlbMesh> meshes{};
};

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  EXPECT_LE(at + 4, bytes.size());
  if (at + 4 <= bytes.size()) std::memcpy(&value, &bytes[at], 4);
  return value;
}

// An array of one accessor, as rows of numbers. Checks the conditions of section 3.6.
template <typename Number>
std::vector<std::vector<Number>> read_array(const json& gltf, const std::string& binary, std::size_t number,
                                            const std::string& type, int component, int target) {
  const json& accessor = gltf.at("accessors").at(number);
  const json& view = gltf.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
  EXPECT_EQ(accessor.at("type"), type);
  EXPECT_EQ(accessor.at("componentType"), component);
  EXPECT_EQ(view.at("target"), target);
  EXPECT_EQ(view.at("buffer"), 0);
  const std::size_t offset = view.at("byteOffset"), length = view.at("byteLength"),
                    count = accessor.at("count");
  const std::size_t width = type == "SCALAR" ? 1 : 3;
  EXPECT_EQ(offset % 4, 0U);
  EXPECT_EQ(length, count * width * sizeof(Number));
  EXPECT_GE(count, 1U);
  std::vector<std::vector<Number>> rows(count, std::vector<Number>(width));
  if (offset + length > binary.size()) {
    ADD_FAILURE() << "a view ends at " << offset + length << " of " << binary.size() << " bytes";
    return rows;
  }
  for (std::size_t r = 0; r < count; ++r)
    std::memcpy(rows[r].data(), &binary[offset + r * width * sizeof(Number)], width * sizeof(Number));
  return rows;
}

std::vector<glm::dvec3> read_vectors(const json& gltf, const std::string& binary, std::size_t number) {
  std::vector<glm::dvec3> out;
  for (const auto& row : read_array<float>(gltf, binary, number, "VEC3", 5126, 34962))
    out.emplace_back(row[0], row[1], row[2]);
  return out;
}

// An accessor of positions must state the bounds of its values.
void expect_bounds(const json& accessor, const std::vector<glm::dvec3>& points) {
  for (int a = 0; a < 3; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    const auto [low, high] =
        std::minmax_element(points.begin(), points.end(), [a](auto& p, auto& q) { return p[a] < q[a]; });
    EXPECT_EQ(accessor.at("min").at(axis).get<float>(), static_cast<float>((*low)[a]));
    EXPECT_EQ(accessor.at("max").at(axis).get<float>(), static_cast<float>((*high)[a]));
  }
}

GlbMesh read_mesh(const json& gltf, const std::string& binary, const json& node) {
  const json& mesh = gltf.at("meshes").at(node.at("mesh").get<std::size_t>());
  EXPECT_EQ(mesh.at("primitives").size(), 1U);
  const json& part = mesh.at("primitives").at(0);
  const json& attributes = part.at("attributes");
  GlbMesh out{.name = node.at("name"),
              .material = gltf.at("materials").at(part.at("material").get<std::size_t>())};
  EXPECT_EQ(part.value("mode", 4), 4);  // triangles
  out.points = read_vectors(gltf, binary, attributes.at("POSITION"));
  out.normals = read_vectors(gltf, binary, attributes.at("NORMAL"));
  if (attributes.contains("COLOR_0")) out.colours = read_vectors(gltf, binary, attributes.at("COLOR_0"));
  for (const auto& row : read_array<std::uint32_t>(gltf, binary, part.at("indices"), "SCALAR", 5125, 34963))
    out.indices.push_back(row[0]);
  expect_bounds(gltf.at("accessors").at(attributes.at("POSITION").get<std::size_t>()), out.points);
  EXPECT_EQ(out.normals.size(), out.points.size());
  EXPECT_EQ(out.indices.size() % 3, 0U);
  for (const std::uint32_t i : out.indices) EXPECT_LT(i, out.points.size());
  for (const glm::dvec3& n : out.normals) EXPECT_NEAR(glm::length(n), 1.0, 1e-5);
  const auto shift = node.at("translation").get<std::vector<double>>();
  out.shift = {shift.at(0), shift.at(1), shift.at(2)};
  return out;
}

// Reads the container (section 4.4), then the nodes of the scene.
GlbScene read_glb(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(bytes, 4), 2U);
  EXPECT_EQ(word(bytes, 8), bytes.size());
  const std::size_t text = word(bytes, 12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(text % 4, 0U);
  const std::size_t binary = word(bytes, 20 + text);
  EXPECT_EQ(bytes.substr(24 + text, 4), std::string("BIN\0", 4));
  EXPECT_EQ(binary % 4, 0U);
  EXPECT_EQ(28 + text + binary, bytes.size());
  GlbScene out{.gltf = json::parse(bytes.substr(20, text))};
  const json& gltf = out.gltf;
  EXPECT_EQ(gltf.at("asset").at("version"), "2.0");
  EXPECT_EQ(gltf.at("buffers").size(), 1U);
  EXPECT_EQ(gltf.at("buffers").at(0).at("byteLength"), binary);
  const json& top = gltf.at("nodes").at(gltf.at("scenes").at(0).at("nodes").at(0).get<std::size_t>());
  const auto turn = top.at("rotation").get<std::vector<double>>();  // x, y, z, w
  out.turn = glm::dquat(turn.at(3), turn.at(0), turn.at(1), turn.at(2));
  EXPECT_NEAR(glm::length(out.turn), 1.0, 1e-12);
  for (const json& child : top.at("children"))
    out.meshes.push_back(
        read_mesh(gltf, bytes.substr(28 + text), gltf.at("nodes").at(child.get<std::size_t>())));
  return out;
}

// A shell that has turned, and a ball of two materials that is pressed.
tests::Session session() {
  tests::Session s = tests::shell_and_ball({0.3, -0.2, 0.1});
  s.now.rigid_place = {
      {true, {0.3, -0.2, 0.1}, {0.01, 0.02, 0.0}, glm::angleAxis(0.7, glm::dvec3(0.6, 0.8, 0.0))}};
  hybrid::DrawnObject& ball = s.scene.objects[1];
  ball.materials = {"liver", "gel"};
  for (const glm::dvec3& v : ball.surface.vertices) ball.vertex_material.push_back(v.z > 0.1 ? 1 : 0);
  return s;
}

class GlbFile : public tests::SceneFile {
 protected:
  GlbScene save(const tests::Session& s) {
    hybrid::save_glb(folder_ / "s.glb", s.scene, s.now);
    return read_glb(folder_ / "s.glb");
  }
};

float to_linear(float srgb) {
  return srgb <= 0.04045F ? srgb / 12.92F : std::pow((srgb + 0.055F) / 1.055F, 2.4F);
}

TEST_F(GlbFile, EveryTriangleLiesWhereItIsInTheSceneInMeters) {
  const tests::Session s = session();
  const GlbScene read = save(s);
  EXPECT_EQ(read.gltf.at("asset").at("extras").at("unit"), "meter");
  ASSERT_EQ(read.meshes.size(), 2U);
  for (std::size_t o = 0; o < 2; ++o) {
    const hybrid::DrawnObject& object = s.scene.objects[o];
    const GlbMesh& mesh = read.meshes[o];
    EXPECT_EQ(mesh.name, object.name);
    ASSERT_EQ(mesh.indices.size(), 3 * object.surface.triangles.size());
    double off = 0.0;
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
      const std::uint32_t vertex = object.surface.triangles[i / 3][i % 3];
      glm::dvec3 expected = s.now.place_of(o)(object.surface.vertices[vertex]);
      if (o == 1) expected += glm::dvec3(s.now.soft_moved_m[1][vertex]);
      off = std::max(off, glm::distance(mesh.points[mesh.indices[i]] + mesh.shift, expected));
    }
    EXPECT_LT(off,
              0.16 * std::pow(2.0, -24));  // half a unit in the last place of a float as large as the object
  }
}

TEST_F(GlbFile, TheScenesUpIsThatOfGltf) {
  const GlbScene read = save(session());
  EXPECT_LT(glm::distance(read.turn * glm::dvec3(0, 0, 1), glm::dvec3(0, 1, 0)), 1e-12);
  EXPECT_LT(glm::distance(read.turn * glm::dvec3(1, 0, 0), glm::dvec3(1, 0, 0)), 1e-12);
}

TEST_F(GlbFile, NormalsPointToTheSideOfTheirTriangle) {
  const GlbScene read = save(session());
  for (const GlbMesh& mesh : read.meshes) {
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const glm::dvec3 &a = mesh.points[mesh.indices[i]], &b = mesh.points[mesh.indices[i + 1]],
                       &c = mesh.points[mesh.indices[i + 2]];
      const glm::dvec3 across = glm::cross(b - a, c - a);
      if (glm::length(across) < 1e-9) continue;  // at the poles of the balls, two corners coincide
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_GT(glm::dot(glm::normalize(across), mesh.normals[mesh.indices[i + k]]), 0.5);
    }
  }
}

TEST_F(GlbFile, ColoursAreThoseOfPicturesInLinearLight) {
  const tests::Session s = session();
  const GlbScene read = save(s);
  const glm::vec3 shell = hybrid::palette::of_object(s.scene, 0);
  const json& factor = read.meshes[0].material.at("pbrMetallicRoughness").at("baseColorFactor");
  for (int a = 0; a < 3; ++a)
    EXPECT_NEAR(factor.at(static_cast<std::size_t>(a)).get<float>(), to_linear(shell[a]), 1e-6);
  EXPECT_TRUE(read.meshes[0].colours.empty());
  const std::vector<glm::vec3> materials = hybrid::palette::of_materials(s.scene, 1);
  const GlbMesh& ball = read.meshes[1];
  ASSERT_EQ(ball.colours.size(), ball.points.size());
  for (std::size_t v = 0; v < ball.points.size(); ++v) {
    const glm::vec3& srgb = materials[s.scene.objects[1].vertex_material[v]];
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(ball.colours[v][a], to_linear(srgb[a]), 0.01);  // 8 bits of sRGB
  }
}

TEST_F(GlbFile, NamesAreEscapedAndEmptyObjectsLeftOut) {
  tests::Session s = session();
  s.scene.title = "\"quoted\"\n\\ \xC3\xA9";
  s.scene.objects[0].name = "a \"b\"\t\xFF";  // the last byte is not UTF-8
  s.scene.objects[1].surface.triangles.clear();
  const GlbScene read = save(s);
  ASSERT_EQ(read.meshes.size(), 1U);
  EXPECT_EQ(read.meshes[0].name, "a \"b\"\t\xEF\xBF\xBD");
  s.scene.objects[0].surface.triangles.clear();
  EXPECT_THROW(save(s), std::runtime_error);
}

}  // namespace
