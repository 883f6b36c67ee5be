// SPDX-License-Identifier: GPL-3.0-or-later
// The scans of a study, each with its segmentation, found by the names of their files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hybrid {

struct ScanPair {
  // Name of its row and of its folder. The names of any two scans of a study differ by more than case.
  std::string name{};
  std::filesystem::path scan{};    // a volume, or a folder of a DICOM series; empty: only labels are known
  std::filesystem::path labels{};  // empty: the study has no labels, or `unpaired` says why
  std::string unpaired{};          // why no labels belong to the scan; empty if some do
};

// `scans`: volumes, DICOM folders, and folders of those. A folder without volumes and without folders is a
// DICOM series. `labels`: label volumes and folders of them; may be empty. A label volume belongs to the
//   first scan that exists of these four: - the scan that NAME=FILE names, where NAME is that of the row;
//   - the scan with whose name its own name begins ("ct_1" and "ct_1_labels"; the longest such name counts).
//     The "_0000" at the end of a scan's name (nnU-Net) is no part of the name;
//   - the scan in the same folder, if that folder has one scan and one label volume;
//   - the only scan, if there is one label volume.
// A volume that is also given as labels is no scan. If all are, the labels are composed without scans. The
// result is in the order of the names. Throws std::runtime_error: a file does not exist, nothing is found, or
// no scan has the NAME.
std::vector<ScanPair> pair_scans(const std::vector<std::filesystem::path>& scans,
                                 const std::vector<std::string>& labels);

}  // namespace hybrid
