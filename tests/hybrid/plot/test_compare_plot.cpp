// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/compare_plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/hybrid/plot/svg_fixture.h"

namespace {

using tests::contents;
using tests::count;
using tests::expect_well_formed;
using tests::Folder;
using tests::row;

// Rows of 5 s with a press from 1 to 2 s. The reference feels 2 N, and each other model the given multiple of
// 2 N.
std::vector<hybrid::ComparedModel> pressed(const std::vector<std::pair<std::string, double>>& others) {
  std::vector<hybrid::ComparedModel> models(1);
  models[0].name = "voxels";
  for (const auto& [name, share] : others) models.push_back({.name = name, .rows = {}});
  for (int i = 0; i <= 5000; ++i) {
    const bool on = i >= 1000 && i < 2000;
    for (std::size_t m = 0; m < models.size(); ++m) {
      const double share = m == 0 ? 1.0 : others[m - 1].second;
      models[m].rows.push_back(row(i * 1e-3, on ? 2.0 * share : 0.0, on ? 1U : 0U));
      models[m].rows.back().device_m.z = on ? -1e-3 : 0.0;
    }
  }
  return models;
}

std::string drawn(const std::vector<hybrid::ComparedModel>& models) {
  const Folder folder;
  hybrid::save_compare_plot(folder.file("a.svg"), models, {}, "compared");
  const std::string svg = contents(folder.file("a.svg"));
  expect_well_formed(svg);
  return svg;
}

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
  EXPECT_NE(svg.find("depth of the device since the first touch (mm)"), std::string::npos);
}

TEST(ComparePlot, RefusesAReferenceThatIsNoModel) {
  EXPECT_THROW(hybrid::save_compare_plot("/tmp/none.svg", {}, {}, "none"), std::invalid_argument);
}

TEST(ComparePlot, GivesEachModelPanelsOfItsOwn) {
  const std::string svg = drawn(pressed({{"mesh and proxy", 15.0}, {"nearest-surface", 1.05}}));
  EXPECT_EQ(count(svg, ">voxels (reference)<"), 1U);
  EXPECT_EQ(count(svg, ">mesh and proxy: difference from voxels<"), 1U);
  EXPECT_EQ(count(svg, ">nearest-surface: difference from voxels<"), 1U);
  EXPECT_EQ(count(svg, ">difference (JND)<"), 2U);
  EXPECT_EQ(count(svg, ">mesh and proxy: force over depth<"), 1U)
      << "15 times the force would flatten the others";
  EXPECT_EQ(count(svg, ">nearest-surface: force over depth<"), 0U);
}

// With a JND of 0.14 N, 30 N instead of 2 N are 200 JND, and 2.1 N are 0.71 JND. Both axes have ticks at 1
// JND.
TEST(ComparePlot, ReadsDifferencesInJndByNumbers) {
  const std::string large = drawn(pressed({{"mesh and proxy", 15.0}}));
  for (const char* tick : {">1<", ">10<", ">100<"}) EXPECT_GE(count(large, tick), 1U) << tick;
  const std::string small = drawn(pressed({{"mesh and proxy", 1.05}}));
  const std::size_t panel = small.find(">mesh and proxy: difference");
  ASSERT_NE(panel, std::string::npos);
  const std::size_t next = small.find("difference (JND)", panel);
  const std::string axis = small.substr(panel, next - panel);
  for (const char* tick : {">−1<", ">0<", ">1<"}) EXPECT_EQ(count(axis, tick), 1U) << tick;
  EXPECT_EQ(count(axis, ">10<"), 0U);
}

// A model still pulls for 3 s after the others have released. It is drawn over its own time axis, below the
// others.
TEST(ComparePlot, DrawsApartWhatPullsOn) {
  auto models = pressed({{"mesh and proxy", 1.1}, {"classic", 0.5}});
  models[2].apart = true;
  for (auto& r : models[2].rows) {
    if (r.t_s >= 1.0) r.contacts = 1U;
    if (r.t_s >= 2.0) r.force_N = {0.0, 0.0, 0.3};
  }
  const std::string svg = drawn(models);
  EXPECT_EQ(count(svg, "long times in the air"), 1U) << "its pull does not count as a contact of the others";
  EXPECT_EQ(count(svg, ">time (s)<"), 2U);
  EXPECT_GT(svg.find(">classic: difference"), svg.find("Force over depth"));
  models.pop_back();
  EXPECT_EQ(count(drawn(models), "classic"), 0U);
}

TEST(ComparePlot, DrawsEachContactOverItsOwnDepth) {
  auto models = pressed({{"mesh and proxy", 1.1}});
  for (auto& model : models) {
    for (auto& r : model.rows) {
      if (r.t_s < 3.0 || r.t_s >= 3.5) continue;
      r.contacts = 1U;
      r.force_N = {1.0, 0.0, 0.0};
    }
  }
  const std::string svg = drawn(models);
  EXPECT_EQ(count(svg, "Force over depth, contact from 1.00 to 2.00 s"), 1U);
  EXPECT_EQ(count(svg, "Force over depth, contact from 3.00 to 3.50 s"), 1U);
}

}  // namespace
