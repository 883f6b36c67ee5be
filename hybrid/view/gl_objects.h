// SPDX-License-Identifier: GPL-3.0-or-later
// The OpenGL objects that the renderer makes: programs, meshes in buffers, and textures to draw into. Every
// call needs the renderer's context to be current. Nothing here deletes its objects: they end with the
// context.
#pragma once

#include <epoxy/gl.h>

#include <cstddef>
#include <vector>

#include "hybrid/view/unit_shapes.h"

namespace hybrid {

// Throws std::runtime_error if OpenGL has reported an error; `doing` completes "error while …".
void check_gl(const char* doing);

// Compiles and links a program. Throws std::runtime_error with the driver's log.
GLuint link_program(const char* vertex, const char* fragment);

// A byte offset into a buffer, as the pointer that OpenGL takes.
const void* buffer_offset(std::size_t bytes);

// A mesh in the card's memory.
struct GlMesh {
  GLuint array = 0, vertices = 0, indices = 0, colours = 0;
  GLsizei count = 0;

  // Throws std::runtime_error when the mesh has too many triangles for one draw call.
  void upload(const DrawMesh& mesh, GLenum usage);
  // One sRGB colour per vertex; called at most once.
  void upload_colours(const std::vector<VertexColour>& of_vertex);
  // Replaces the vertices. Orphans the old storage, so that the driver need not wait for the previous frame.
  void stream(const DrawMesh& mesh) const;
  void draw() const;
};

// A texture to draw into, sampled without filtering (unit of width and height: pixel).
GLuint make_texture_target(GLenum inner, GLenum outer, GLenum type, int width, int height);

// Attaches textures to a framebuffer (0: none) and binds it. Throws std::runtime_error if the driver refuses.
void attach_targets(GLuint frame, GLuint colour, GLuint depth);

}  // namespace hybrid
