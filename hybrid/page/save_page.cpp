// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "hybrid/base/whole_file.h"
#include "hybrid/page/page.h"

namespace hybrid {
namespace {

// A field of a CSV file (RFC 4180). It is quoted if it contains a comma, a quote or a line break.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? std::string("\"\"") : std::string(1, c);
  return field + "\"";
}

}  // namespace

std::string table_csv(const PageTable& table) {
  std::string csv;
  for (std::size_t c = 0; c < table.head.size(); ++c) csv += (c > 0 ? "," : "") + csv_field(table.head[c]);
  csv += '\n';
  for (const auto& row : table.rows) {
    for (std::size_t c = 0; c < row.size(); ++c) {
      csv += c > 0 ? "," : "";
      csv += row[c].value ? nlohmann::json(*row[c].value).dump() : csv_field(row[c].text);
    }
    csv += '\n';
  }
  return csv;
}

std::vector<std::filesystem::path> save_page(const std::filesystem::path& folder, const Page& page) {
  std::vector<std::filesystem::path> written;
  const auto save = [&](const std::string& name, std::string_view text) {
    save_text(folder / name, text);
    written.push_back(folder / name);
  };
  save(std::string(kPageFile), to_html(page));
  save("report.json", page_json(page).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + '\n');
  for (const PageSection& section : page.sections) {
    for (const PagePart& part : section.parts) {
      if (const auto* table = std::get_if<PageTable>(&part)) save(table->name + ".csv", table_csv(*table));
      const auto* figure = std::get_if<PageFigure>(&part);
      if (figure == nullptr) continue;
      const bool svg = !figure->svg.empty();
      save(figure->name + (svg ? ".svg" : ".png"), svg ? figure->svg : figure->png);
    }
  }
  return written;
}

}  // namespace hybrid
