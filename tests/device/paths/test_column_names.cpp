// SPDX-License-Identifier: GPL-3.0-or-later
// The quantity, axis and unit that are read from a column's name.
#include "device/paths/column_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/device/paths/text_files.h"

namespace {

using device::ColumnName;
using device::Quantity;
using device::read_column_name;
using testing::HasSubstr;

struct Said {
  std::string name;
  Quantity quantity;
  double in_si;  // the unit in SI; 0: no unit is stated
  std::size_t axis = 0;
};

void expect_said(const std::vector<Said>& all) {
  for (const Said& said : all) {
    SCOPED_TRACE(said.name);
    const ColumnName read = read_column_name(said.name);
    EXPECT_EQ(read.quantity, said.quantity);
    EXPECT_EQ(read.axis, said.axis);
    EXPECT_DOUBLE_EQ(read.in_si.value_or(0.0), said.in_si);
    EXPECT_EQ(read.unknown_unit, "");
  }
}

TEST(ColumnNames, TimesInEverySpelling) {
  std::vector<Said> all;
  for (const char* name : {"t_s",       "t [s]",        "t(s)",           "t/s",
                           "T [S]",     "time_sec",     "Time (seconds)", "TIME_S",
                           "t in s",    "t_in_s",       "timestamp [s]",  "time stamp / s",
                           "elapsed_s", "TimeStampSec", "t, s",           "header.stamp.secs",
                           "time {s}",  "t <s>",        "t [s",           "Time (sec.)"})
    all.push_back({name, Quantity::time, 1.0});
  for (const char* name : {"t_ms", "time [ms]", "Time(ms)", "t/ms", "TIME_MS", "time_msec", "timeMs",
                           "t_millis", "Timestamp (milliseconds)", "time in ms", "T [MS]"})
    all.push_back({name, Quantity::time, 1e-3});
  for (const char* name :
       {"t_us", "time [\xC2\xB5s]", "time [\xCE\xBCs]", "time [\xB5s]", "t_usec", "t / microseconds"})
    all.push_back({name, Quantity::time, 1e-6});
  for (const char* name : {"t_ns", "timestamp_ns", "time [ns]", "stamp.nsecs", "TimestampNs"})
    all.push_back({name, Quantity::time, 1e-9});
  all.push_back({"time [min]", Quantity::time, 60.0});
  all.push_back({"t_h", Quantity::time, 3600.0});
  for (const char* name :
       {"t", "T", "time", "Timestamp", "%time", "header.stamp", "ros_time", "elapsed time"})
    all.push_back({name, Quantity::time, 0.0});
  expect_said(all);
}

TEST(ColumnNames, PositionsInEverySpelling) {
  std::vector<Said> all;
  for (const char* name : {"y_mm",
                           "y [mm]",
                           "Y(mm)",
                           "y/mm",
                           "POS_Y_MM",
                           "pos_y_mm",
                           "position_y [mm]",
                           "Position Y (mm)",
                           "y_pos_mm",
                           "posY [mm]",
                           "posYMm",
                           "tool_y_mm",
                           "py_mm",
                           "ypos_mm",
                           "y in mm",
                           "y_in_mm",
                           "y_millimetres",
                           "Y-Axis [mm]",
                           "/tool/pose/position/y/mm",
                           "\"y\" [mm]",
                           "Y [MM]",
                           "position (y) [mm]",
                           "pose.position.y [mm]"})
    all.push_back({name, Quantity::position, 1e-3, 1});
  for (const char* name : {"x_m", "x [m]", "X(m)", "x/m", "X_M", "x_meter"})
    all.push_back({name, Quantity::position, 1.0, 0});
  for (const char* name : {"z_um", "z [\xC2\xB5m]", "z [\xCE\xBCm]", "z (\xB5m)", "z_micron", "Z_UM"})
    all.push_back({name, Quantity::position, 1e-6, 2});
  for (const char* name : {"x_in", "x [inch]", "x (in)", "x_inches", "X_INCH"})
    all.push_back({name, Quantity::position, 0.0254, 0});
  all.push_back({"x_cm", Quantity::position, 1e-2, 0});
  all.push_back({"x [nm]", Quantity::position, 1e-9, 0});
  all.push_back({"x_ft", Quantity::position, 0.3048, 0});
  for (const char* name :
       {"z", "Z", "pos.z", "pose.position.z", "transform.translation.z", "device_z", "pz", "tz"})
    all.push_back({name, Quantity::position, 0.0, 2});
  expect_said(all);
}

TEST(ColumnNames, ForcesInEverySpelling) {
  std::vector<Said> all;
  for (const char* name :
       {"fy_N", "Fy [N]", "F_y (N)", "force_y/N", "FORCE_Y_N", "forceY [N]", "giver_fy [N]",
        "wrench.force.y [N]", "y_force_N", "y [N]", "Force Y (filtered) [N]"})
    all.push_back({name, Quantity::force, 1.0, 1});
  for (const char* name : {"fy_mN", "Fy [mN]", "FY_MN", "fy / mN"})
    all.push_back({name, Quantity::force, 1e-3, 1});
  all.push_back({"fz_kN", Quantity::force, 1e3, 2});
  all.push_back({"fn_N", Quantity::strength, 1.0});
  all.push_back({"normal force [mN]", Quantity::strength, 1e-3});
  expect_said(all);
  EXPECT_EQ(read_column_name("giver_fx").of_what, "giver");
  EXPECT_EQ(read_column_name("Giver Force X [N]").of_what, "giver");
}

TEST(ColumnNames, OtherQuantitiesAreNeitherTimesNorPositionsNorForces) {
  for (const char* name : {"yaw",
                           "roll",
                           "pitch",
                           "yaw [rad]",
                           "xvel_mm",
                           "vx",
                           "x_vel",
                           "x [m/s]",
                           "x_m_s",
                           "x_m_per_s",
                           "x_mps",
                           "linear.x",
                           "angular.z",
                           "qx",
                           "q0",
                           "orientation.x",
                           "rx",
                           "x [rad]",
                           "x_deg",
                           "x [\xC2\xB0]",
                           "trial",
                           "tick_us",
                           "temperature",
                           "tremor",
                           "zoom",
                           "zero",
                           "x_raw",
                           "proxy_x_m",
                           "said_x_m",
                           "x_px",
                           "torque_x",
                           "int_tx",
                           "Tx [Nm]",
                           "fx_dot",
                           "force",
                           "x [s]",
                           "t [mm]",
                           "dt_s",
                           "x_m^2",
                           "yield [N]",
                           "x [m\xC2\xB2]",
                           "rigid_N",
                           "target_x",
                           "index",
                           "",
                           "_",
                           "[mm]",
                           "mm"}) {
    EXPECT_EQ(read_column_name(name).quantity, Quantity::other) << name;
  }
}

TEST(ColumnNames, AUnitThatIsNoneIsKept) {
  EXPECT_EQ(read_column_name("x [furlong]").unknown_unit, "furlong");
  EXPECT_EQ(read_column_name("x_Mm").unknown_unit, "Mm") << "a megametre, or a slip: not decided";
  EXPECT_EQ(read_column_name("Fx [MN]").unknown_unit, "MN");
  EXPECT_EQ(read_column_name("x_mm [m]").unknown_unit, "mm") << "two units";
}

TEST(ColumnNames, UnitsOfAFileAreTakenFromItsHeading) {
  const char* rows = "\n0,10,20,5\n2500,10,20,-5\n";
  for (const char* heading :
       {"time [ms],x [mm],y [mm],z [mm]", "Time(ms),X(mm),Y(mm),Z(mm)", "t/ms,x/mm,y/mm,z/mm",
        "T_MS,POS_X_MM,POS_Y_MM,POS_Z_MM", "t_msec,x_mm,y_mm,z_mm"}) {
    SCOPED_TRACE(heading);
    const auto path = tests::path_of(heading + std::string(rows));
    EXPECT_DOUBLE_EQ(path.t_s.back(), 2.5);
    EXPECT_EQ(path.position_m.back(), 1e-3 * glm::dvec3(10, 20, -5));
    EXPECT_THAT(path.notes, testing::IsEmpty());
  }
}

TEST(ColumnNames, AUnknownUnitIsRefusedWithTheKnownOnes) {
  EXPECT_THAT(
      tests::path_refusal("t_s,x [furlong],y [mm],z [mm]\n0,1,2,3\n"),
      testing::AllOf(HasSubstr("a file.csv:1: "), HasSubstr("'furlong'"), HasSubstr("m, cm, mm, um")));
  EXPECT_THAT(tests::path_refusal("t [fortnight],x_mm,y_mm,z_mm\n0,1,2,3\n"), HasSubstr("s, ms, us, ns"));
  EXPECT_THAT(tests::measured_refusal("t_s,x_mm,y_mm,z_mm,fx [dyn],fy [dyn],fz [dyn]\n0,1,2,3,4,5,6\n"),
              HasSubstr("N, mN, kN"));
}

TEST(ColumnNames, OfSeveralPositionsThePlainestIsTakenAndEqualOnesAreRefused) {
  // In recordings of robots, Euler angles, velocities and quaternions often precede the position.
  const auto yaw = tests::path_of("t_s,roll,pitch,yaw,x_mm,y_mm,z_mm\n0,1,2,1.5,10,20,30\n");
  EXPECT_EQ(yaw.position_m[0], 1e-3 * glm::dvec3(10, 20, 30));
  const auto velocity = tests::path_of("t_s,xvel_mm,yvel_mm,zvel_mm,x_mm,y_mm,z_mm\n0,0,0,-15,10,20,30\n");
  EXPECT_EQ(velocity.position_m[0], 1e-3 * glm::dvec3(10, 20, 30));
  const auto force = tests::path_of("t_s,x_N,y_N,z_N,x_mm,y_mm,z_mm\n0,1,2,3,10,20,30\n");
  EXPECT_EQ(force.position_m[0], 1e-3 * glm::dvec3(10, 20, 30));
  const auto pose = tests::path_of(
      "%time,pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.position.x,"
      "pose.position.y,pose.position.z\n0,0.1,0.2,0.3,10,20,30\n");
  EXPECT_EQ(pose.position_m[0], 1e-3 * glm::dvec3(10, 20, 30));
  const auto plainest = tests::path_of("t_s,tool_x,tool_y,tool_z,x,y,z\n0,1,2,3,10,20,30\n");
  EXPECT_EQ(plainest.position_m[0], 1e-3 * glm::dvec3(10, 20, 30));
  const auto translation = tests::path_of("# timestamp tx ty tz qx qy qz qw\n0 10 20 30 0 0 0 1\n");
  EXPECT_EQ(translation.position_m[0], 1e-3 * glm::dvec3(10, 20, 30));

  EXPECT_THAT(tests::path_refusal("t_s,tool_x,tool_y,tool_z,hand_x,hand_y,hand_z\n0,1,2,3,4,5,6\n"),
              HasSubstr("several positions, tool and hand"));
  EXPECT_THAT(tests::path_refusal("t_s,x_mm,y_mm,z_mm,x_m\n0,1,2,3,4\n"),
              HasSubstr("two columns for x, 'x_mm' and 'x_m'"));
  EXPECT_THAT(tests::path_refusal("stamp.secs,stamp.nsecs,x,y,z\n0,1,2,3,4\n"),
              HasSubstr("two columns for the time"));
  EXPECT_THAT(tests::path_refusal("t_s,pos_x,tool_y,z\n0,1,2,3\n"), HasSubstr("belong together"));
  EXPECT_THAT(tests::path_refusal("t_s,yaw,xvel,zoom\n0,1,2,3\n"),
              testing::AllOf(HasSubstr("nothing is named x, y, z"), HasSubstr("'yaw'")));
  EXPECT_THAT(tests::measured_refusal("x,y,z,tx,ty,tz\n1,2,3,4,5,6\n"), HasSubstr("no columns of a force"));
}

}  // namespace
