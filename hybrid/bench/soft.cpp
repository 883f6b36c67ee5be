// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/soft.h"

#include <algorithm>

#include "hybrid/base/flush_to_zero.h"

namespace hybrid::bench {

const std::vector<std::string>& soft_cases() {
  static const std::vector<std::string> kCases{"wave", "relax", "session", "load"};
  return kCases;
}

std::vector<SoftRow> bench_soft(const SoftBenchOptions& options) {
  const auto wanted = [&options](const char* name) {
    return options.cases.empty() ||
           std::find(options.cases.begin(), options.cases.end(), name) != options.cases.end();
  };
  std::vector<SoftEngine> engines = options.engines;
  if (engines.empty()) engines.assign(kSoftEngines.begin(), kSoftEngines.end());
  const ScopedFlushToZero flushed;  // as in a session
  std::vector<SoftRow> rows;
  const AddRow add = [&](SoftRow row) {
    if (options.on_row) options.on_row(row);
    rows.push_back(std::move(row));
  };
  if (wanted("wave")) bench_waves(options, engines, add);
  if (wanted("relax")) bench_relaxation(options, engines, add);
  const bool ours = std::find(engines.begin(), engines.end(), SoftEngine::hybrid) != engines.end();
  if (ours && (wanted("session") || wanted("load")))
    bench_sessions(options, wanted("session"), wanted("load"), add);
  return rows;
}

}  // namespace hybrid::bench
