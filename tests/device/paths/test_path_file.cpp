// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/path_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <iostream>
#include <iterator>
#include <string>

#include "tests/shared_data.h"

namespace {

using device::CsvPath;
using device::make_path;
using device::PathError;
using device::read_trajectory;
using device::Trajectory;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class PathFile : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  [[nodiscard]] CsvPath csv(const std::string& text) const {
    const std::filesystem::path file = folder_ / "a path.csv";
    std::ofstream(file, std::ios::binary) << text;
    return {.file = file};
  }
  // The error text of reading the file; empty if the file is accepted.
  static std::string refusal(const CsvPath& path) {
    try {
      read_trajectory(path);
    } catch (const PathError& error) {
      return error.what();
    }
    return {};
  }
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("hybrid path file " + std::to_string(getpid()));
};

TEST_F(PathFile, UnitsComeFromTheHeader) {
  const Trajectory metres = read_trajectory(csv("t_s,x_m,y_m,z_m\n0,1,2,3\n0.5,4,5,6\n"));
  EXPECT_THAT(metres.t_s, ElementsAre(0.0, 0.5));
  EXPECT_THAT(metres.position_m, ElementsAre(glm::dvec3(1, 2, 3), glm::dvec3(4, 5, 6)));
  EXPECT_THAT(metres.notes, IsEmpty());

  const Trajectory mixed = read_trajectory(csv("t_ms,x_mm,y_cm,z_um\n0,1,2,3\n500,4,5,6\n"));
  EXPECT_THAT(mixed.t_s, ElementsAre(0.0, 0.5));
  EXPECT_LE(glm::length(mixed.position_m[1] - glm::dvec3(4e-3, 5e-2, 6e-6)), 1e-15);
}

TEST_F(PathFile, WithoutAUnitTheCallersHolds) {
  CsvPath path = csv("Time, X, Y, Z\n0, 1, 2, 3\n");
  path.unit_m = 1e-3;
  path.offset_m = {1.0, 0.0, 0.0};
  const Trajectory read = read_trajectory(path);
  EXPECT_LE(glm::length(read.position_m[0] - glm::dvec3(1.001, 0.002, 0.003)), 1e-15);
  EXPECT_THAT(read.notes, ElementsAre(HasSubstr("taken as the scene's, 1 mm")));
  // A time without a unit is in seconds. If the usual step is then several seconds, a note says so, because
  // this is doubtful.
  EXPECT_THAT(read_trajectory(csv("t,x_m,y_m,z_m\n0,0,0,0\n10,0,0,0\n20,0,0,0\n")).notes,
              ElementsAre(testing::AllOf(HasSubstr("taken as seconds"), HasSubstr("10 s"))));
}

// A file of `rostopic echo -p`: the heading begins like a comment, and a column holds text.
TEST_F(PathFile, AHeadingThatBeginsLikeAComment) {
  const Trajectory ros = read_trajectory(
      csv("%time,field.header.seq,field.header.frame_id,field.pose.position.x,field.pose.position.y,"
          "field.pose.position.z,field.pose.orientation.x,field.pose.orientation.w\n"
          "1617187200000000000,1,base,0.1,0.2,0.3,0,1\n1617187200500000000,2,base,0.4,0.5,0.6,0,1\n"));
  EXPECT_THAT(ros.t_s, ElementsAre(0.0, testing::DoubleNear(0.5, 1e-6)));
  EXPECT_THAT(ros.position_m, ElementsAre(glm::dvec3(0.1, 0.2, 0.3), glm::dvec3(0.4, 0.5, 0.6)));
  // The comment above the heading could be a heading itself.
  const Trajectory headed = read_trajectory(csv("# t_ms,x_mm,y_mm,z_mm\nt_s,x_m,y_m,z_m\n0,1,2,3\n"));
  EXPECT_THAT(headed.position_m, ElementsAre(glm::dvec3(1, 2, 3)));
  // A comment is no heading if the row below it has text in a column of coordinates.
  EXPECT_THAT(refusal(csv("%time,x_m,y_m,z_m,note\n0,1,two,3,hello\n")), HasSubstr("no columns x, y and z"));
}

TEST_F(PathFile, OtherColumnsAreIgnoredWhateverTheyHold) {
  const Trajectory read = read_trajectory(
      csv("quality,z_m,t_s,taker_fx,y_m,x_m,x_raw,note\n9,3,0,nan,2,1,77,hello\n9,6,1,,5,4,77,\n"));
  EXPECT_THAT(read.t_s, ElementsAre(0.0, 1.0));
  EXPECT_THAT(read.position_m, ElementsAre(glm::dvec3(1, 2, 3), glm::dvec3(4, 5, 6)));
}

TEST_F(PathFile, CommentsBlanksQuotesByteOrderMarksAndForeignLineEndsAreRead) {
  const Trajectory read =
      read_trajectory(csv("\xEF\xBB\xBF# from somewhere\r\n\r\n\"t_s\",\"x_m\",\"y_m\",\"z_m\"\r\n 0 "
                          ",+1,2e0,3\r\n\r\n# half\r\n1,4,5,6"));
  EXPECT_THAT(read.position_m, ElementsAre(glm::dvec3(1, 2, 3), glm::dvec3(4, 5, 6)));
}

TEST_F(PathFile, TimesBeginAtZero) {
  const Trajectory read = read_trajectory(csv("t_s,x_m,y_m,z_m\n100,0,0,0\n101,1,0,0\n"));
  EXPECT_THAT(read.t_s, ElementsAre(0.0, 1.0));
  EXPECT_THAT(read.notes, ElementsAre(HasSubstr("100 s")));
}

TEST_F(PathFile, ClocksThatCountFrom1970AreRecognisedByTheirSize) {
  struct Clock {
    const char *heading, *first, *last, *said;  // first and last time are 2 s apart
  };
  for (const Clock& clock : {Clock{"time", "1617187200000000000", "1617187202000000000", "nanoseconds"},
                             Clock{"timestamp", "1617187200000000", "1617187202000000", "microseconds"},
                             Clock{"t", "1617187200000", "1617187202000", "milliseconds"}}) {
    const Trajectory read = read_trajectory(csv(clock.heading + std::string(",x_m,y_m,z_m\n") + clock.first +
                                                ",0,0,0\n" + clock.last + ",1,0,0\n"));
    EXPECT_DOUBLE_EQ(read.t_s.back(), 2.0);
    EXPECT_THAT(read.notes, ElementsAre(HasSubstr(clock.said), HasSubstr("1.617e+09 s, is taken as 0")));
  }
  const Trajectory seconds =
      read_trajectory(csv("t,x_m,y_m,z_m\n1617187200.25,0,0,0\n1617187200.75,0,0,0\n"));
  EXPECT_DOUBLE_EQ(seconds.t_s.back(), 0.5);
  EXPECT_THAT(seconds.notes, testing::SizeIs(1));
}

TEST_F(PathFile, NanosecondsSince1970KeepEveryDigit) {
  const Trajectory read =
      read_trajectory(csv("timestamp_ns,x_m,y_m,z_m\n1617187200000000001,0,0,0\n1617187200000000002,0,0,0\n"
                          "1617187202000000001,0,0,0\n"));
  EXPECT_THAT(read.t_s, ElementsAre(0.0, testing::DoubleEq(1e-9), testing::DoubleEq(2.0)));
}

TEST_F(PathFile, TimesThatCannotBeInTheirUnitAreRefused) {
  const auto from_to = [&](const char* heading, const char* first, const char* last) {
    return refusal(csv(heading + std::string(",x_m,y_m,z_m\n") + first + ",0,0,0\n" + last + ",0,0,0\n"));
  };
  EXPECT_THAT(from_to("t", "0", "86401"), testing::AllOf(HasSubstr("longer than a day"), HasSubstr("t_ms")));
  EXPECT_EQ(from_to("t", "0", "86400"), "");
  EXPECT_THAT(from_to("t_s", "0", "2000000000"), HasSubstr("longer than a day")) << "stated, and wrong";
  EXPECT_THAT(from_to("t_s", "1617187200000000000", "1617187200000000001"), HasSubstr("beyond any calendar"));
  EXPECT_THAT(from_to("t", "86400000000000", "86400010000000"), HasSubstr("beyond any calendar"))
      << "nanoseconds since the machine started";
  EXPECT_THAT(from_to("time", "12:30:15.5", "12:30:16.5"), HasSubstr("write times as numbers"));
  EXPECT_EQ(from_to("t_min", "0", "1440"), "");
}

TEST_F(PathFile, RepeatedTimesAndGapsAreReported) {
  const Trajectory read = read_trajectory(
      csv("t_s,x_m,y_m,z_m\n0,0,0,0\n1,1,0,0\n1,2,0,0\n2,2,0,0\n3,3,0,0\n4,4,0,0\n15,5,0,0\n16,6,0,0\n"));
  EXPECT_THAT(read.t_s, ElementsAre(0, 1, 2, 3, 4, 15, 16));
  EXPECT_EQ(read.position_m[1].x, 2.0) << "the later of two samples at one time stands";
  EXPECT_THAT(read.notes, ElementsAre(testing::AllOf(HasSubstr("1 sample repeats"), HasSubstr("line 4")),
                                      testing::AllOf(HasSubstr("1 gap"), HasSubstr("11 s at t = 4 s"))));
  const auto path = make_path(csv("t_s,x_m,y_m,z_m\n0,0,0,0\n1,1,0,0\n1,2,0,0\n2,2,0,0\n"));
  EXPECT_EQ(path->notes().size(), 1U);
}

TEST_F(PathFile, MalformedRowsAreRefusedWithFileAndLine) {
  const std::string header = "t_s,x_m,y_m,z_m\n0,0,0,0\n";
  for (const char* row : {"1,2,3", "1,a,2,3", "1,,2,3", "1,nan,2,3", "1,inf,2,3", "1,2,3,4x", "1;2;3;4",
                          "1,1e999,2,3", "1,+-2,3,4", "t_s,x_m,y_m,z_m"}) {
    EXPECT_THAT(refusal(csv(header + row + "\n")), HasSubstr("a path.csv:3: ")) << row;
  }
  EXPECT_THAT(refusal(csv(header + "1,0,0,0\n0.5,0,0,0\n")),
              testing::AllOf(HasSubstr("a path.csv:4: "), HasSubstr("backwards"), HasSubstr("0.5 s")));
}

TEST_F(PathFile, FilesThatAreNoTrajectoryAreRefused) {
  EXPECT_THAT(refusal(csv("")), HasSubstr("empty"));
  EXPECT_THAT(refusal(csv("\n\n# nothing\n")), HasSubstr("empty"));
  EXPECT_THAT(refusal(csv("t_s,x_m,y_m,z_m\n")), HasSubstr("no rows"));
  EXPECT_THAT(refusal(csv("0,1,2,3\n")), HasSubstr("without a heading"));
  EXPECT_THAT(refusal(csv("t_s,x_m,y_m\n0,1,2\n")), HasSubstr("nothing is named z"));
  EXPECT_THAT(refusal(csv("x_m,y_m,z_m\n0,1,2\n")), HasSubstr("no column of times"));
  EXPECT_THAT(refusal(csv(std::string(100'000, 'x'))), HasSubstr("longer than"));
  EXPECT_THAT(refusal({.file = folder_ / "missing.csv"}), HasSubstr("no such file"));
  EXPECT_THAT(refusal({.file = folder_}), HasSubstr("not a file"));
  CsvPath bad_unit = csv("t_s,x_m,y_m,z_m\n0,0,0,0\n");
  bad_unit.unit_m = 0.0;
  EXPECT_THAT(refusal(bad_unit), HasSubstr("unit"));
  EXPECT_THAT(refusal(csv("t_s,x_m,y_m,z_m\n0,0,0,0\n1,0,-1e300,0\n")),
              testing::AllOf(HasSubstr("a path.csv:3: "), HasSubstr("'-1e300' is more than 1e+09 m")));
  EXPECT_THAT(refusal(csv("t_s,x_mm,y_m,z_m\n0,1e12,1e9,-1e9\n")), "") << "large, and not too large";
}

TEST_F(PathFile, CompressedFilesReadTheSameAndDamagedOnesAreRefused) {
  std::string text = "t_s,x_mm,y_mm,z_mm\n";
  for (int i = 0; i < 5000; ++i)
    text += std::to_string(i * 1e-3) + "," + std::to_string(i * i % 1013) + ",1,2\n";
  const Trajectory plain = read_trajectory(csv(text));
  const std::filesystem::path file = folder_ / "packed.csv.gz";
  gzFile packed = gzopen(file.c_str(), "wb");
  gzwrite(packed, text.data(), static_cast<unsigned>(text.size()));
  gzclose(packed);
  const Trajectory read = read_trajectory({.file = file});
  EXPECT_EQ(read.t_s, plain.t_s);
  EXPECT_EQ(read.position_m, plain.position_m);

  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  EXPECT_THAT(refusal({.file = file}), HasSubstr("cut short or damaged"));
}

TEST(PathFileData, RecordedTrajectoriesAreFollowed) {
  const std::filesystem::path folder = tests::shared_data("data/trajectories");
  SKIP_WITHOUT(folder);
  struct Expected {
    const char* file;
    std::size_t samples;
    double duration_s;
    glm::dvec3 first_m, range_m;
    double longest_gap_s;  // 0: no gap is expected
  };
  const Expected recordings[] = {
      {"desk_taurus_S3_T2_right.csv.gz",
       22625,
       128.13,
       {0.335294, 0.098635, 0.133825},
       {0.037565, 0.096302, 0.048425},
       36.19},
      {"desk_taurus_S7_T4_left.csv.gz",
       24665,
       99.75,
       {0.355198, -0.077648, 0.148061},
       {0.044898, 0.068953, 0.040162},
       1.10},
      {"handover_baton_pose_wrench_120hz.csv.gz",
       801,
       6.67,
       {-0.2566639, -0.4832027, 0.8373007},
       {0.535, 0.81, 0.296},
       0.0},
  };
  for (const Expected& expected : recordings) {
    SCOPED_TRACE(expected.file);
    const CsvPath csv{.file = folder / expected.file};
    const Trajectory read = read_trajectory(csv);
    glm::dvec3 low = read.position_m.front(), high = low;
    for (const glm::dvec3& p : read.position_m) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
    EXPECT_LE(read.t_s.size(), expected.samples);
    EXPECT_GT(read.t_s.size(), expected.samples * 9 / 10);
    EXPECT_LE(glm::length(read.position_m.front() - expected.first_m), 1e-12);
    EXPECT_LE(glm::length(high - low - expected.range_m), 1e-3);
    const auto path = make_path(csv);
    EXPECT_NEAR(path->duration_s(), expected.duration_s, 0.01);
    EXPECT_EQ(path->position(0.0), read.position_m.front());
    EXPECT_EQ(path->position(1e9), read.position_m.back());
    for (std::size_t i = 0; i + 1 < read.t_s.size(); i += 37) {
      const glm::dvec3 middle = 0.5 * (read.position_m[i] + read.position_m[i + 1]);
      ASSERT_LE(glm::length(path->position(0.5 * (read.t_s[i] + read.t_s[i + 1])) - middle), 1e-9) << i;
    }
    if (expected.longest_gap_s > 0.0) {
      ASSERT_FALSE(path->notes().empty());
      EXPECT_THAT(path->notes().back(), HasSubstr("gap"));
    } else {
      EXPECT_THAT(path->notes(), IsEmpty());
    }
    for (const std::string& note : path->notes()) std::cout << "  note: " << note << "\n";
  }
}

}  // namespace
