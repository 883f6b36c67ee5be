// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/read_material.h"

#include <cmath>
#include <string_view>
#include <vector>

#include "hybrid/scene/read_objects.h"

namespace hybrid {
namespace {

constexpr UnsupportedKey material_later[] = {
    {"elastic", "remove it: every material is elastic up to its yield"},
    {"plastic", "say from which strain on: yield = 0.2"},
    {"damping", "remove it: tissue is quasi-static for now"},
    {"density", "remove it: tissue has no mass here"},
};
void read_stretch(const TableReader& table, Material& out) {
  const TreeNode& stretch = table.list("stretch", "[0.4, 1.6]");
  if (stretch.items.size() != 2) {
    table.refuse("stretch", words("'stretch' in ", table.what(), " has ", stretch.items.size(), " numbers"),
                 "give two, the shortest and the longest of a link by its rest length: stretch = [0.4, 1.6]");
  }
  const Quantity any{"a finite number", "1", 1.0, -1e300, 1e300};
  out.stretch_min = table.number_at(stretch.items[0], stretch.items[0].place, "'stretch' (min)", any);
  out.stretch_max = table.number_at(stretch.items[1], stretch.items[1].place, "'stretch' (max)", any);
  if (out.stretch_min > out.stretch_max) {
    table.refuse("stretch",
                 words("'stretch' in ", table.what(), " has its min ", in_words(out.stretch_min),
                       " above its max ", in_words(out.stretch_max)),
                 "put the smaller number first: stretch = [min, max]");
  }
  const bool usable =
      out.stretch_min > 0.0 && out.stretch_min <= 1.0 && out.stretch_max >= 1.0 && out.stretch_max <= 1e6;
  if (!usable) {
    table.refuse("stretch",
                 words("'stretch' in ", table.what(), " is [", in_words(out.stretch_min), ", ",
                       in_words(out.stretch_max), "], which leaves out a link at rest, or a positive length"),
                 "keep 0 < min <= 1 <= max <= 1e6, e.g. stretch = [0.4, 1.6]");
  }
}

Material read_material(const TableReader& table) {
  static constexpr std::string_view keys[] = {"young", "poisson", "stretch", "shear", "yield", "energy"};
  table.allow(keys, material_later);
  Material out;
  out.place = table.place();
  out.young_Pa =
      table.number("young", {"Young's modulus above 0, in Pa", "3000", 1.0, 1e-3, 1e13}, out.young_Pa);
  out.poisson = table.number(
      "poisson", {"Poisson's ratio, below 0.5", "0.3", 1.0, 0.0, std::nextafter(0.5, 0.0)}, out.poisson);
  if (table.has("stretch")) read_stretch(table, out);
  out.shear =
      table.number("shear", {"a share of the rest length, 0 or more", "0.6", 1.0, 0.0, 1e6}, out.shear);
  out.yield = table.number(
      "yield", {"a strain, above 0, beyond which it stays deformed", "0.2", 1.0, 1e-6, 1e6}, out.yield);
  out.energy = read_energy(table);
  if (out.energy == Energy::trilinear && std::isfinite(out.yield)) {
    table.refuse("energy", words(table.what(), " has both a yield and the trilinear energy"),
                 "take one of them away: what yields is of links");
  }
  // Refuses materials whose links may slip but not stretch, or stretch but not slip. Relaxation moves single
  // voxels and blocks of voxels. Neither can move without violating the limits of such links, so tissue would
  // stay as it was pressed.
  const bool stretches = out.stretch_max > out.stretch_min, slips = out.shear > 0.0;
  if (stretches != slips) {
    table.refuse(
        table.has("shear") ? "shear" : "stretch",
        words("the links of ", table.what(),
              slips ? " may slip but not stretch" : " may stretch but not slip",
              ", and nothing would bring back what is pressed"),
        "give both some slack, e.g. stretch = [0.99, 1.01] and shear = 0.01, or neither: stretch = [1, "
        "1] and shear = 0");
  }
  return out;
}

}  // namespace

void read_materials(const TableReader& table, Scene& scene) {
  for (const TreeEntry& entry : table.entries()) {
    const std::string& name = entry.key;
    table.source().gather([&] {
      if (entry.value.kind != TreeNode::Kind::table) {
        table.source().refuse(entry.place,
                              words(in_quotes(name), " in [material] is ", kind_in_words(entry.value.kind)),
                              "give every material a name and a table: [material.tissue]");
      }
      scene.materials.emplace(name,
                              read_material(TableReader(table.source(), entry.value, entry.place,
                                                        words("[material.", printable(name, 60), "]"))));
    });
  }
}

void check_material(const SceneSource& source, const Scene& scene, const SoftDescription& soft,
                    const std::string& name, SourcePlace place) {
  if (name.empty() || scene.materials.contains(name)) return;
  const std::string what =
      words("[[soft]] '", soft.name, "' is of material ", in_quotes(name), ", which is not defined");
  if (scene.materials.empty())
    source.refuse(place, what, words("add a table [material.", printable(name, 60), "]"));
  std::vector<std::string_view> names;
  for (const auto& [known, material] : scene.materials) names.push_back(known);
  source.refuse(place, what,
                words("did you mean '", nearest_name(name, names), "'? Else add a table [material.",
                      printable(name, 60), "]"));
}

}  // namespace hybrid
