// SPDX-License-Identifier: GPL-3.0-or-later
// The tables of objects, [[rigid]] and [[soft]], of a scene file. read_soft() is in read_soft.cpp, the
// other functions are in read_rigid.cpp.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {

// Each function reads one table and checks everything in it, except references to other tables (names,
// materials), which the caller checks. `number` counts the tables of the kind from 1, for messages about a
// table without a name.
RigidDescription read_rigid(const SceneSource& source, const TreeNode& table, std::size_t number);
SoftDescription read_soft(const SceneSource& source, const TreeNode& table, std::size_t number);

// Parts that both kinds of table have in common.
TableReader object_table(const SceneSource& source, const TreeNode& table, const std::string& kind,
                         std::size_t number);
std::string read_name(const TableReader& table);
Pose read_pose(const TableReader& table);
MeshSource read_mesh_source(const TableReader& table);
// `energy` of an object or a material; empty if absent.
std::optional<Energy> read_energy(const TableReader& table);
// Rules from `labels`, `range` or `ranges`; empty without these keys. `keep_labels`: each label of `labels`
// keeps its number; otherwise all become label 1.
std::vector<voxel::LabelRule> read_label_rules(const TableReader& table, bool keep_labels);
// The key that names the source; exactly one must be present.
std::string_view source_key(const TableReader& table, std::span<const std::string_view> keys);

}  // namespace hybrid
