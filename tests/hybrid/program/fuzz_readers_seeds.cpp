// SPDX-License-Identifier: GPL-3.0-or-later
// Small files of every kind that the program reads, except meshes, volumes and paths. These have fuzzers of
// their own.
#include <png.h>

#include <fstream>
#include <iterator>

#include "hybrid/build/build_world.h"
#include "hybrid/build/load_scene.h"
#include "hybrid/session/recording.h"
#include "hybrid/session/session.h"
#include "tests/polygon/files/fuzz_seeds.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

const fs::path scenes_folder = fs::path(HYBRID_SOURCE_DIR) / "scenes";

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// A recording of a few ticks, with an edit or without. The scene file has to stay in its place, because a
// replay reads the file again.
std::string recording(const char* scene_name, bool edited) {
  const fs::path scene_file = scenes_folder / scene_name;
  const hybrid::Scene scene = hybrid::load_scene(scene_file);
  hybrid::BuiltScene built = hybrid::build_scene(scene, {});
  hybrid::SessionOptions options{.seconds = 0.02, .keep_recording = true, .progress = {}};
  options.async_relaxation = true;
  if (edited) {
    options.edits = {{.tick = 5, .quantity = hybrid::EditedQuantity::coupling_stiffness, .value = 500.0}};
  }
  const hybrid::SessionResult result = hybrid::run_session(scene, built, options);
  const fs::path file = fs::temp_directory_path() / "hybrid-fuzz-seed.rec";
  hybrid::save_recording(file, {.scene_file = scene_file,
                                .scene_text = bytes_of(scene_file),
                                .dt_s = result.dt_s,
                                .device = {},
                                .async_relaxation = true,
                                .state_hash = result.state_hash,
                                .start_m = result.start_m,
                                .ticks = result.recording,
                                .edits = result.edits});
  std::string bytes = bytes_of(file);
  fs::remove(file);
  return bytes;
}

std::string png(std::uint32_t format) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = 5;
  image.height = 3;
  image.format = format;
  std::vector<std::uint8_t> values(PNG_IMAGE_SIZE(image));
  for (std::size_t n = 0; n < values.size(); ++n) values[n] = static_cast<std::uint8_t>(17 * n);
  png_alloc_size_t size = 0;
  png_image_write_to_memory(&image, nullptr, &size, 0, values.data(), 0, nullptr);
  std::string bytes(size, '\0');
  png_image_write_to_memory(&image, bytes.data(), &size, 0, values.data(), 0, nullptr);
  return bytes;
}

constexpr const char* kReport = R"({"command": "bench", "version": "1", "machine": "m", "build": "b",
 "quick": true, "suites": {
 "threads": [{"scene": "a", "load": "memory", "same_ticks": true, "tick_us": {"p50": 90, "p99": 1e2}}],
 "occupancy": [{"case": "lookup", "engine": "map", "cells": 1000, "box_cells": 2, "time_ns": {"mean": 31.5}}],
 "rigid": [{"path": "slide", "mesh": "ico0", "tool": "ball", "engine": "hybrid", "tick_us": {"p50": 1.5}}],
 "soft": [{"case": "wave", "engine": "hybrid", "voxels": 64, "time_us": null}]}})";

constexpr const char* kScript = R"(# a tour
0 select bone
0.5 edit bone texture-height 0.25  # mm
0.5 hide "left lung"
1 clip y 0.25
1.5 edit tool stiffness 600
2 drag 10 20 30 40 right
2 look contact
2.5 opacity bone 0.3
3 key space
3 click 400 300
3 wheel 2
3.5 picture view.png
4 quit
)";

}  // namespace

std::vector<FuzzInput> fuzz_seeds() {
  std::vector<FuzzInput> seeds;
  for (const auto& entry : fs::directory_iterator(scenes_folder)) {
    if (entry.path().extension() == ".toml") seeds.push_back({bytes_of(entry.path()), ".toml"});
  }
  seeds.push_back({recording("wall.toml", false), ".rec"});
  seeds.push_back({recording("wall.toml", true), ".rec"});
  seeds.push_back({recording("tissue.toml", true), ".rec"});
  for (const char* names :
       {"number,name\n1,femur\n2,\"skull, left\"\n255,n/a\n", "1\tliver\n2\tkidney left\n3.0\tspleen\n",
        "# ITK-SNAP\n    1   255    0    0        1  1  1    \"Label 1\"\n    2   0 255 0 1 1 1 \"b\"\n",
        "label;name;r;g;b\n1;bone;10;20;30\n2;fat;1;2;3\n",
        "17 Left-Hippocampus 220 216 20 0\n18 Left-Amygdala 103 255 255 0\n"})
    seeds.push_back({names, ".csv"});
  seeds.push_back({R"({"labels": {"background": 0, "liver": 1, "kidney": 2}, "name": "x"})", ".json"});
  seeds.push_back({R"({"labels": {"0": "background", "1": "liver", "2": "skull"}})", ".json"});
  seeds.push_back({R"(["background", "a", {"name": "b", "id": 2}])", ".json"});
  seeds.push_back({kReport, ".json"});
  seeds.push_back({kScript, ".tour"});
  for (const std::uint32_t format :
       {std::uint32_t{PNG_FORMAT_GRAY}, std::uint32_t{PNG_FORMAT_RGBA}, std::uint32_t{PNG_FORMAT_LINEAR_Y}})
    seeds.push_back({png(format), ".png"});
  return seeds;
}

}  // namespace tests
