// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/page/page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <utility>

#include "hybrid/base/letters.h"
#include "hybrid/base/number_text.h"
#include "hybrid/page/assets.h"
#include "hybrid/page/embed.h"
#include "hybrid/plot/svg_canvas.h"

namespace hybrid {
namespace {

// From so many letters on, a text gets a wider column, so that it does not become a tall stack of words.
constexpr std::size_t kMediumText = 18, kLongText = 48;

std::string width_class(const std::string& text) {
  const std::size_t count = letters(text);
  return count > kLongText ? "long" : count > kMediumText ? "medium" : "";
}

nlohmann::ordered_json cell_json(const PageCell& cell) {
  return cell.value ? nlohmann::ordered_json(*cell.value) : nlohmann::ordered_json(cell.text);
}

std::string class_of(PageMark mark) {
  return mark == PageMark::good ? "good" : mark == PageMark::bad ? "bad" : "";
}

std::string class_attribute(const std::string& names) {
  return names.empty() ? "" : " class=\"" + names + "\"";
}

bool is_number_column(const PageTable& table, std::size_t column) {
  return column > 0 && std::ranges::any_of(table.rows, [column](const auto& row) {
           return column < row.size() && row[column].value.has_value();
         });
}

std::string cell_html(const PageCell& cell, bool is_number) {
  std::string names = is_number ? "n" : width_class(cell.text);
  const std::string mark = class_of(cell.mark);
  if (!mark.empty()) names += (names.empty() ? "" : " ") + mark;
  const std::string value = cell.value ? " data-value=\"" + nlohmann::json(*cell.value).dump() + "\"" : "";
  return "<td" + class_attribute(names) + value + ">" + escaped(cell.text) + "</td>";
}

std::string table_html(const PageTable& table) {
  std::string html = "<div class=\"part\"><div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"" +
                     escaped(table.caption) + "\"><table>\n<caption>" + escaped(table.caption) +
                     "</caption>\n<thead><tr>";
  std::vector<bool> is_number;
  for (std::size_t c = 0; c < table.head.size(); ++c) {
    is_number.push_back(is_number_column(table, c));
    html += "<th scope=\"col\"" + class_attribute(is_number[c] ? "n" : "") + ">" + escaped(table.head[c]) +
            "</th>";
  }
  html += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    html += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c) {
      html += c == 0 ? "<th scope=\"row\"" + class_attribute(width_class(row[c].text)) + ">" +
                           escaped(row[c].text) + "</th>"
                     : cell_html(row[c], c < is_number.size() && is_number[c]);
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div></div>\n";
}

std::string figure_html(const PageFigure& figure, std::size_t number) {
  const std::string inside =
      figure.svg.empty() ? "<img alt=\"" + escaped(figure.alternative) + "\" src=\"data:image/png;base64," +
                               base64(figure.png) + "\">"
                         : inline_svg(figure.svg, "f" + std::to_string(number) + "-", figure.alternative);
  return "<figure><div class=\"wide card\" tabindex=\"0\" role=\"region\" aria-label=\"" +
         escaped("Figure " + std::to_string(number)) + "\">" + inside + "</div>\n<figcaption>Figure " +
         std::to_string(number) + ". " + escaped(figure.caption) + "</figcaption></figure>\n";
}

std::string section_html(const PageSection& section, std::size_t& figures) {
  std::string html = "<section>\n<h2>" + escaped(section.heading) + "</h2>\n";
  for (const PagePart& part : section.parts) {
    if (const auto* text = std::get_if<std::string>(&part)) html += "<p>" + escaped(*text) + "</p>\n";
    if (const auto* table = std::get_if<PageTable>(&part)) html += table_html(*table);
    if (const auto* figure = std::get_if<PageFigure>(&part)) html += figure_html(*figure, ++figures);
  }
  return html + "</section>\n";
}

std::string footer_html(const Page& page) {
  std::string html = "<footer>\n<h2>How to repeat this</h2>\n<dl>\n";
  const auto add = [&html](const char* name, const std::string& text, bool code = false) {
    if (text.empty()) return;
    html += std::string("<dt>") + name + "</dt><dd>" + (code ? "<code>" : "") + escaped(text) +
            (code ? "</code>" : "") + "</dd>\n";
  };
  add("Command", page.command, true);
  add("Version", page.version);
  add("Build", page.build);
  add("Machine", page.machine);
  add("Date", page.date);
  return html + "</dl>\n</footer>\n";
}

template <class Visit>
void for_each_table(const Page& page, const Visit& visit) {
  for (const PageSection& section : page.sections) {
    for (const PagePart& part : section.parts) {
      if (const auto* table = std::get_if<PageTable>(&part)) visit(*table);
    }
  }
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &utc)};
}

}  // namespace

void set_provenance(Page& page, std::string command, const nlohmann::ordered_json& report) {
  page.command = std::move(command);
  page.version = report.value("version", "");
  page.machine = report.value("machine", "");
  page.build = report.value("build", "");
  page.date = utc_now();
  page.data = report;
}

PageCell number_cell(std::optional<double> value, int decimals) {
  if (!value || !std::isfinite(*value)) return {.text = "–"};
  std::string text = with_decimals(*value, decimals);
  const bool is_zero = text.find_first_not_of("-0.") == std::string::npos;
  if (text.starts_with('-')) text.replace(0, 1, is_zero ? "" : "−");
  return {.text = std::move(text), .value = value};
}

PageCell count_cell(std::uint64_t count) {
  return {.text = std::to_string(count), .value = static_cast<double>(count)};
}

nlohmann::ordered_json page_json(const Page& page) {
  nlohmann::ordered_json tables = nlohmann::ordered_json::array();
  for_each_table(page, [&tables](const PageTable& table) {
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const auto& row : table.rows) {
      nlohmann::ordered_json& cells = rows.emplace_back(nlohmann::ordered_json::array());
      for (const PageCell& cell : row) cells.push_back(cell_json(cell));
    }
    tables.push_back(
        {{"name", table.name}, {"caption", table.caption}, {"head", table.head}, {"rows", std::move(rows)}});
  });
  return {{"report", page.data}, {"tables", std::move(tables)}};
}

std::string to_html(const Page& page) {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>";
  html += escaped(page.title) + "</title>\n<style>" + std::string(page_style()) +
          "</style>\n</head>\n<body>\n<main>\n";
  html += "<h1" + class_attribute(class_of(page.mark)) + ">" + escaped(page.verdict) +
          "</h1>\n<p class=\"title\">" + escaped(page.title) + "</p>\n";
  for (const std::string& paragraph : page.summary) html += "<p>" + escaped(paragraph) + "</p>\n";
  std::size_t figures = 0;
  for (const PageSection& section : page.sections) html += section_html(section, figures);
  html += "</main>\n" + footer_html(page) + "<script type=\"application/json\" id=\"data\">\n" +
          json_for_script(page_json(page)) + "\n</script>\n<script>" + std::string(page_script()) +
          "</script>\n</body>\n</html>\n";
  return html;
}

}  // namespace hybrid
