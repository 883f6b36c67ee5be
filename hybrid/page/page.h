// SPDX-License-Identifier: GPL-3.0-or-later
// A report as one HTML file that needs no other file, no network and no script. It can be printed, follows
// the reader's light or dark scheme, and contains its data as JSON. All text is escaped.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace hybrid {

// Colour of a word, in addition to its text.
enum class PageMark : std::uint8_t { none, good, bad };

struct PageCell {
  std::string text;               // as the reader sees it
  std::optional<double> value{};  // of a number; used for sorting, JSON and CSV
  PageMark mark = PageMark::none;
};
// A cell like "1.25" that holds the full value. "–" if there is no value or it is not finite.
PageCell number_cell(std::optional<double> value, int decimals);
PageCell count_cell(std::uint64_t count);

struct PageTable {
  std::string name;                         // name of its CSV file, without ending
  std::string caption;                      // one sentence
  std::vector<std::string> head;            // headings, with units
  std::vector<std::vector<PageCell>> rows;  // as many cells as headings; the first cell names the row
};

// Either `svg` or `png` is given.
struct PageFigure {
  std::string name;         // name of its file, without ending
  std::string caption;      // one or two sentences, below the figure
  std::string alternative;  // text for readers who do not see the figure
  std::string svg{};        // from to_svg()
  std::string png{};        // bytes of a PNG file
};

using PagePart = std::variant<std::string, PageTable, PageFigure>;  // a string is one paragraph
struct PageSection {
  std::string heading;
  std::vector<PagePart> parts;
};

struct Page {
  std::string title;    // title of the browser's window
  std::string verdict;  // the first line: one sentence
  PageMark mark = PageMark::none;
  std::vector<std::string> summary{};  // paragraphs below the verdict
  std::vector<PageSection> sections{};
  std::string command{};                              // command that makes the page again
  std::string version{}, machine{}, build{}, date{};  // at the end of the page; empty ones are left out
  nlohmann::ordered_json data = nullptr;              // the report as JSON
};

// {report, tables[{name, caption, head, rows}]}: the data that the page contains and save_page() writes. A
// cell is a number if it has a value, otherwise a text.
nlohmann::ordered_json page_json(const Page& page);
std::string table_csv(const PageTable& table);
std::string to_html(const Page& page);

// Fills the entries at the end of the page: `command`, the time now, and version, machine and build from
// `report`. `report` is the page's data too; it must begin with report_head().
void set_provenance(Page& page, std::string command, const nlohmann::ordered_json& report);

// Writes report.html, report.json, a CSV file for each table and a file for each figure into the folder. Each
// file is written whole or not at all. Other files in the folder stay. Returns the files that were written,
// report.html first. Throws std::runtime_error if a file is not writable.
std::vector<std::filesystem::path> save_page(const std::filesystem::path& folder, const Page& page);
inline constexpr std::string_view kPageFile = "report.html";

}  // namespace hybrid
