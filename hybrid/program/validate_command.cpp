// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "hybrid/program/commands.h"
#include "hybrid/program/report_page.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"
#include "hybrid/validate/table.h"
#include "hybrid/validate/validate.h"

namespace hybrid {

int validate(const ValidateCommand& command) {
  Outputs outputs;
  ask_report(outputs, command.report);
  outputs.ask_json(command.json);
  const ValidationReport report =
      validate(ValidationOptions{.quick = command.quick, .progress = progress_on_terminal()});
  end_progress();
  nlohmann::ordered_json json = report_head("validate");
  json["quick"] = command.quick;
  add_to_json(report, json);
  outputs.write_json(command.json, json);
  if (!command.report.folder.empty())
    write_report(outputs, command.report, validation_page(report, command.quick), json);
  fmt::print(outputs.words(), "{}", validation_table(report));
  outputs.say_files();
  return count(report).failed > 0 || outputs.failed() ? 1 : 0;
}

}  // namespace hybrid
