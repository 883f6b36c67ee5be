// SPDX-License-Identifier: GPL-3.0-or-later
// Layout of the text: ITK's TxtTransformIO. Meaning of parameters: ITK Software Guide, book 1, section
// "Transforms"; matrix by rows, then translation, about the centre in the fixed parameters. Frame and
// direction: 3D Slicer, developer guide, "Transforms": files hold the transform from the parent, in LPS.
#include "hybrid/scene/itk_transform.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "hybrid/scene/toml_tree.h"

namespace hybrid {
namespace {

constexpr double kMeters = 1e-3;               // per unit of the file
constexpr double kMostStretch = 1e-4;          // of a rigid map: 0.1 mm on 1 m; above the rounding of floats
constexpr std::size_t kMostShown = 20;         // characters of a wrong text that a message shows
constexpr std::size_t kMostBytes = 1U << 20U;  // of a file; one transform has some hundred bytes
constexpr const char* kHarden =
    "in 3D Slicer harden it on the model or volume and save that instead; or save a rigid transform (.tfm)";

struct ItkTransform {
  std::size_t count = 0;  // number of transforms in the file; the members below are of the last one
  std::string type;       // "AffineTransform_double_3_3"
  std::vector<double> parameters, fixed;
};

[[noreturn]] void refuse_transform(const std::string& what, const std::string& remedy) {
  throw std::runtime_error(what + "; " + remedy);
}

std::vector<double> numbers_of(const std::string& line) {
  std::vector<double> out;
  const char* at = line.data();
  const char* const end = at + line.size();
  while (true) {
    while (at != end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
    if (at == end) return out;
    double value = 0.0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc() || next == at)
      refuse_transform(words("has '", printable({at, static_cast<std::size_t>(end - at)}, kMostShown),
                             "' where a number should be"),
                       "save it again");
    out.push_back(value);
    at = next;
  }
}

ItkTransform read_itk_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text(kMostBytes, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.starts_with("\x89HDF"))
    refuse_transform("is HDF5, which is not read", "save the transform as .tfm");
  if (!text.starts_with("#Insight Transform File"))
    refuse_transform("is no transform file of ITK: it does not begin with '#Insight Transform File'",
                     "save the transform as .tfm");
  ItkTransform out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto rest = [&line](std::string_view key) { return line.substr(key.size()); };
    if (line.starts_with("Transform: ")) {
      ++out.count;
      out.type = rest("Transform: ");
    } else if (line.starts_with("Parameters:")) {
      out.parameters = numbers_of(rest("Parameters:"));
    } else if (line.starts_with("FixedParameters:")) {
      out.fixed = numbers_of(rest("FixedParameters:"));
    }
  }
  return out;
}

// x -> matrix · (x - centre) + centre + shift, in the file's units.
struct LinearMap {
  glm::dmat3 matrix{1.0};
  glm::dvec3 shift{0.0}, centre{0.0};
};

LinearMap linear_map(const ItkTransform& t) {
  const std::vector<double>& p = t.parameters;
  const bool affine =
      t.type.starts_with("AffineTransform_") || t.type.starts_with("MatrixOffsetTransformBase_");
  const bool versor = t.type.starts_with("VersorRigid3DTransform_");
  if (!affine && !versor)
    refuse_transform(words("holds a ", printable(t.type, 60), ", which is not supported"), kHarden);
  if (p.size() != (affine ? 12U : 6U) || (t.fixed.size() != 3 && !t.fixed.empty()))
    refuse_transform(words("is damaged: ", p.size(), " parameters and ", t.fixed.size(), " fixed ones"),
                     "save it again");
  for (const std::vector<double>* list : {&p, &t.fixed}) {
    for (const double number : *list) {
      if (!std::isfinite(number)) refuse_transform("holds a number that is not finite", "save it again");
    }
  }
  LinearMap map;
  if (!t.fixed.empty()) map.centre = {t.fixed[0], t.fixed[1], t.fixed[2]};
  if (affine) {
    map.matrix = glm::transpose(glm::dmat3(p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8]));
    map.shift = {p[9], p[10], p[11]};
  } else {  // the vector of a unit quaternion whose real part is not negative
    const double rest = 1.0 - p[0] * p[0] - p[1] * p[1] - p[2] * p[2];
    if (rest < -kMostStretch) refuse_transform("is damaged: its versor is longer than 1", "save it again");
    map.matrix = glm::mat3_cast(glm::normalize(glm::dquat(std::sqrt(std::max(rest, 0.0)), p[0], p[1], p[2])));
    map.shift = {p[3], p[4], p[5]};
  }
  return map;
}

// Deviation of the matrix from a rotation: the largest entry of |MᵀM - 1|.
double stretch_of(const glm::dmat3& matrix) {
  const glm::dmat3 product = glm::transpose(matrix) * matrix;
  double most = 0.0;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) most = std::max(most, std::abs(product[c][r] - (c == r ? 1.0 : 0.0)));
  }
  return most;
}

}  // namespace

Pose load_itk_transform(const std::filesystem::path& file) {
  const ItkTransform t = read_itk_text(file);
  if (t.count != 1) refuse_transform(words("holds ", t.count, " transforms, and one can be read"), kHarden);
  const LinearMap map = linear_map(t);
  const double stretch = stretch_of(map.matrix);
  if (stretch > kMostStretch)
    refuse_transform(
        words("stretches or shears by ", in_words(100.0 * stretch), " %, and objects keep their size"),
        kHarden);
  if (glm::determinant(map.matrix) < 0.0) refuse_transform("mirrors, and objects keep their sides", kHarden);
  const glm::dmat3 to_scene = glm::transpose(map.matrix);  // the inverse of a rotation
  Pose pose;
  pose.rotation = glm::normalize(glm::quat_cast(to_scene));
  pose.position_m = kMeters * (map.centre - pose.rotation * (map.centre + map.shift));
  return pose;
}

}  // namespace hybrid
