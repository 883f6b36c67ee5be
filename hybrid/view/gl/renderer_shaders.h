// SPDX-License-Identifier: GPL-3.0-or-later
// The renderer's shaders (GLSL 3.30).
#pragma once

namespace hybrid::shaders {

inline constexpr const char* version = "#version 330 core\n";

// Lighting, in both stages: the factor on the surface's colour, the gloss that is added, and the cosine
// between normal and direction to the eye.
inline constexpr const char* lighting = R"(
uniform vec3 eye;
uniform vec3 light_right;   // camera axes: the light moves with the eye
uniform vec3 light_up;
uniform float shine;
vec3 light_on(vec3 n, vec3 toward_eye) {
  float facing = clamp(dot(n, toward_eye), 0.0, 1.0);
  vec3 key = normalize(toward_eye + 0.75 * light_up - 0.55 * light_right);
  float diffuse = max(dot(n, key), 0.0);
  float sky = 0.5 + 0.5 * dot(n, light_up);
  float halfway = max(dot(n, normalize(key + toward_eye)), 0.0);
  float to_8 = halfway * halfway;
  to_8 *= to_8;
  to_8 *= to_8;
  // The silhouette is a little darker, as in a drawing.
  float rim = mix(0.78, 1.0, smoothstep(0.0, 0.30, facing));
  float gloss = shine * to_8 * to_8 * to_8 * to_8 * to_8;  // power 40, without a logarithm
  return vec3(rim * (0.46 + 0.16 * sky + 0.46 * diffuse), rim * gloss, facing);
}
)";

inline constexpr const char* mesh_vertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float displacement;
layout(location = 3) in vec3 vertex_colour;
#ifdef SLICE
layout(location = 4) in vec2 place_of_vertex;
out vec2 image_place;
#endif
uniform mat4 scene_from_mesh;   // scene: relative to the renderer's origin
uniform mat3 normal_from_mesh;
uniform mat4 clip_from_scene;
uniform vec4 kept;              // plane of a cut (scene): the positive side is drawn
uniform vec4 clip_plane;        // the same of the view's clip plane
uniform float nearer;           // length by which the surface is drawn towards the eye (scene)
out vec3 scene_position;
#ifdef LIT_BY_VERTEX
out vec3 light;                 // as in light_on()
#else
out vec3 scene_normal;
#endif
out float moved;
out vec3 material_colour;
invariant gl_Position;  // equal depths in every program
void main() {
  vec4 at = scene_from_mesh * vec4(position, 1.0);
  vec3 toward_eye = normalize(eye - at.xyz);
  scene_position = at.xyz;
  vec3 n = normal_from_mesh * normal;
#ifdef LIT_BY_VERTEX
  // Both sides of a surface are lit, as in the other stage.
  n = length(n) > 0.1 ? normalize(n) : toward_eye;
  light = light_on(dot(n, toward_eye) < 0.0 ? -n : n, toward_eye);
#else
  scene_normal = n;
#endif
#ifdef SLICE
  image_place = place_of_vertex;
#endif
  moved = displacement;
  material_colour = vertex_colour;
  gl_ClipDistance[0] = dot(kept, at);
  gl_ClipDistance[1] = dot(clip_plane, at);
  gl_Position = clip_from_scene * vec4(at.xyz + nearer * toward_eye, 1.0);
}
)";

// The fragment shaders. One of the sets of constants of shading.cpp is defined before them.
inline constexpr const char* mesh_fragment = R"(
in vec3 scene_position;
#ifdef UNHIDING
uniform sampler2D shown_depth;  // depth of the objects that must not be hidden
uniform mat4 clip_from_scene;
uniform float apart;  // least length by which a surface in front hides another (scene)
// Does this fragment hide something? It counts with the depth that it would have if it were further from the
// eye by `apart`.
bool hides() {
  vec4 at = clip_from_scene * vec4(scene_position + apart * normalize(scene_position - eye), 1.0);
  float kept = texelFetch(shown_depth, ivec2(gl_FragCoord.xy), 0).r;
  return kept < 1.0 && 0.5 + 0.5 * at.z / at.w < kept;
}
#endif
#ifdef SLICE
in vec2 image_place;
uniform sampler2D slice_image;  // alpha below 1/2: no tissue
#endif
#ifdef LIT_BY_VERTEX
in vec3 light;
#else
in vec3 scene_normal;
#endif
in float moved;
in vec3 material_colour;
uniform vec3 own_colour;
uniform bool coloured_vertices;  // material_colour in place of own_colour
uniform float alpha;
#ifdef TISSUE
uniform vec3 moved_ramp[9];      // colours of the scale, from 0 to its end
uniform float own_until;         // shares of the scale over which the own colour gives way to the ramp
uniform float ramp_from;
uniform float ramp_share;        // most share of the ramp in the colour
uniform float moved_scale;       // value at the end of the scale; 0: only the own colour
// Piecewise linear between the colours of the ramp. An index that differs from pixel to pixel costs more.
vec3 ramp_at(float share) {
  vec3 colour = moved_ramp[0];
  for (int n = 0; n < 8; ++n)
    colour += clamp(8.0 * share - float(n), 0.0, 1.0) * (moved_ramp[n + 1] - moved_ramp[n]);
  return colour;
}
#endif
out vec4 colour;
void main() {
#ifdef UNHIDING
  if (hides()) discard;
#endif
  bool inside = !gl_FrontFacing;
#ifndef LIT_BY_VERTEX
  vec3 toward_eye = normalize(eye - scene_position);
  vec3 face = cross(dFdx(scene_position), dFdy(scene_position));
  face = length(face) > 0.0 ? normalize(face) : toward_eye;
  if (dot(face, toward_eye) < 0.0) face = -face;
  vec3 n = length(scene_normal) > 0.1 ? normalize(inside ? -scene_normal : scene_normal) : face;
  // A normal shared across a sharp edge, or by triangles that do not agree on their side, is no use.
  if (dot(n, face) < 0.4) n = face;
  vec3 light = light_on(n, toward_eye);
#endif
  float facing = clamp(light.z, 0.0, 1.0);

#if defined(GLASS)
  float a = mix(0.12, 0.95, pow(1.0 - facing, 1.6));
#elif defined(LAYER)
  float a = mix(0.17, 0.80, pow(1.0 - facing, 1.7));
#else
  float a = alpha;
#endif

#ifdef SLICE
  vec4 pixel = texture(slice_image, image_place);
  if (pixel.a < 0.5) discard;
  vec3 base = pixel.rgb / pixel.a;  // pixels without tissue are black and transparent
#else
  vec3 base = coloured_vertices ? material_colour : own_colour;
#endif
#ifdef TISSUE
  if (moved_scale > 0.0) {
    float t = clamp(moved / moved_scale, 0.0, 1.0);
    base = mix(base, ramp_at(t), ramp_share * smoothstep(own_until, ramp_from, t));
    // A thin darker line every tenth of the scale: contours show shape where colour alone does not.
    float line = t * 10.0;
    float width = max(fwidth(line), 1e-4);
    float away = abs(fract(line + 0.5) - 0.5) / width;
    if (t > 0.05) base *= 1.0 - 0.22 * (1.0 - smoothstep(0.4, 1.4, away)) * clamp(0.5 / width, 0.0, 1.0);
  }
#endif
#ifdef SLICE
  // Hardly any light, so that grey values stay comparable; enough to tell the planes apart.
  colour = vec4(base * mix(0.82, 1.0, facing), 1.0);
#else
  if (inside) base *= vec3(0.90, 0.87, 0.84);
  colour = vec4(base * light.x + vec3(light.y), a);
#endif
}
)";

// Depth only, without lighting.
inline constexpr const char* depth_fragment = R"(
void main() {}
)";

// Copies the layer of rigid objects, which covers the viewport.
inline constexpr const char* cover_vertex = R"(
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
)";
inline constexpr const char* layer_fragment = R"(
uniform sampler2D layer_colour, layer_depth, shown_depth;
// a and b: the depth of a surface that moves away by twice `apart` rises by b * (depth + a)^2.
uniform vec2 further;
out vec4 colour;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float depth = texelFetch(layer_depth, pixel, 0).r;
  if (depth >= 1.0) discard;
  float kept = texelFetch(shown_depth, pixel, 0).r;
  float from_end = depth + further.x;
  bool hides = kept < 1.0 && depth + further.y * from_end * from_end < kept;
  vec4 own = texelFetch(layer_colour, pixel, 0);
  colour = vec4(own.rgb, hides ? own.a : 1.0);
  gl_FragDepth = depth;
}
)";

inline constexpr const char* overlay_vertex = R"(#version 330 core
layout(location = 0) in vec2 position;
layout(location = 1) in vec2 texture_position;
layout(location = 2) in vec4 colour_in;
uniform vec2 size;  // of the picture, in pixels
out vec2 at;
out vec4 tint;
void main() {
  at = texture_position;
  tint = colour_in;
  gl_Position = vec4(2.0 * position.x / size.x - 1.0, 1.0 - 2.0 * position.y / size.y, 0.0, 1.0);
}
)";

inline constexpr const char* overlay_fragment = R"(#version 330 core
in vec2 at;
in vec4 tint;
uniform sampler2D font;
out vec4 colour;
void main() { colour = vec4(tint.rgb, tint.a * texture(font, at).r); }
)";

}  // namespace hybrid::shaders
