// SPDX-License-Identifier: GPL-3.0-or-later
// Measured trajectories: the interpretation of each layout, and the refusals.
#include "device/paths/trajectory_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "device/paths/path_file.h"

namespace {

using device::MeasuredFile;
using device::MeasuredTrajectory;
using testing::HasSubstr;

std::filesystem::path write(const std::string& name, const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / name;
  std::ofstream(file) << text;
  return file;
}

MeasuredTrajectory read(const std::string& name, const std::string& text, MeasuredFile with = {}) {
  with.file = write(name, text);
  return device::read_measured(with);
}

std::string refusal(const std::string& name, const std::string& text, const MeasuredFile& with = {}) {
  try {
    (void)read(name, text, with);
  } catch (const device::PathError& e) {
    return e.what();
  }
  return "";
}

TEST(TrajectoryFile, RowsOfNumbersAreTakenByTheirCountAndItIsSaid) {
  const auto seven = read("a.traj", "0.5 1 2 3 0.1 0.2 0.3\n0.501 2 3 4 0.4 0.5 0.6\n");
  ASSERT_EQ(seven.t_s.size(), 2U);
  EXPECT_EQ(seven.t_s[0], 0.0);
  EXPECT_NEAR(seven.t_s[1], 1e-3, 1e-12);
  EXPECT_EQ(seven.position_m[1], glm::dvec3(2, 3, 4) * 1e-3);
  EXPECT_EQ(seven.force_N[1], glm::dvec3(0.4, 0.5, 0.6));
  ASSERT_FALSE(seven.notes.empty());
  EXPECT_THAT(seven.notes.front(), HasSubstr("taken as t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N"));

  const auto six = read("b.traj", "1\t2\t3\t0.1\t0.2\t0.3\n2 3 4 0 0 0\n", {.rate_hz = 500});
  EXPECT_DOUBLE_EQ(six.t_s[1], 1.0 / 500);
  EXPECT_EQ(six.force_N[0].z, 0.3);
  EXPECT_THAT(six.notes.back(), HasSubstr("500 samples a second"));

  const auto five = read("c.traj", "0 1 2 3 0.7\n0.001 1 2 3 -0.9\n");
  EXPECT_TRUE(five.force_N.empty());
  EXPECT_EQ(five.strength_N, (std::vector<double>{0.7, 0.9}));

  const auto eight = read("d.traj", "0;1;2;3;0.1;0.2;0.3;9\n");
  EXPECT_EQ(eight.force_N[0], glm::dvec3(0.1, 0.2, 0.3)) << "the vector, where both are there";
}

TEST(TrajectoryFile, AHeaderACommentOrTheUserNamesTheColumns) {
  const auto header =
      read("e.csv", "fx_mN,fy_mN,fz_mN,x_cm,y_cm,z_cm,t_ms\n100,200,300,1,2,3,0\n0,0,0,1,2,3,4\n");
  EXPECT_EQ(header.force_N[0], glm::dvec3(100, 200, 300) * 1e-3);
  EXPECT_EQ(header.position_m[0], glm::dvec3(1, 2, 3) * 1e-2);
  EXPECT_NEAR(header.t_s[1], 4e-3, 1e-15);
  EXPECT_TRUE(header.notes.empty());

  const auto comment = read("f.traj", "# scanned today\n# z_m y_m x_m t_s fx_N fy_N fz_N\n3 2 1 0 7 8 9\n");
  EXPECT_EQ(comment.position_m[0], glm::dvec3(1, 2, 3));
  EXPECT_EQ(comment.force_N[0], glm::dvec3(7, 8, 9));

  const auto user =
      read("g.traj", "9 1 2 3 4 5 6\n", {.columns = "-,fx_N,fy_N,fz_N,x_m,y_m,z_m", .on_object = true});
  EXPECT_EQ(user.position_m[0], glm::dvec3(4, 5, 6));
  EXPECT_EQ(user.force_N[0], glm::dvec3(-1, -2, -3));
  EXPECT_THAT(refusal("g.traj", "9 1 2 3 4 5 6\n", {.columns = "-,fx_N,fy_N,fz_N,x_furlong,y_m,z_m"}),
              HasSubstr("nothing is named x"));
}

TEST(TrajectoryFile, ATraceOfThisProgramIsAMeasurementAndAPath) {
  const std::string text =
      "t_s,device_x_m,device_y_m,device_z_m,proxy_x_m,proxy_y_m,proxy_z_m,force_x_N,force_y_N,force_z_N,"
      "rigid_N,"
      "soft_N,contacts,tick_us\n0,1,2,3,9,9,9,4,5,6,7,8,1,12.5\n";
  const auto trace = read("h.csv", text);
  EXPECT_EQ(trace.position_m[0], glm::dvec3(1, 2, 3));
  EXPECT_EQ(trace.force_N[0], glm::dvec3(4, 5, 6));
  EXPECT_TRUE(trace.notes.empty());
  EXPECT_EQ(device::read_trajectory({.file = write("h.csv", text)}).position_m[0], glm::dvec3(1, 2, 3));
}

TEST(TrajectoryFile, OfSeveralForcesOneIsChosen) {
  const std::string text =
      "t_s,x_m,y_m,z_m,int_fx,int_fy,int_fz,int_tx,giver_fx,giver_fy,giver_fz\n0,1,2,3,4,5,6,0,7,8,9\n";
  EXPECT_THAT(refusal("i.csv", text), HasSubstr("choose one with --force: int, giver"));
  EXPECT_EQ(read("i.csv", text, {.force = "giver"}).force_N[0], glm::dvec3(7, 8, 9));
  EXPECT_THAT(refusal("i.csv", text, {.force = "taker"}), HasSubstr("no force 'taker'"));
  EXPECT_TRUE(read("i.csv", text, {.needs_force = false}).force_N.empty());
}

TEST(TrajectoryFile, WhatDoesNotFitIsRefusedWithItsPlace) {
  EXPECT_THAT(refusal("j.traj", "1 2 3 4\n"),
              HasSubstr("j.traj:1: 4 columns without a name; state them with --columns"));
  EXPECT_THAT(refusal("k.traj", "# 7\n0 1 2 3 4 5 6\n1 1 2 3 4 5\n"), HasSubstr("k.traj:3: only 6 columns"));
  EXPECT_THAT(refusal("l.traj", "1 1 2 3 4 5 6\n0.5 1 2 3 4 5 6\n"),
              HasSubstr("time runs backwards, by 0.5 s"));
  EXPECT_THAT(refusal("m.traj", "0 1 2 3 4 5 nan\n"), HasSubstr("m.traj:1"));
  EXPECT_THAT(refusal("n.csv", "t_s,x_m,y_m,z_m\n0,1,2,3\n"), HasSubstr("no columns of a force"));
  EXPECT_THAT(refusal("o.csv", "t_s,a,b,c,fx,fy,fz\n0,1,2,3,4,5,6\n"), HasSubstr("no columns x, y and z"));
  EXPECT_THAT(refusal("p.csv", ""), HasSubstr("is empty"));
  EXPECT_THAT(refusal("v.csv", "t_s,x_m,y_m,z_m,fx,fy,fz\n0,1,2,3,4,5,-1e200\n"),
              HasSubstr("v.csv:2: '-1e200' is more than 1e+09 N"));
  EXPECT_THAT(refusal("q.csv", "t_s,x_m,y_m,z_m,fx,fy,fz\n"), HasSubstr("no rows"));
}

TEST(TrajectoryFile, UnitsThatAreNotStatedAreSaid) {
  EXPECT_THAT(read("s.csv", "t,x,y,z,fx,fy,fz\n0,1,2,3,4,5,6\n").notes,
              testing::ElementsAre(HasSubstr("taken as mm")));
  const auto clock =
      read("t.csv", "time,x_mm,y_mm,z_mm,fn_N\n1617187200000,1,2,3,4\n1617187202000,1,2,3,4\n");
  EXPECT_DOUBLE_EQ(clock.t_s.back(), 2.0);
  EXPECT_THAT(clock.notes, testing::ElementsAre(HasSubstr("milliseconds"), HasSubstr("is taken as 0")));
  EXPECT_THAT(refusal("u.csv", "t,x_mm,y_mm,z_mm,fn_N\n0,1,2,3,4\n100000,1,2,3,4\n"),
              HasSubstr("longer than a day"));
}

TEST(TrajectoryFile, GapsAndRepeatedTimesAreToldAndGapsAreNoMeasurement) {
  std::string text = "t_s,x_m,y_m,z_m,fx_N,fy_N,fz_N\n";
  for (int i = 0; i < 20; ++i) text += std::to_string(0.001 * i) + ",0,0,0,1,0,0\n";
  text += "0.019,0,0,0,3,0,0\n";  // a repeated time
  for (int i = 0; i < 20; ++i) text += std::to_string(0.5 + 0.001 * i) + ",0,0,0,1,0,0\n";
  const auto found = read("r.csv", text);
  ASSERT_EQ(found.notes.size(), 2U);
  EXPECT_THAT(found.notes[0], HasSubstr("1 sample repeats"));
  EXPECT_THAT(found.notes[1], HasSubstr("1 gap of more than 0.01 s"));
  EXPECT_EQ(found.force_N[19].x, 3.0) << "the later one stands";
  std::size_t before = 0;
  double share = 0.0;
  EXPECT_TRUE(device::measured_at(found, 0.0105, before, share));
  EXPECT_EQ(before, 10U);
  EXPECT_NEAR(share, 0.5, 1e-9);
  EXPECT_TRUE(device::measured_at(found, found.t_s[19], before, share)) << "its first end was measured";
  EXPECT_FALSE(device::measured_at(found, 0.2, before, share));
  EXPECT_TRUE(device::measured_at(found, 99.0, before, share));
  EXPECT_EQ(before, found.t_s.size() - 1);
}

}  // namespace
