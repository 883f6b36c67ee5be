// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/study/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybrid {
namespace {

constexpr double kScoreOfNormal = 0.6745;  // quartile of the normal distribution, in standard deviations
// Least spread of the logarithms that counts: figures within 5 % of one another are alike.
const double kLeastSpread = std::log(1.05);
constexpr double kLeastError_jnd = 0.05;  // smaller errors are alike: no hand tells them apart

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

// The larger of two ratios: error to its bound, and tick to its bound. Infinite for a failed scan.
double badness(const JudgedScan& scan) {
  if (!scan.failed.empty()) return std::numeric_limits<double>::infinity();
  const double ratio = std::max(scan.session.p99_jnd / scan.bounds.error_jnd,
                                scan.session.tick_us.p999 / scan.bounds.budget_us);
  return scan.faults.empty() ? ratio : 1e6 + ratio;  // the figures of a session with a fault do not count
}

}  // namespace

std::vector<double> outliers_among(const std::vector<double>& values) {
  std::vector<double> times(values.size(), 0.0);
  if (values.size() < kFewestForOutliers) return times;
  std::vector<double> logs, apart;
  for (const double v : values) logs.push_back(std::log(std::max(v, std::numeric_limits<double>::min())));
  const double middle = median(logs);
  for (const double v : logs) apart.push_back(std::fabs(v - middle));
  const double spread = std::max(median(apart), kLeastSpread);
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (kScoreOfNormal * (logs[n] - middle) / spread > kOutlierScore) times[n] = std::exp(logs[n] - middle);
  }
  return times;
}

Study arranged(std::vector<JudgedScan> scans, double error_jnd) {
  std::ranges::stable_sort(scans, std::ranges::greater(), badness);
  Study study{.error_jnd = error_jnd};
  std::vector<std::size_t> whole;
  for (JudgedScan& scan : scans) {
    if (scan.failed.empty()) whole.push_back(study.scans.size());
    study.scans.push_back({.judged = std::move(scan)});
  }
  const auto find = [&](const char* figure, const auto& value_of) {
    std::vector<double> values;
    for (const std::size_t n : whole) values.push_back(value_of(study.scans[n].judged));
    const std::vector<double> times = outliers_among(values);
    for (std::size_t n = 0; n < whole.size(); ++n) {
      if (times[n] > 0.0) study.scans[whole[n]].outliers.push_back({figure, times[n]});
    }
  };
  find("error", [](const JudgedScan& s) { return std::max(s.session.p99_jnd, kLeastError_jnd); });
  find("largest error", [](const JudgedScan& s) {
    return std::max({s.session.moving_max_jnd, s.session.still_max_jnd, kLeastError_jnd});
  });
  find("tick", [](const JudgedScan& s) { return s.session.tick_us.p999; });
  find("memory", [](const JudgedScan& s) { return static_cast<double>(s.memory_bytes); });
  find("load", [](const JudgedScan& s) { return s.load_s; });
  return study;
}

void study(const StudyOptions& options, const std::function<void(const JudgedScan&, std::size_t)>& on_scan) {
  std::size_t number = 0;
  for (const ScanPair& pair : options.scans) {
    ++number;
    StudyOptions own = options;
    if (options.progress) {
      own.progress = [&](const std::string& text) {
        options.progress(fmt::format("scan {} of {}, {}: {}", number, options.scans.size(), pair.name, text));
      };
    }
    on_scan(judge_scan(pair, own), number);
  }
}

}  // namespace hybrid
