// SPDX-License-Identifier: GPL-3.0-or-later
// Names of labels from tables and JSON, and the tissues that are known by their names.
#include "hybrid/compose/label_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "hybrid/compose/compose.h"
#include "hybrid/compose/tissue_table.h"

namespace {

namespace fs = std::filesystem;

TEST(LabelNames, ComeFromTablesAndJson) {
  const auto file = fs::temp_directory_path() / "hybrid-test-names.json";
  std::ofstream(file) << R"({"R": [0, 1], "labels": ["Air", "liver", "", "rib_1"]})";
  EXPECT_EQ(hybrid::read_label_names(file), (hybrid::LabelNames{{1, "liver"}, {3, "rib_1"}}));
  std::ofstream(file) << R"({"1": "liver", "7": "rib_1"})";
  EXPECT_EQ(hybrid::read_label_names(file), (hybrid::LabelNames{{1, "liver"}, {7, "rib_1"}}));
  fs::remove(file);
  const auto table = fs::temp_directory_path() / "hybrid-test-names.txt";
  std::ofstream(table) << "# a comment\r\n1\tliver\r\n2 \"left rib\" 255 0 0\r\n";
  EXPECT_EQ(hybrid::read_label_names(table).at(1), "liver");
  fs::remove(table);
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
                                                    {"adrenal_gland_left", "gland"}};
  for (const auto& [label, tissue] : expected) {
    const hybrid::Tissue* found = hybrid::find_tissue(label);
    ASSERT_NE(found, nullptr) << label;
    EXPECT_EQ(found->name, tissue) << label;
  }
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
