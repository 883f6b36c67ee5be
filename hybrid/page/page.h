// SPDX-License-Identifier: GPL-3.0-or-later
// A report as one HTML file that needs nothing else: no other file, no network, no script. It prints, follows
// the light or dark scheme of the reader, and holds its data as JSON. All text is escaped.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace hybrid {

// Words that are also set apart by colour.
enum class PageMark : std::uint8_t { none, good, bad };

struct PageCell {
  std::string text;               // as it is read
  std::optional<double> value{};  // of a number: the table is sorted by it, and JSON and CSV hold it
  PageMark mark = PageMark::none;
};
// "1.25", with the full value behind it; "–" where there is none or it is not finite.
PageCell number_cell(std::optional<double> value, int decimals);
PageCell count_cell(std::uint64_t count);

struct PageTable {
  std::string name;                         // of its CSV file, without ending
  std::string caption;                      // one sentence
  std::vector<std::string> head;            // with units
  std::vector<std::vector<PageCell>> rows;  // as wide as the head; the first cell names its row
};

// One of `svg` and `png` is given.
struct PageFigure {
  std::string name;         // of its file, without ending
  std::string caption;      // one or two sentences, below the figure
  std::string alternative;  // for readers who do not see it
  std::string svg{};        // as of to_svg()
  std::string png{};        // the bytes of a file
};

using PagePart = std::variant<std::string, PageTable, PageFigure>;  // the text is one paragraph
struct PageSection {
  std::string heading;
  std::vector<PagePart> parts;
};

struct Page {
  std::string title;    // of the window
  std::string verdict;  // the first line: one sentence
  PageMark mark = PageMark::none;
  std::vector<std::string> summary{};  // paragraphs below the verdict
  std::vector<PageSection> sections{};
  std::string command{};                              // that makes the page again
  std::string version{}, machine{}, build{}, date{};  // stand at the end; those that are empty are left out
  nlohmann::ordered_json data = nullptr;              // the report
};

// {report, tables[{name, caption, head, rows}]}: what the page embeds and save_page() writes. A cell is a
// number where it has a value, else a text.
nlohmann::ordered_json page_json(const Page& page);
std::string table_csv(const PageTable& table);
std::string to_html(const Page& page);

// Writes report.html, report.json, a CSV for each table and a file for each figure into the folder. Each file
// is written whole or not at all. Other files there stay. Returns what was written, report.html first. Throws
// std::runtime_error: not writable.
std::vector<std::filesystem::path> save_page(const std::filesystem::path& folder, const Page& page);
inline constexpr std::string_view kPageFile = "report.html";

}  // namespace hybrid
