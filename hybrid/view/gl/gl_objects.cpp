// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/gl/gl_objects.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

#include "hybrid/view/gl/renderer_shaders.h"

namespace hybrid {
namespace {

constexpr int kMostPixelsOfPicture = 8192;  // along each side

GLuint compile(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint good = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good != GL_TRUE) {
    std::string log(1024, '\0');
    GLsizei length = 0;
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(std::max(length, 0)));
    throw std::runtime_error("the graphics driver refuses a shader: " + log +
                             "; set LIBGL_ALWAYS_SOFTWARE=1 to draw without it");
  }
  return shader;
}

}  // namespace

void require_gl() {
  if (epoxy_gl_version() < 33) {
    throw std::runtime_error("drawing needs OpenGL 3.3, and this one is " +
                             std::to_string(epoxy_gl_version() / 10) + "." +
                             std::to_string(epoxy_gl_version() % 10) +
                             "; set LIBGL_ALWAYS_SOFTWARE=1 to draw without the graphics card");
  }
}

bool draws_in_software() {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name != nullptr && std::string_view(name).find("llvmpipe") != std::string_view::npos;
}

void check_gl(const char* doing) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return;
  for (int i = 0; i < 16 && glGetError() != GL_NO_ERROR; ++i) {
  }
  if (error == GL_OUT_OF_MEMORY) {
    throw std::runtime_error(std::string("the graphics memory is full while ") + doing +
                             "; use a smaller picture or a coarser mesh");
  }
  throw std::runtime_error("OpenGL error " + std::to_string(error) + " while " + doing +
                           "; update the graphics driver, or set LIBGL_ALWAYS_SOFTWARE=1 to draw without it");
}

void set_uniform(GLuint program, const char* name, float value) {
  glUniform1f(glGetUniformLocation(program, name), value);
}
void set_uniform(GLuint program, const char* name, int value) {
  glUniform1i(glGetUniformLocation(program, name), value);
}
void set_uniform(GLuint program, const char* name, const glm::vec2& value) {
  glUniform2fv(glGetUniformLocation(program, name), 1, glm::value_ptr(value));
}
void set_uniform(GLuint program, const char* name, const glm::vec3& value) {
  glUniform3fv(glGetUniformLocation(program, name), 1, glm::value_ptr(value));
}
void set_uniform(GLuint program, const char* name, const glm::vec4& value) {
  glUniform4fv(glGetUniformLocation(program, name), 1, glm::value_ptr(value));
}
void set_uniform(GLuint program, const char* name, const glm::mat3& value) {
  glUniformMatrix3fv(glGetUniformLocation(program, name), 1, GL_FALSE, glm::value_ptr(value));
}
void set_uniform(GLuint program, const char* name, const glm::mat4& value) {
  glUniformMatrix4fv(glGetUniformLocation(program, name), 1, GL_FALSE, glm::value_ptr(value));
}
void set_uniform(GLuint program, const char* name, std::span<const glm::vec3> values) {
  glUniform3fv(glGetUniformLocation(program, name), static_cast<GLsizei>(values.size()),
               glm::value_ptr(values.front()));
}

GLuint link_program(const char* vertex, const char* fragment) {
  const GLuint program = glCreateProgram();
  const GLuint parts[] = {compile(GL_VERTEX_SHADER, vertex), compile(GL_FRAGMENT_SHADER, fragment)};
  for (const GLuint part : parts) {
    glAttachShader(program, part);
    glDeleteShader(part);
  }
  glLinkProgram(program);
  GLint good = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &good);
  if (good != GL_TRUE) throw std::runtime_error("the graphics driver cannot link a shader; update it");
  return program;
}

void delete_program(GLuint program) {
  glDeleteProgram(program);
}

void clip_by_planes(bool cut, bool view) {
  (cut ? glEnable : glDisable)(GL_CLIP_DISTANCE0);
  (view ? glEnable : glDisable)(GL_CLIP_DISTANCE1);
}

void hide_backs(bool hidden) {
  (hidden ? glEnable : glDisable)(GL_CULL_FACE);
}

void write_colours(bool written) {
  const GLboolean mask = written ? GL_TRUE : GL_FALSE;
  glColorMask(mask, mask, mask, mask);
}

void draw_edges_only(bool edges) {
  glPolygonMode(GL_FRONT_AND_BACK, edges ? GL_LINE : GL_FILL);
  glDepthMask(edges ? GL_FALSE : GL_TRUE);
}

const void* buffer_offset(std::size_t bytes) {
  // OpenGL takes an offset as a pointer.
  return reinterpret_cast<const void*>(bytes);  // NOLINT(performance-no-int-to-ptr)
}

GLuint make_image(int width, int height, std::span<const VertexColour> pixels) {
  GLuint image = 0;
  glGenTextures(1, &image);
  replace_image(image, width, height, pixels);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return image;
}

void replace_image(GLuint image, int width, int height, std::span<const VertexColour> pixels) {
  bind_image(image);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
}

void delete_image(GLuint image) {
  if (image != 0) glDeleteTextures(1, &image);
}

void bind_image(GLuint image) {
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, image);
}

void GlMesh::upload(const DrawMesh& mesh, bool moves) {
  if (mesh.indices.size() > static_cast<std::size_t>(std::numeric_limits<GLsizei>::max())) {
    throw std::runtime_error("a surface of " + std::to_string(mesh.indices.size() / 3) +
                             " triangles is more than one draw call holds; simplify the mesh");
  }
  glGenVertexArrays(1, &array);
  glGenBuffers(1, &vertices);
  glGenBuffers(1, &indices);
  glBindVertexArray(array);
  glBindBuffer(GL_ARRAY_BUFFER, vertices);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(DrawVertex)),
               mesh.vertices.data(), moves ? GL_STREAM_DRAW : GL_STATIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.indices.size() * sizeof(std::uint32_t)),
               mesh.indices.data(), GL_STATIC_DRAW);
  constexpr auto stride = static_cast<GLsizei>(sizeof(DrawVertex));
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, stride, buffer_offset(offsetof(DrawVertex, position)));
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, stride, buffer_offset(offsetof(DrawVertex, normal)));
  glVertexAttribPointer(2, 1, GL_FLOAT, GL_FALSE, stride, buffer_offset(offsetof(DrawVertex, value)));
  for (GLuint i = 0; i < 3; ++i) glEnableVertexAttribArray(i);
  count = static_cast<GLsizei>(mesh.indices.size());
}

void GlMesh::upload_colours(const std::vector<VertexColour>& of_vertex) {
  glGenBuffers(1, &colours);
  glBindVertexArray(array);
  glBindBuffer(GL_ARRAY_BUFFER, colours);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(of_vertex.size() * sizeof(VertexColour)),
               of_vertex.data(), GL_STATIC_DRAW);
  glVertexAttribPointer(3, 4, GL_UNSIGNED_BYTE, GL_TRUE, 0, buffer_offset(0));
  glEnableVertexAttribArray(3);
}

void GlMesh::upload_places(std::span<const glm::vec2> of_vertex) {
  glGenBuffers(1, &places);
  glBindVertexArray(array);
  glBindBuffer(GL_ARRAY_BUFFER, places);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(of_vertex.size_bytes()), of_vertex.data(),
               GL_STATIC_DRAW);
  glVertexAttribPointer(4, 2, GL_FLOAT, GL_FALSE, 0, buffer_offset(0));
  glEnableVertexAttribArray(4);
}

void GlMesh::stream(const DrawMesh& mesh) const {
  const auto bytes = static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(DrawVertex));
  glBindBuffer(GL_ARRAY_BUFFER, vertices);
  glBufferData(GL_ARRAY_BUFFER, bytes, nullptr, GL_STREAM_DRAW);
  glBufferSubData(GL_ARRAY_BUFFER, 0, bytes, mesh.vertices.data());
}

void GlMesh::draw() const {
  glBindVertexArray(array);
  glDrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT, nullptr);
}

void GlMesh::draw_seen(const glm::mat4& clip_from_mesh, float margin, const ValueRange& values) const {
  glBindVertexArray(array);
  std::vector<GLsizei> counts;
  std::vector<const void*> offsets;
  for (const IndexRange& range : seen_ranges(parts, clip_from_mesh, margin, values)) {
    counts.push_back(static_cast<GLsizei>(range.count));
    offsets.push_back(buffer_offset(range.first * sizeof(std::uint32_t)));
  }
  glMultiDrawElements(GL_TRIANGLES, counts.data(), GL_UNSIGNED_INT, offsets.data(),
                      static_cast<GLsizei>(counts.size()));
}

void GlMesh::release() {
  glDeleteVertexArrays(1, &array);
  for (const GLuint* buffer : {&vertices, &indices, &colours, &places}) {
    if (*buffer != 0) glDeleteBuffers(1, buffer);
  }
  *this = {};
}

GLuint make_texture_target(GLenum inner, GLenum outer, GLenum type, int width, int height) {
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(inner), width, height, 0, outer, type, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  return texture;
}

void attach_targets(GLuint frame, GLuint colour, GLuint depth) {
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour, 0);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
  const GLenum buffer = colour != 0 ? GL_COLOR_ATTACHMENT0 : GL_NONE;
  glDrawBuffers(1, &buffer);
  glReadBuffer(buffer);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw std::runtime_error(
        "the graphics driver cannot draw into a picture of this size; ask for a smaller one");
  }
}

bool GlLayer::set_size(int to_width, int to_height) {
  if (frame != 0 && width == to_width && height == to_height) return false;
  release();
  width = to_width, height = to_height;
  glGenFramebuffers(1, &frame);
  colour = make_texture_target(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, width, height);
  depth = make_texture_target(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, width, height);
  attach_targets(frame, colour, depth);
  return true;
}

void GlLayer::release() {
  if (frame == 0) return;
  const std::array textures{colour, depth};
  glDeleteTextures(textures.size(), textures.data());
  glDeleteFramebuffers(1, &frame);
  *this = {};
}

void GlCover::create() {
  glGenVertexArrays(1, &array);
}

void GlCover::draw() const {
  glBindVertexArray(array);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void GlCover::release() {
  glDeleteVertexArrays(1, &array);
  array = 0;
}

bool ViewTargets::set_size(int width, int height) {
  if (!scene.set_size(width, height)) return false;
  if (shown_frame == 0) glGenFramebuffers(1, &shown_frame);
  if (shown_depth != 0) glDeleteTextures(1, &shown_depth);
  shown_depth = make_texture_target(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, width, height);
  attach_targets(shown_frame, 0, shown_depth);
  return true;
}

void ViewTargets::release() {
  scene.release();
  if (shown_depth != 0) glDeleteTextures(1, &shown_depth);
  if (shown_frame != 0) glDeleteFramebuffers(1, &shown_frame);
  *this = {};
}

bool FrameTarget::set_size(int to_width, int to_height) {
  if (frame != 0 && width == to_width && height == to_height) return false;
  release();
  width = to_width, height = to_height;
  glGenFramebuffers(1, &frame);
  colour = make_texture_target(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, width, height);
  attach_targets(frame, colour, 0);
  return true;
}

void FrameTarget::release() {
  if (frame == 0) return;
  glDeleteTextures(1, &colour);
  glDeleteFramebuffers(1, &frame);
  *this = {};
}

int samples_for(int width, int height, int wanted) {
  if (width < 1 || height < 1 || width > kMostPixelsOfPicture || height > kMostPixelsOfPicture) {
    throw std::runtime_error("a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                             " pixels cannot be drawn; each side must be from 1 to " +
                             std::to_string(kMostPixelsOfPicture));
  }
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  int factor = wanted;
  while (factor > 1 && std::max(width, height) * factor > std::min(most, kMostPixelsOfPicture)) --factor;
  return factor;
}

void copy_view(const ViewTargets& view, const FrameTarget& frame, const PixelRect& to) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, view.scene.frame);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, frame.frame);
  glBlitFramebuffer(0, 0, view.scene.width, view.scene.height, to.x, to.y, to.x + to.width, to.y + to.height,
                    GL_COLOR_BUFFER_BIT, view.scene.width == to.width ? GL_NEAREST : GL_LINEAR);
}

void show_frame(GLuint frame, int width, int height, int to_width, int to_height) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, frame);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  glBlitFramebuffer(0, 0, width, height, 0, 0, to_width, to_height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  check_gl("showing a frame");
}

std::vector<std::uint8_t> read_frame(GLuint frame, int width, int height) {
  const auto row = static_cast<std::size_t>(width) * 3;
  std::vector<std::uint8_t> up(row * static_cast<std::size_t>(height));
  std::vector<std::uint8_t> down(up.size());
  glBindFramebuffer(GL_FRAMEBUFFER, frame);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, up.data());
  check_gl("reading a frame");
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    std::copy_n(up.end() - static_cast<std::ptrdiff_t>((y + 1) * row), row,
                down.begin() + static_cast<std::ptrdiff_t>(y * row));
  }
  return down;
}

void GlOverlay::create() {
  program_ = link_program(shaders::overlay_vertex, shaders::overlay_fragment);
  glGenVertexArrays(1, &array_);
  glGenBuffers(1, &vertices_);
  glGenBuffers(1, &indices_);
  glBindVertexArray(array_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
  constexpr auto stride = static_cast<GLsizei>(sizeof(OverlayVertex));
  glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, stride, buffer_offset(offsetof(OverlayVertex, x)));
  glVertexAttribPointer(1, 2, GL_FLOAT, GL_FALSE, stride, buffer_offset(offsetof(OverlayVertex, u)));
  glVertexAttribPointer(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, stride,
                        buffer_offset(offsetof(OverlayVertex, colour)));
  for (GLuint i = 0; i < 3; ++i) glEnableVertexAttribArray(i);
}

void GlOverlay::set_font(const FontAtlas& atlas) {
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  if (font_ == 0) glGenTextures(1, &font_);
  glBindTexture(GL_TEXTURE_2D, font_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, atlas.width, atlas.height, 0, GL_RED, GL_UNSIGNED_BYTE,
               atlas.alpha.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  check_gl("uploading the font");
}

void GlOverlay::release() {
  glDeleteProgram(program_);
  glDeleteVertexArrays(1, &array_);
  for (const GLuint buffer : {vertices_, indices_}) glDeleteBuffers(1, &buffer);
  glDeleteTextures(1, &font_);
}

void GlOverlay::draw(const OverlayMesh& overlay, int width, int height) const {
  glViewport(0, 0, width, height);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  glEnable(GL_SCISSOR_TEST);
  glUseProgram(program_);
  glUniform2f(glGetUniformLocation(program_, "size"), static_cast<float>(width), static_cast<float>(height));
  glUniform1i(glGetUniformLocation(program_, "font"), 0);
  glBindTexture(GL_TEXTURE_2D, font_);
  glBindVertexArray(array_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(overlay.vertices.size() * sizeof(OverlayVertex)),
               overlay.vertices.data(), GL_STREAM_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(overlay.indices.size() * sizeof(std::uint32_t)),
               overlay.indices.data(), GL_STREAM_DRAW);
  for (const OverlayMesh::Batch& batch : overlay.batches) {
    const PixelRect& r = batch.inside;
    glScissor(r.x, height - r.y - r.height, std::max(r.width, 0), std::max(r.height, 0));
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(batch.count), GL_UNSIGNED_INT,
                   buffer_offset(batch.first * sizeof(std::uint32_t)));
  }
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_BLEND);
}

}  // namespace hybrid
