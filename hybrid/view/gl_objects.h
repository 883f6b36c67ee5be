// SPDX-License-Identifier: GPL-3.0-or-later
// The OpenGL objects that the renderer makes: programs, meshes in buffers, and textures to draw into. Every
// call needs the renderer's context to be current. Objects end with the context, unless they are released.
#pragma once

#include <cstddef>
#include <vector>

#include "hybrid/view/unit_shapes.h"

namespace hybrid {

// OpenGL's own types, by their definition: its header stays out of this one.
using GlName = unsigned int;  // GLuint: an object or program
using GlEnum = unsigned int;  // GLenum

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

}  // namespace hybrid
