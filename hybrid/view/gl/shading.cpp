// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/gl/shading.h"

#include <string>

#include "hybrid/view/gl/renderer_shaders.h"

namespace hybrid {
namespace {

// The constants of renderer_shaders.h that select a shading, in the order of Shading.
constexpr std::array<const char*, kShadings> kDefines{"#define PLAIN\n",
                                                      "#define TISSUE\n",
                                                      "#define TISSUE\n#define SLICE\n",
                                                      "#define LAYER\n",
                                                      "#define UNHIDING\n",
                                                      "#define GLASS\n",
                                                      "",
                                                      "#define COVER\n"};

bool copies_layer(std::size_t shading) {
  return shading == static_cast<std::size_t>(Shading::cover);
}

std::string begin_of(std::size_t shading, bool by_vertex) {
  return std::string(shaders::version) + kDefines[shading] + (by_vertex ? "#define LIT_BY_VERTEX\n" : "") +
         shaders::lighting;
}

std::string fragment_of(std::size_t shading, bool by_vertex) {
  if (copies_layer(shading)) return begin_of(shading, by_vertex) + shaders::layer_fragment;
  const bool depth_only = shading == static_cast<std::size_t>(Shading::depth);
  return begin_of(shading, by_vertex) + (depth_only ? shaders::depth_fragment : shaders::mesh_fragment);
}

}  // namespace

void ShadingPrograms::create() {
  for (const bool by_vertex : {false, true}) {
    for (std::size_t n = 0; n < kShadings; ++n) {
      const std::string vertex =
          begin_of(n, by_vertex) + (copies_layer(n) ? shaders::cover_vertex : shaders::mesh_vertex);
      programs_[by_vertex ? 1 : 0][n] = link_program(vertex.c_str(), fragment_of(n, by_vertex).c_str());
    }
  }
}

void ShadingPrograms::release() {
  for (const auto& kind : programs_) {
    for (const GlName program : kind) delete_program(program);
  }
}

}  // namespace hybrid
