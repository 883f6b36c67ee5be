// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "device/loop/stop_signal.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/report_page.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"
#include "hybrid/study/study_report.h"

namespace hybrid {

int study(const StudyCommand& command) {
  StudyOptions options = command.options;
  options.scans = pair_scans(command.scans, command.labels);
  const ReportRequest page{.folder = options.out, .command = command.command_line};
  Outputs outputs;
  ask_report(outputs, page);
  outputs.ask_json(command.json);
  options.progress = progress_on_terminal();
  std::vector<JudgedScan> judged;
  std::optional<int> signal;
  try {
    const device::StopOnSignal stop;
    study(options, [&](const JudgedScan& scan, std::size_t number) {
      end_progress();
      fmt::print(stderr, "{} of {}, {}\n", number, options.scans.size(), scan_words(scan));
      judged.push_back(scan);
    });
  } catch (const device::StopAsked& asked) {
    signal = asked.signal;
  }
  const Study result = arranged(std::move(judged), options.error_jnd);
  end_progress();
  nlohmann::ordered_json report = report_head("study");
  report["command_line"] = command.command_line;
  report.update(study_json(result));
  outputs.write_json(command.json, report);
  write_report(outputs, page, study_page(result, fmt::format("Study of {} scans", result.scans.size())),
               report);
  fmt::print(outputs.words(), "{}", study_words(result));
  outputs.say_files();
  if (signal) {
    return outputs.say_stopped(*signal,
                               fmt::format("{} of {} scans", result.scans.size(), options.scans.size()));
  }
  const bool any =
      std::ranges::any_of(result.scans, [](const StudiedScan& scan) { return scan.judged.failed.empty(); });
  return outputs.failed() || !any ? 1 : 0;
}

}  // namespace hybrid
