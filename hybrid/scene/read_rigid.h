// SPDX-License-Identifier: GPL-3.0-or-later
// The [[rigid]] and [[soft]] tables of a scene file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {

// Each checks all that one table says by itself; what concerns other tables (names, materials) is left to
// load_scene. `number` counts the tables of the kind from 1, for messages about one that has no name.
RigidDescription read_rigid(const SceneSource& source, const TreeNode& table, std::size_t number);
SoftDescription read_soft(const SceneSource& source, const TreeNode& table, std::size_t number);

// What both kinds share.
TableReader object_table(const SceneSource& source, const TreeNode& table, const std::string& kind,
                         std::size_t number);
std::string read_name(const TableReader& table);
Pose read_pose(const TableReader& table);
MeshSource read_mesh_source(const TableReader& table);
// `energy` of an object or a material; nothing where it does not say.
std::optional<Energy> read_energy(const TableReader& table);
// `labels` or `range` (and `ranges` where each may become its own label); none of them: no rules.
std::vector<voxel::LabelRule> read_label_rules(const TableReader& table, bool keep_labels);
// Which one of the keys names the source; exactly one must.
std::string_view source_key(const TableReader& table, std::span<const std::string_view> keys);

}  // namespace hybrid
