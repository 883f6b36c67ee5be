// SPDX-License-Identifier: GPL-3.0-or-later
// What the labels of a volume are called, and which of them a person means.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybrid {

// An input of `compose` that is refused: what is wrong, where, and what to do.
class ComposeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using LabelNames = std::map<int, std::string>;  // 1..255

// From a table (label_rows.h) or JSON, by its extension: under "labels" or at its top, names by number or
// numbers by name (dataset.json of nnU-Net), or a list of names. UTF-8. Labels above 255, which no volume can
// have, are passed over. Throws ComposeError: what cannot be read, with its line, and a table without a name.
LabelNames read_label_names(const std::filesystem::path& file);

// The labels that the words name: by number, by name, or by a pattern with '*' and '?'. `names` has a name
// for every label of `present` (those with voxels), and may have more. Throws ComposeError, with `option` as
// where it was said: a word that fits no name (with the nearest that there is), or none that has voxels.
std::set<int> chosen_labels(const std::vector<std::string>& words, const LabelNames& names,
                            const std::set<int>& present, const std::string& option);

}  // namespace hybrid
