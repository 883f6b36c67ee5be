// SPDX-License-Identifier: GPL-3.0-or-later
// The OpenGL objects that the renderer makes: programs, meshes in buffers, and textures to draw into. Every
// call needs the renderer's context to be current. Objects end with the context, unless they are released.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hybrid/view/layout.h"
#include "hybrid/view/unit_shapes.h"

namespace hybrid {

// OpenGL's own types, by their definition: its header stays out of this one.
using GlName = unsigned int;  // GLuint: an object or program
using GlEnum = unsigned int;  // GLenum

// Throws std::runtime_error with the remedy: the context is older than OpenGL 3.3.
void require_gl();
// Does the context draw without a graphics card?
[[nodiscard]] bool draws_in_software();

// Throws std::runtime_error if OpenGL has reported an error; `doing` completes "error while …".
void check_gl(const char* doing);

// Compiles and links a program. Throws std::runtime_error with the driver's log.
GlName link_program(const char* vertex, const char* fragment);

// A byte offset into a buffer, as the pointer that OpenGL takes.
const void* buffer_offset(std::size_t bytes);

// A mesh in the card's memory.
struct GlMesh {
  GlName array = 0, vertices = 0, indices = 0, colours = 0;
  int count = 0;

  // Throws std::runtime_error when the mesh has too many triangles for one draw call.
  void upload(const DrawMesh& mesh, GlEnum usage);
  // One sRGB colour per vertex; called at most once.
  void upload_colours(const std::vector<VertexColour>& of_vertex);
  // Replaces the vertices. Orphans the old storage, so that the driver need not wait for the previous frame.
  void stream(const DrawMesh& mesh) const;
  void draw() const;
  // Deletes the buffers; the mesh is empty then.
  void release();
};

// A texture to draw into, sampled without filtering (unit of width and height: pixel).
GlName make_texture_target(GlEnum inner, GlEnum outer, GlEnum type, int width, int height);

// Attaches textures to a framebuffer (0: none) and binds it. Throws std::runtime_error if the driver refuses.
void attach_targets(GlName frame, GlName colour, GlName depth);

// The overlay's triangles: pixels (y down), texture coordinates in the font atlas, colour 0xAABBGGRR.
struct OverlayVertex {
  float x = 0.0F, y = 0.0F, u = 0.0F, v = 0.0F;
  std::uint32_t colour = 0;
};
struct OverlayMesh {
  struct Batch {
    std::size_t first = 0, count = 0;  // indices
    PixelRect inside;                  // nothing is drawn outside of it
  };
  std::vector<OverlayVertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<Batch> batches;  // in the order in which they are drawn
};
struct FontAtlas {
  int width = 0, height = 0;
  std::span<const std::uint8_t> alpha;  // width × height
};

// Draws an overlay's triangles, in batches that are each clipped to a rectangle.
class GlOverlay {
 public:
  void create();
  void set_font(const FontAtlas& atlas);
  void release();
  // Into the bound framebuffer of this many pixels.
  void draw(const OverlayMesh& overlay, int width, int height) const;

 private:
  GlName program_ = 0, array_ = 0, vertices_ = 0, indices_ = 0, font_ = 0;
};

}  // namespace hybrid
