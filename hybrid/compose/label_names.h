// SPDX-License-Identifier: GPL-3.0-or-later
// The names of a volume's labels, and the labels that a person selects by them.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybrid {

// Refusal of an input of `compose`. The text names the error, its place and the remedy.
class ComposeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using LabelNames = std::map<int, std::string>;  // key: label, 1..255

// Reads names from a UTF-8 file. ".json": names by number or numbers by name (dataset.json of nnU-Net), or a
// list of names. These are under "labels" or at the top. Any other extension: a table (label_rows.h). Labels
// above 255 are skipped, because no volume can have them. Throws ComposeError for text that cannot be read,
// with its line, and for a table without a name.
LabelNames read_label_names(const std::filesystem::path& file);

// The labels that `words` select by number, by name, or by a pattern with '*' and '?'. `names` has a name for
// every label of `present` (the labels with voxels), and may have more. Throws ComposeError, which names
// `option`, for a word that fits no name (with the nearest name), or only names without voxels.
std::set<int> chosen_labels(const std::vector<std::string>& words, const LabelNames& names,
                            const std::set<int>& present, const std::string& option);

}  // namespace hybrid
