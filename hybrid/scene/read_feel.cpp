// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/read_feel.h"

#include <string>

#include "hybrid/scene/ranges.h"

namespace hybrid {
namespace {

constexpr std::string_view keys_of_feel[] = {"stiffness", "damping", "friction", "shading", "texture"};

// Reads `friction`: one number for both coefficients, [static, dynamic], or { static = , dynamic = }.
void read_friction(const TableReader& table, FeelDescription& out) {
  static constexpr std::string_view keys[] = {"static", "dynamic"};
  const Quantity coefficient{"a friction coefficient", "0.4", 1.0, kFrictionRange.low, kFrictionRange.high};
  const TreeEntry* entry = table.find("friction");
  if (entry == nullptr) return;
  const TreeNode& value = entry->value;
  if (value.kind == TreeNode::Kind::array) {
    if (value.items.size() != 2) {
      table.refuse("friction", words("'friction' in ", table.what(), " has ", value.items.size(), " numbers"),
                   "give two, friction = [static, dynamic], e.g. [0.5, 0.4]");
    }
    out.static_friction =
        table.number_at(value.items[0], value.items[0].place, "'friction' (static)", coefficient);
    out.dynamic_friction =
        table.number_at(value.items[1], value.items[1].place, "'friction' (dynamic)", coefficient);
  } else if (value.kind == TreeNode::Kind::table) {
    const TableReader both = table.table("friction");
    both.allow(keys);
    out.static_friction = both.number("static", coefficient);
    out.dynamic_friction = both.number("dynamic", coefficient, out.static_friction);
  } else {
    out.static_friction = table.number("friction", coefficient);
    out.dynamic_friction = out.static_friction;
  }
  if (out.dynamic_friction > out.static_friction) {
    table.refuse("friction",
                 words("'friction' in ", table.what(), " holds less at rest (", out.static_friction,
                       ") than sliding (", out.dynamic_friction, ")"),
                 "put the static coefficient first, and not below the dynamic one");
  }
}

TextureDescription read_texture(const TableReader& table) {
  static constexpr std::string_view keys[] = {"image", "pattern", "size", "height", "kind", "along"};
  static constexpr std::string_view sources[] = {"image", "pattern"};
  static constexpr std::string_view patterns[] = {"waves", "grid", "bumps"};
  static constexpr std::string_view kinds[] = {"height", "shading"};
  static constexpr std::string_view axes[] = {"x", "y", "z", "box"};
  table.allow(keys);
  TextureDescription out;
  out.place = table.place();
  if (table.has("image") && table.has("pattern")) {
    table.refuse("pattern", words(table.what(), " has an image and a pattern"), "keep one of them");
  }
  if (table.has("image")) {
    out.image = table.file("image", false);
    out.place = table.place_of("image");
  } else if (table.has("pattern")) {
    out.pattern = static_cast<TexturePattern>(table.choice("pattern", patterns));
  } else {
    table.source().refuse(table.place(), words(table.what(), " does not say what it is"),
                          words("add one of these keys: ", joined(sources)));
  }
  out.mapping.kind = static_cast<TextureKind>(table.choice("kind", kinds, 0));
  out.mapping.along = static_cast<TextureAlong>(table.choice("along", axes, 3));
  out.mapping.size_m = table.number("size", table.source().size());
  out.mapping.height_m = table.number("height", table.source().size());
  if (out.mapping.height_m > kMostTextureHeight * out.mapping.size_m) {
    table.refuse("height", words("'height' in ", table.what(), " is more than half of 'size'"),
                 "make it flatter or its period longer: a steeper texture is a wall");
  }
  return out;
}

}  // namespace

std::span<const std::string_view> feel_keys() {
  return keys_of_feel;
}

FeelDescription read_feel(const TableReader& table) {
  FeelDescription out;
  const Quantity stiffness{"a stiffness above 0 in N/m", "1000", 1.0, kCouplingRange_N_per_m.low,
                           kCouplingRange_N_per_m.high};
  out.stiffness_N_per_m = table.number("stiffness", stiffness, out.stiffness_N_per_m);
  const Quantity damping{"a damping of 0 or more in N s/m", "2", 1.0, kDampingRange_N_s_per_m.low,
                         kDampingRange_N_s_per_m.high};
  out.damping_N_s_per_m = table.number("damping", damping, out.damping_N_s_per_m);
  read_friction(table, out);
  out.shading = table.boolean("shading", out.shading);
  if (table.has("texture")) out.texture = read_texture(table.table("texture"));
  return out;
}

SurfaceFeel build_feel(const FeelDescription& description) {
  SurfaceFeel feel{.damping_N_s_per_m = description.damping_N_s_per_m,
                   .static_friction = description.static_friction,
                   .dynamic_friction = description.dynamic_friction,
                   .shading = description.shading,
                   .texture = nullptr,
                   .stiffness_N_per_m = description.stiffness_N_per_m};
  if (!description.texture) return feel;
  const TextureDescription& texture = *description.texture;
  feel.texture = texture.image.empty()
                     ? std::make_shared<const HeightTexture>(texture.pattern, texture.mapping)
                     : std::make_shared<const HeightTexture>(load_grey_png(texture.image), texture.mapping);
  return feel;
}

}  // namespace hybrid
