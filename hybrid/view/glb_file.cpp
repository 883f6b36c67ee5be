// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers and layout: glTF 2.0 specification (Khronos Group), sections 3.6 (buffers, accessors), 3.9.2
// (materials) and 4.4 (GLB file format).
#include "hybrid/view/glb_file.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "hybrid/base/whole_file.h"
#include "hybrid/view/gl/unit_shapes.h"
#include "hybrid/view/palette.h"

namespace hybrid {
namespace {

using Json = nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little,
              "glTF is little-endian, and numbers are written as they lie");
static_assert(sizeof(glm::vec3) == 3 * sizeof(float), "written as it lies");

constexpr int kFloat = 5126, kUnsignedInt = 5125;   // componentType
constexpr int kVertices = 34962, kIndices = 34963;  // target of a bufferView
constexpr std::uint32_t kGlb = 0x46546C67, kJson = 0x4E4F534A, kBinary = 0x004E4942;  // magic words of 4.4

// Colours of glTF are linear, those of the palette sRGB (IEC 61966-2-1).
float linear(float srgb) {
  return srgb <= 0.04045F ? srgb / 12.92F : std::pow((srgb + 0.055F) / 1.055F, 2.4F);
}

Json as_json(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}

// The binary chunk, and its description in JSON.
class GlbBuffer {
 public:
  // Appends an array and returns the number of its accessor.
  template <typename Value>
  std::size_t add(const std::vector<Value>& values, const char* type, int component, int target) {
    const std::size_t bytes =
        values.size() * sizeof(Value);  // a multiple of 4, so that all arrays are aligned
    views_.push_back(
        {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes}, {"target", target}});
    bytes_.append(reinterpret_cast<const char*>(values.data()), bytes);
    accessors_.push_back({{"bufferView", views_.size() - 1},
                          {"componentType", component},
                          {"count", values.size()},
                          {"type", type}});
    return accessors_.size() - 1;
  }
  // glTF requires the bounds of positions.
  std::size_t add_positions(const std::vector<glm::vec3>& positions) {
    const std::size_t accessor = add(positions, "VEC3", kFloat, kVertices);
    glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    for (const glm::vec3& p : positions) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    accessors_[accessor]["min"] = {low.x, low.y, low.z};
    accessors_[accessor]["max"] = {high.x, high.y, high.z};
    return accessor;
  }
  void describe_in(Json& gltf) const {
    gltf["buffers"] = Json::array({Json::object({{"byteLength", bytes_.size()}})});
    gltf["bufferViews"] = views_;
    gltf["accessors"] = accessors_;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  Json views_ = Json::array(), accessors_ = Json::array();
};

// The surface at its place in the snapshot.
polygon::TriangleMesh surface_now(const DrawnScene& scene, const Snapshot& now, std::size_t object) {
  polygon::TriangleMesh mesh = scene.objects[object].surface;
  const RigidPlace place = now.place_of(object);
  for (glm::dvec3& v : mesh.vertices) v = place(v);
  if (object >= now.soft_moved_m.size() || now.soft_moved_m[object].size() != mesh.vertices.size())
    return mesh;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.vertices[v] += glm::dvec3(now.soft_moved_m[object][v]);
  return mesh;
}

// Positions are floats relative to the middle of the object, as in pictures.
glm::dvec3 middle_of(const polygon::TriangleMesh& mesh) {
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const glm::dvec3& v : mesh.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  return 0.5 * (low + high);
}

// Adds the mesh, its arrays and its node; returns the number of the node.
std::size_t add_glb_object(Json& gltf, GlbBuffer& buffer, const std::string& name, const DrawMesh& draw,
                           const glm::dvec3& middle_m, const std::vector<VertexColour>& colours) {
  std::vector<glm::vec3> positions, normals, linear_colours;
  for (const DrawVertex& v : draw.vertices) {
    positions.push_back(v.position);
    // A vertex of degenerate triangles alone has no normal, and glTF wants a unit vector.
    normals.push_back(glm::length(v.normal) > 0.5F ? v.normal : glm::vec3(0.0F, 0.0F, 1.0F));
  }
  Json attributes{{"POSITION", buffer.add_positions(positions)},
                  {"NORMAL", buffer.add(normals, "VEC3", kFloat, kVertices)}};
  if (colours.size() == draw.vertices.size()) {
    for (const VertexColour& c : colours)
      linear_colours.emplace_back(linear(c[0] / 255.0F), linear(c[1] / 255.0F), linear(c[2] / 255.0F));
    attributes["COLOR_0"] = buffer.add(linear_colours, "VEC3", kFloat, kVertices);
  }
  const std::size_t indices = buffer.add(draw.indices, "SCALAR", kUnsignedInt, kIndices);
  const Json triangles = {
      {"attributes", attributes}, {"indices", indices}, {"material", gltf["materials"].size() - 1}};
  gltf["meshes"].push_back({{"name", name}, {"primitives", Json::array({triangles})}});
  gltf["nodes"].push_back(
      {{"name", name}, {"mesh", gltf["meshes"].size() - 1}, {"translation", as_json(middle_m)}});
  return gltf["nodes"].size() - 1;
}

// A rough surface that is no metal. Where the vertices have colours, the material is white.
void add_material(Json& gltf, const std::string& name, const glm::vec3& srgb) {
  constexpr double kRough = 0.6;  // soft highlights, as in pictures
  gltf["materials"].push_back({{"name", name},
                               {"pbrMetallicRoughness",
                                {{"baseColorFactor", {linear(srgb.x), linear(srgb.y), linear(srgb.z), 1.0}},
                                 {"metallicFactor", 0.0},
                                 {"roughnessFactor", kRough}}},
                               {"doubleSided", true}});
}

void add_objects(Json& gltf, GlbBuffer& buffer, const DrawnScene& scene, const Snapshot& now) {
  Json children = Json::array();
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const DrawnObject& object = scene.objects[o];
    const polygon::TriangleMesh mesh = surface_now(scene, now, o);
    const glm::dvec3 middle_m = middle_of(mesh);
    const DrawMesh draw = object.soft ? make_moving_mesh(mesh, middle_m) : make_draw_mesh(mesh, middle_m);
    if (draw.indices.empty()) continue;  // glTF has no empty arrays
    const std::vector<VertexColour> colours = palette::of_vertices(scene, o);
    add_material(gltf, object.name, colours.empty() ? palette::of_object(scene, o) : glm::vec3(1.0F));
    children.push_back(add_glb_object(gltf, buffer, object.name, draw, middle_m, colours));
  }
  // A turn by -90 degrees about x: the scene's z becomes y.
  gltf["nodes"].push_back({{"name", scene.title},
                           {"rotation", {-0.5 * std::numbers::sqrt2, 0.0, 0.0, 0.5 * std::numbers::sqrt2}},
                           {"children", children}});
}

void append_word(std::string& bytes, std::size_t word) {
  const auto value = static_cast<std::uint32_t>(word);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

void save_glb(const std::filesystem::path& file, const DrawnScene& scene, const Snapshot& now) {
  Json gltf{
      {"asset",
       {{"version", "2.0"},
        {"generator", "hybrid"},
        {"extras", {{"unit", "meter"}, {"frame", "within the uppermost node that of the scene, z up"}}}}},
      {"scene", 0}};
  GlbBuffer buffer;
  add_objects(gltf, buffer, scene, now);
  if (buffer.bytes().empty())
    throw std::runtime_error(file.string() + ": not written, because the scene has no surface left");
  gltf["scenes"] = Json::array({Json::object({{"nodes", Json::array({gltf["nodes"].size() - 1})}})});
  buffer.describe_in(gltf);
  std::string text = gltf.dump(-1, ' ', false, Json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t total = 12 + 8 + text.size() + 8 + buffer.bytes().size();
  if (total > std::numeric_limits<std::uint32_t>::max())
    throw std::runtime_error(file.string() + ": glTF holds 4 GB at most; write PLY");
  std::string head;
  for (const std::size_t word : {std::size_t{kGlb}, std::size_t{2}, total, text.size(), std::size_t{kJson}})
    append_word(head, word);
  text = head + text;
  append_word(text, buffer.bytes().size());
  append_word(text, kBinary);
  WholeFile out(file);
  out.write(text);
  out.write(buffer.bytes());
  out.keep();
}

}  // namespace hybrid
