// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/session_plot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/common.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "hybrid/plot/contacts.h"
#include "hybrid/plot/downsample.h"
#include "tests/hybrid/plot/svg_fixture.h"

namespace {

using hybrid::PlotPoint;
using tests::contents;
using tests::count;
using tests::expect_well_formed;
using tests::Folder;
using tests::row;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

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
  // Compares the extremes of each tested column with brute force.
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
  ASSERT_EQ(kept.size(), 4U);  // the values 1, gap, 2, gap
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

// A session of 10 s with three contacts: with bone and tissue at 1 s, with tissue at 5 s, and with the 40th
// object at 9 s.
struct ThreeContacts {
  std::vector<hybrid::TraceRow> rows;
  std::vector<hybrid::PlottedObject> objects{{"bone", false, {}}, {"rib", false, {}}, {"tissue", true, {}}};

  ThreeContacts() {
    for (int n = 3; n < 39; ++n) objects.push_back({"far " + std::to_string(n), false, {}});
    objects.push_back({"fortieth", false, {}});
    for (auto& object : objects) object.force_N.assign(10'001, 0.0);
    for (int i = 0; i <= 10'000; ++i) {
      const bool first = i >= 1000 && i < 1500, second = i >= 5000 && i < 5500, third = i >= 9000 && i < 9500;
      const double into = (i % 4000 - 1000) * 1e-3;
      rows.push_back(row(i * 1e-3, first || second || third ? 1.0 : 0.0,
                         (first ? 1U : 0U) | (first || second ? 4U : 0U) | (third ? 1U << 31U : 0U)));
      if (first || second || third) rows.back().device_m.z = -0.01 * into;
      rows.back().tick_us = 20.0;
      const auto at = static_cast<std::size_t>(i);
      objects[0].force_N[at] = first ? 0.1 : 0.0;
      objects[2].force_N[at] = first || second ? 0.9 : 0.0;
      objects[39].force_N[at] = third ? 1.0 : 0.0;
    }
  }
  [[nodiscard]] std::string svg() const {
    const Folder folder;
    hybrid::save_session_plot(folder.file("a.svg"), rows, objects, "three");
    return contents(folder.file("a.svg"));
  }
};

TEST(SessionPlot, NamesWhatWasTouchedTheMostFeltFirstAndCountsTheOthers) {
  const std::string svg = ThreeContacts().svg();
  expect_well_formed(svg);
  const std::size_t lanes = svg.find("Touched, the most felt first");
  ASSERT_NE(lanes, std::string::npos);
  const std::size_t tissue = svg.find(">tissue<", lanes), fortieth = svg.find(">fortieth<", lanes),
                    bone = svg.find(">bone<", lanes);
  ASSERT_NE(bone, std::string::npos);
  EXPECT_LT(tissue, fortieth);
  EXPECT_LT(fortieth, bone);
  EXPECT_EQ(count(svg, "rib"), 0U);
  EXPECT_EQ(count(svg, "far "), 0U);
  EXPECT_EQ(count(svg, "37 objects were not touched"), 1U);
  EXPECT_NE(svg.find("soft, 1.000 s"), std::string::npos);
  EXPECT_NE(svg.find("rigid, 0.500 s"), std::string::npos);
}

TEST(SessionPlot, CountsASingleUntouchedObjectAndNone) {
  ThreeContacts session;
  session.objects.resize(3);
  session.rows.resize(6000);
  for (auto& object : session.objects) object.force_N.resize(6000);
  EXPECT_EQ(count(session.svg(), "1 object was not touched"), 1U);
  session.objects.erase(session.objects.begin() + 1);
  session.objects.insert(session.objects.begin() + 1, {"rib", false, session.objects[1].force_N});
  for (auto& r : session.rows) r.contacts |= r.contacts != 0 ? 2U : 0U;
  EXPECT_EQ(count(session.svg(), "not touched"), 0U);
}

TEST(SessionPlot, NamesTheOrganThatIsTouched) {
  ThreeContacts session;
  session.objects[2].parts = {"spleen", "liver", "fat"};
  session.objects[2].touched_part.assign(session.rows.size(), 1);
  const std::string svg = session.svg();
  EXPECT_GE(count(svg, "liver"), 1U);
  EXPECT_EQ(count(svg, "spleen"), 0U);
  EXPECT_EQ(count(svg, ">tissue<"), 0U);
}

TEST(SessionPlot, DrawsOneLineOverDepthForEachContact) {
  const std::string svg = ThreeContacts().svg();
  EXPECT_EQ(count(svg, ">1.00 s: tissue<"), 1U);
  EXPECT_EQ(count(svg, ">5.00 s: tissue<"), 1U);
  EXPECT_EQ(count(svg, ">9.00 s: fortieth<"), 1U);
}

TEST(SessionPlot, SqueezesTheAirAndSaysSo) {
  ThreeContacts session;
  const std::string svg = session.svg();
  // The times from 1.5 to 5 s and from 5.5 to 9 s are squeezed, less 0.3 s on each side.
  EXPECT_EQ(count(svg, ">+2.9<"), 2U);
  EXPECT_EQ(count(svg, "long times in the air"), 1U);
  for (auto& r : session.rows) r.contacts = 4U;
  EXPECT_EQ(count(session.svg(), "long times in the air"), 0U);
}

TEST(SessionPlot, SaysTheOverlapIfTwoDecimalsShowIt) {
  const ThreeContacts session;
  for (const auto& [gap_m, words] : {std::pair(-2e-5, "overlap at most 1.00 % of a voxel"),
                                     {-2e-8, "no overlap"},
                                     {0.0, "no overlap"},
                                     {1e-4, "no overlap"}}) {
    const hybrid::ClearanceCourse near{
        .t_s = {0.0, 1.0}, .rigid_m = {1e-3, gap_m}, .soft_m = {nan, nan}, .cell_m = 2e-3};
    EXPECT_EQ(
        count(hybrid::to_svg(hybrid::session_figure(session.rows, session.objects, "a", {.near = near})),
              words),
        1U)
        << gap_m;
  }
}

TEST(SessionPlot, ShowsTickTimesBesideTheNextTick) {
  ThreeContacts session;
  const std::string svg = session.svg();
  EXPECT_EQ(count(svg, ">1 ms: the next tick begins<"), 1U);
  EXPECT_EQ(count(svg, ">100 µs<"), 1U);
  for (auto& r : session.rows) r.tick_us = 0.0;
  EXPECT_EQ(count(session.svg(), "the next tick begins"), 0U) << "nothing was timed";
}

TEST(Contacts, AMomentInTheAirDoesNotEndOne) {
  std::vector<hybrid::TraceRow> rows;
  for (int i = 0; i < 1000; ++i) {
    rows.push_back(row(i * 1e-3, i == 300 ? 3.0 : 1.0, i >= 200 && i < 700 && i % 100 >= 20 ? 1U : 0U));
    rows.back().device_m.z = -i * 1e-5;
  }
  const auto contacts = hybrid::contacts_of(rows, hybrid::contact_intervals(rows, ~0U));
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].from_s, 0.22, 1e-12);
  EXPECT_NEAR(contacts[0].to_s, 0.7, 1e-12);
  EXPECT_EQ(contacts[0].most_N, 3.0) << "from the first touch to the last, a moment in the air included";
  EXPECT_NEAR(contacts[0].depth_m(rows[420].device_m), 2e-3, 1e-9);
}

// Presses 2 mm down, then strokes `far_m` along x in a second. Friction is half of the normal force.
std::vector<hybrid::TraceRow> press_and_stroke(double far_m) {
  std::vector<hybrid::TraceRow> rows;
  for (int i = 0; i < 1400; ++i) {
    rows.push_back(row(i * 1e-3, 0.0, i >= 100 ? 1U : 0U));
    const double down = std::clamp(i - 100, 0, 200) / 200.0, along = std::clamp(i - 300, 0, 1000) / 1000.0;
    rows.back().device_m = {far_m * along, 0.0, -2e-3 * down};
    rows.back().force_N = {along > 0.0 ? -0.5 * down : 0.0, 0.0, down};
  }
  return rows;
}

TEST(Contacts, AStrokeGoesFartherAcrossItsForceThanAlongIt) {
  // Friction tilts the force by atan(0.5). So a far stroke goes 0.45 of its length along the force, and 0.89
  // across it.
  for (const auto& [far_m, stroke] : {std::pair(0.0, false), {1e-3, false}, {0.01, true}, {0.05, true}}) {
    const auto rows = press_and_stroke(far_m);
    const auto contacts = hybrid::contacts_of(rows, hybrid::contact_intervals(rows, ~0U));
    ASSERT_EQ(contacts.size(), 1U);
    EXPECT_EQ(contacts[0].stroke, stroke) << far_m;
  }
}

TEST(SessionPlot, DrawsStrokesOverPathLengthAndPressesOverDepth) {
  for (const double far_m : {0.0, 0.05}) {
    const Folder folder;
    hybrid::save_session_plot(folder.file("a.svg"), press_and_stroke(far_m),
                              std::vector<hybrid::PlottedObject>{{"plate", false, {}}}, "one contact");
    const std::string svg = contents(folder.file("a.svg"));
    EXPECT_EQ(count(svg, "one line for each stroke"), far_m > 0.0 ? 1U : 0U);
    EXPECT_EQ(count(svg, "one line for each press"), far_m > 0.0 ? 0U : 1U);
  }
}

// A circle of 10 mm radius in two seconds, as an encoder with steps of 0.03 mm along each axis reports it.
TEST(Contacts, ThePathLengthIsThatOfTheWayAndNotOfTheEncodersSteps) {
  constexpr double radius_m = 0.01, step_m = 3e-5;
  const double whole_m = 2.0 * std::numbers::pi * radius_m;
  std::vector<hybrid::TraceRow> exact, reported;
  for (int i = 0; i <= 2000; ++i) {
    const double angle = whole_m / radius_m * i / 2000.0;
    exact.push_back(row(i * 1e-3, 1.0, 1U));
    exact.back().device_m = radius_m * glm::dvec3(std::cos(angle), std::sin(angle), 0.0);
    reported.push_back(exact.back());
    reported.back().device_m = step_m * glm::round(exact.back().device_m / step_m);
  }
  EXPECT_NEAR(hybrid::path_length_m(exact).back(), whole_m, 1e-4 * whole_m);
  EXPECT_NEAR(hybrid::path_length_m(exact)[1000], 0.5 * whole_m, 1e-4 * whole_m);
  EXPECT_NEAR(hybrid::path_length_m(reported).back(), whole_m, 0.05 * whole_m);
  // The device is still, and the last bit of its encoder alternates.
  for (std::size_t i = 0; i < reported.size(); ++i)
    reported[i].device_m = {i % 2 == 0 ? 0.0 : step_m, 0.0, i % 3 == 0 ? 0.0 : step_m};
  EXPECT_LE(hybrid::path_length_m(reported).back(), 2.0 * step_m);
  reported[7].device_m.x = nan;
  EXPECT_LE(hybrid::path_length_m(reported).back(), 2.0 * step_m);
  EXPECT_TRUE(hybrid::path_length_m({}).empty());
}

TEST(Contacts, TheMostFeltStayInOrderOfTime) {
  std::vector<hybrid::Contact> contacts;
  for (const double force : {1.0, 5.0, 2.0, 4.0})
    contacts.push_back({.from_s = static_cast<double>(contacts.size()), .most_N = force});
  const auto kept = hybrid::most_felt(contacts, 2);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].most_N, 5.0);
  EXPECT_EQ(kept[1].most_N, 4.0);
}

TEST(PlottedObjects, HaveTheMaterialBeneathTheTool) {
  hybrid::DrawnScene scene;
  scene.objects.push_back({"table", false, {}});
  scene.objects.push_back({"body", true, {.vertices = {{-1, 0, 0}, {1, 0, 0}}, .triangles = {}}});
  scene.objects.back().materials = {"fat", "liver"};
  scene.objects.back().vertex_material = {0, 1};
  scene.objects.push_back({"block", true, {}});
  scene.objects.back().material = "gel";
  std::vector<hybrid::TraceRow> rows(100);
  for (std::size_t i = 40; i < 80; ++i) {
    rows[i].contacts = 2U;
    rows[i].proxy_m.x = i < 60 ? 0.4 : -0.4;
  }
  const auto objects = hybrid::plotted_objects(scene, rows, std::vector<std::vector<double>>(3));
  ASSERT_EQ(objects.size(), 3U);
  EXPECT_EQ(objects[2].name, "block (gel)");
  ASSERT_EQ(objects[1].parts.size(), 2U);
  EXPECT_EQ(objects[1].touched_part[45], 1);
  EXPECT_EQ(objects[1].touched_part[75], 0);
  EXPECT_GT(objects[1].touched_part[90], 1) << "nothing is touched";
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

}  // namespace
