// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/report_page.h"

#include <nlohmann/json.hpp>
#include <string_view>

namespace hybrid {
namespace {

std::string quoted_for_shell(std::string_view word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=,+@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos) return std::string(word);
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

std::string command_line(int count, const char* const* words) {
  std::string line;
  for (int w = 0; w < count; ++w) line += (w > 0 ? " " : "") + quoted_for_shell(words[w]);
  return line;
}

void ask_report(Outputs& outputs, const ReportRequest& request) {
  if (!request.folder.empty()) outputs.ask("--report", request.folder / kPageFile, {".html"});
}

void write_report(Outputs& outputs, const ReportRequest& request, Page page,
                  const nlohmann::ordered_json& report) {
  set_provenance(page, request.command, report);
  outputs.attempt([&] { outputs.wrote("page", save_page(request.folder, page).front()); });
}

}  // namespace hybrid
