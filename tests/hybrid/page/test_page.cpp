// SPDX-License-Identifier: GPL-3.0-or-later
// Report pages: texts are escaped, nothing is loaded from elsewhere, and the visible tables show the embedded
// data.
#include "hybrid/page/page.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <regex>
#include <set>
#include <sstream>

#include "hybrid/page/assets.h"
#include "hybrid/page/embed.h"
#include "hybrid/plot/svg_figure.h"
#include "tests/hybrid/plot/svg_fixture.h"

namespace {

using hybrid::Page;
using hybrid::PageTable;

const std::string hostile = "</script><script>alert('1')</script> & \"quoted\" <b>";

hybrid::Figure two_points(const std::string& title) {
  hybrid::Figure figure;
  figure.title = title;
  auto& panel = figure.groups.emplace_back().panels.emplace_back();
  panel.series.push_back({.name = hostile, .x = {0.0, 1.0}, .y = {0.0, 2.0}});
  return figure;
}

PageTable numbers() {
  return {.name = "numbers",
          .caption = "Forces",
          .head = {"case", "force (N)", "verdict"},
          .rows = {{{.text = "soft, \"a\""}, hybrid::number_cell(-1.25, 1), {.text = "inside"}},
                   {{.text = hostile}, hybrid::number_cell(1.0 / 3.0, 3), {.text = "outside"}},
                   {{.text = "none"}, hybrid::number_cell({}, 3), {.text = hostile}}}};
}

Page hostile_page() {
  Page page{.title = hostile, .verdict = hostile, .summary = {hostile}, .sections = {}};
  page.command = hostile;
  page.version = page.machine = page.date = hostile;
  page.data = {{"key", hostile}};
  const std::string svg = hybrid::to_svg(two_points(hostile));
  page.sections.push_back({.heading = hostile, .parts = {hostile, numbers()}});
  for (const char* name : {"one", "two"}) {
    page.sections.push_back(
        {.heading = name,
         .parts = {hybrid::PageFigure{.name = name, .caption = hostile, .alternative = hostile, .svg = svg},
                   hybrid::PageFigure{.name = std::string(name) + "-picture",
                                      .caption = "png",
                                      .alternative = hostile,
                                      .png = std::string("not really\0a png", 16)}}});
  }
  return page;
}

std::vector<std::string> matches(const std::string& text, const std::string& pattern, std::size_t group = 1) {
  std::vector<std::string> found;
  const std::regex regex(pattern);
  for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at)
    found.push_back((*at)[group].str());
  return found;
}

nlohmann::json embedded(const std::string& html) {
  const std::string begin = "id=\"data\">", end = "</script>";
  const std::size_t from = html.find(begin) + begin.size();
  return nlohmann::json::parse(html.substr(from, html.find(end, from) - from));
}

TEST(Page, NoTextGetsOutOfItsPlace) {
  const std::string html = to_html(hostile_page());
  const std::string seen = html.substr(0, html.find("id=\"data\""));
  EXPECT_EQ(tests::count(seen, "alert('1')"), 0U) << "a quote of a text is escaped";
  EXPECT_EQ(tests::count(html, "<script"), 2U) << "the data and the page's own";
  EXPECT_EQ(tests::count(html, "<b>"), 0U);
  const nlohmann::json data = embedded(html);
  EXPECT_EQ(data["report"]["key"], hostile);
}

TEST(Page, LoadsNothingFromElsewhere) {
  const std::string html = to_html(hostile_page());
  for (const std::string& source : matches(html, "(?:src|href|action|srcset)=\"([^\"]*)\""))
    EXPECT_TRUE(source.starts_with("data:image/png;base64,")) << source;
  for (const char* loads :
       {"@import", "<link", "<iframe", "<object", "<embed", "fetch(", "XMLHttpRequest", "import(", "<base"})
    EXPECT_EQ(tests::count(html, loads), 0U) << loads;
  // The address of SVG's name space is only a name and loads nothing.
  const std::string without = std::regex_replace(html, std::regex("http://www.w3.org/2000/svg"), "");
  EXPECT_EQ(tests::count(without, "http"), 0U);
  for (const std::string& place : matches(html, "url\\(([^)]*)\\)"))
    EXPECT_TRUE(place.starts_with("#")) << place;
}

TEST(Page, FiguresDoNotShareNames) {
  const std::string html = to_html(hostile_page());
  std::set<std::string> ids;
  for (const std::string& id : matches(html, " id=\"([^\"]*)\"")) EXPECT_TRUE(ids.insert(id).second) << id;
  const std::vector<std::string> used = matches(html, "url\\(#([^)]*)\\)");
  EXPECT_EQ(used.size(), 2U);
  for (const std::string& id : used) EXPECT_TRUE(ids.contains(id)) << id;
}

TEST(Page, TablesThatAreSeenHoldTheEmbeddedData) {
  const std::string html = to_html(hostile_page());
  const nlohmann::json table = embedded(html)["tables"][0];
  const PageTable expected = numbers();
  ASSERT_EQ(table["rows"].size(), expected.rows.size());
  std::vector<double> seen;
  for (const std::string& value : matches(html, "data-value=\"([^\"]*)\"")) seen.push_back(std::stod(value));
  std::vector<double> held;
  for (std::size_t r = 0; r < expected.rows.size(); ++r) {
    for (std::size_t c = 0; c < expected.rows[r].size(); ++c) {
      const auto& cell = expected.rows[r][c];
      if (cell.value) {
        held.push_back(table["rows"][r][c].get<double>());
        EXPECT_EQ(held.back(), *cell.value);
      } else {
        EXPECT_EQ(table["rows"][r][c], cell.text);
      }
    }
  }
  EXPECT_EQ(seen, held);
}

TEST(Page, CanBeReadAloud) {
  const std::string html = to_html(hostile_page());
  EXPECT_NE(html.find("<html lang=\"en\">"), std::string::npos);
  EXPECT_EQ(tests::count(html, "<h1"), 1U);
  EXPECT_LT(html.find("<h1"), html.find("<h2"));
  EXPECT_EQ(tests::count(html, "<h3"), 0U) << "no level is skipped";
  EXPECT_EQ(tests::count(html, "<table"), tests::count(html, "<caption>"));
  EXPECT_EQ(tests::count(html, "<figure>"), tests::count(html, "<figcaption>"));
  EXPECT_EQ(matches(html, "<img alt=\"[^\"]+\"", 0).size(), 2U);
  EXPECT_EQ(matches(html, "<svg [^>]*role=\"img\" aria-label=\"[^\"]+\"", 0).size(), 2U);
  EXPECT_EQ(tests::count(html, "scope=\"col\""), 3U);
  EXPECT_EQ(tests::count(html, "scope=\"row\""), 3U);
}

TEST(Page, CsvHoldsFullNumbersAndQuotesWhatItMust) {
  const std::string csv = table_csv(numbers());
  std::istringstream lines(csv);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "case,force (N),verdict");
  std::getline(lines, line);
  EXPECT_EQ(line, "\"soft, \"\"a\"\"\",-1.25,inside");
  std::getline(lines, line);
  EXPECT_NE(line.find(",0.3333333333333333,outside"), std::string::npos) << line;
}

TEST(Page, NumbersThatAreNotThereAreADash) {
  EXPECT_EQ(hybrid::number_cell(std::numeric_limits<double>::quiet_NaN(), 2).text, "–");
  EXPECT_FALSE(hybrid::number_cell(std::numeric_limits<double>::infinity(), 2).value.has_value());
  EXPECT_EQ(hybrid::number_cell(-0.5, 1).text, "−0.5");
  EXPECT_EQ(hybrid::number_cell(-0.01, 1).text, "0.0");
}

TEST(Page, Base64IsThatOfRfc4648) {
  EXPECT_EQ(hybrid::base64(""), "");
  EXPECT_EQ(hybrid::base64("f"), "Zg==");
  EXPECT_EQ(hybrid::base64("fo"), "Zm8=");
  EXPECT_EQ(hybrid::base64("foo"), "Zm9v");
  EXPECT_EQ(hybrid::base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(hybrid::base64(std::string("\0\xff\x10", 3)), "AP8Q");
}

TEST(Page, IsWrittenBesideItsDataAndLeavesOtherFiles) {
  const tests::Folder folder;
  std::ofstream(folder.file("mine.txt")) << "mine";
  const auto written = save_page(folder.file("."), hostile_page());
  EXPECT_EQ(written.front().filename(), hybrid::kPageFile);
  EXPECT_EQ(tests::contents(folder.file("mine.txt")), "mine");
  for (const auto& file : written) EXPECT_GT(std::filesystem::file_size(file), 0U) << file;
  EXPECT_EQ(nlohmann::json::parse(tests::contents(folder.file("report.json"))),
            embedded(tests::contents(folder.file("report.html"))));
  EXPECT_EQ(tests::contents(folder.file("numbers.csv")), table_csv(numbers()));
  tests::expect_well_formed(tests::contents(folder.file("one.svg")));
}

TEST(Page, TheScriptIsShort) {
  EXPECT_LE(tests::count(std::string(hybrid::page_script()), "\n"), 110U);
}

}  // namespace
