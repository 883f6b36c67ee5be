// SPDX-License-Identifier: GPL-3.0-or-later
// The colours of pictures, window and legend, in one table, so that all three agree. Objects differ in hue
// and in lightness, so that colour-blind readers can tell them apart (after Okabe & Ito 2008).
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/gl/unit_shapes.h"

namespace hybrid::palette {

// All colours are sRGB, 0 to 1.
inline constexpr glm::vec3 background{0.945F, 0.953F, 0.962F};
inline constexpr glm::vec3 dark_background{0.118F, 0.129F, 0.149F};
inline constexpr glm::vec3 tool{0.13F, 0.17F, 0.24F};
inline constexpr glm::vec3 dark_tool{0.66F, 0.71F, 0.79F};  // on the dark background
inline constexpr glm::vec3 device{0.10F, 0.45F, 0.85F};
inline constexpr glm::vec3 force{0.03F, 0.38F, 0.93F};

// Edges of triangles, on any surface.
inline constexpr glm::vec3 wire{0.10F, 0.12F, 0.16F};
inline constexpr glm::vec3 dark_wire{0.86F, 0.89F, 0.94F};

// Axes of the scene, x first (Okabe & Ito 2008).
inline constexpr std::array<glm::vec3, 3> axes{
    {{0.835F, 0.369F, 0.0F}, {0.0F, 0.55F, 0.40F}, {0.0F, 0.447F, 0.698F}}};

// The scale of a quantity of tissue, from 0 to its end: viridis (Smith & van der Walt 2015). Equal steps of
// viridis look equal, to colour-blind readers too, and its lightness rises from end to end.
inline constexpr std::array<glm::vec3, 9> moved{{{0.267F, 0.005F, 0.329F},
                                                 {0.283F, 0.141F, 0.458F},
                                                 {0.229F, 0.322F, 0.546F},
                                                 {0.173F, 0.449F, 0.558F},
                                                 {0.128F, 0.567F, 0.551F},
                                                 {0.158F, 0.684F, 0.502F},
                                                 {0.369F, 0.789F, 0.383F},
                                                 {0.678F, 0.864F, 0.190F},
                                                 {0.993F, 0.906F, 0.144F}}};
// Shares of a scale: up to the first only the tissue's own colour is drawn, and from the second on only
// viridis.
struct RampStart {
  float own_until = 0.0F, ramp_from = 0.0F;
};
inline constexpr RampStart kOwnFirst{0.02F, 0.15F};    // tissue that hardly moved keeps its own colour
inline constexpr RampStart kRampAtOnce{5e-4F, 1e-3F};  // the own colour means that nothing is known

inline constexpr std::array<glm::vec3, 4> rigid{
    {{0.89F, 0.84F, 0.72F}, {0.78F, 0.77F, 0.74F}, {0.80F, 0.71F, 0.55F}, {0.66F, 0.68F, 0.72F}}};
// Colours of soft objects. Those near the scale `moved` come last.
inline constexpr std::array<glm::vec3, 6> soft{{{0.86F, 0.58F, 0.62F},
                                                {0.58F, 0.53F, 0.82F},
                                                {0.75F, 0.48F, 0.72F},
                                                {0.36F, 0.62F, 0.85F},
                                                {0.52F, 0.72F, 0.36F},
                                                {0.30F, 0.66F, 0.62F}}};

// Colours of the materials of one object. A search in Oklab maximised the least distance between any two
// colours, and their distance to the colours above. It did so for normal vision and for vision without the
// first or the second cone type (Machado et al. 2009). Each colour differs from every other in hue or in
// lightness. The first colours are furthest from each other.
inline constexpr std::array<glm::vec3, 10> material{{{0.86F, 0.57F, 0.57F},
                                                     {0.54F, 0.71F, 0.96F},
                                                     {0.74F, 0.90F, 0.56F},
                                                     {0.54F, 0.28F, 0.53F},
                                                     {0.36F, 0.56F, 0.62F},
                                                     {0.98F, 0.79F, 0.94F},
                                                     {0.45F, 0.37F, 0.33F},
                                                     {0.68F, 0.52F, 0.80F},
                                                     {0.61F, 0.62F, 0.37F},
                                                     {0.20F, 0.38F, 0.68F}}};
// All materials beyond these share one neutral colour, so that no colour stands for two materials.
inline constexpr glm::vec3 other_material{0.50F, 0.50F, 0.50F};

// At least this many colours stay free for materials, however many colours the scene already has.
inline constexpr std::size_t kLeastFree = 5;

// Colour of object `index`. It is the customary one if the object's name, or that of its material, is in the
// table of tissues (hybrid/scene/tissue_table.h). Otherwise the n-th such rigid (or soft) object gets the
// n-th colour of its kind.
glm::vec3 of_object(const DrawnScene& scene, std::size_t index);

// Colours of an object's materials, in their order; the object's own colour if it has no materials. A
// material has one colour in the whole scene: the customary one, or one that is assigned by name, object
// after object.
std::vector<glm::vec3> of_materials(const DrawnScene& scene, std::size_t index);

// Colours of all materials within an object (DrawnInside::materials), including those that the surface hides.
std::vector<glm::vec3> of_inside(const DrawnScene& scene, std::size_t index);

// Colours of the materials at an object's vertices, in the mesh's order; empty if the object has one colour.
std::vector<VertexColour> of_vertices(const DrawnScene& scene, std::size_t index);

// End of the scale for a largest displacement: the next 1, 2 or 5 · 10^n at or above it (m).
double scale_end(double moved_m);

// Colour of a point on an object of colour `own`. The point's displacement is `share` (0 to 1) of the scale's
// end. The renderer's shader has the same formula.
glm::vec3 of_displacement(const glm::vec3& own, float share, const RampStart& start = kOwnFirst);

}  // namespace hybrid::palette
