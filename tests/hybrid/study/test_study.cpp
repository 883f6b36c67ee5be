// SPDX-License-Identifier: GPL-3.0-or-later
// A study: figures equal those of a session, failures are rows, finished scans stay, outliers come first.
#include "hybrid/study/study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "hybrid/session/session.h"
#include "hybrid/study/study_report.h"
#include "tests/hybrid/compose/label_boxes.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "voxel/volume/write_volume.h"

namespace {

namespace fs = std::filesystem;
using hybrid::JudgedScan;
using hybrid::StudyOptions;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// A block of tissue on a plate of bone.
std::vector<tests::LabelBox> block_on_bone() {
  return {{{8, 8, 8}, {27, 27, 15}, 1}, {{8, 8, 4}, {27, 27, 7}, 2}};
}

class StudyOfScans : public tests::SceneFile {
 protected:
  fs::path save(const std::string& name, const std::vector<tests::LabelBox>& boxes) const {
    fs::create_directories((folder_ / name).parent_path());
    voxel::save_volume(folder_ / name, tests::volume_of(boxes));
    return folder_ / name;
  }
  [[nodiscard]] StudyOptions of_labels() const {
    StudyOptions options;
    options.scans = hybrid::pair_scans({folder_ / "labels"}, {(folder_ / "labels").string()});
    options.compose.names = write("names.csv", "label,name\n1,liver\n2,vertebrae_L1\n");
    options.out = folder_ / "out";
    return options;
  }
  static std::string text_of(const fs::path& file) {
    std::ifstream in(file);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
};

TEST_F(StudyOfScans, FiguresAreThoseOfASessionAndAFailureIsARow) {
  save("labels/whole.nii.gz", block_on_bone());
  save("labels/empty.nii.gz", {});
  std::vector<std::string> done;
  std::vector<JudgedScan> scans;
  hybrid::study(of_labels(), [&](const JudgedScan& scan, std::size_t n) {
    done.push_back(std::to_string(n) + " " + scan.pair.name);
    scans.push_back(scan);
  });
  const hybrid::Study study = hybrid::arranged(scans, 1.0);
  EXPECT_THAT(done, ElementsAre("1 empty", "2 whole"));
  ASSERT_EQ(study.scans.size(), 2U);
  const JudgedScan &empty = study.scans[0].judged, &whole = study.scans[1].judged;
  EXPECT_THAT(empty.failed, HasSubstr("nothing is labelled"));
  EXPECT_FALSE(empty.good());
  EXPECT_EQ(hybrid::scan_verdict(empty), "failed");

  ASSERT_EQ(whole.failed, "");
  EXPECT_EQ(whole.rigid_objects, 1U);
  EXPECT_EQ(whole.soft_objects, 1U);
  EXPECT_THAT(whole.session.worst_near, AllOf(HasSubstr("liver"), HasSubstr("from")));
  const hybrid::Scene scene = hybrid::load_scene(whole.scene);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  const hybrid::SessionResult session = hybrid::run_session(scene, built, [] {
    hybrid::SessionOptions options;
    options.measure_error = true;
    options.async_relaxation = true;
    return options;
  }());
  EXPECT_EQ(whole.soft_voxels, built.state->soft[0]->lattice().voxel_count());
  EXPECT_EQ(whole.session.ticks, session.ticks);
  EXPECT_EQ(whole.session.contact_ticks, session.contact_ticks);
  EXPECT_EQ(whole.session.max_force_N, session.max_force_N);
  EXPECT_EQ(whole.session.p99_jnd, session.error.p99_jnd);
  EXPECT_EQ(whole.session.moving_max_jnd, session.error.moving.max_jnd);
  EXPECT_EQ(whole.session.still_max_jnd, session.error.still.max_jnd);

  const nlohmann::ordered_json json = hybrid::study_json(study);
  EXPECT_EQ(json.at("scans").at(0).at("failed"), empty.failed);
  EXPECT_EQ(json.at("scans").at(1).at("session").at("error").at("jnd_p99"), session.error.p99_jnd);
  const std::string html = hybrid::to_html(hybrid::study_page(study, "two scans"));
  EXPECT_THAT(html, AllOf(HasSubstr("nothing is labelled"), HasSubstr("1 failed"), HasSubstr(">whole<")));
  EXPECT_THAT(hybrid::study_words(study), AllOf(HasSubstr("nothing is labelled"), HasSubstr("Of 2 scans")));
}

TEST_F(StudyOfScans, WhatIsDoneStaysUntilItsFilesChange) {
  save("labels/a.nii.gz", block_on_bone());
  const StudyOptions options = of_labels();
  const JudgedScan first = hybrid::judge_scan(options.scans[0], options);
  ASSERT_EQ(first.failed, "");
  const auto written = fs::last_write_time(first.scene);
  // Times of ticks differ between sessions. Equal times show that no new session was played.
  const JudgedScan again = hybrid::judge_scan(options.scans[0], options);
  EXPECT_EQ(again.session.tick_us.max, first.session.tick_us.max);
  EXPECT_EQ(again.session.worst_near, first.session.worst_near);
  EXPECT_EQ(again.notes, first.notes);
  EXPECT_EQ(fs::last_write_time(first.scene), written);

  // An edited scene is judged as it is.
  std::string text = text_of(first.scene);
  const std::size_t speed = text.find("speed = ");
  ASSERT_NE(speed, std::string::npos);
  text.replace(speed, text.find('\n', speed) - speed, "speed = 100");
  write("out/a/scene/scene.toml", text);
  const JudgedScan edited = hybrid::judge_scan(options.scans[0], options);
  ASSERT_EQ(edited.failed, "");
  EXPECT_NE(edited.session.ticks, first.session.ticks);
  EXPECT_EQ(text_of(first.scene), text);

  // Other labels make another scene.
  auto larger = block_on_bone();
  larger[0].high[2] = 20;
  save("labels/a.nii.gz", larger);
  const JudgedScan other = hybrid::judge_scan(options.scans[0], options);
  ASSERT_EQ(other.failed, "");
  EXPECT_GT(other.soft_voxels, first.soft_voxels);
  EXPECT_THAT(text_of(other.scene), Not(HasSubstr("speed = 100\n")));
}

TEST_F(StudyOfScans, AForeignSceneIsNotWrittenOver) {
  save("labels/a.nii.gz", block_on_bone());
  fs::create_directories(folder_ / "out" / "a" / "scene");
  const fs::path mine = write("out/a/scene/scene.toml", "format = 1\n");
  const fs::path beside = write("out/a/scene/mesh.stl", "mine");
  const StudyOptions options = of_labels();
  EXPECT_THAT(hybrid::judge_scan(options.scans[0], options).failed, HasSubstr("no study wrote"));
  EXPECT_EQ(text_of(mine), "format = 1\n");
  EXPECT_EQ(text_of(beside), "mine");
}

TEST_F(StudyOfScans, TheChoiceOfTuneIsPartOfTheRow) {
  save("labels/a.nii.gz", block_on_bone());
  StudyOptions options = of_labels();
  options.tune = options.quick = true;
  const JudgedScan judged = hybrid::judge_scan(options.scans[0], options);
  ASSERT_EQ(judged.failed, "");
  ASSERT_TRUE(judged.tuned.has_value());
  EXPECT_EQ(judged.tuned->not_tuned, "");
  EXPECT_THAT(judged.tuned->verdict, HasSubstr(judged.tuned->words));
  EXPECT_TRUE(fs::exists(folder_ / "out" / "a" / "tune" / "report.html"));
  const hybrid::Study study = hybrid::arranged({judged}, 1.0);
  EXPECT_THAT(hybrid::to_html(hybrid::study_page(study, "one")), HasSubstr("chosen setting"));
}

JudgedScan scan_of(const std::string& name, double error_jnd, double tick_us) {
  JudgedScan scan;
  scan.pair.name = name;
  scan.session.p99_jnd = error_jnd;
  scan.session.tick_us = {tick_us, tick_us, tick_us, tick_us};
  scan.memory_bytes = 1'000'000;
  scan.load_s = 1.0;
  return scan;
}

TEST(StudyOrder, TheFurthestBeyondABoundComesFirst) {
  JudgedScan failed = scan_of("failed", 0.1, 10.0), fault = scan_of("fault", 0.1, 10.0);
  failed.failed = "no labels";
  fault.faults = {"a buffer was full"};
  const hybrid::Study study = hybrid::arranged(
      {scan_of("good", 0.2, 100.0), scan_of("slow", 0.3, 1500.0), failed, scan_of("felt", 2.0, 90.0), fault},
      1.0);
  std::vector<std::string> names;
  for (const auto& scan : study.scans) names.push_back(scan.judged.pair.name);
  EXPECT_THAT(names, ElementsAre("failed", "fault", "slow", "felt", "good"));
  EXPECT_EQ(hybrid::scan_verdict(study.scans[2].judged), "too slow");
  EXPECT_EQ(hybrid::scan_verdict(study.scans[3].judged), "error felt");
  EXPECT_EQ(
      hybrid::study_verdict(study),
      "Of 5 scans, 1 is felt with an error of at most 1 JND, in time; 1 scan is felt with a larger error; "
      "1 scan is too slow; 1 scan has a fault; 1 failed.");
}

TEST(StudyOutliers, OneOfManyIsFoundAndSpreadIsNot) {
  EXPECT_THAT(hybrid::outliers_among({1.0, 1.1, 0.9, 1.05, 4.0, 1.0}), ElementsAre(0, 0, 0, 0, Not(0.0), 0));
  EXPECT_THAT(hybrid::outliers_among({1.0, 2.0, 4.0, 8.0, 16.0}), ElementsAre(0, 0, 0, 0, 0));
  EXPECT_THAT(hybrid::outliers_among({1.0, 1.0, 1.0, 1.0, 1.01}), ElementsAre(0, 0, 0, 0, 0));
  EXPECT_THAT(hybrid::outliers_among({1.0, 1.0, 100.0}), ElementsAre(0, 0, 0));  // too few to tell
  // Low values are no outliers, and the scale of the values does not matter.
  EXPECT_THAT(hybrid::outliers_among({1e9, 1e9, 1e9, 1e9, 1.0}), ElementsAre(0, 0, 0, 0, 0));
  const auto scaled = hybrid::outliers_among({1e-6, 1.1e-6, 0.9e-6, 1.05e-6, 4e-6, 1e-6});
  EXPECT_NEAR(scaled[4], 4.0 / 1.0, 0.3);
}

TEST(StudyOutliers, AreInTheirRows) {
  std::vector<JudgedScan> scans;
  for (int n = 0; n < 6; ++n) scans.push_back(scan_of("s" + std::to_string(n), 0.2, 100.0 + n));
  scans[3].memory_bytes = 50'000'000;
  scans[2].session.p99_jnd = 0.9;
  const hybrid::Study study = hybrid::arranged(scans, 1.0);
  EXPECT_EQ(study.scans[0].judged.pair.name, "s2");
  ASSERT_EQ(study.scans[0].outliers.size(), 1U);
  EXPECT_EQ(study.scans[0].outliers[0].figure, "error");
  for (const auto& scan : study.scans) {
    if (scan.judged.pair.name == "s3") {
      ASSERT_EQ(scan.outliers.size(), 1U);
      EXPECT_EQ(scan.outliers[0].figure, "memory");
      EXPECT_NEAR(scan.outliers[0].times_median, 50.0, 1e-6);
    }
  }
}

}  // namespace
