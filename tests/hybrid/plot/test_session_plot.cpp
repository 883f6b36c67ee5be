// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/session_plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

#include "hybrid/plot/downsample.h"
#include "hybrid/plot/svg_figure.h"

namespace {

using hybrid::PlotPoint;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

class Folder {  // removed with its content
 public:
  Folder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            ("hybrid-" + std::string(test->test_suite_name()) + "-" + test->name() + "-" +
             std::to_string(std::hash<const void*>{}(this)));
    std::filesystem::create_directories(path_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  Folder(Folder&&) = delete;
  Folder& operator=(Folder&&) = delete;
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::filesystem::path file(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + what.size())) ++n;
  return n;
}

// Tags open and close in order, attributes are quoted, entities are known: enough XML to catch the errors of
// a hand-written writer.
void expect_well_formed(const std::string& xml) {
  std::vector<std::string> open;
  std::size_t i = 0;
  while (i < xml.size()) {
    if (xml[i] == '&') {
      const std::size_t end = xml.find(';', i);
      ASSERT_NE(end, std::string::npos);
      const std::string entity = xml.substr(i + 1, end - i - 1);
      EXPECT_TRUE(entity == "amp" || entity == "lt" || entity == "gt" || entity == "quot" || entity == "apos")
          << entity;
      i = end + 1;
    } else if (xml[i] == '<') {
      std::size_t end = i + 1;
      bool quoted = false;
      while (end < xml.size() && (quoted || xml[end] != '>')) {
        if (xml[end] == '"') quoted = !quoted;
        EXPECT_FALSE(xml[end] == '<') << "at " << end;
        ++end;
      }
      ASSERT_LT(end, xml.size());
      const std::string tag = xml.substr(i + 1, end - i - 1);
      const std::string name = tag.substr(0, tag.find_first_of(" /", 1));
      if (tag[0] == '/') {
        ASSERT_FALSE(open.empty());
        EXPECT_EQ("/" + open.back(), tag);
        open.pop_back();
      } else if (tag[0] != '?' && tag.back() != '/') {
        open.push_back(name);
      }
      i = end + 1;
    } else {
      EXPECT_GE(static_cast<unsigned char>(xml[i]), xml[i] == '\n' ? 0x0A : 0x20);
      ++i;
    }
  }
  EXPECT_TRUE(open.empty());
}

hybrid::TraceRow row(double t, double force, std::uint32_t contacts = 0) {
  hybrid::TraceRow made;
  made.t_s = t;
  made.force_N = {0.0, 0.0, force};
  made.contacts = contacts;
  return made;
}

TEST(NiceTicks, AreRoundEvenlySpacedAndInside) {
  for (const double size : {1e-9, 3.7e-4, 1.0, 42.0, 9.99e8}) {
    for (const double from : {-0.3 * size, 0.0, 17.0 * size}) {
      const auto ticks = hybrid::nice_ticks(from, from + size, 8);
      ASSERT_GE(ticks.size(), 3U) << size;
      ASSERT_LE(ticks.size(), 12U);
      const double step = ticks[1] - ticks[0];
      const double mantissa = step / std::pow(10.0, std::floor(std::log10(step * (1.0 + 1e-9))));
      EXPECT_TRUE(std::abs(mantissa - 1.0) < 1e-6 || std::abs(mantissa - 2.0) < 1e-6 ||
                  std::abs(mantissa - 5.0) < 1e-6)
          << mantissa;
      for (std::size_t i = 0; i < ticks.size(); ++i) {
        EXPECT_GE(ticks[i], from - 1e-6 * step);
        EXPECT_LE(ticks[i], from + size + 1e-6 * step);
        EXPECT_NEAR(ticks[i] / step, std::round(ticks[i] / step), 1e-6);
      }
    }
  }
  EXPECT_TRUE(hybrid::nice_ticks(1.0, 1.0, 5).empty());
  EXPECT_TRUE(hybrid::nice_ticks(nan, 1.0, 5).empty());
}

TEST(TickText, HasTheDecimalsItsStepNeeds) {
  EXPECT_EQ(hybrid::tick_text(0.5, 0.5), "0.5");
  EXPECT_EQ(hybrid::tick_text(2.0, 0.25), "2.00");
  EXPECT_EQ(hybrid::tick_text(40.0, 20.0), "40");
  EXPECT_EQ(hybrid::tick_text(0.1 * 3 - 0.3, 0.1), "0");
  EXPECT_EQ(hybrid::tick_text(-2.0, 1.0), "−2");
}

TEST(Decimate, KeepsEveryColumnsExtremesAndEnds) {
  std::vector<double> x;
  std::vector<double> y;
  for (int i = 0; i < 100'000; ++i) {
    x.push_back(i * 1e-3);
    y.push_back(std::sin(i * 0.37) + (i == 54'321 ? 50.0 : 0.0) - (i == 77'777 ? 40.0 : 0.0));
  }
  const auto kept = hybrid::downsample_columns(x, y, x.front(), x.back(), 500);
  EXPECT_LE(kept.size(), 4U * 500U);
  EXPECT_TRUE(std::ranges::is_sorted(kept, {}, &PlotPoint::x));
  EXPECT_EQ(kept.front().x, x.front());
  EXPECT_EQ(kept.back().x, x.back());
  EXPECT_EQ(std::ranges::max(kept, {}, &PlotPoint::y).y, std::ranges::max(y));
  EXPECT_EQ(std::ranges::min(kept, {}, &PlotPoint::y).y, std::ranges::min(y));
  // Against brute force, column by column.
  for (std::size_t column = 0; column < 500; column += 7) {
    double low = 1e9;
    double high = -1e9;
    double kept_low = 1e9;
    double kept_high = -1e9;
    const auto in = [&](double at) {
      return std::min<std::size_t>(
                 static_cast<std::size_t>((at - x.front()) / (x.back() - x.front()) * 500.0), 499) == column;
    };
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!in(x[i])) continue;
      low = std::min(low, y[i]);
      high = std::max(high, y[i]);
    }
    for (const PlotPoint& p : kept) {
      if (!in(p.x)) continue;
      kept_low = std::min(kept_low, p.y);
      kept_high = std::max(kept_high, p.y);
    }
    EXPECT_EQ(low, kept_low);
    EXPECT_EQ(high, kept_high);
  }
}

TEST(Decimate, LeavesAFewSamplesAsTheyAre) {
  const std::vector<double> x{0.0, 1.0, 2.0, 3.0};
  const std::vector<double> y{5.0, 1.0, 4.0, 2.0};
  const auto kept = hybrid::downsample_columns(x, y, 0.0, 3.0, 100);
  ASSERT_EQ(kept.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(kept[i].y, y[i]);
}

TEST(Decimate, TurnsARunOfNonFiniteValuesIntoOneGap) {
  const std::vector<double> x{0.0, 1.0, 2.0, 3.0, 4.0, 5.0};
  const std::vector<double> y{nan, 1.0, nan, std::numeric_limits<double>::infinity(), 2.0, nan};
  const auto kept = hybrid::downsample_columns(x, y, 0.0, 5.0, 100);
  ASSERT_EQ(kept.size(), 4U);  // 1, gap, 2, gap
  EXPECT_EQ(kept[0].y, 1.0);
  EXPECT_TRUE(std::isnan(kept[1].y));
  EXPECT_EQ(kept[2].y, 2.0);
}

TEST(Decimate, PathKeepsItsEndsAndItsBound) {
  std::vector<PlotPoint> path;
  for (int i = 0; i <= 200'000; ++i) {
    const double a = i * 1e-3;
    path.push_back({400.0 + 300.0 * std::cos(a), 200.0 + 150.0 * std::sin(3.1 * a)});
  }
  const auto kept = hybrid::downsample_path(path, 0.4, 3000);
  EXPECT_LE(kept.size(), 3000U);
  EXPECT_GT(kept.size(), 300U);
  EXPECT_EQ(kept.front().x, path.front().x);
  EXPECT_EQ(kept.back().x, path.back().x);
  EXPECT_EQ(kept.back().y, path.back().y);
}

TEST(SessionPlot, IsWellFormedWhateverTheNames) {
  const Folder folder;
  std::vector<hybrid::TraceRow> rows;
  rows.reserve(3000);
  for (int i = 0; i < 3000; ++i)
    rows.push_back(row(i * 1e-3, std::abs(std::sin(i * 0.01)), i % 700 < 300 ? 3U : 0U));
  std::vector<hybrid::PlottedObject> objects{{"skull <\"1\"> & 'co'", false, {}},
                                             {"Gehörgang µ\x01", true, {}}};
  objects[1].force_N.assign(rows.size(), 0.5);
  hybrid::save_session_plot(folder.file("a.svg"), rows, objects, "a < b & \"c\"");
  const std::string svg = contents(folder.file("a.svg"));
  expect_well_formed(svg);
  EXPECT_NE(svg.find("skull &lt;&quot;1&quot;&gt;"), std::string::npos);
  EXPECT_NE(svg.find("Gehörgang µ"), std::string::npos);
  EXPECT_NE(svg.find("force (N)"), std::string::npos);
  EXPECT_NE(svg.find("time (s)"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(SessionPlot, StaysSmallForAMillionNoisyTicks) {
  const Folder folder;
  std::vector<hybrid::TraceRow> rows;
  std::vector<hybrid::PlottedObject> objects(6);
  std::uint32_t random = 1;
  for (std::size_t i = 0; i < 1'000'000; ++i) {
    random = random * 1664525U + 1013904223U;
    hybrid::TraceRow noisy = row(static_cast<double>(i) * 1e-3, random * 1e-9, random >> 20U);
    noisy.rigid_N = random * 0.5e-9;
    noisy.soft_N = random * 0.3e-9;
    noisy.device_m.z = random * 1e-12;
    rows.push_back(noisy);
  }
  for (std::size_t o = 0; o < objects.size(); ++o) {
    objects[o].name = "object " + std::to_string(o);
    objects[o].soft = o > 2;
    for (const auto& r : rows) objects[o].force_N.push_back(r.soft_N * static_cast<double>(o));
  }
  hybrid::save_session_plot(folder.file("a.svg"), rows, objects, "noise");
  EXPECT_LT(std::filesystem::file_size(folder.file("a.svg")), 300'000U);
  EXPECT_GT(std::filesystem::file_size(folder.file("a.svg")), 20'000U);
}

TEST(SessionPlot, DrawsEmptyAndNonFiniteTraces) {
  const Folder folder;
  const std::vector<hybrid::PlottedObject> objects{{"a", false, {}}};
  hybrid::save_session_plot(folder.file("empty.svg"), {}, objects, "");
  expect_well_formed(contents(folder.file("empty.svg")));
  std::vector<hybrid::TraceRow> rows{row(nan, nan), row(0.0, nan, 1), row(0.1, 1e300, 1),
                                     row(0.2, -std::numeric_limits<double>::infinity())};
  hybrid::save_session_plot(folder.file("bad.svg"), rows, objects, "bad");
  const std::string svg = contents(folder.file("bad.svg"));
  expect_well_formed(svg);
  EXPECT_EQ(count(svg, "nan"), 0U);
  EXPECT_NE(svg.find("without a finite force"), std::string::npos);
}

TEST(SessionPlot, ContactLanesLastAsLongAsContact) {
  const Folder folder;
  std::vector<hybrid::TraceRow> rows;
  // Object 1 touches from 0.25 to 0.5 s and from 0.75 to the end at 1 s.
  for (int i = 0; i <= 1000; ++i) {
    rows.push_back(row(i * 1e-3, 1.0, (i >= 250 && i < 500) || i >= 750 ? 2U : 0U));
  }
  const std::vector<hybrid::PlottedObject> objects{{"a", false, {}}, {"b", true, {}}};
  hybrid::save_session_plot(folder.file("a.svg"), rows, objects, "lanes");
  const std::string svg = contents(folder.file("a.svg"));
  EXPECT_NE(svg.find("rigid, 0.000 s"), std::string::npos);
  EXPECT_NE(svg.find("soft, 0.500 s"), std::string::npos);
}

TEST(SessionPlot, SaysWhenItCannotWrite) {
  try {
    hybrid::save_session_plot("/nonexistent-folder/a.svg", {}, {}, "");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent-folder/a.svg"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("folder that exists"), std::string::npos);
  }
}

// The samples of the difference panel are visible only in the figure. A constant difference must be a
// straight line at the right height: half of the largest force there.
TEST(ComparePlot, NamesEveryModelAndStaysSmall) {
  const Folder folder;
  std::vector<hybrid::ComparedModel> models(8);
  for (std::size_t m = 0; m < models.size(); ++m) {
    models[m].name = "model " + std::to_string(m);
    for (int i = 0; i < 50'000; ++i) {
      // Each model has its own rate.
      hybrid::TraceRow r = row(i * 1e-3 * (1.0 + 0.1 * static_cast<double>(m)),
                               1.0 + std::sin(i * 0.7 + static_cast<double>(m)), 1);
      r.device_m.z = -5e-3 * std::sin(i * 1e-2);
      models[m].rows.push_back(r);
    }
  }
  const std::vector<hybrid::ReferenceCurve> curves{{"Hertz & co", {0.0, 1e-3, 2e-3}, {0.0, 1.0, 2.8}}};
  hybrid::save_compare_plot(folder.file("a.svg"), models, curves, "many");
  const std::string svg = contents(folder.file("a.svg"));
  expect_well_formed(svg);
  EXPECT_LT(svg.size(), 300'000U);
  for (const auto& model : models) EXPECT_GE(count(svg, model.name), 2U) << model.name;
  EXPECT_NE(svg.find("Hertz &amp; co"), std::string::npos);
  EXPECT_NE(svg.find("±1 JND"), std::string::npos);
  EXPECT_NE(svg.find("depth of the device (mm)"), std::string::npos);
}

TEST(ComparePlot, RefusesAReferenceThatIsNoModel) {
  EXPECT_THROW(hybrid::save_compare_plot("/tmp/none.svg", {}, {}, "none"), std::invalid_argument);
}

}  // namespace
