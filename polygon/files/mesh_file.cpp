// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/files/mesh_file.h"

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <istream>
#include <mutex>
#include <new>
#include <span>
#include <streambuf>

#include "polygon/files/file_bytes.h"
#include "polygon/files/prescan.h"
#include "polygon/mesh/mesh_bounds.h"
#include "polygon/repair/cut_polygon.h"

namespace polygon {
namespace {

namespace io = OpenMesh::IO;

// Collects the points and faces that OpenMesh reads, as a soup. OpenMesh's own meshes would lose non-manifold
// faces. Everything else in a file is ignored.
class SoupImporter final : public io::BaseImporter {
 public:
  // `keeps_points` = false: points are only counted, because the prescan keeps them as doubles.
  SoupImporter(bool keeps_points, std::size_t faces) : keeps_points_(keeps_points) {
    corners.reserve(3 * faces);
    face_begin.reserve(faces + 1);
  }
  std::vector<glm::dvec3> points;
  std::vector<std::uint32_t> corners;        // of all faces, concatenated
  std::vector<std::uint32_t> face_begin{0};  // [face] start of its corners; the last entry is the end of all

  using VH = OpenMesh::VertexHandle;
  using HH = OpenMesh::HalfedgeHandle;
  using EH = OpenMesh::EdgeHandle;
  using FH = OpenMesh::FaceHandle;

  VH add_vertex(const OpenMesh::Vec3f& p) override { return add_vertex(OpenMesh::Vec3d(p[0], p[1], p[2])); }
  VH add_vertex(const OpenMesh::Vec3d& p) override {
    if (keeps_points_) points.emplace_back(p[0], p[1], p[2]);
    return VH(static_cast<int>(vertices_++));
  }
  VH add_vertex() override { return add_vertex(OpenMesh::Vec3f(0.0F, 0.0F, 0.0F)); }
  FH add_face(const VHandles& indices) override {
    for (const VH& v : indices)
      corners.push_back(static_cast<std::uint32_t>(v.idx()));  // as an unsigned index, -1 is out of any range
    face_begin.push_back(static_cast<std::uint32_t>(corners.size()));
    return FH(static_cast<int>(face_begin.size()) - 2);
  }
  void set_point(VH v, const OpenMesh::Vec3f& p) override {
    if (keeps_points_) points.at(static_cast<std::size_t>(v.idx())) = {p[0], p[1], p[2]};
  }

  [[nodiscard]] size_t n_vertices() const override { return vertices_; }
  [[nodiscard]] size_t n_faces() const override { return face_begin.size() - 1; }
  [[nodiscard]] size_t n_edges() const override { return 0; }

  HH add_edge(VH, VH) override { return HH(); }
  FH add_face(HH) override { return FH(); }
  void add_face_texcoords(FH, VH, const std::vector<OpenMesh::Vec2f>&) override {}
  void add_face_texcoords(FH, VH, const std::vector<OpenMesh::Vec3f>&) override {}
  void set_face_texindex(FH, int) override {}
  void set_halfedge(VH, HH) override {}
  void set_normal(VH, const OpenMesh::Vec3f&) override {}
  void set_normal(VH, const OpenMesh::Vec3d&) override {}
  void set_color(VH, const OpenMesh::Vec3uc&) override {}
  void set_color(VH, const OpenMesh::Vec4uc&) override {}
  void set_color(VH, const OpenMesh::Vec3f&) override {}
  void set_color(VH, const OpenMesh::Vec4f&) override {}
  void set_texcoord(VH, const OpenMesh::Vec2f&) override {}
  void set_status(VH, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_next(HH, HH) override {}
  void set_face(HH, FH) override {}
  void request_face_texcoords2D() override {}
  void set_texcoord(HH, const OpenMesh::Vec2f&) override {}
  void set_texcoord(VH, const OpenMesh::Vec3f&) override {}
  void set_texcoord(HH, const OpenMesh::Vec3f&) override {}
  void set_status(HH, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_color(EH, const OpenMesh::Vec3uc&) override {}
  void set_color(EH, const OpenMesh::Vec4uc&) override {}
  void set_color(EH, const OpenMesh::Vec3f&) override {}
  void set_color(EH, const OpenMesh::Vec4f&) override {}
  void set_status(EH, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_normal(FH, const OpenMesh::Vec3f&) override {}
  void set_normal(FH, const OpenMesh::Vec3d&) override {}
  void set_color(FH, const OpenMesh::Vec3uc&) override {}
  void set_color(FH, const OpenMesh::Vec4uc&) override {}
  void set_color(FH, const OpenMesh::Vec3f&) override {}
  void set_color(FH, const OpenMesh::Vec4f&) override {}
  void set_status(FH, const OpenMesh::Attributes::StatusInfo&) override {}
  void add_texture_information(int, std::string) override {}

 private:
  bool keeps_points_;
  std::size_t vertices_ = 0;
};

// A stream buffer over bytes in memory, without a copy. It can seek, because OpenMesh's readers may do so.
class MemoryBuffer final : public std::streambuf {
 public:
  explicit MemoryBuffer(std::string& bytes) { setg(bytes.data(), bytes.data(), bytes.data() + bytes.size()); }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode which) override {
    if ((which & std::ios_base::in) == 0) return {off_type(-1)};
    const off_type base = from == std::ios_base::beg   ? 0
                          : from == std::ios_base::cur ? gptr() - eback()
                                                       : egptr() - eback();
    const off_type target = base + offset;
    if (target < 0 || target > egptr() - eback()) return {off_type(-1)};
    setg(eback(), eback() + target, egptr());
    return {target};
  }
  pos_type seekpos(pos_type position, std::ios_base::openmode which) override {
    return seekoff(off_type(position), std::ios_base::beg, which);
  }
};

SoupImporter read_by_openmesh(const std::filesystem::path& file, PrescannedFile& prescanned) {
  // OpenMesh's readers are global objects that keep state while they read a file.
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  omerr().disable();
  omlog().disable();
  omout().disable();
  MemoryBuffer buffer(prescanned.dialect);
  std::istream in(&buffer);
  SoupImporter soup(prescanned.binary, prescanned.faces);
  io::Options options(prescanned.binary ? io::Options::Binary : io::Options::Default);
  const bool read = io::IOManager().read(in, prescanned.openmesh_extension, soup, options);
  const bool vertices_agree = soup.n_vertices() >= prescanned.coordinates.size();
  const bool faces_agree =
      prescanned.may_drop ? soup.n_faces() <= prescanned.faces : soup.n_faces() == prescanned.faces;
  if (!read || !vertices_agree || !faces_agree) {
    refuse_mesh(file, "OpenMesh reads " + std::to_string(soup.n_vertices()) + " vertices and " +
                          std::to_string(soup.n_faces()) + " faces where the file has " +
                          std::to_string(prescanned.coordinates.size()) + " and " +
                          std::to_string(prescanned.faces) + "; export it as binary PLY");
  }
  std::string().swap(prescanned.dialect);  // no longer needed
  return soup;
}

void report(std::vector<Finding>& findings, const char* id, Severity severity, std::size_t count,
            const std::string& text) {
  if (count > 0) findings.push_back({id, severity, count, text});
}

// Cuts polygons into triangles. Leaves out unusable elements and reports them.
MeshFile assemble(PrescannedFile& prescanned, SoupImporter& soup, double scale) {
  MeshFile result;
  std::vector<glm::dvec3>& vertices = result.mesh.vertices;
  // For STL, the vertices are the floats that OpenMesh has welded.
  vertices.swap(prescanned.binary ? soup.points : prescanned.coordinates);
  std::vector<bool> usable(vertices.size());
  std::size_t unusable_vertices = 0;
  std::size_t first_unusable = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    usable[i] = is_usable(vertices[i]) && is_usable(vertices[i] * scale);
    if (usable[i]) continue;
    if (unusable_vertices++ == 0) first_unusable = i;
  }

  std::size_t out_of_range = 0, first_out_of_range = 0, nonfinite = prescanned.nonfinite_facets;
  std::size_t repeated = prescanned.faces - soup.n_faces();
  std::size_t polygons = 0, crossing = 0, first_crossing = 0;
  const std::size_t fewer = 2 * soup.n_faces();
  result.mesh.triangles.reserve(soup.corners.size() > fewer ? soup.corners.size() - fewer : 0);
  for (std::size_t f = 0; f + 1 < soup.face_begin.size(); ++f) {
    const std::span<const std::uint32_t> face(soup.corners.data() + soup.face_begin[f],
                                              soup.face_begin[f + 1] - soup.face_begin[f]);
    if (std::any_of(face.begin(), face.end(), [&](std::uint32_t v) { return v >= vertices.size(); })) {
      if (out_of_range++ == 0) first_out_of_range = f;
    } else if (std::any_of(face.begin(), face.end(), [&](std::uint32_t v) { return !usable[v]; })) {
      ++nonfinite;
    } else if (face.size() < 3) {
      ++repeated;
    } else if (face.size() == 3) {
      result.mesh.triangles.push_back({face[0], face[1], face[2]});
    } else {
      const PolygonCut cut = cut_polygon(vertices, face, result.mesh.triangles);
      if (cut == PolygonCut::nothing) ++repeated;
      if (cut != PolygonCut::nothing) ++polygons;
      if (cut == PolygonCut::crossing && crossing++ == 0) first_crossing = f;
    }
  }

  if (unusable_vertices > 0) {  // removed, because all vertices of a mesh are finite
    std::vector<std::uint32_t> moved(vertices.size(), 0);
    std::uint32_t kept = 0;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (!usable[i]) continue;
      moved[i] = kept;
      vertices[kept++] = vertices[i];
    }
    vertices.resize(kept);
    for (TriangleIndices& t : result.mesh.triangles) t = {moved[t[0]], moved[t[1]], moved[t[2]]};
  }
  for (glm::dvec3& v : vertices) v *= scale;

  std::vector<Finding>& findings = result.findings;
  report(findings, "F01-nonfinite-vertices", Severity::error, unusable_vertices,
         "vertices are not finite numbers, or beyond 1e12 (first: vertex " + std::to_string(first_unusable) +
             ", counted from 0); they and the faces that use them are left out: export the mesh again");
  report(findings, "F02-nonfinite-faces", Severity::error, nonfinite,
         "faces have a corner that is not finite, or beyond 1e12" +
             (prescanned.nonfinite_facets > 0 ? " (first: " + prescanned.first_nonfinite_facet + ")"
                                              : std::string()) +
             ", and are left out, which leaves holes: export the mesh again, or close it elsewhere");
  report(findings, "F03-index-out-of-range", Severity::error, out_of_range,
         "faces use vertices that the file does not have (first: face " + std::to_string(first_out_of_range) +
             ", counted from 0 without shorter ones), and are left out, which leaves holes: export the mesh "
             "again");
  report(findings, "F04-short-faces", Severity::warning, prescanned.short_faces,
         "faces have fewer than three corners (first: " + prescanned.first_short_face +
             ") and are left out: points and lines cannot be touched");
  report(findings, "F05-repeated-corners", Severity::warning, repeated,
         "faces have fewer than three different corners and no area, and are left out: nothing is lost to "
         "touch");
  report(findings, "F06-polygons", Severity::info, polygons,
         "faces have more than three corners and are cut into triangles inside them");
  report(findings, "F07-trailing-bytes", Severity::warning, prescanned.trailing_bytes,
         "bytes follow the end of the mesh and are ignored: the file may be damaged");
  report(
      findings, "F08-crossing-polygons", Severity::warning, crossing,
      "faces cross themselves, seen along their normal (first: face " + std::to_string(first_crossing) +
          ", counted from 0 without shorter ones), so no triangles cover just them: look at them there, or "
          "cut them into triangles before export");
  return result;
}

std::string lower_case(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

// The ending that a mesh file should have by its first line, in lower case; empty if the line does not tell.
std::string_view ending_by_first_line(std::string_view bytes) {
  const std::string_view line = bytes.substr(0, std::min<std::size_t>(bytes.find_first_of("\r\n"), 80));
  if (line == "ply") return ".ply";
  if (line == "OFF" || line == "COFF" || line == "NOFF") return ".off";
  return line.starts_with("solid ") ? ".stl" : "";
}

}  // namespace

MeshFile load_mesh(const std::filesystem::path& file, const MeshFileOptions& options) {
  if (!(std::isfinite(options.scale) && options.scale > 0.0)) {
    refuse_mesh(file,
                "its length unit is " + std::to_string(options.scale) + " m; it must be finite and > 0");
  }
  std::string extension = lower_case(file.extension().string());
  const bool packed = extension == ".gz";
  if (packed) extension = lower_case(file.stem().extension().string());
  using Prescan = PrescannedFile (*)(const std::filesystem::path&, std::span<char>);
  struct Kind {
    std::string_view extension;
    Prescan prescan;
  };
  static constexpr std::array<Kind, 4> kKinds{
      {{".obj", prescan_obj}, {".ply", prescan_ply}, {".stl", prescan_stl}, {".off", prescan_off}}};
  const auto* kind =
      std::find_if(kKinds.begin(), kKinds.end(), [&](const Kind& k) { return k.extension == extension; });
  if (kind == kKinds.end()) {
    refuse_mesh(file, "'" + extension +
                          "' is no mesh format known here; use .obj, .ply, .stl or .off, or one with .gz");
  }
  try {
    PrescannedFile prescanned = [&] {
      std::string bytes = read_file_bytes(file, packed, options.max_bytes);
      const std::string_view by_line = ending_by_first_line(without_byte_order_mark(bytes));
      if (!by_line.empty() && by_line != extension)
        refuse_mesh(file,
                    "is named " + extension + " but begins as " + std::string(by_line) + " does; rename it");
      return kind->prescan(file, bytes);
    }();
    SoupImporter soup = read_by_openmesh(file, prescanned);
    MeshFile result = assemble(prescanned, soup, options.scale);
    if (result.mesh.empty()) {
      std::string why;
      for (const Finding& f : result.findings) why += "; " + std::to_string(f.count) + " " + f.text;
      refuse_mesh(file, "has no triangle that can be used; export a mesh with faces" + why);
    }
    return result;
  } catch (const std::bad_alloc&) {
    refuse_mesh(file, "does not fit into memory; simplify the mesh");
  }
}

}  // namespace polygon
