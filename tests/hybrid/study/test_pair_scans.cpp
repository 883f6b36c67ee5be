// SPDX-License-Identifier: GPL-3.0-or-later
// Labels are paired with their scans, in the layouts in which data sets are published.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "hybrid/study/pair_scans.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

namespace fs = std::filesystem;
using hybrid::pair_scans;
using hybrid::ScanPair;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PairScans : public tests::SceneFile {
 protected:
  // Makes empty files, because only names count.
  void make(const std::vector<std::string>& names) const {
    for (const std::string& name : names) {
      fs::create_directories((folder_ / name).parent_path());
      write(name, "");
    }
  }
  // "name: scan + labels", with paths below the test's folder. Without labels, "name: scan".
  [[nodiscard]] std::vector<std::string> pairs(const std::vector<std::string>& scans,
                                               const std::vector<std::string>& labels) const {
    std::vector<std::string> found;
    for (const ScanPair& pair : pair_scans(in_folder(scans), strings(labels))) {
      std::string text = pair.name + ": " + below(pair.scan);
      if (!pair.labels.empty()) text += " + " + below(pair.labels);
      found.push_back(text);
      EXPECT_TRUE(pair.unpaired.empty() || pair.labels.empty()) << text;
    }
    return found;
  }
  [[nodiscard]] std::vector<fs::path> in_folder(const std::vector<std::string>& names) const {
    std::vector<fs::path> paths;
    for (const std::string& name : names) paths.push_back(folder_ / name);
    return paths;
  }
  [[nodiscard]] std::vector<std::string> strings(const std::vector<std::string>& names) const {
    std::vector<std::string> paths;
    for (const std::string& name : names) paths.push_back((folder_ / name).string());
    return paths;
  }
  [[nodiscard]] std::string below(const fs::path& file) const {
    return file.empty() ? "" : file.lexically_relative(folder_).string();
  }
};

TEST_F(PairScans, LabelsBesideScansInOneFolder) {
  make({"a.nii.gz", "a_labels.nii.gz", "a_2.nii.gz", "a_2_labels.nii.gz", "notes.txt"});
  EXPECT_THAT(pairs({"."}, {"a_labels.nii.gz", "a_2_labels.nii.gz"}),
              ElementsAre("a: ./a.nii.gz + a_labels.nii.gz", "a_2: ./a_2.nii.gz + a_2_labels.nii.gz"));
}

TEST_F(PairScans, ANameIsNoBeginningOfALongerWord) {
  make({"in/case1.nrrd", "in/case10.nrrd", "seg/case10-seg.nrrd"});
  const auto found = pair_scans(in_folder({"in"}), strings({"seg"}));
  EXPECT_THAT(found[0].unpaired, HasSubstr("case1_labels.nii.gz"));
  EXPECT_EQ(found[1].labels.filename(), "case10-seg.nrrd");
}

TEST_F(PairScans, DataSetsOfNnUNet) {
  make({"imagesTr/liver_1_0000.nii.gz", "imagesTr/liver_2_0000.nii.gz", "labelsTr/liver_1.nii.gz",
        "labelsTr/liver_2.nii.gz"});
  EXPECT_THAT(pairs({"imagesTr"}, {"labelsTr"}),
              ElementsAre("liver_1: imagesTr/liver_1_0000.nii.gz + labelsTr/liver_1.nii.gz",
                          "liver_2: imagesTr/liver_2_0000.nii.gz + labelsTr/liver_2.nii.gz"));
}

TEST_F(PairScans, AFolderForEachPatient) {
  make({"s1/ct.nii.gz", "s1/segmentation.nii.gz", "s2/ct.nii.gz", "s2/segmentation.nii.gz"});
  EXPECT_THAT(pairs({"s1/ct.nii.gz", "s2/ct.nii.gz"}, {"s1/segmentation.nii.gz", "s2/segmentation.nii.gz"}),
              ElementsAre("s1-ct: s1/ct.nii.gz + s1/segmentation.nii.gz",
                          "s2-ct: s2/ct.nii.gz + s2/segmentation.nii.gz"));
  EXPECT_THAT(pairs({"."}, {"s1/segmentation.nii.gz", "s2/segmentation.nii.gz"}),
              ElementsAre("s1-ct: ./s1/ct.nii.gz + s1/segmentation.nii.gz",
                          "s2-ct: ./s2/ct.nii.gz + s2/segmentation.nii.gz"));
}

TEST_F(PairScans, ADicomSeriesIsItsFolder) {
  make({"scans/p1/IM0001", "scans/p1/IM0002", "scans/p2/1.dcm", "labels/p1.nii.gz", "labels/p2_seg.nii.gz"});
  EXPECT_THAT(pairs({"scans"}, {"labels"}),
              ElementsAre("p1: scans/p1 + labels/p1.nii.gz", "p2: scans/p2 + labels/p2_seg.nii.gz"));
  EXPECT_THAT(pairs({"scans/p1/"}, {"labels/p1.nii.gz"}), ElementsAre("p1: scans/p1 + labels/p1.nii.gz"));
}

TEST_F(PairScans, OneScanTakesTheOnlyLabels) {
  make({"x/ct.nii.gz", "y/organs.nii.gz"});
  EXPECT_THAT(pairs({"x/ct.nii.gz"}, {"y/organs.nii.gz"}), ElementsAre("ct: x/ct.nii.gz + y/organs.nii.gz"));
}

TEST_F(PairScans, SeveralLabelsForOneScanAreRefusedByName) {
  make({"a.nii.gz", "a_bones.nii.gz", "a_organs.nii.gz", "b.nii.gz", "b_bones.nii.gz", "b.mha"});
  const auto found = pair_scans(in_folder({"a.nii.gz", "b.nii.gz"}),
                                strings({"a_bones.nii.gz", "a_organs.nii.gz", "b_bones.nii.gz", "b.mha"}));
  EXPECT_THAT(found[0].unpaired, HasSubstr("2 label volumes belong to it by name, a_bones.nii.gz"));
  EXPECT_EQ(found[1].labels.filename(), "b.mha");  // has exactly the name of the scan
}

TEST_F(PairScans, LabelsByTheNameOfTheRow) {
  make({"in/a.nii.gz", "in/b.nii.gz", "in/organs.nii.gz", "b_labels.nii.gz", "b_2=x.nii.gz"});
  const std::string organs = (folder_ / "in/organs.nii.gz").string();
  const auto found = pair_scans(in_folder({"in"}), {"a=" + organs, (folder_ / "b_labels.nii.gz").string()});
  ASSERT_EQ(found.size(), 2U);  // the labels are no scan
  EXPECT_EQ(found[0].labels, organs);
  EXPECT_EQ(found[1].labels.filename(), "b_labels.nii.gz");
  // A stated name of a row counts more than the file's name. A file may have '=' in its name.
  EXPECT_EQ(
      pair_scans(in_folder({"in/b.nii.gz"}), {"b=" + organs, (folder_ / "b_2=x.nii.gz").string()})[0].labels,
      organs);
  EXPECT_THROW((void)pair_scans(in_folder({"in"}), {"c=" + organs}), std::runtime_error);
  EXPECT_THROW((void)pair_scans(in_folder({"in"}), {"a=" + organs + "x"}), std::runtime_error);
}

TEST_F(PairScans, LabelsAlone) {
  make({"l/a.nii.gz", "l/b.nii.gz"});
  const auto found = pair_scans(in_folder({"l"}), strings({"l"}));
  ASSERT_EQ(found.size(), 2U);
  EXPECT_THAT(found[0].scan.string(), IsEmpty());
  EXPECT_EQ(found[1].labels.filename(), "b.nii.gz");
}

TEST_F(PairScans, NamesAreUniqueAlsoWhereCaseDoesNotCount) {
  make({"u/s/ct.nii.gz", "v/s/ct.nii.gz", "v/S/CT.nii.gz"});
  const auto found = pair_scans(in_folder({"u", "v"}), {});
  ASSERT_EQ(found.size(), 3U);
  std::vector<std::string> names;
  for (const ScanPair& pair : found) {
    std::string small = pair.name;
    for (char& c : small) c = static_cast<char>(std::tolower(c));
    names.push_back(small);
    EXPECT_THAT(pair.unpaired, IsEmpty());
  }
  std::ranges::sort(names);
  EXPECT_EQ(std::ranges::adjacent_find(names), names.end());
}

TEST_F(PairScans, NothingToStudyIsRefused) {
  make({"a.nii.gz", "empty/readme.txt"});
  fs::create_directories(folder_ / "none");
  EXPECT_THROW((void)pair_scans(in_folder({"none"}), {}), std::runtime_error);
  EXPECT_THROW((void)pair_scans(in_folder({"missing.nii.gz"}), {}), std::runtime_error);
  EXPECT_THROW((void)pair_scans(in_folder({"a.nii.gz"}), strings({"empty"})), std::runtime_error);
}

}  // namespace
