// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the parts of `hybrid validate` with closed forms, and its quick cases with their bounds.
#include "hybrid/validate/validate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/validate/cases.h"
#include "hybrid/validate/half_space.h"
#include "hybrid/validate/references.h"
#include "hybrid/validate/specimen.h"
#include "hybrid/validate/table.h"
#include "tests/shared_data.h"

namespace {

using hybrid::Energy;
using hybrid::PressedSpecimen;
using hybrid::Specimen;
using hybrid::ValidationReport;
using hybrid::ValidationRow;

class Specimens : public testing::Test {
 protected:
  void SetUp() override { hybrid::set_flush_to_zero(); }
};

TEST_F(Specimens, ABarBetweenSlippingPlatesIsYoungsModulusTimesAreaTimesStrain) {
  for (const Energy energy : {Energy::six_link, Energy::trilinear}) {
    PressedSpecimen bar({.size_m = {0.02, 0.03, 0.02},
                         .spacing_m = 2e-3,
                         .energy = energy,
                         .poisson = 0.3,
                         .young_Pa = {5e3},
                         .slipping_base = true});
    EXPECT_NEAR(bar.top_area_m2(), 0.02 * 0.03, 1e-12);
    for (const double strain : {0.02, 0.1, 0.25})
      EXPECT_NEAR(bar.on_punch_N(0.05, strain * bar.height_m()), 5e3 * 0.02 * 0.03 * strain, 1e-3 * strain);
  }
}

TEST_F(Specimens, ForcesAreProportionalToTheModulus) {
  PressedSpecimen soft({.size_m = glm::dvec3(0.02), .spacing_m = 2e-3, .young_Pa = {1.0}});
  PressedSpecimen stiff({.size_m = glm::dvec3(0.02), .spacing_m = 2e-3, .young_Pa = {1e5}});
  const double a = soft.on_ball_N(0.01, 2e-3), b = stiff.on_ball_N(0.01, 2e-3);
  EXPECT_NEAR(b / (1e5 * a), 1.0, 1e-3);
}

TEST_F(Specimens, ACylinderHasTheAreaOfItsCircle) {
  PressedSpecimen cylinder(
      {.shape = Specimen::Shape::cylinder, .size_m = {0.05, 0.05, 0.01}, .spacing_m = 1e-3});
  EXPECT_NEAR(cylinder.top_area_m2() / (std::acos(-1.0) * 0.025 * 0.025), 1.0, 0.01);
}

TEST(BondedLayer, OfAnIncompressibleOneHasThePublishedCoefficients) {
  // Dimitriadis et al. 2002, equation 13, for ν = 0.5: 1 + 1.133 χ + 1.283 χ² + 0.769 χ³ + 0.0975 χ⁴.
  for (const double x : {0.05, 0.1, 0.2, 0.3}) {
    const double published =
        1.0 + 1.133 * x + 1.283 * x * x + 0.769 * std::pow(x, 3) + 0.0975 * std::pow(x, 4);
    EXPECT_NEAR(hybrid::bonded_layer_factor(0.5, x), published, 2e-3 * published);
  }
  EXPECT_EQ(hybrid::bonded_layer_factor(0.3, 0.0), 1.0);
}

TEST(Hertz, IsThatOfSixteenNinthsForAnIncompressibleHalfSpace) {
  EXPECT_NEAR(hybrid::hertz_N(9.0, 0.5, 4.0, 1.0), 16.0 * 2.0, 1e-12);
}

TEST(ValidationRows, KnowWhatInsideIs) {
  ValidationRow row{.reference = 10.0, .ours = 10.9, .bound = 0.1, .stated = true};
  EXPECT_TRUE(row.inside());
  row.ours = 8.9;
  EXPECT_FALSE(row.inside());
  EXPECT_TRUE(row.fails());
  row.ours = std::nan("");
  EXPECT_FALSE(row.inside()) << "a force that is not known is not inside";
  ValidationRow spread{.reference = 10.0, .ours = 13.0, .low = 9.0, .high = 14.0};
  EXPECT_TRUE(spread.inside());
  spread.ours = 14.1;
  EXPECT_FALSE(spread.inside());
  EXPECT_FALSE(spread.fails()) << "it is not stated to hold";
}

// The tables in the program equal the published ones. Skipped without the folder of reference data.
TEST(References, AreThoseOfTheFiniteElements) {
  const auto folder = tests::shared_data("reference");
  SKIP_WITHOUT(folder);
  std::ifstream file(folder / "fem-block.csv");
  std::string line;
  std::set<std::string> rows;
  std::getline(file, line);
  while (std::getline(file, line)) rows.insert(line);
  ASSERT_EQ(rows.size(), hybrid::fem_rows().size());
  std::size_t n = 0;
  std::ifstream again(folder / "fem-block.csv");
  std::getline(again, line);
  for (const hybrid::FemRow& row : hybrid::fem_rows()) {
    std::getline(again, line);
    std::ranges::replace(line, ',', ' ');
    std::istringstream words(line);
    std::string material;
    double spacing_m = 0.0, width_m = 0.0, poisson = 0.0, force_N = 0.0;
    words >> material >> spacing_m >> width_m >> poisson >> force_N;
    EXPECT_EQ(spacing_m, row.spacing_m);
    EXPECT_EQ(width_m, row.width_m);
    EXPECT_EQ(poisson, row.poisson);
    EXPECT_EQ(force_N, row.force_N) << ++n;
  }
}

TEST(References, GrowWithDepthAndLieWithinTheirSpread) {
  EXPECT_EQ(hybrid::silicones().size(), 19U);
  for (const hybrid::Silicone& silicone : hybrid::silicones()) {
    for (std::size_t s = 1; s < silicone.at_strain.size(); ++s)
      EXPECT_GT(silicone.at_strain[s].mean_N, silicone.at_strain[s - 1].mean_N) << silicone.name;
  }
  EXPECT_EQ(hybrid::probed_tissues().size(), 7U);
  for (const hybrid::ProbedTissue& tissue : hybrid::probed_tissues()) {
    for (std::size_t d = 0; d < tissue.depths.size(); ++d) {
      const hybrid::ProbedDepth& at = tissue.depths[d];
      EXPECT_LT(at.low_N, at.median_N) << tissue.name;
      EXPECT_LT(at.median_N, at.high_N) << tissue.name;
      if (d > 0) {
        EXPECT_GT(at.median_N, tissue.depths[d - 1].median_N) << tissue.name;
      }
    }
  }
}

void expect_stated_cases_to_hold(const ValidationReport& report) {
  EXPECT_FALSE(report.rows.empty());
  for (const ValidationRow& row : report.rows) {
    EXPECT_TRUE(std::isfinite(row.ours)) << row.name << ": did not come to rest";
    EXPECT_FALSE(row.fails()) << row.name << ", " << row.quantity << ": " << row.ours << " against "
                              << row.reference;
    EXPECT_FALSE(row.source.empty()) << row.name;
    if (!row.inside()) {
      EXPECT_FALSE(row.why.empty()) << row.name << ", " << row.quantity << " says no reason";
    }
  }
}

class QuickCases : public testing::Test {
 protected:
  void SetUp() override { hybrid::set_flush_to_zero(); }
  ValidationReport report_;
  const hybrid::ValidationOptions quick_{.quick = true};
};

TEST_F(QuickCases, ClosedFormsHold) {
  add_closed_forms(quick_, report_);
  expect_stated_cases_to_hold(report_);
}

TEST_F(QuickCases, TheLoopHolds) {
  add_loop_cases(quick_, report_);
  expect_stated_cases_to_hold(report_);
}

TEST_F(QuickCases, FiniteElementsHold) {
  add_finite_elements(quick_, report_);
  expect_stated_cases_to_hold(report_);
  EXPECT_EQ(report_.rows.size(), 6U);
}

TEST_F(QuickCases, SiliconesHoldAtTenPercentAndFallShortAtThirty) {
  add_silicones(quick_, report_);
  expect_stated_cases_to_hold(report_);
  EXPECT_EQ(report_.rows.size(), 57U);
  for (const ValidationRow& row : report_.rows) {
    if (row.quantity.find("30 %") == std::string::npos) continue;
    EXPECT_LT(row.difference(), -0.15) << row.name << ": a linear law does not stiffen";
  }
  for (const auto& m : report_.moduli) {
    EXPECT_LT(m.bonded_Pa, m.slipping_Pa) << "bonded plates make the same silicone stiffer";
    // The published modulus is the chord modulus at small strain, measured between plates that slip.
    if (m.published_Pa) {
      EXPECT_NEAR(m.slipping_Pa / *m.published_Pa, 1.0, 0.1) << m.name;
    }
  }
}

TEST_F(QuickCases, PorkLiesWithinItsQuartiles) {
  add_probed_tissues(quick_, report_);
  expect_stated_cases_to_hold(report_);
  EXPECT_EQ(std::ranges::count_if(report_.rows, &ValidationRow::stated), 3);
}

TEST_F(QuickCases, CartilageHolds) {
  add_cartilage(quick_, report_);
  expect_stated_cases_to_hold(report_);
}

TEST(ValidationReports, ThePageHoldsWhatTheJsonHolds) {
  ValidationReport report;
  report.rows.push_back({.group = "pork",
                         .name = "a",
                         .source = "s",
                         .quantity = "force",
                         .unit = "N",
                         .reference = 1.0,
                         .ours = 2.0,
                         .low = 0.5,
                         .high = 1.5,
                         .stated = true,
                         .why = "w"});
  report.panels.push_back({.group = "pork",
                           .title = "a",
                           .x_label = "depth (mm)",
                           .y_label = "force (N)",
                           .x = {0.0, 1.0},
                           .ours = {0.0, 1.0},
                           .series = {{.name = "measured", .measured = {{1.0, 1.0, 0.5, 1.5}}}}});
  nlohmann::ordered_json json;
  add_to_json(report, json);
  EXPECT_EQ(json["failed"], 1);
  EXPECT_EQ(json["rows"][0]["why"], "w");
  const hybrid::Page page = validation_page(report, true);
  EXPECT_EQ(page.mark, hybrid::PageMark::bad);
  const nlohmann::ordered_json tables = page_json(page)["tables"];
  const auto pork = std::ranges::find_if(tables, [](const auto& t) { return t["name"] == "pork"; });
  ASSERT_NE(pork, tables.end());
  EXPECT_EQ((*pork)["rows"][0][2], json["rows"][0]["reference"]);
  EXPECT_EQ((*pork)["rows"][0][4], json["rows"][0]["ours"]);
  EXPECT_NE(validation_table(report).find("FAILS"), std::string::npos);
  EXPECT_NE(to_html(page).find("<svg"), std::string::npos);
}

}  // namespace
