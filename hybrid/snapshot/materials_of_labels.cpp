// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/snapshot/materials_of_labels.h"

#include <map>

namespace hybrid {

MaterialsOfLabels materials_of_labels(const SoftDescription& description, const SoftBody& body) {
  MaterialsOfLabels result;
  std::map<std::string, std::uint8_t> number;
  const auto number_of = [&](const std::string& name) {
    const auto [at, fresh] = number.try_emplace(name, static_cast<std::uint8_t>(number.size()));
    if (fresh) result.names.push_back(name);
    return at->second;
  };
  for (std::size_t label = 1; label < 256; ++label) {
    const auto own = description.materials.find(static_cast<std::uint8_t>(label));
    const std::string& name = own != description.materials.end() ? own->second : description.material;
    result.of_label[label] = number_of(name.empty() ? kUnnamed : name);
  }
  // A strut has the material of the tissue that it replaces.
  for (const auto& [strut, label] : body.struts) result.of_label[strut] = result.of_label[label];
  return result;
}

}  // namespace hybrid
