// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/unused_keys.h"

#include <algorithm>
#include <set>

namespace hybrid {
namespace {

// The tables of `key` in the order of the file, which is also that of scene.rigid and scene.soft.
std::vector<const TreeNode*> tables_of(const TableReader& root, std::string_view key) {
  std::vector<const TreeNode*> tables;
  const TreeEntry* entry = root.find(key);
  if (entry == nullptr) return tables;
  for (const TreeNode& item : entry->value.items) tables.push_back(&item);
  return tables;
}

class UnusedKeys {
 public:
  UnusedKeys(const TableReader& root, Scene& scene) : root_(root), scene_(scene) {}

  void note() {
    note_hand();
    note_safety();
    note_rigid();
    note_soft();
    note_materials();
  }

 private:
  void add(const TableReader& table, std::string_view key, const std::string& object,
           const std::string& reason) {
    if (!table.has(key)) return;
    const SourcePlace place = table.place_of(key);
    scene_.unused_keys.push_back(
        {object, words("line ", place.line, ": '", key, "' has no effect: ", reason)});
  }

  [[nodiscard]] TableReader reader(const TreeNode& node) const {
    return {root_.source(), node, node.place, std::string()};
  }

  void note_hand() {
    const TreeEntry* entry = root_.find("hand");
    if (entry == nullptr) return;
    const TableReader hand = reader(entry->value);
    const bool simulated = !scene_.real_device && !is_ideal(scene_);
    if (!simulated) {
      add(root_, "hand", {},
          is_ideal(scene_) ? "the ideal device follows the path whatever the hand is"
                           : "a real device is held by a real hand");
    } else if (!hand.has("tremor_mm")) {
      add(hand, "tremor_hz", {}, "there is no tremor; add tremor_mm = 0.1, or remove it");
    }
  }

  void note_safety() {
    const TreeEntry* entry = root_.find("safety");
    if (entry == nullptr || !is_ideal(scene_) || scene_.max_energy_given) return;
    add(reader(entry->value), "energy_window", {},
        "the ideal device has no max_energy by default; add max_energy, or remove it");
  }

  void note_rigid() {
    const std::vector<const TreeNode*> tables = tables_of(root_, "rigid");
    for (std::size_t o = 0; o < tables.size() && o < scene_.rigid.size(); ++o) {
      const RigidDescription& rigid = scene_.rigid[o];
      const bool facets = std::holds_alternative<MeshSource>(rigid.source) ||
                          std::holds_alternative<VolumeSurfaceSource>(rigid.source);
      if (rigid.feel.shading && !facets)
        add(reader(*tables[o]), "shading", rigid.name, "a primitive has no facets; remove it");
    }
  }

  void note_soft() {
    const std::vector<const TreeNode*> tables = tables_of(root_, "soft");
    for (std::size_t o = 0; o < tables.size() && o < scene_.soft.size(); ++o) {
      const SoftDescription& soft = scene_.soft[o];
      const TableReader table = reader(*tables[o]);
      if (soft.model == SoftModel::proxy) {
        for (const char* key :
             {"material", "materials", "energy", "anchors", "thinning", "budget", "work", "patch"}) {
          add(table, key, soft.name,
              "the object is felt through the proxy, as rigid; remove it, or the key 'model'");
        }
        continue;
      }
      if (soft.anchors.rigid_within_m > 0.0 && scene_.rigid.empty()) {
        add(table.table("anchors"), "rigid_within", soft.name,
            "the scene has no [[rigid]] object; remove it");
      }
      if (table.has("energy") && !soft.material.empty() && every_material_has_its_energy(soft))
        add(table, "energy", soft.name, "each of its materials says its own; remove it");
    }
  }

  [[nodiscard]] bool every_material_has_its_energy(const SoftDescription& soft) const {
    return scene_.materials.at(soft.material).energy.has_value() &&
           std::all_of(soft.materials.begin(), soft.materials.end(), [this](const auto& label_and_name) {
             return scene_.materials.at(label_and_name.second).energy.has_value();
           });
  }

  void note_materials() {
    std::set<std::string> used;
    for (const SoftDescription& soft : scene_.soft) {
      used.insert(soft.material);
      for (const auto& [label, name] : soft.materials) used.insert(name);
    }
    for (const auto& [name, material] : scene_.materials) {
      if (used.contains(name)) continue;
      scene_.unused_keys.push_back(
          {{},
           words("line ", material.place.line, ": [material.", printable(name, 60),
                 "] has no effect: no [[soft]] object names it; remove it, or name it in material or "
                 "materials")});
    }
  }

  const TableReader& root_;
  Scene& scene_;
};

}  // namespace

void note_unused_keys(const TableReader& root, Scene& scene) {
  UnusedKeys(root, scene).note();
}

}  // namespace hybrid
