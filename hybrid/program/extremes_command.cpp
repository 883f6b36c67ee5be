// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "device/loop/stop_signal.h"
#include "hybrid/program/commands.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"
#include "hybrid/stress/extremes.h"
#include "hybrid/stress/fuzz_ticks.h"

namespace hybrid {
namespace {

nlohmann::ordered_json fuzz(const ExtremesCommand& command, std::FILE* words, bool& ok) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  const FuzzOptions options{.ticks = command.fuzz_ticks,
                            .seed = command.seed,
                            .async_relaxation = command.async_relaxation,
                            .progress = progress_on_terminal()};
  for (const FuzzResult& r : fuzz_ticks(options)) {
    end_progress();
    fmt::print(
        words,
        "fuzz {:<8} {} ticks, {} in contact, {} inputs held back, {} recoveries; at most {:.3g} N, "
        "{:.2g} um inside, {:.2g} % of the work beyond its account, slowest tick {:.3g} ms, hash {:016x}\n",
        r.scene, r.ticks, r.contact_ticks, r.nonfinite, r.recoveries, r.most_N, 1e6 * r.inside_m,
        100.0 * r.excess_share, 1e-3 * r.slowest_us, r.hash);
    for (const std::string& failure : r.failures) fmt::print(words, "FELL SHORT  {}\n", failure);
    ok = ok && r.failures.empty();
    rows.push_back({{"scene", r.scene},
                    {"ticks", r.ticks},
                    {"contact_ticks", r.contact_ticks},
                    {"nonfinite", r.nonfinite},
                    {"recoveries", r.recoveries},
                    {"max_force_N", r.most_N},
                    {"inside_m", r.inside_m},
                    {"excess_share", r.excess_share},
                    {"slowest_us", r.slowest_us},
                    {"hash", fmt::format("{:016x}", r.hash)},
                    {"faults", fault_texts(r.faults)},
                    {"failures", r.failures}});
  }
  return rows;
}

}  // namespace

int extremes(const ExtremesCommand& command) {
  Outputs outputs;
  outputs.ask_json(command.json);
  std::FILE* words = outputs.words();
  const device::StopOnSignal stop;  // after a signal, temporary files are removed
  nlohmann::ordered_json report = report_head("stability");
  report["scene"] = command.scene.string();
  bool ok = true;
  if (command.table) {
    const std::vector<ExtremeRow> rows = run_extremes(
        {.quick = command.quick, .scene = command.scene, .progress = progress_on_terminal(), .on_row = {}});
    end_progress();
    report["rows"] = nlohmann::ordered_json::array();
    for (const ExtremeRow& row : rows) report["rows"].push_back(to_json(row));
    fmt::print(words, "{}", extremes_text(rows));
    ok = std::all_of(rows.begin(), rows.end(), [](const ExtremeRow& row) { return row.ok; });
  }
  if (command.fuzz_ticks > 0) report["fuzz"] = fuzz(command, words, ok);
  report["ok"] = ok;
  outputs.write_json(command.json, report);
  return ok && !outputs.failed() ? 0 : 1;
}

}  // namespace hybrid
