// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/study/pair_scans.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <stdexcept>
#include <system_error>

#include "hybrid/base/file_ending.h"
#include "hybrid/compose/write_folder.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kChannel = "_0000";  // nnU-Net: the first channel of a scan

// A file that holds a whole volume. Slices of DICOM are read by their folder.
bool is_whole_volume(const fs::path& file) {
  const std::string ending = lower_ending(file);
  return fs::is_regular_file(file) && is_volume_name(file) && ending != ".dcm" && ending != ".ima";
}

std::vector<fs::path> sorted_entries(const fs::path& folder) {
  std::vector<fs::path> entries;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.path().filename().string().starts_with('.')) entries.push_back(entry.path());
  }
  std::ranges::sort(entries);
  return entries;
}

// Adds the volumes that the path stands for. `series`: a folder of other files is a DICOM series.
void add_volumes(const fs::path& path, bool series, std::vector<fs::path>& found) {
  if (!fs::is_directory(path)) {
    found.push_back(path);
    return;
  }
  const std::vector<fs::path> entries = sorted_entries(path);
  bool holds_volumes = false;
  for (const fs::path& entry : entries) {
    if (!fs::is_directory(entry) && !is_whole_volume(entry)) continue;
    holds_volumes = true;
    add_volumes(entry, series, found);
  }
  if (!holds_volumes && !entries.empty() && series) found.push_back(path);
}

std::vector<fs::path> volumes_of(const std::vector<fs::path>& given, bool series) {
  std::vector<fs::path> found, unique;
  for (const fs::path& path : given) {
    if (!fs::exists(path)) throw std::runtime_error(fmt::format("{}: there is no such file", path.string()));
    add_volumes(path.filename().empty() ? path.parent_path() : path, series, found);
  }
  std::set<fs::path> known;
  for (const fs::path& path : found) {
    if (known.insert(fs::weakly_canonical(path)).second) unique.push_back(path);
  }
  return unique;
}

// The file's name without the endings of its format.
std::string stem_of_volume(const fs::path& file) {
  if (fs::is_directory(file)) return file.filename().string();
  const fs::path stem = lower_ending(file) == ".gz" ? file.stem() : file;
  return stem.stem().string();
}

std::string stem_of_scan(const fs::path& file) {
  const std::string stem = stem_of_volume(file);
  const bool channel = stem.size() > kChannel.size() && stem.ends_with(kChannel);
  return channel ? stem.substr(0, stem.size() - kChannel.size()) : stem;
}

std::string in_small_letters(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// Names of folders: the stem, with the name of the scan's folder before it if others have the same stem.
void name_them(std::vector<ScanPair>& pairs) {
  const auto file_of = [](const ScanPair& pair) { return pair.scan.empty() ? pair.labels : pair.scan; };
  std::map<std::string, int> stems;
  for (const ScanPair& pair : pairs) ++stems[in_small_letters(stem_of_scan(file_of(pair)))];
  std::set<std::string> used;
  for (ScanPair& pair : pairs) {
    std::string name = stem_of_scan(file_of(pair));
    if (stems.at(in_small_letters(name)) > 1) {
      const fs::path folder = fs::absolute(file_of(pair)).lexically_normal().parent_path();
      name = folder.filename().string() + "-" + name;
    }
    name = name_letters(name);
    pair.name = name;
    for (int n = 2; !used.insert(in_small_letters(pair.name)).second; ++n)
      pair.name = fmt::format("{}-{}", name, n);
  }
}

// Indices of the scans to which the labels belong by their name. Several scans may have the same name.
std::vector<std::size_t> scans_by_name(const std::vector<fs::path>& scans, const fs::path& labels) {
  const std::string label_stem = stem_of_volume(labels);
  std::vector<std::size_t> best;
  std::size_t longest = 0;
  for (std::size_t n = 0; n < scans.size(); ++n) {
    const std::string stem = stem_of_scan(scans[n]);
    const bool whole_word = label_stem.size() == stem.size() ||
                            (label_stem.size() > stem.size() &&
                             std::isalnum(static_cast<unsigned char>(label_stem[stem.size()])) == 0);
    if (!label_stem.starts_with(stem) || !whole_word || stem.size() < longest) continue;
    if (stem.size() > longest) best.clear();
    longest = stem.size();
    best.push_back(n);
  }
  return best;
}

fs::path folder_of(const fs::path& file) {
  return fs::weakly_canonical(fs::absolute(file)).parent_path();
}

// [scan] the label volumes that belong to it.
std::vector<std::vector<fs::path>> labels_of_scans(const std::vector<fs::path>& scans,
                                                   const std::vector<fs::path>& labels) {
  std::vector<std::vector<fs::path>> owned(scans.size());
  std::map<fs::path, int> scans_in, labels_in;
  for (const fs::path& scan : scans) ++scans_in[folder_of(scan)];
  for (const fs::path& file : labels) ++labels_in[folder_of(file)];
  for (const fs::path& file : labels) {
    const fs::path folder = folder_of(file);
    const bool alone = scans_in[folder] == 1 && labels_in[folder] == 1;
    std::vector<std::size_t> found = scans_by_name(scans, file);
    // If several scans have the same name, the labels belong to the scan in the same folder.
    std::erase_if(found, [&](std::size_t n) { return found.size() > 1 && folder_of(scans[n]) != folder; });
    if (found.size() != 1 && alone) {
      found.clear();
      for (std::size_t n = 0; n < scans.size(); ++n) {
        if (folder_of(scans[n]) == folder) found.push_back(n);
      }
    }
    if (found.empty() && scans.size() == 1 && labels.size() == 1) found.push_back(0);
    if (found.size() == 1) owned[found.front()].push_back(file);
  }
  return owned;
}

// Labels that the user gave by the name of a row.
struct NamedLabels {
  std::string name;
  fs::path file;
};

// Takes the entries NAME=FILE out of `labels`. The name of a file may contain '=', too.
std::vector<NamedLabels> named_among(const std::vector<std::string>& labels, std::vector<fs::path>& rest) {
  std::vector<NamedLabels> named;
  for (const std::string& text : labels) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || fs::exists(text)) {
      rest.emplace_back(text);
      continue;
    }
    named.push_back({text.substr(0, equals), text.substr(equals + 1)});
    if (!fs::exists(named.back().file))
      throw std::runtime_error(fmt::format("{}: there is no such file", named.back().file.string()));
  }
  return named;
}

void give_named(const std::vector<NamedLabels>& named, std::vector<ScanPair>& pairs) {
  for (const NamedLabels& given : named) {
    const auto found = std::ranges::find(pairs, given.name, &ScanPair::name);
    if (found == pairs.end()) {
      std::vector<std::string_view> known;
      for (const ScanPair& pair : pairs) known.push_back(pair.name);
      throw std::runtime_error(fmt::format("--labels {}={}: no scan has this name; the nearest is \"{}\"",
                                           given.name, given.file.string(), nearest_name(given.name, known)));
    }
    found->labels = given.file;
    found->unpaired.clear();
  }
}

void take_labels(ScanPair& pair, const std::vector<fs::path>& owned, std::size_t given) {
  const auto exact = std::ranges::find_if(
      owned, [&](const fs::path& file) { return stem_of_volume(file) == stem_of_scan(pair.scan); });
  if (exact != owned.end()) {
    pair.labels = *exact;
  } else if (owned.size() == 1) {
    pair.labels = owned.front();
  } else if (owned.empty()) {
    pair.unpaired = fmt::format(
        "none of the {} label volumes belongs to it by name; say --labels {}=FILE, or call the file "
        "{}_labels.nii.gz",
        given, stem_of_scan(pair.scan), stem_of_scan(pair.scan));
  } else {
    pair.unpaired = fmt::format(
        "{} label volumes belong to it by name, {} and {} among them; say --labels {}=FILE", owned.size(),
        owned[0].filename().string(), owned[1].filename().string(), stem_of_scan(pair.scan));
  }
}

}  // namespace

std::vector<ScanPair> pair_scans(const std::vector<fs::path>& scans, const std::vector<std::string>& labels) {
  std::vector<fs::path> unnamed;
  const std::vector<NamedLabels> named = named_among(labels, unnamed);
  const std::vector<fs::path> all = volumes_of(scans, true);
  const std::vector<fs::path> segmented = volumes_of(unnamed, false);
  if (all.empty()) throw std::runtime_error("no volume and no DICOM series in the folders of the scans");
  if (!unnamed.empty() && segmented.empty()) throw std::runtime_error("no volume in the folders of --labels");
  std::vector<fs::path> images;
  for (const fs::path& file : all) {
    const auto same = [&](const fs::path& other) { return fs::equivalent(file, other); };
    const bool is_label =
        std::ranges::any_of(segmented, same) || std::ranges::any_of(named, same, &NamedLabels::file);
    if (!is_label) images.push_back(file);
  }
  std::vector<ScanPair> pairs;
  if (images.empty()) {
    for (const fs::path& file : all) pairs.push_back({.labels = file});
  } else {
    const auto owned = labels_of_scans(images, segmented);
    for (std::size_t n = 0; n < images.size(); ++n) {
      pairs.push_back({.scan = images[n]});
      if (!labels.empty()) take_labels(pairs.back(), owned[n], segmented.size());
    }
  }
  name_them(pairs);
  give_named(named, pairs);
  std::ranges::sort(pairs, {}, &ScanPair::name);
  return pairs;
}

}  // namespace hybrid
