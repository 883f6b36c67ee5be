// SPDX-License-Identifier: GPL-3.0-or-later
// The renderer's shaders (GLSL 3.30).
#pragma once

namespace hybrid::shaders {

inline constexpr const char* mesh_vertex = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float displacement;
layout(location = 3) in vec3 vertex_colour;
uniform mat4 scene_from_mesh;   // scene: relative to the renderer's origin
uniform mat3 normal_from_mesh;
uniform mat4 clip_from_scene;
uniform vec3 eye;
uniform vec4 kept;              // plane of a cut (scene): the positive side is drawn
uniform vec4 clip_plane;        // the same of the view's clip plane
uniform float nearer;           // length by which the surface is drawn towards the eye (scene)
out vec3 scene_position;
out vec3 scene_normal;
out float moved;
out vec3 material_colour;
invariant gl_Position;  // equal depths in every program
void main() {
  vec4 at = scene_from_mesh * vec4(position, 1.0);
  scene_position = at.xyz;
  scene_normal = normal_from_mesh * normal;
  moved = displacement;
  material_colour = vertex_colour;
  gl_ClipDistance[0] = dot(kept, at);
  gl_ClipDistance[1] = dot(clip_plane, at);
  gl_Position = clip_from_scene * vec4(at.xyz + nearer * normalize(eye - at.xyz), 1.0);
}
)";

// Passes. 0: lit; opaque, or with one alpha. 1: rigid, only in pixels where it hides no soft object and no
// tool. 2: rigid, only in the other pixels: dense at the rim, thin where it faces the eye. 3: like glass.
inline constexpr const char* mesh_fragment = R"(#version 330 core
in vec3 scene_position;
in vec3 scene_normal;
in float moved;
in vec3 material_colour;
uniform vec3 eye;
uniform vec3 light_right;   // camera axes: the light moves with the eye
uniform vec3 light_up;
uniform vec3 own_colour;
uniform bool coloured_vertices;  // material_colour in place of own_colour
uniform vec3 moved_ramp[9];      // colours of the scale, from 0 to its end
uniform float own_until;         // shares of the scale over which the own colour gives way to the ramp
uniform float ramp_from;
uniform float moved_scale;  // 0: the object does not move
uniform float alpha;
uniform float shine;
uniform int pass;
uniform sampler2D shown_depth;  // depth of what must not be hidden
out vec4 colour;
void main() {
  vec3 toward_eye = normalize(eye - scene_position);
  vec3 face = cross(dFdx(scene_position), dFdy(scene_position));
  face = length(face) > 0.0 ? normalize(face) : toward_eye;
  if (dot(face, toward_eye) < 0.0) face = -face;
  bool inside = !gl_FrontFacing;
  vec3 n = length(scene_normal) > 0.1 ? normalize(inside ? -scene_normal : scene_normal) : face;
  // A normal shared across a sharp edge, or by triangles that do not agree on their side, is no use.
  if (dot(n, face) < 0.4) n = face;
  float facing = clamp(dot(n, toward_eye), 0.0, 1.0);

  float a = alpha;
  if (pass == 3) {
    a = mix(0.12, 0.95, pow(1.0 - facing, 1.6));
  } else if (pass != 0) {
    float kept = texelFetch(shown_depth, ivec2(gl_FragCoord.xy), 0).r;
    bool hides = gl_FragCoord.z < kept && kept < 1.0;
    if (hides != (pass == 2)) discard;
    if (pass == 2) a = mix(0.17, 0.80, pow(1.0 - facing, 1.7));
  }

  vec3 own = coloured_vertices ? material_colour : own_colour;
  vec3 base = own;
  if (moved_scale > 0.0) {
    float t = clamp(moved / moved_scale, 0.0, 1.0);
    float at = t * 8.0;
    int low = min(int(at), 7);
    base = mix(own, mix(moved_ramp[low], moved_ramp[low + 1], at - float(low)), smoothstep(own_until, ramp_from, t));
    // A thin darker line every tenth of the scale: contours show shape where colour alone does not.
    float line = t * 10.0;
    float width = max(fwidth(line), 1e-4);
    float away = abs(fract(line + 0.5) - 0.5) / width;
    if (t > 0.05) base *= 1.0 - 0.22 * (1.0 - smoothstep(0.4, 1.4, away)) * clamp(0.5 / width, 0.0, 1.0);
  }
  if (inside) base *= vec3(0.90, 0.87, 0.84);

  vec3 key = normalize(toward_eye + 0.75 * light_up - 0.55 * light_right);
  float diffuse = max(dot(n, key), 0.0);
  float sky = 0.5 + 0.5 * dot(n, light_up);
  vec3 halfway = normalize(key + toward_eye);
  float gloss = shine * pow(max(dot(n, halfway), 0.0), 40.0);
  vec3 lit = base * (0.46 + 0.16 * sky + 0.46 * diffuse) + vec3(gloss);
  // The silhouette is a little darker, as in a drawing.
  lit *= mix(0.78, 1.0, smoothstep(0.0, 0.30, facing));
  colour = vec4(lit, a);
}
)";

// Depth only, without lighting: all fragments (pass 0), or the fragments of pass 2 of mesh_fragment.
inline constexpr const char* depth_fragment = R"(#version 330 core
uniform int pass;
uniform sampler2D shown_depth;
void main() {
  if (pass == 2) {
    float kept = texelFetch(shown_depth, ivec2(gl_FragCoord.xy), 0).r;
    if (!(gl_FragCoord.z < kept && kept < 1.0)) discard;
  }
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
