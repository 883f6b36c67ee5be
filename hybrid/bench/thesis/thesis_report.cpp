// SPDX-License-Identifier: GPL-3.0-or-later
// The thesis's study as text, as JSON and as a page.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "hybrid/base/table.h"
#include "hybrid/bench/thesis/thesis_study.h"
#include "hybrid/plot/svg_figure.h"
#include "hybrid/session/report.h"

namespace hybrid::bench {
namespace {

const char* in_words(SoftEngine engine) {
  return engine == SoftEngine::classic ? "the thesis's algorithm" : "hybrid";
}
std::string in_words(const Vigour& vigour) {
  const std::string hand = fmt::format("{:g} mm at {:g} mm/s", vigour.depth_mm, vigour.speed_mm_per_s);
  return vigour.name.empty() ? hand : vigour.name + ", " + hand;
}
std::string thousands(std::size_t count) {
  std::string text = std::to_string(count);
  for (auto at = static_cast<std::ptrdiff_t>(text.size()) - 3; at > 0; at -= 3)
    text.insert(static_cast<std::size_t>(at), ",");
  return text;
}
bool every_cube(const LargestCube& row) {
  return row.edge > 0 && row.late_edge == 0;
}
std::string cube_words(const LargestCube& row) {
  if (row.edge == 0) return "none";
  return thousands(row.voxels) + (every_cube(row) ? " (largest tried)" : "");
}

const LargestCube* row_of(const ThesisStudy& study, SoftEngine engine, const std::string& vigour) {
  const auto found = std::ranges::find_if(
      study.cubes, [&](const LargestCube& row) { return row.engine == engine && row.vigour.name == vigour; });
  return found == study.cubes.end() ? nullptr : &*found;
}

double session_sum(const ThesisStudy& study, bool voxel_by_voxel) {
  double sum = 0.0;
  for (const ThreadShare& share : study.threads)
    sum += (voxel_by_voxel ? share.ms_per_s_voxel_by_voxel : share.ms_per_s).value_or(0.0);
  return sum;
}

// The largest cubes of one engine, in words, with the share of their ticks in contact. An engine that loses
// its contact has less work, and so serves larger cubes.
std::string served(const ThesisStudy& study, SoftEngine engine) {
  std::string list;
  std::size_t hands = 0, every = 0, most = 0;
  double least_contact = 1.0, most_contact = 0.0;
  for (const char* name : {"gentle", "normal", "vigorous"}) {
    const LargestCube* row = row_of(study, engine, name);
    if (row == nullptr) continue;
    ++hands;
    every += every_cube(*row) ? 1 : 0;
    most = std::max(most, row->voxels);
    if (row->edge > 0) {
      least_contact = std::min(least_contact, row->of_largest.contact_share);
      most_contact = std::max(most_contact, row->of_largest.contact_share);
    }
    list += fmt::format(
        "{}{} under a {} hand", list.empty() ? "" : ", ",
        row->edge == 0 ? "no cube"
                       : (every_cube(*row) ? "every cube up to " : "") + thousands(row->voxels) + " voxels",
        name);
  }
  if (most == 0) return list;
  if (every == hands)
    list = fmt::format("every cube up to {} voxels, however vigorous the hand", thousands(most));
  return fmt::format("{} (in contact for {:.0f} to {:.0f} % of the ticks)", list, 100.0 * least_contact,
                     100.0 * most_contact);
}

PageTable cubes_table(const ThesisStudy& study) {
  PageTable table{
      .name = "cubes",
      .caption = fmt::format("Largest cube of those tried ({} to {} voxels an edge) with at most "
                             "{:g} % of its ticks over {:.0f} µs",
                             study.edges.front(), study.edges.back(), 100.0 * kMostLate, kStudyPeriod_us),
      .head = {"hand", "engine", "largest cube (voxels)", "edge (voxels)", "late from edge",
               "tick median (µs)", "tick 99 % (µs)", "tick 99.9 % (µs)", "ticks over 1 ms (%)",
               "ticks in contact (%)", "force error 99 % (JND)"},
      .rows = {}};
  for (const LargestCube& row : study.cubes) {
    const bool any = row.edge > 0;
    const auto number = [any](double value, int decimals) {
      return number_cell(any ? std::optional(value) : std::nullopt, decimals);
    };
    const StudyTicks& t = row.of_largest;
    table.rows.push_back({{.text = in_words(row.vigour)},
                          {.text = in_words(row.engine)},
                          {.text = cube_words(row), .value = static_cast<double>(row.voxels)},
                          any ? count_cell(static_cast<std::uint64_t>(row.edge)) : PageCell{.text = "–"},
                          row.late_edge > 0 ? count_cell(static_cast<std::uint64_t>(row.late_edge))
                                            : PageCell{.text = "none tried"},
                          number(t.tick_us.p50, 1),
                          number(t.tick_us.p99, 0),
                          number(t.tick_us.p999, 0),
                          number(100.0 * t.late_share, 2),
                          number(100.0 * t.contact_share, 0),
                          number_cell(row.error_jnd, 2)});
  }
  return table;
}

PageTable pair_table(const ThesisStudy& study) {
  PageTable table{.name = "pair",
                  .caption = fmt::format("One block as voxels ({} of them on its surface) and as a mesh",
                                         thousands(study.surface_voxels)),
                  .head = {"hand", "block as", "voxels or triangles", "tick median (µs)", "tick 99 % (µs)",
                           "tick 99.9 % (µs)", "tick largest (µs)", "ticks over 1 ms (%)",
                           "ticks in contact (%)", "memory (MB)", "load (s)", "force error 99 % (JND)"},
                  .rows = {}};
  for (const PairRow& row : study.pair) {
    const StudyTicks& t = row.session;
    const bool known = row.memory_bytes > 0;
    table.rows.push_back(
        {{.text = in_words(row.vigour)},
         {.text = row.model},
         count_cell(row.elements),
         number_cell(t.tick_us.p50, 1),
         number_cell(t.tick_us.p99, 0),
         number_cell(t.tick_us.p999, 0),
         number_cell(t.tick_us.max, 0),
         {.text = fmt::format("{:.2f}", 100.0 * t.late_share),
          .value = 100.0 * t.late_share,
          .mark = t.in_time() ? PageMark::good : PageMark::bad},
         number_cell(100.0 * t.contact_share, 0),
         number_cell(known ? std::optional(1e-6 * static_cast<double>(row.memory_bytes)) : std::nullopt, 1),
         number_cell(known ? std::optional(row.load_s) : std::nullopt, 2),
         number_cell(row.error_jnd, 2)});
  }
  return table;
}

PageTable threads_table(const ThesisStudy& study) {
  PageTable table{.name = "threads",
                  .caption =
                      "Shares of the processor time of all threads, and the time for each second of a "
                      "session under a normal hand",
                  .head = {"thread", "thesis, Table 5 (%)", "hybrid (%)", "hybrid (ms/s)",
                           "hybrid, voxel by voxel (%)", "hybrid, voxel by voxel (ms/s)"},
                  .rows = {}};
  for (const ThreadShare& share : study.threads) {
    const auto percent = [&](const std::optional<double>& ms, bool voxel_by_voxel) {
      const double sum = session_sum(study, voxel_by_voxel);
      return number_cell(ms && sum > 0.0 ? std::optional(100.0 * *ms / sum) : std::nullopt, 1);
    };
    table.rows.push_back({{.text = share.name},
                          number_cell(share.thesis_percent, 0),
                          percent(share.ms_per_s, false),
                          number_cell(share.ms_per_s, 1),
                          percent(share.ms_per_s_voxel_by_voxel, true),
                          number_cell(share.ms_per_s_voxel_by_voxel, 1)});
  }
  return table;
}

std::string cubes_svg(const ThesisStudy& study) {
  Figure figure;
  figure.title = "Largest cube that is served at 1 kHz";
  figure.notes = {
      "The hand presses faster and deeper from left to right (1 mm at 25 mm/s to 20 mm at 500 mm/s)."};
  PanelGroup& group = figure.groups.emplace_back();
  group.x_label = "speed of the hand (mm/s)";
  group.x_scale = Scale::logarithmic;
  Panel& panel = group.panels.emplace_back();
  panel.title = "Largest cube";
  panel.y_label = "voxels";
  panel.height = 300.0;
  panel.y_scale = Scale::logarithmic;
  for (const SoftEngine engine : {SoftEngine::classic, SoftEngine::hybrid}) {
    Series line{.name = in_words(engine),
                .x = {},
                .y = {},
                .colour = series_colour(engine == SoftEngine::classic ? 0 : 1),
                .width = 2.5};
    for (const LargestCube& row : study.cubes) {
      if (row.engine != engine || row.edge == 0) continue;
      line.x.push_back(row.vigour.speed_mm_per_s);
      line.y.push_back(static_cast<double>(row.voxels));
    }
    if (!line.x.empty()) panel.series.push_back(std::move(line));
  }
  const double most = std::pow(study.edges.back(), 3.0);
  panel.lines.push_back({most, "largest cube that was tried"});
  panel.lines.push_back({24'000.0, "24,000 voxels, the thesis's largest", series_colour(2)});
  return to_svg(figure);
}

std::vector<PagePart> threads_parts(const ThesisStudy& study) {
  std::vector<PagePart> parts{threads_table(study),
                              "The thesis's shares are of a whole processor, so its relaxation took what the "
                              "other threads left. Here "
                              "each thread takes what its work needs. On nested patches tissue relaxes "
                              "within the tick. Voxel by voxel "
                              "a thread of its own relaxes it, and the tick never waits for that thread. "
                              "Graphics: 30 frames a second, "
                              "drawn without a display. This study opens no window."};
  if (!study.no_graphics.empty()) parts.emplace_back("Frames were not drawn: " + study.no_graphics);
  return parts;
}

}  // namespace

std::string thesis_verdict(const ThesisStudy& study) {
  return fmt::format("At 1 kHz {} serves {}; {} serves {}.", in_words(SoftEngine::classic),
                     served(study, SoftEngine::classic), in_words(SoftEngine::hybrid),
                     served(study, SoftEngine::hybrid));
}

std::string thesis_table(const ThesisStudy& study) {
  using Cube = LargestCube;
  const Table<Cube> cubes({
      {{"hand"}, 0, Side::left, [](const Cube& r) { return in_words(r.vigour); }},
      {{"engine"}, 0, Side::left, [](const Cube& r) { return std::string(engine_name(r.engine)); }},
      {{"largest cube", "voxels"}, 0, Side::right, cube_words},
      {{"late from", "edge"},
       0,
       Side::right,
       [](const Cube& r) { return r.late_edge > 0 ? std::to_string(r.late_edge) : "-"; }},
      {{"tick us", "p50/p99/p99.9/max"},
       0,
       Side::right,
       [](const Cube& r) { return r.edge > 0 ? hybrid::in_words(r.of_largest.tick_us) : "-"; }},
      {{"error", "JND p99"},
       0,
       Side::right,
       [](const Cube& r) { return r.error_jnd ? fmt::format("{:.2f}", *r.error_jnd) : "-"; }},
  });
  const Table<PairRow> pair({
      {{"hand"}, 0, Side::left, [](const PairRow& r) { return in_words(r.vigour); }},
      {{"block as"}, 0, Side::left, [](const PairRow& r) { return r.model; }},
      {{"voxels or", "triangles"},
       0,
       Side::right,
       [](const PairRow& r) { return std::to_string(r.elements); }},
      {{"tick us", "p50/p99/p99.9/max"},
       0,
       Side::right,
       [](const PairRow& r) { return hybrid::in_words(r.session.tick_us); }},
      {{"over 1 ms", "%"},
       0,
       Side::right,
       [](const PairRow& r) { return fmt::format("{:.2f}", 100.0 * r.session.late_share); }},
      {{"error", "JND p99"},
       0,
       Side::right,
       [](const PairRow& r) { return r.error_jnd ? fmt::format("{:.2f}", *r.error_jnd) : "-"; }},
  });
  const auto ms = [](const std::optional<double>& v) {
    return v ? fmt::format("{:.1f}", *v) : std::string("-");
  };
  const Table<ThreadShare> threads({
      {{"thread"}, 0, Side::left, [](const ThreadShare& r) { return r.name; }},
      {{"thesis", "%"},
       0,
       Side::right,
       [](const ThreadShare& r) { return fmt::format("{:.0f}", r.thesis_percent); }},
      {{"hybrid", "ms/s"}, 0, Side::right, [ms](const ThreadShare& r) { return ms(r.ms_per_s); }},
      {{"voxel by voxel", "ms/s"},
       0,
       Side::right,
       [ms](const ThreadShare& r) { return ms(r.ms_per_s_voxel_by_voxel); }},
  });
  return thesis_verdict(study) + "\n\n" + cubes.text(study.cubes) +
         "\nthe pair: one block as voxels and as a mesh\n" + pair.text(study.pair) +
         "\nthreads: processor time for each second of a session\n" + threads.text(study.threads) +
         (study.no_graphics.empty() ? "" : "frames were not drawn: " + study.no_graphics + "\n");
}

namespace {

template <class T>
nlohmann::ordered_json or_null(const std::optional<T>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}
void add_hand(const Vigour& vigour, nlohmann::ordered_json& j) {
  j["hand"] = vigour.name;
  j["depth_mm"] = vigour.depth_mm;
  j["speed_mm_per_s"] = vigour.speed_mm_per_s;
}
void add_ticks(const StudyTicks& t, nlohmann::ordered_json& j) {
  j["ticks"] = t.ticks;
  j["p50_us"] = t.tick_us.p50;
  j["p99_us"] = t.tick_us.p99;
  j["p999_us"] = t.tick_us.p999;
  j["max_us"] = t.tick_us.max;
  j["late_share"] = t.late_share;
  j["contact_share"] = t.contact_share;
}

}  // namespace

nlohmann::ordered_json to_json(const LargestCube& row) {
  nlohmann::ordered_json j{{"case", "largest"}, {"engine", engine_name(row.engine)}};
  add_hand(row.vigour, j);
  j["voxels"] = row.voxels;
  j["edge"] = row.edge;
  j["late_edge"] = row.late_edge;
  add_ticks(row.of_largest, j);
  j["force_error_jnd"] = or_null(row.error_jnd);
  return j;
}

nlohmann::ordered_json to_json(const PairRow& row) {
  nlohmann::ordered_json j{{"case", "pair"}, {"model", row.model}};
  add_hand(row.vigour, j);
  j["elements"] = row.elements;
  add_ticks(row.session, j);
  j["memory_bytes"] = row.memory_bytes;
  j["load_s"] = row.load_s;
  j["force_error_jnd"] = or_null(row.error_jnd);
  return j;
}

nlohmann::ordered_json to_json(const ThreadShare& row) {
  return {{"case", "threads"},
          {"thread", row.name},
          {"thesis_percent", row.thesis_percent},
          {"ms_per_s", or_null(row.ms_per_s)},
          {"ms_per_s_voxel_by_voxel", or_null(row.ms_per_s_voxel_by_voxel)}};
}

Page thesis_page(const ThesisStudy& study) {
  const LargestCube* const vigorous = row_of(study, SoftEngine::hybrid, "vigorous");
  Page page{.title = "The thesis's study, repeated",
            .verdict = thesis_verdict(study),
            .mark = vigorous != nullptr && every_cube(*vigorous) ? PageMark::good : PageMark::bad,
            .summary = {
                "Chapter V of the thesis found that the rate of 1 kHz depends on the vigour of the hand, "
                "and rendered up to 24,000 voxels. Both engines play the same strokes here, on this "
                "machine. Cubes have voxels of 1 mm, a stiffer core, and a slack of 0.1 (core 0.05).",
                "Times are processor times. Those of the thesis's algorithm are of its check, its chain and "
                "its force. Its relaxation, which had a thread of its own, is left out. Those of hybrid are "
                "of the whole tick. Force errors are against the same session played five times slower."}};
  page.sections.push_back(
      {.heading = "Largest cube",
       .parts = {
           PageFigure{.name = "largest",
                      .caption =
                          "Largest cube in time over the vigour of the hand. Small cubes are pressed less "
                          "deep, so that the hand feels tissue and not its anchors.",
                      .alternative = "Largest cube of both engines; the table has the figures",
                      .svg = cubes_svg(study)},
           cubes_table(study)}});
  page.sections.push_back({.heading = "24,000 voxels and 11,200 triangles", .parts = {pair_table(study)}});
  page.sections.push_back({.heading = "Threads", .parts = threads_parts(study)});
  return page;
}

}  // namespace hybrid::bench
