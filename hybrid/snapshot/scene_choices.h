// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of a scene that need a new world: the model, energy and spacing of an object, the elasticity and
// limits of a material, the place of an object, the size of the tool. The new world is built while the
// session goes on. Then the session goes on in the new world.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

namespace hybrid {

// One change. The object or the material has this name in the scene.
struct SceneChange {
  enum class Key : std::uint8_t {
    model,     // x: 1 as rigid, through the proxy; 0 by its voxels
    energy,    // x: 1 trilinear, 0 six-link
    spacing,   // x: the finest spacing of the three axes (m); their ratios stay
    young,     // x: Pa, of the material `name`, as the next four
    poisson,   // x: Poisson's ratio
    shortest,  // x: least length of a link (unit: its rest length)
    longest,   // x: greatest length of a link (unit: its rest length)
    shear,     // x: greatest slip of a link's ends (unit: its rest length)
    move,      // displacement of the object in the scene's frame (m)
    radius,    // x: m, of the tool; without a name
  };
  Key key = Key::model;
  std::string name{};
  glm::dvec3 value{0.0};
};

struct SpacingChoice {
  double spacing_m = 0.0;  // as SceneChange::value
  std::string words{};     // "2 mm"
};

struct MaterialChoice {
  std::string name{};
  double young_Pa = 0.0, poisson = 0.0;
  double shortest = 0.0, longest = 0.0, shear = 0.0;  // limits of links, as SceneChange::value
  std::string shared_with{};                          // other objects of this material; empty: none
};

// The radius of the tool, which may be changed as objects are.
struct ToolChoices {
  bool open = false;
  double radius_m = 0.0;  // 0: a point
  std::string note{};     // why it cannot be changed; may be empty
};

// The changes that one object allows.
struct ObjectChoices {
  bool open = false;    // it may be changed while it is felt; false: `note` says why not
  bool tissue = false;  // the scene describes it as [[soft]], even if it is felt as rigid
  bool as_rigid = false, trilinear = false;
  bool other_model = false, other_energy = false;  // can it be changed?
  double spacing_m = 0.0;
  std::string spacing_words{};
  std::vector<SpacingChoice> spacings{};  // without the present one
  std::vector<MaterialChoice> materials{};
  std::string note{};  // why something cannot be changed; may be empty
};

// Two models of an object that are compared over its surface. Each is the present scene after some changes.
struct ModelComparison {
  std::string object{};
  std::vector<SceneChange> a{}, b{};
  double depth_m = 0.0;    // to which the tool is pressed in
  std::size_t places = 0;  // number of places that end the comparison; 0: it ends when the surface is covered
};

// Forces on the hand at one place before and after a change, with all tissue at rest.
struct ComparedForces {
  double before_N = 0.0, after_N = 0.0, difference_jnd = 0.0;
  bool at_rest = true;  // false: a force had not come to rest, and may be some percent off
};
// A change of a scene while it was felt. `voxels_…`: of all soft objects.
struct ChangeEffect {
  std::string words{};  // the change
  double t_s = 0.0;
  std::optional<ComparedForces> forces{};  // empty: they are being compared
  std::size_t voxels_before = 0, voxels_after = 0;
};

}  // namespace hybrid
