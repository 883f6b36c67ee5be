// SPDX-License-Identifier: GPL-3.0-or-later
// The OpenGL objects of the renderer: programs, meshes in buffers, and textures that are drawn into. Every
// call needs the renderer's context to be current. Objects live until they are released or the context ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "hybrid/view/gl/mesh_parts.h"
#include "hybrid/view/gl/pixel_rect.h"
#include "hybrid/view/gl/unit_shapes.h"

namespace hybrid {

// OpenGL's types, defined here so that its header need not be included.
using GlName = unsigned int;  // GLuint: name of an object or program
using GlEnum = unsigned int;  // GLenum

// Throws std::runtime_error with the remedy if the context is older than OpenGL 3.3.
void require_gl();
// Does the context draw without a graphics card?
[[nodiscard]] bool draws_in_software();

// Throws std::runtime_error if OpenGL has reported an error; `doing` completes "error while …".
void check_gl(const char* doing);

// Sets a uniform of the program in use.
void set_uniform(GlName program, const char* name, float value);
void set_uniform(GlName program, const char* name, int value);
void set_uniform(GlName program, const char* name, const glm::vec2& value);
void set_uniform(GlName program, const char* name, const glm::vec3& value);
void set_uniform(GlName program, const char* name, const glm::vec4& value);
void set_uniform(GlName program, const char* name, const glm::mat3& value);
void set_uniform(GlName program, const char* name, const glm::mat4& value);
void set_uniform(GlName program, const char* name, std::span<const glm::vec3> values);

// A texture with an image, filtered between pixels. 0 is no image.
GlName make_image(int width, int height, std::span<const VertexColour> pixels);
void replace_image(GlName image, int width, int height, std::span<const VertexColour> pixels);
void delete_image(GlName image);
void bind_image(GlName image);  // to the first unit

// Compiles and links a program. Throws std::runtime_error with the driver's log.
GlName link_program(const char* vertex, const char* fragment);
void delete_program(GlName program);

// Selects which planes of the program in use clip: the plane of a cut, and that of the view.
void clip_by_planes(bool cut, bool view);
// Are the backs of triangles left out?
void hide_backs(bool hidden);
// false: triangles write their depth only.
void write_colours(bool written);
// true: only the edges of triangles are drawn, and they write no depth.
void draw_edges_only(bool edges);

// A byte offset into a buffer, as the pointer that OpenGL takes.
const void* buffer_offset(std::size_t bytes);

// A mesh in the card's memory.
struct GlMesh {
  GlName array = 0, vertices = 0, indices = 0, colours = 0, places = 0;
  int count = 0;
  std::vector<MeshPart> parts{};  // of the indices, for draw_seen()

  // Throws std::runtime_error when the mesh has too many triangles for one draw call.
  // `moves`: stream() will be called often.
  void upload(const DrawMesh& mesh, bool moves = false);
  // One sRGB colour per vertex; called at most once.
  void upload_colours(const std::vector<VertexColour>& of_vertex);
  // The place of each vertex in an image, from 0 to 1; called at most once.
  void upload_places(std::span<const glm::vec2> of_vertex);
  // Replaces the vertices. Orphans the old storage, so that the driver need not wait for the previous frame.
  void stream(const DrawMesh& mesh) const;
  void draw() const;
  // Draws the parts that may be in the view of `clip_from_mesh`. `margin`, `values`: as for seen_ranges().
  void draw_seen(const glm::mat4& clip_from_mesh, float margin, const ValueRange& values = {}) const;
  // Deletes the buffers. The mesh is empty afterwards.
  void release();
};

// A texture that is drawn into and sampled without filtering; width and height in pixels.
GlName make_texture_target(GlEnum inner, GlEnum outer, GlEnum type, int width, int height);

// Attaches textures to a framebuffer (0: none) and binds it. Throws std::runtime_error if the driver refuses.
void attach_targets(GlName frame, GlName colour, GlName depth);

// Textures of colour and depth into which something is drawn once and used in many frames.
struct GlLayer {
  GlName frame = 0, colour = 0, depth = 0;
  int width = 0, height = 0;  // pixels

  // Builds the textures anew if the size differs. Returns true if it did.
  bool set_size(int to_width, int to_height);
  void release();
};

// A triangle that covers the viewport, for programs without vertices.
struct GlCover {
  GlName array = 0;

  void create();
  void draw() const;
  void release();
};

// The textures of one view. They keep their content from frame to frame.
struct ViewTargets {
  GlLayer scene;
  GlName shown_frame = 0, shown_depth = 0;  // depth of the objects that must not be hidden

  // Builds the textures anew if the size (samples) differs. Returns true if it did.
  bool set_size(int width, int height);
  void release();
};

// The whole frame in pixels: the views, and the overlay over them.
struct FrameTarget {
  GlName frame = 0, colour = 0;
  int width = 0, height = 0;

  // Builds the texture anew if the size (pixels) differs. Returns true if it did.
  bool set_size(int to_width, int to_height);
  void release();
};

// Samples per pixel along each axis: `wanted`, or less if the driver's textures would be too small. Throws
// std::runtime_error if a side of the frame is not from 1 to 8192 pixels.
int samples_for(int width, int height, int wanted);

// Copies the colours of a view to a part of the frame (pixels, y up).
void copy_view(const ViewTargets& view, const FrameTarget& frame, const PixelRect& to);

// Copies a framebuffer to the context's default one, whose size is to_width × to_height.
void show_frame(GlName frame, int width, int height, int to_width, int to_height);

// The pixels of a framebuffer: rows from the top, three bytes (RGB) a pixel.
std::vector<std::uint8_t> read_frame(GlName frame, int width, int height);

// A vertex of the overlay: position in pixels (y down), texture coordinates in the font atlas, colour
// 0xAABBGGRR.
struct OverlayVertex {
  float x = 0.0F, y = 0.0F, u = 0.0F, v = 0.0F;
  std::uint32_t colour = 0;

  friend bool operator==(const OverlayVertex&, const OverlayVertex&) = default;
};
struct OverlayMesh {
  struct Batch {
    std::size_t first = 0, count = 0;  // range of `indices`
    PixelRect inside;                  // clips the batch

    friend bool operator==(const Batch&, const Batch&) = default;
  };
  std::vector<OverlayVertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<Batch> batches;  // in drawing order

  friend bool operator==(const OverlayMesh&, const OverlayMesh&) = default;
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
  // Draws into the bound framebuffer, which has this many pixels.
  void draw(const OverlayMesh& overlay, int width, int height) const;

 private:
  GlName program_ = 0, array_ = 0, vertices_ = 0, indices_ = 0, font_ = 0;
};

}  // namespace hybrid
