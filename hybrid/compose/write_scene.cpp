// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compose/write_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <string_view>

#include "hybrid/base/letters.h"

namespace hybrid {
namespace {

constexpr double kToolShare = 0.02;  // radius of the tool, as a share of the longest object
constexpr double kCoupling = 800.0;  // N/m; does not buzz in any grip, see `hybrid stability`

// The text with '_' for characters that may not be printed. A line break would end the comment around the
// text. Names and titles come from files, so any character may occur.
std::string plain(std::string_view text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = printable_at(text, at);
    out += length > 0 ? text.substr(at, length) : "_";
    at += std::max<std::size_t>(character_at(text, at), 1);
  }
  return out;
}

// The text as a quoted string of TOML.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : plain(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

// The text as a key of TOML: bare where that is allowed.
std::string as_key(const std::string& text) {
  const bool bare = !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x80 &&
           (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_');
  });
  return bare ? text : quoted(text);
}

// Names of materials. Each is the name of its label, with '_' for blanks and signs, so that reports, plots
// and pictures name organs.
class MaterialNames {
 public:
  explicit MaterialNames(const SceneParts& parts) {
    for (const SoftPart& part : parts.soft) {
      auto& of_part = of_part_.emplace_back();
      for (const auto& [label, tissue] : part.materials)
        of_part[label] = unused(part.label_names.at(label), tissue);
    }
  }
  [[nodiscard]] const std::string& of(std::size_t part, int label) const { return of_part_[part].at(label); }
  // All materials, in the order of their names.
  [[nodiscard]] const std::map<std::string, const Tissue*>& all() const { return all_; }

 private:
  // A name that no other material has. Labels with the same name and tissue share a material.
  std::string unused(const std::string& label_name, const Tissue* tissue) {
    const std::string key = name_letters(label_name);
    std::string name = key;
    for (int n = 2;; ++n) {
      const auto [of, fresh] = label_of_.try_emplace(name, label_name);
      if (fresh || (of->second == label_name && all_.at(name) == tissue)) break;
      name = fmt::format("{}-{}", key, n);
    }
    all_[name] = tissue;
    return name;
  }

  std::vector<std::map<int, std::string>> of_part_;
  std::map<std::string, const Tissue*> all_;
  std::map<std::string, std::string> label_of_;  // [name of a material] the name of its label
};

std::string vector_mm(const glm::dvec3& v) {
  return fmt::format("[{:.7g}, {:.7g}, {:.7g}]", v.x, v.y, v.z);
}

void add_placement(std::string& text, const Placement& p) {
  if (p.position_mm != glm::dvec3(0.0)) text += fmt::format("position = {}\n", vector_mm(p.position_mm));
  if (p.rotation_deg != glm::dvec3(0.0))
    text += fmt::format("rotation = {} # degrees, about the scene's x, then y, then z\n",
                        vector_mm(p.rotation_deg));
}

void add_materials(std::string& text, const MaterialNames& names) {
  if (names.all().empty()) return;
  text +=
      "\n# Stiffness of tissue: Young's modulus and Poisson's ratio, with where they are from. Where tissues "
      "meet,\n"
      "# links between voxels are right near a ratio of 0.3, and nested patches need one ratio in a volume. "
      "So all\n"
      "# tissue has 0.3, and the Young's modulus that keeps its contact modulus E/(1 - nu^2). `stretch` and "
      "`shear`\n"
      "# bound how far a link may give way; see scenes/README.md.\n";
  for (const auto& [name, t] : names.all()) {
    const LatticeStiffness links = as_six_links(*t);
    const std::string published = links.poisson == t->poisson
                                      ? std::string()
                                      : fmt::format("{:.6g} at nu {:.3g}; ", t->young_Pa, t->poisson);
    text += fmt::format(
        "[material.{}]\nyoung = {:.4g} # Pa; {}{}{}\npoisson = {:.3g}\nstretch = [0.5, 1.5]\nshear = "
        "0.5\n\n",
        as_key(name), links.young_Pa, published, t->measured ? "" : "no measurement: ", t->source,
        links.poisson);
  }
}

void add_rigid(std::string& text, const SceneParts& parts) {
  if (parts.rigid.empty()) return;
  text +=
      "# Rigid surfaces, each a file of this folder. Exchange a file for a finer one, or take its block "
      "away.\n"
      "# friction = 0.2 makes a surface rough, shading = true smooths its facets.\n";
  for (const RigidPart& part : parts.rigid) {
    text += fmt::format("[[rigid]] # {}\nname = {}\nmesh = {}\nunit = {}\n", plain(part.comment),
                        quoted(part.name), quoted(part.file), quoted(part.unit));
    if (part.repair) text += "repair = true\n";
    add_placement(text, part.placement);
    text += "\n";
  }
}

std::string anchors(const SoftPart& part) {
  std::string items;
  const auto add = [&items](const std::string& item) { items += (items.empty() ? "" : ", ") + item; };
  if (part.anchor_bottom) add("faces = [\"-z\"]");
  std::string labels;
  for (const int label : part.anchor_labels) labels += (labels.empty() ? "" : ", ") + std::to_string(label);
  if (!labels.empty()) add("labels = [" + labels + "]");
  if (part.rigid_within_mm > 0.0) add(fmt::format("rigid_within = {:.4g}", part.rigid_within_mm));
  return "{ " + items + " }";
}

void add_soft(std::string& text, const SceneParts& parts, const MaterialNames& names) {
  for (std::size_t o = 0; o < parts.soft.size(); ++o) {
    const SoftPart& part = parts.soft[o];
    text +=
        "# Tissue: one volume, so that what touches in the body hangs together. Its labels have the "
        "stiffness that\n"
        "# `materials` names. It is held where it lies within `rigid_within` mm of something rigid, and by "
        "the labels and\n"
        "# faces of `anchors`. A larger `spacing` (mm) makes it coarser and faster.\n";
    if (!part.comment.empty()) text += fmt::format("# {}\n", plain(part.comment));
    text += fmt::format("[[soft]]\nname = {}\nvolume = {}\nlargest = false\n", quoted(part.name),
                        quoted(part.file));
    if (!part.scan.empty())
      text += fmt::format("scan = {} # its grey values are for slices in `hybrid view`\n",
                          quoted(part.scan.string()));
    const bool alone = part.materials.size() == 1;
    if (alone) {
      text += fmt::format("material = {}\n", quoted(names.of(o, part.materials.begin()->first)));
    } else {
      text += "materials = { ";
      bool first = true;
      for (const auto& [label, tissue] : part.materials) {
        text += fmt::format("{}\"{}\" = {}", first ? "" : ", ", label, quoted(names.of(o, label)));
        first = false;
      }
      text += " }\n# labels:";
      std::string line;
      for (const auto& [label, name] : part.label_names) {
        const std::string item =
            fmt::format(" {} {}{}", label, plain(name), part.anchor_labels.contains(label) ? " (held)" : "");
        if (line.size() + item.size() > 96) {
          text += line + "\n#  ";
          line.clear();
        }
        line += item + ",";
      }
      if (!line.empty()) line.pop_back();
      text += line + "\n";
    }
    text += fmt::format("anchors = {}\n", anchors(part));
    add_placement(text, part.placement);
    text += "\n";
  }
}

// Says which parts the path does not press, and why. Lines are as long as those of the scene's other
// comments.
void add_not_pressed(std::string& text, const PressPath& path) {
  constexpr std::size_t kLineLength = 105;
  for (const bool hidden : {true, false}) {
    std::string line = fmt::format("# Not pressed, {}:", not_pressed_why(hidden));
    bool any = false;
    for (const NotPressed& n : path.not_pressed) {
      if (n.hidden != hidden) continue;
      const std::string word = (any ? ", " : " ") + plain(n.what);
      if (line.size() + word.size() > kLineLength) {
        text += line + (any ? ",\n" : "\n");
        line = "#   " + plain(n.what);
      } else {
        line += word;
      }
      any = true;
    }
    if (any) text += line + "\n";
  }
}

void add_path(std::string& text, const PressPath& path) {
  text +=
      "# Where the simulated hand goes: [x, y, z] or [x, y, z, seconds to hold]. A comment names the press "
      "of its\n"
      "# point; the points after it are the way over the surface to the next one. kind = \"lissajous\", "
      "\"slide\" or a recorded \"csv\" "
      "are other paths.\n";
  add_not_pressed(text, path);
  text += "[path]\nkind = \"waypoints\"\n";
  text += fmt::format("speed = {:.3g} # mm/s\npoints = [\n", path.speed_m_per_s * 1e3);
  for (const PathPoint& p : path.points) {
    const glm::dvec3 mm = p.at_m * 1e3;
    const std::string hold = p.hold_s > 0.0 ? fmt::format(", {:.3g}", p.hold_s) : "";
    text += fmt::format("  [{:.2f}, {:.2f}, {:.2f}{}],{}{}\n", mm.x, mm.y, mm.z, hold,
                        p.comment.empty() ? "" : " # ", plain(p.comment));
  }
  text += "]\n";
}

}  // namespace

SceneSettings default_settings(const SceneParts& parts) {
  SceneSettings settings;
  double spacing = 0.0, longest = 0.0;
  for (const SoftPart& part : parts.soft) {
    const glm::dvec3& h = part.volume.spacing_m;
    spacing = std::max({spacing, h.x, h.y, h.z});
  }
  for (const ComposedPart& row : parts.rows)
    longest = std::max({longest, row.size_m.x, row.size_m.y, row.size_m.z});
  // A ball of some millimeters radius is needed to feel tissue of a few kPa. A lattice resolves a ball from
  // two spacings of radius on.
  const double wanted = kToolShare * longest;
  const double radius = spacing > 0.0 ? std::clamp(wanted, 2.0 * spacing, 4.0 * spacing) : wanted;
  // Two digits, because a person reads and edits the value.
  const double digit = std::pow(10.0, std::floor(std::log10(radius)) - 1.0);
  settings.tool_radius_m = std::round(radius / digit) * digit;
  settings.coupling_N_per_m = kCoupling;
  return settings;
}

std::string scene_text(const SceneParts& parts, const SceneSettings& settings, const PressPath& path) {
  std::string text = fmt::format(
      "# {}: {} rigid surfaces and {} of tissue, written by `hybrid compose`.\n"
      "# Every block may be edited; scenes/README.md of hybrid describes each key. `hybrid check scene.toml` "
      "says what is\n"
      "# wrong with it, `hybrid run scene.toml` runs it, `hybrid view scene.toml` opens a window.\n",
      plain(settings.title), parts.rigid.size(),
      parts.soft.size() == 1 ? "a volume" : fmt::format("{} volumes", parts.soft.size()));
  if (parts.of_a_body)
    text += "# Frame: that of the volume, x to the patient's left, y to the back, z to the head.\n";
  text += fmt::format("format = 1\ntitle = {}\nunits = \"mm\"\n\n", quoted(settings.title));
  text += fmt::format(
      "# The tool that the hand holds, and the spring between both (the virtual coupling). A stiffer spring "
      "makes bone\n"
      "# harder, until the loop buzzes: `hybrid stability scene.toml` says where.\n"
      "[tool]\nshape = \"ball\"\nradius = {:.4g}\nstiffness = {:.4g} # N/m\n\n",
      settings.tool_radius_m * 1e3, settings.coupling_N_per_m);
  text +=
      "# A simulated device; model = \"phantom\" is a real one.\n[device]\nmodel = \"premium-1.5\"\nrate = "
      "1000 # Hz\n";
  const MaterialNames names(parts);
  add_materials(text, names);
  if (text.back() == '\n' && !text.ends_with("\n\n")) text += "\n";
  add_rigid(text, parts);
  add_soft(text, parts, names);
  add_path(text, path);
  return text;
}

std::string starter_scene() {
  return R"(# A scene to begin from: a rigid ball that rests on a soft block. Written by `hybrid compose`.
# Every block may be edited; scenes/README.md of hybrid describes each key. `hybrid check scene.toml` says what
# is wrong with it, `hybrid run scene.toml` runs it, `hybrid view scene.toml` opens a window.
format = 1
title = "A first scene"
units = "mm"

# The tool that the hand holds, and the spring between both (the virtual coupling).
[tool]
shape = "ball"
radius = 5
stiffness = 800 # N/m

# A simulated device; model = "phantom" is a real one.
[device]
model = "premium-1.5"
rate = 1000 # Hz

# How stiff the tissue is. Liver has about 5,500 Pa, muscle 11,000.
[material.gel]
young = 8000 # Pa
poisson = 0.4

# Something rigid. In place of a primitive: mesh = "part.ply", or the surface of labels of a volume.
[[rigid]]
name = "ball"
primitive = "ball"
radius = 10
position = [-20, 0, 20] # the block's top is at z = 15

# Something soft. In place of a formula: volume = "labels.nii.gz", or a closed mesh. Its bottom layer is held, as
# it says nothing of `anchors`.
[[soft]]
name = "block"
formula = "block"
size = [80, 60, 30]
spacing = 2
material = "gel"

# Where the simulated hand goes: [x, y, z] or [x, y, z, seconds to hold].
[path]
kind = "waypoints"
speed = 50 # mm/s
points = [
  [-20, 0, 50],
  [-20, 0, 33.5, 0.3], # the ball alone
  [-20, 0, 45],
  [20, 0, 45],
  [20, 0, 14, 0.5], # the block alone
  [20, 0, 24],
  [0, 0, 24],
  [-3, 0, 15, 0.5], # down the ball's side into the block: both at once
  [5, 0, 40],
]
)";
}

}  // namespace hybrid
