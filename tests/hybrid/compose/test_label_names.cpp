// SPDX-License-Identifier: GPL-3.0-or-later
// Names of labels from tables and JSON, and the tissues that are recognised by their names.
#include "hybrid/compose/label_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "hybrid/compose/compose.h"
#include "hybrid/compose/parts_from_labels.h"
#include "hybrid/scene/tissue_table.h"

namespace {

namespace fs = std::filesystem;

using hybrid::LabelNames;

const LabelNames kThree{{1, "femur_left"}, {2, "liver"}, {3, "rib left 5"}};

// A file of names in a temporary folder, which is removed at the end.
class NamesFile {
 public:
  NamesFile(const std::string& name, const std::string& bytes)
      : folder_(fs::temp_directory_path() / ("hybrid-names-" + std::to_string(::getpid()))),
        file_(folder_ / name) {
    fs::create_directories(folder_);
    std::ofstream(file_, std::ios::binary) << bytes;
  }
  ~NamesFile() { fs::remove_all(folder_); }
  NamesFile(const NamesFile&) = delete;
  NamesFile& operator=(const NamesFile&) = delete;

  [[nodiscard]] const fs::path& path() const { return file_; }
  // The text of the refusal; empty if the file is read.
  [[nodiscard]] std::string refusal() const {
    try {
      (void)hybrid::read_label_names(file_);
      return {};
    } catch (const hybrid::ComposeError& error) {
      return error.what();
    }
  }

 private:
  fs::path folder_, file_;
};

LabelNames read(const std::string& name, const std::string& bytes) {
  return hybrid::read_label_names(NamesFile(name, bytes).path());
}

TEST(LabelNames, ComeFromTables) {
  struct Case {
    const char *what, *file, *bytes;
  };
  for (const Case& c : std::vector<Case>{
           {"CSV", "a.csv", "1,femur_left\n2,liver\n3,rib left 5\n"},
           {"a byte-order mark", "a.csv",
            "\xEF\xBB\xBF"
            "1,femur_left\r\n2,liver\r\n3,rib left 5\r\n"},
           {"a mark before a heading", "a.csv",
            "\xEF\xBB\xBFlabel,name\n1,femur_left\n2,liver\n3,rib left 5\n"},
           {"lines that end with CR", "a.csv", "1,femur_left\r2,liver\r3,rib left 5\r"},
           {"no end of the last line", "a.csv", "1,femur_left\n2,liver\n3,rib left 5"},
           {"colours in CSV", "a.csv", "1,femur_left,255,0,0\n2,liver,0,1,0\n3,rib left 5,3,3,3\n"},
           {"colours first in CSV", "a.csv", "1,255,0,0,femur_left\n2,0,1,0,liver\n3,3,3,3,rib left 5\n"},
           {"a colour after blanks in CSV", "a.csv",
            "1,femur_left 255 0 0\n2,liver 0 1 0\n3,rib left 5 3 3 3\n"},
           {"hexadecimal colours", "a.csv",
            "1,#ff0000,femur_left\n2,liver,#00ff00\n3,\"rib left 5\",#00ff00ff\n"},
           {"quotes", "a.csv", "\"1\",\"femur_left\"\n\"2\",\"liver\"\n\"3\",\"rib left 5\"\n"},
           {"semicolons", "a.csv", "index;name\n1;femur_left\n2;liver\n3;rib left 5\n"},
           {"a separator that is stated", "a.csv",
            "sep=;\nindex;name\n1;femur_left\n2;liver\n3;rib left 5\n"},
           {"colons", "a.txt", "1: femur_left\n2: liver\n3 : rib left 5\n"},
           {"equals signs", "a.txt", "1 = femur_left\n2=liver\n3 = \"rib left 5\"\n"},
           {"the name first", "a.csv", "name,index\nfemur_left,1\nliver,2\nrib left 5,3\n"},
           {"'label' is the name", "a.csv", "id,label\n1,femur_left\n2,liver\n3,rib left 5\n"},
           {"numbers as decimals", "a.csv", "index,name\n1.0,femur_left\n2.0,liver\n3.0,rib left 5\n"},
           {"words", "a.txt", "# names\n1 femur_left\n2\tliver\n3 rib left 5\n"},
           {"words and RGB", "a.txt", "1 femur_left 255 0 0\n2 liver 0 255 0\n3 rib left 5 1 2 3\n"},
           {"3D Slicer", "a.ctbl",
            "# Color table file a.ctbl\n# 4 values\n0 Background 0 0 0 0\n1 femur_left 221 130 101 255\n"
            "2 liver 144 238 144 255\n3 rib left 5 1 2 3 255\n"},
           {"3D Slicer in CSV", "a.csv",
            "LabelValue,Name,Color_R,Color_G,Color_B,Color_A\n1,femur_left,1,2,3,255\n2,liver,1,2,3,255\n"
            "3,\"rib left 5\",1,2,3,255\n"},
           {"ITK-SNAP", "a.txt",
            "################################################\n# ITK-SnAP Label Description File\n"
            "# IDX   -R-  -G-  -B-  -A--  VIS MSH  LABEL\n"
            "    0     0    0    0        0  0  0    \"Clear Label\"\n"
            "    1   255    0    0        1  1  1    \"femur_left\"\n"
            "    2     0  255    0      0.5  1  1    \"liver\"\n"
            "    3     0    0  255        1  1  1    \"rib left 5\"\n"},
           {"ITK-SNAP with tabs", "a.label",
            "1\t255\t0\t0\t1\t1\t1\t\"femur_"
            "left\"\n2\t0\t1\t0\t1\t1\t1\t\"liver\"\n3\t0\t1\t0\t1\t1\t1\t\"rib left 5\"\n"},
           {"FreeSurfer", "FreeSurferColorLUT.txt",
            "#No. Label Name:                            R   G   B   A\n\n"
            "0   Unknown                                 0   0   0   0\n"
            "1   femur_left                              70  130 180 0\n"
            "2   liver                                   205 62  78  0\n"
            "3   rib left 5                              205 62  78  0\n"
            "14175 wm_rh_S_temporal_transverse           221 60  60  0\n"},
           {"BIDS", "a.tsv",
            "index\tname\tabbreviation\tcolor\n0\tBackground\tBG\t#000000\n1\tfemur_left\tFL\t#ff53bb\n"
            "2\tliver\tn/a\t#ff53bb\n3\trib left 5\tR5\t#ff53bb\n4\tn/a\tn/a\tn/a\n1001\tfar\tF\t#ff53bb\n"},
           {"BIDS in another order", "a.tsv",
            "color\tmapping\tname\tindex\n#ff53bb\t\tfemur_left\t1\n\t2\tliver\t2\n#ff53bb\t3\trib left "
            "5\t3\n"}}) {
    EXPECT_EQ(read(c.file, c.bytes), kThree) << c.what;
  }
  EXPECT_EQ(read("a.csv", "1,\"liver, left\",255,0,0\n2,\"the \"\"second\"\"\"\n"),
            (LabelNames{{1, "liver, left"}, {2, "the \"second\""}}));
  EXPECT_EQ(read("a.csv", "1,7\n"), (LabelNames{{1, "7"}})) << "a number can be a name";
}

TEST(LabelNames, ComeFromJson) {
  for (
      const std::string text :
      {R"({"labels": ["Air", "femur_left", "liver", "rib left 5"], "R": [0, 1]})",
       R"(["Air", "femur_left", "liver", "rib left 5"])",
       R"({"1": "femur_left", "2": "liver", "3": "rib left 5"})",
       R"({"labels": {"background": 0, "femur_left": 1, "liver": 2, "rib left 5": 3}, "file_ending": ".nii.gz"})",
       R"({"labels": {"0": "background", "1": "femur_left", "2": "liver", "3": "rib left 5"}})",
       R"({"labels": {"background": 0, "all": [1, 2, 3], "femur_left": [1], "liver": 2, "rib left 5": [3], "ignore": 0}})",
       R"({"LabelMap": {"femur_left": 1, "liver": 2, "rib left 5": 3}})",
       R"({"labels": [{"index": 1, "name": "femur_left"}, {"index": 2, "name": "liver"}, {"index": 3, "name": "rib left 5"}]})"}) {
    EXPECT_EQ(read("a.json", text), kThree) << text;
    EXPECT_EQ(read("A.JSON", "\xEF\xBB\xBF" + text), kThree) << text;
  }
  EXPECT_EQ(
      read("a.json",
           R"({"labels": {"background": 0, "whole": [1, 2], "core": [2]}, "regions_class_order": [1, 2]})"),
      (LabelNames{{1, "whole"}, {2, "core"}}))
      << "a label of several regions is called by the smallest";
}

TEST(LabelNames, WhatCannotBeReadNamesTheFileAndWhatToDo) {
  struct Case {
    const char *file, *bytes, *says, *remedy;
  };
  for (const Case& c : std::vector<Case>{
           {"latin.csv", "1,Leber (gro\xDF)\n2,Rippe\n", "latin.csv:1: is not UTF-8", "iconv"},
           {"latin.json", "{\"1\":\n\"Leber (gro\xDF)\"}", "latin.json:2: is not UTF-8", "iconv"},
           {"latin.tsv", "index\tname\n1\tLeber\n2\tN\xE4gel\n", "latin.tsv:3: is not UTF-8",
            "save it as UTF-8"},
           {"overlong.csv", "1,a\xC0\x80\n", "overlong.csv:1: is not UTF-8", "save it as UTF-8"},
           {"wide.csv",
            "\xFF\xFE"
            "1",
            "wide.csv: is UTF-16", "save it as UTF-8"},
           {"lfs.csv", "version https://git-lfs.github.com/spec/v1\noid sha256:4d\nsize 12345\n",
            "lfs.csv: is a Git LFS pointer", "git lfs pull"},
           {"page.json", "<!DOCTYPE html>\n<html>", "page.json: is a web page", "download"},
           {"colours.txt", "1 255 0 0\n", "colours.txt:1: the row has no name", "as in 5,liver"},
           {"colours.csv", "1,liver\n2,255,0,0\n", "colours.csv:2: the row has no name", "as in 5,liver"},
           {"empty.csv", "", "empty.csv: names no label", "as in 5,liver"},
           {"order.txt", "1 liver\nspleen 2\n", "order.txt:2: \"spleen\" is neither", "as in 5,liver"},
           {"heading.csv", "one,liver\n2,spleen\n", "heading.csv:1: \"one\" is neither", "index, name"},
           {"below.csv", "-1,liver\n", "below.csv:1: label -1 is below 0", "renumber"},
           {"beyond.csv", "300,liver\n", "names no label from 1 to 255", "renumber"},
           {"twice.json", R"({"liver": 1, "spleen": 1})", "label 1 is called \"liver\" and \"spleen\"",
            "keep one"},
           {"key.json", R"({"1": "femur", "2": "liver", "1": "tibia"})", "key.json: has the key \"1\" twice",
            "keep one"},
           {"escape.csv", "1,fem\x1B[31mur\n", "escape.csv:1: the name of label 1 holds a character",
            "write the name"},
           {"control.csv",
            "1,rib\n2,fem\xC2\x9B"
            "31mur\n",
            "control.csv:2: the name of label 2", "write the name"},
           {"turned.csv",
            "1,\xE2\x80\xAE"
            "rumef\n",
            "cannot be printed", "write the name"},
           {"line.json", R"({"1": "fem\nur"})", "cannot be printed", "write the name"},
           {"blank.csv", "1,\"  \"\n2,liver\n", "blank.csv:1: the row has no name", "as in 5,liver"},
           {"book.csv", "PK\x03\x04 and more", "book.csv: is a ZIP file", "workbooks"},
           {"broken.json", "{\"labels\":\n {\"liver\": 1,,}}", "broken.json:2: is no JSON", "nnU-Net"},
           {"large.json", R"({"liver": 1e999})", "large.json: holds a number that is too large", "nnU-Net"},
           {"none.json", R"({"index": {"Description": "a number"}})", "none.json: names no label",
            "nnU-Net"}}) {
    const std::string text = NamesFile(c.file, c.bytes).refusal();
    EXPECT_THAT(text, testing::HasSubstr(c.says)) << c.file;
    EXPECT_THAT(text, testing::HasSubstr(c.remedy)) << c.file;
  }
  try {
    (void)hybrid::read_label_names(fs::temp_directory_path());
    FAIL() << "a folder was read";
  } catch (const hybrid::ComposeError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("is a folder"));
  }
}

TEST(LabelNames, AFemurIsRigidWhateverTheFileOfNames) {
  for (const auto& [file, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"a.csv",
            "\xEF\xBB\xBF"
            "1,femur_left\r\n2,liver\r\n"},
           {"a.txt", "1 255 0 0 1 1 1 \"femur_left\"\n2 0 255 0 1 1 1 \"liver\"\n"},
           {"a.ctbl", "1 femur_left 255 0 0 255\n2 liver 0 255 0 255\n"},
           {"a.json", R"({"labels": {"background": 0, "femur_left": 1, "liver": 2}})"}}) {
    const hybrid::Split split = hybrid::split_labels(read(file, bytes), {1, 2}, {}, {});
    EXPECT_EQ(split.rigid, std::set<int>{1}) << file;
    EXPECT_EQ(split.soft, std::set<int>{2}) << file;
  }
}

TEST(Tissues, AreKnownByTheirNames) {
  const std::map<std::string, std::string> expected{{"rib_left_7", "rib"},
                                                    {"vertebrae_L3", "vertebra"},
                                                    {"hip_right", "hip"},
                                                    {"skull", "skull"},
                                                    {"costal_cartilages", "cartilage"},
                                                    {"spinal_cord", "spinal cord"},
                                                    {"liver", "liver"},
                                                    {"kidney_left", "kidney"},
                                                    {"small_bowel", "bowel"},
                                                    {"inferior_vena_cava", "vessel"},
                                                    {"portal_vein_and_splenic_vein", "vessel"},
                                                    {"lung_upper_lobe_left", "lung"},
                                                    {"gluteus_maximus_left", "muscle"},
                                                    {"iliac_artery_left", "vessel"},
                                                    {"iliopsoas_left", "muscle"},
                                                    {"atrial_appendage_left", "heart"},
                                                    {"urinary_bladder", "bladder"},
                                                    {"gallbladder", "bladder"},
                                                    {"Subcutaneous Fat", "fat"},
                                                    {"brachiocephalic_trunk", "vessel"},
                                                    {"trachea", "airway"},
                                                    {"thyroid_gland", "thyroid"},
                                                    {"adrenal_gland_left", "gland"},
                                                    // Any way to join words.
                                                    {"Left-Femur", "femur"},
                                                    {"Right.Hip", "hip"},
                                                    {"LeftHumerus", "humerus"},
                                                    {"L/scapula", "scapula"},
                                                    {"1: rib (left)", "rib"},
                                                    {"ctx-Spinal-Cord", "spinal cord"},
                                                    {"LeftCerebralWhiteMatter", "brain"},
                                                    {"SubcutaneousFat", "fat"},
                                                    {"pelvis", "hip"},
                                                    {"Talus-Right", "bone"},
                                                    {"renal_pelvis_of_kidney", "kidney"}};
  for (const auto& [label, tissue] : expected) {
    const hybrid::Tissue* found = hybrid::find_tissue(label);
    ASSERT_NE(found, nullptr) << label;
    EXPECT_EQ(found->name, tissue) << label;
  }
  for (const char* none : {"mystery", "renal_pelvis", "biceps",
                           "Sch\xC3\xA4"
                           "del"})
    EXPECT_TRUE(hybrid::find_tissue(none) == nullptr || !hybrid::find_tissue(none)->bone) << none;
  EXPECT_EQ(hybrid::find_tissue("mystery"), nullptr);
  for (const hybrid::Tissue& t : hybrid::tissue_table()) {
    EXPECT_FALSE(t.source.empty()) << t.name;
    if (t.bone) continue;
    EXPECT_GT(t.young_Pa, 0.0) << t.name;
    EXPECT_GE(t.poisson, 0.0) << t.name;
    EXPECT_LT(t.poisson, 0.5) << t.name;
  }
}

TEST(Tissues, PatternsHaveStarsAndQuestionMarks) {
  EXPECT_TRUE(hybrid::fits_pattern("rib_left_1", "rib_*"));
  EXPECT_TRUE(hybrid::fits_pattern("Rib_Left_1", "rib_left_?"));
  EXPECT_TRUE(hybrid::fits_pattern("", "*"));
  EXPECT_TRUE(hybrid::fits_pattern("aXbXc", "*x*c"));
  EXPECT_FALSE(hybrid::fits_pattern("rib_left_12", "rib_left_?"));
  EXPECT_FALSE(hybrid::fits_pattern("rib", "rib_*"));
  EXPECT_FALSE(hybrid::fits_pattern("aab", "a*a"));
}

}  // namespace
