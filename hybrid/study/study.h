// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid study`: composes a scene from each of many scans, and finds the cost and the error of each scene.
// The scans that are unlike the others come first.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "hybrid/study/judge_scan.h"

namespace hybrid {

// A figure of a scan that is far above those of the other scans.
struct Outlier {
  std::string figure{};  // "error", "largest error", "tick", "memory", "load"
  double times_median = 0.0;
};

struct StudiedScan {
  JudgedScan judged{};
  std::vector<Outlier> outliers{};
};

struct Study {
  // Failed scans first, then by how far error or tick are beyond their bounds, the worst first.
  std::vector<StudiedScan> scans{};
  double error_jnd = 1.0;
};

// Judges all scans in turn. Calls `on_scan` with each of them, and its number from 1 on. Throws
// device::StopAsked after a signal. The folders of the scans keep the finished parts.
void study(const StudyOptions& options, const std::function<void(const JudgedScan&, std::size_t)>& on_scan);

// Sorts the scans, and finds outliers.
Study arranged(std::vector<JudgedScan> scans, double error_jnd);

// An outlier's modified z-score of the logarithm exceeds this bound (Iglewicz and Hoaglin, 'How to Detect and
// Handle Outliers', 1993). Only high values count.
inline constexpr double kOutlierScore = 3.5;
inline constexpr std::size_t kFewestForOutliers = 5;  // scans with figures

// The values that are outliers among `values`, as multiples of the median; 0: no outlier. Values must not be
// negative.
std::vector<double> outliers_among(const std::vector<double>& values);

}  // namespace hybrid
