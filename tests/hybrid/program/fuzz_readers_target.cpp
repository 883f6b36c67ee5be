// SPDX-License-Identifier: GPL-3.0-or-later
// The fuzzer of readers reads each file by its extension: scenes, recordings (loaded, written again and
// replayed), names of labels, reports of `bench`, scripts of a window, images of reliefs.
#include <zlib.h>

#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>

#include "hybrid/bench/reports/compare_reports.h"
#include "hybrid/compose/label_names.h"
#include "hybrid/feel/height_texture.h"
#include "hybrid/scene/scene.h"
#include "hybrid/session/recording.h"
#include "hybrid/session/scene_text.h"
#include "hybrid/window/view_script.h"
#include "tests/polygon/files/fuzz_target.h"

namespace tests {
namespace {

namespace fs = std::filesystem;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz: broken: %s\n", what);
  std::abort();
}

std::string bytes_of_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// Reads a scene, writes a value into its text, and reads the text again. The value must be in it, and the
// number of objects must be the same.
std::size_t read_a_scene(const fs::path& file) {
  const hybrid::Scene scene = hybrid::read_scene(file);
  require(std::isfinite(scene.rate_hz) && scene.rate_hz > 0.0, "a scene has a rate");
  require(std::isfinite(scene.tool.radius_m) && scene.tool.radius_m >= 0.0, "a tool has a radius");
  for (const auto& rigid : scene.rigid) {
    require(std::isfinite(glm::dot(rigid.pose.position_m, rigid.pose.position_m)), "a place is finite");
    require(std::fabs(glm::length(rigid.pose.rotation) - 1.0) < 1e-9, "a rotation is one");
  }
  const double wanted = scene.tool.stiffness_N_per_m == 432.0 ? 433.0 : 432.0;
  const hybrid::EditedText edited = hybrid::write_values(
      bytes_of_file(file), file, scene.unit_m,
      std::vector<hybrid::ValueInScene>{
          {{}, hybrid::EditedQuantity::coupling_stiffness, wanted, scene.tool.stiffness_N_per_m}});
  require(edited.changed.size() + edited.left.size() == 1, "an edit is written, or said to be left");
  if (edited.changed.empty()) return scene.rigid.size() + scene.soft.size();
  const fs::path again = file.parent_path() / "edited.toml";
  std::ofstream(again, std::ios::binary) << edited.text;
  const hybrid::Scene read = hybrid::read_scene(again);
  require(std::fabs(read.tool.stiffness_N_per_m - wanted) < 1e-9 * wanted, "an edit is read again");
  require(read.rigid.size() == scene.rigid.size() && read.soft.size() == scene.soft.size(),
          "an edit changes no object");
  return scene.rigid.size() + scene.soft.size();
}

std::size_t read_a_recording(const fs::path& file) {
  const hybrid::Recording recording = hybrid::load_recording(file);
  const fs::path again = file.parent_path() / "again.rec";
  hybrid::save_recording(again, recording);
  require(hybrid::load_recording(again).ticks.size() == recording.ticks.size(), "what was read is written");
  const hybrid::ReplayResult result = hybrid::replay(recording, {});
  require(result.replayed_ticks == recording.ticks.size(), "a replay has every tick");
  return recording.ticks.size();
}

std::size_t read_names(const fs::path& file) {
  const hybrid::LabelNames names = hybrid::read_label_names(file);
  require(!names.empty(), "a table has a name");
  for (const auto& [label, name] : names) {
    require(label >= 0 && label <= 255, "labels are those that a volume can have");
    require(!name.empty(), "a name has a letter");
  }
  return names.size();
}

std::size_t read_a_report(const fs::path& file) {
  const std::vector<hybrid::bench::BenchReport> reports{hybrid::bench::read_bench_report(file)};
  const auto compared = hybrid::bench::compare_reports(reports, reports);
  for (const auto& figure : compared.figures)
    require(figure.verdict != hybrid::bench::Verdict::changed, "a report equals itself");
  return compared.figures.size();
}

std::size_t read_a_script(const fs::path& file) {
  hybrid::DrawnScene scene;
  scene.objects.resize(2);
  scene.objects[0].name = "bone";
  scene.objects[1].name = "left lung";
  scene.editable = {{.object = hybrid::Edit::kTool,
                     .quantity = hybrid::EditedQuantity::coupling_stiffness,
                     .range = {1.0, 2000.0},
                     .in_scene = 800.0},
                    {.object = 0,
                     .quantity = hybrid::EditedQuantity::texture_height,
                     .range = {0.0, 1e-3},
                     .in_scene = 1e-4}};
  hybrid::ViewScript script(bytes_of_file(file), file.string(), scene);
  hybrid::ViewState state;
  const auto actions = script.due(1e6);
  require(actions.size() == script.size(), "every action has its time");
  for (const hybrid::ViewAction& action : actions) {
    for (const double number : action.numbers) require(std::isfinite(number), "numbers are finite");
    hybrid::act(state, action);
  }
  return script.size();
}

// Gives each chunk of a PNG the checksum of its content. A reader refuses a chunk with a wrong checksum
// without reading its content.
void mend_checksums(const fs::path& file) {
  std::string png = bytes_of_file(file);
  std::size_t at = 8;  // behind the signature
  const auto byte = [&png](std::size_t n) { return std::size_t{static_cast<unsigned char>(png[n])}; };
  while (png.size() >= at + 12) {
    const std::size_t length = byte(at) << 24U | byte(at + 1) << 16U | byte(at + 2) << 8U | byte(at + 3);
    if (length > png.size() - at - 12) break;
    const auto* data = reinterpret_cast<const Bytef*>(png.data() + at + 4);
    const uLong sum = crc32(crc32(0, nullptr, 0), data, static_cast<uInt>(length + 4));
    for (int n = 0; n < 4; ++n)
      png[at + 8 + length + static_cast<std::size_t>(n)] = static_cast<char>(sum >> (24 - 8 * n));
    at += length + 12;
  }
  std::ofstream(file, std::ios::binary) << png;
}

std::size_t read_an_image(const fs::path& file) {
  mend_checksums(file);
  const hybrid::GreyImage image = hybrid::load_grey_png(file);
  require(image.grey.size() == static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
          "every pixel has a grey");
  for (const float grey : image.grey) require(grey >= 0.0F && grey <= 1.0F, "a grey is a share of white");
  return image.grey.size();
}

const std::map<std::string, std::vector<std::function<std::size_t(const fs::path&)>>>& readers() {
  static const std::map<std::string, std::vector<std::function<std::size_t(const fs::path&)>>> kReaders{
      {".toml", {read_a_scene}},  {".rec", {read_a_recording}},
      {".csv", {read_names}},     {".json", {read_names, read_a_report}},
      {".tour", {read_a_script}}, {".png", {read_an_image}}};
  return kReaders;
}

void add_letters(std::string& signature, const std::string& words) {
  for (const char c : words.substr(0, 120)) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0 && signature.size() < 60) signature += c;
  }
}

}  // namespace

FuzzOutcome fuzz_file(const fs::path& file) {
  FuzzOutcome outcome;
  const auto known = readers().find(file.extension().string());
  if (known == readers().end())
    throw std::invalid_argument(file.string() +
                                ": no reader; it reads .toml, .rec, .csv, .json, .tour, .png");
  for (const auto& read : known->second) {
    try {
      const std::size_t size = read(file);
      outcome.loaded = true;
      outcome.size += size;
      outcome.signature += "ok" + std::to_string(std::min<std::size_t>(size, 40));
    } catch (const std::runtime_error& refusal) {  // includes SceneError and ComposeError
      add_letters(outcome.signature, refusal.what());
      require(outcome.signature.size() > 4, "a refusal has words");
    } catch (const std::invalid_argument& refusal) {  // from a report of `bench`
      add_letters(outcome.signature, refusal.what());
    }
  }
  return outcome;
}

}  // namespace tests
