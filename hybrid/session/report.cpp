// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <thread>

#include "hybrid/base/process_memory.h"
#include "hybrid/base/whole_file.h"

namespace hybrid {
namespace {

std::string processor() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("model name", 0) == 0 && line.find(':') != std::string::npos)
      return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

// The compiler, and the build settings that can slow the program down.
std::string build_text() {
#ifdef __OPTIMIZE__
  constexpr const char* kOptimised = "optimised";
#else
  constexpr const char* kOptimised = "not optimised";
#endif
#ifdef NDEBUG
  constexpr const char* kChecks = "without assertions";
#else
  constexpr const char* kChecks = "with assertions";
#endif
#ifdef __clang__
  constexpr const char* kCompiler = "Clang";
#else
  constexpr const char* kCompiler = "GCC";
#endif
  return fmt::format("{} {}, {}, {}", kCompiler, __VERSION__, kOptimised, kChecks);
}

struct ObjectRow {
  std::string name, kind, motion{};  // motion: empty if the object stays
  glm::dvec3 position_m{0.0};        // position of a moving object at the end of the session
  std::size_t triangles = 0, voxels = 0, surface_voxels = 0, memory_bytes = 0;
  std::uint64_t contact_ticks = 0;
  double max_force_N = 0.0;
  std::vector<FeltMaterial> materials{};  // the materials that were felt
};

std::vector<ObjectRow> object_rows(const BuiltScene& built, const SessionResult& result) {
  std::vector<ObjectRow> rows;
  for (std::size_t o = 0; o < built.world->rigid.size(); ++o) {
    const RigidObject& object = built.world->rigid[o];
    const bool free = object.motion.kind() == RigidMotion::Kind::free;
    rows.push_back({.name = object.name,
                    .kind = "rigid",
                    .motion = object.motion.moves() ? (free ? "free" : "path") : "",
                    .position_m = built.state->rigid[o].pose.position_m,
                    .triangles = object.drawn->triangles.size(),
                    .memory_bytes = object.memory_bytes()});
  }
  for (std::size_t o = 0; o < built.world->soft.size(); ++o) {
    const voxel::SoftObject& object = *built.state->soft[o];
    rows.push_back({.name = built.world->soft[o].name,
                    .kind = "soft",
                    .voxels = object.lattice().voxel_count(),
                    .surface_voxels = object.lattice().surface().size(),
                    .memory_bytes = object.memory_bytes()});
    for (const FeltMaterial& material : result.felt_materials[o]) {
      if (material.contact_ticks > 0) rows.back().materials.push_back(material);
    }
  }
  for (std::size_t o = 0; o < rows.size(); ++o) {
    rows[o].contact_ticks = result.object_contact_ticks[o];
    rows[o].max_force_N = result.object_max_force_N[o];
  }
  return rows;
}

// RMS of the force that the passivity controller removed, over the ticks in which a force was felt.
double rms_taken_N(const device::PassivityState& passive) {
  return passive.felt > 0 ? std::sqrt(passive.taken_sum_N2 / static_cast<double>(passive.felt)) : 0.0;
}

nlohmann::ordered_json safety_json(const Scene& scene, const BuiltScene& built) {
  const device::ForceLimitState& limit = built.state->limit;
  nlohmann::ordered_json j{{"nonfinite", limit.nonfinite}, {"clamped", limit.clamped},
                           {"slewed", limit.slewed},       {"late", limit.late},
                           {"lost", limit.lost},           {"energy_limited", limit.energy_limited}};
  j["passivity"] = nullptr;
  if (!built.world->passivity) return j;
  const device::PassivityState& passive = built.state->passive;
  j["passivity"] = {{"acted_ticks", passive.acted},
                    {"felt_ticks", passive.felt},
                    {"taken_rms_N", rms_taken_N(passive)},
                    {"taken_max_N", passive.most_taken_N},
                    {"taken_max_jnd", passive.most_taken_jnd},
                    {"jnd_floor_N", jnd_floor_N(scene)},
                    {"given_max_J", passive.most_given_J},
                    {"worst_tick_J", passive.worst_tick_J},
                    {"jumps", passive.jumps}};
  return j;
}

nlohmann::ordered_json to_json(const ErrorRange& range) {
  nlohmann::ordered_json j{{"samples", range.samples}};
  if (range.samples == 0) return j;
  j["max_N"] = range.max_N;
  j["rms_N"] = range.rms_N;
  j["max_jnd"] = range.max_jnd;
  j["worst_t_s"] = range.worst_t_s;
  return j;
}

nlohmann::ordered_json budget_json(const BuiltScene& built, const ForceError& error) {
  const auto measured = [&error](double value) {
    return error.all.samples > 0 ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
  };
  nlohmann::ordered_json j{{"truncated_ticks", built.state->truncated_ticks},
                           {"force_error_N", measured(error.all.max_N)},
                           {"force_error_rms_N", measured(error.all.rms_N)},
                           {"force_error_jnd", measured(error.all.max_jnd)},
                           {"worst_t_s", measured(error.all.worst_t_s)},
                           {"samples", error.all.samples},
                           {"moving", to_json(error.moving)},
                           {"still", to_json(error.still)},
                           {"within_1_jnd_after_s", nullptr},
                           {"verdict", in_words(error)}};
  if (error.within_after_s) j["within_1_jnd_after_s"] = *error.within_after_s;
  const bool known = error.all.samples > 0;
  j["reference"] = known ? reference_words(error) : "not measured: " + error.not_measured;
  j["slower"] = known ? nlohmann::ordered_json(error.slower) : nlohmann::ordered_json(nullptr);
  j["wide_patches"] = error.wide_patches;
  return j;
}

std::string range_words(const char* name, const ErrorRange& range) {
  if (range.samples == 0) return {};
  return fmt::format("  {:<6} {:>3} ticks: at most {:.4f} N, {:.2f} JND at {:.3f} s; rms {:.4f} N\n", name,
                     range.samples, range.max_N, range.max_jnd, range.worst_t_s, range.rms_N);
}

std::string error_words(const ForceError& error) {
  if (error.all.samples == 0) return fmt::format("force error of tissue: {}\n", in_words(error));
  return fmt::format("force error of tissue, against {}: {}\n", reference_words(error), in_words(error)) +
         range_words("moving", error.moving) + range_words("still", error.still);
}

std::string safety_words(const BuiltScene& built) {
  const device::ForceLimitState& limit = built.state->limit;
  std::string text;
  if (limit.late + limit.lost + limit.energy_limited > 0) {
    text += fmt::format(
        "the motors were let go: in {} ticks that came too late, {} in which the device was not there, {} "
        "after more "
        "than {:.3g} J went to the hand within {:.3g} s\n",
        limit.late, limit.lost, limit.energy_limited, built.world->limits.max_energy_J,
        built.world->limits.energy_window_s);
  }
  if (!built.world->passivity) return text;
  const device::PassivityState& passive = built.state->passive;
  text += fmt::format(
      "passivity: at most {:.3g} mJ given out beyond what was taken in (one tick's worst: {:.3g} mJ); it "
      "took force in "
      "{} of {} ticks, {:.3f} N rms, at most {:.3f} N ({:.2f} JND)\n",
      1e3 * passive.most_given_J, 1e3 * passive.worst_tick_J, passive.acted, passive.felt,
      rms_taken_N(passive), passive.most_taken_N, passive.most_taken_jnd);
  return text;
}

// If an object's force exceeds the greatest felt force by this factor, a limit or another object's force
// reduced it.
constexpr double kBeyondFelt = 1.01;
constexpr std::array kPairKinds{"rigid", "soft", "anchors"};  // ObjectPair::Kind

std::string other_name(const World& world, const ObjectPair& pair) {
  if (pair.kind == ObjectPair::Kind::anchors) return "its anchors";
  return pair.kind == ObjectPair::Kind::rigid ? world.rigid[pair.other].name : world.soft[pair.other].name;
}

nlohmann::ordered_json between_json(const World& world, const ForcesCourse& between) {
  nlohmann::ordered_json j{{"samples", between.samples}, {"end_t_s", between.end_t_s}};
  j["pairs"] = nlohmann::ordered_json::array();
  for (const PairCourse& course : between.pairs) {
    nlohmann::ordered_json pair{{"soft", world.soft[course.pair.soft].name},
                                {"kind", kPairKinds[static_cast<std::size_t>(course.pair.kind)]},
                                {"other", nullptr},
                                {"samples", course.samples},
                                {"known_samples", course.known_samples},
                                {"max_N", nullptr},
                                {"max_t_s", nullptr},
                                {"end_N", nullptr},
                                {"end_on_soft_N", nullptr}};
    if (course.pair.kind != ObjectPair::Kind::anchors) pair["other"] = other_name(world, course.pair);
    if (course.known_samples > 0) {
      pair["max_N"] = course.max_N;
      pair["max_t_s"] = course.max_t_s;
    }
    if (const auto& end = course.end_on_soft_N) {
      pair["end_N"] = glm::length(*end);
      pair["end_on_soft_N"] = {end->x, end->y, end->z};
    }
    j["pairs"].push_back(pair);
  }
  j["balance"] = nlohmann::ordered_json::array();
  for (std::size_t o = 0; o < between.end_balance.size(); ++o) {
    const ForceBalance& balance = between.end_balance[o];
    nlohmann::ordered_json of_object{
        {"soft", world.soft[o].name}, {"largest_N", balance.largest_N}, {"sum_N", nullptr}};
    if (balance.sum_N) of_object["sum_N"] = *balance.sum_N;
    j["balance"].push_back(of_object);
  }
  return j;
}

std::string between_words(const World& world, const ForcesCourse& between, std::uint64_t ticks) {
  if (between.pairs.empty()) return {};
  std::string text = between.samples < ticks
                         ? fmt::format("forces between objects, in {} of {} ticks:\n", between.samples, ticks)
                         : "forces between objects, in every tick:\n";
  for (const PairCourse& course : between.pairs) {
    const std::string most = course.known_samples > 0
                                 ? fmt::format("at most {:.3f} N at {:.3f} s", course.max_N, course.max_t_s)
                                 : "force not known";
    const std::string end =
        course.end_on_soft_N ? fmt::format("{:.3f} N", glm::length(*course.end_on_soft_N)) : "not known";
    text += fmt::format("  {:<16} {:<16} {}; at the end {}", world.soft[course.pair.soft].name,
                        other_name(world, course.pair), most, end);
    const std::uint64_t unknown = course.samples - course.known_samples;
    text += unknown > 0 ? fmt::format(
                              " (not known in {} of the {} ticks in which they touch: links at "
                              "their limits carry load)\n",
                              unknown, course.samples)
                        : "\n";
  }
  return text;
}

}  // namespace

nlohmann::ordered_json report_head(const std::string& command) {
  nlohmann::ordered_json j;
  j["command"] = command;
  j["version"] = HYBRID_VERSION;
  j["machine"] = fmt::format("{}, {} threads", processor(), std::thread::hardware_concurrency());
  j["build"] = build_text();
  return j;
}

std::string in_words(const Percentiles& p) {
  return fmt::format("{:.0f}/{:.0f}/{:.0f}/{:.0f}", p.p50, p.p99, p.p999, p.max);
}

nlohmann::ordered_json to_json(const Percentiles& p) {
  return {{"p50", p.p50}, {"p99", p.p99}, {"p999", p.p999}, {"max", p.max}};
}

nlohmann::ordered_json run_report(const Scene& scene, const BuiltScene& built, SessionResult& result) {
  nlohmann::ordered_json j = report_head("run");
  j["scene"] = scene.file.string();
  j["ticks"] = result.ticks;
  j["dt_s"] = result.dt_s;
  j["seconds"] = static_cast<double>(result.ticks) * result.dt_s;
  j["state_hash"] = fmt::format("{:016x}", result.state_hash);
  j["nonfinite"] = built.state->nonfinite;
  j["deadline_misses"] = result.deadline_misses;
  j["contact_ticks"] = result.contact_ticks;
  j["tick_us"] = to_json(result.tick_us.percentiles());
  for (std::size_t s = 0; s < kStages; ++s)
    j["stage_us"][kStageNames[s]] = to_json(result.stage_us[s].percentiles());
  j["force_N"] = {{"max", result.max_force_N}, {"rms", result.rms_force_N}};
  j["objects"] = nlohmann::ordered_json::array();
  for (const ObjectRow& row : object_rows(built, result)) {
    nlohmann::ordered_json o{{"name", row.name}, {"kind", row.kind}};
    if (row.kind == "rigid") {
      o["triangles"] = row.triangles;
    } else {
      o["voxels"] = row.voxels;
      o["surface_voxels"] = row.surface_voxels;
    }
    o["memory_bytes"] = row.memory_bytes;
    o["contact_ticks"] = row.contact_ticks;
    o["max_force_N"] = row.max_force_N;
    if (row.kind == "soft") {
      o["materials"] = nlohmann::ordered_json::array();
      for (const FeltMaterial& m : row.materials) {
        o["materials"].push_back(
            {{"name", m.name}, {"contact_ticks", m.contact_ticks}, {"max_force_N", m.max_force_N}});
      }
    }
    if (!row.motion.empty()) {
      o["motion"] = row.motion;
      o["position_m"] = {row.position_m.x, row.position_m.y, row.position_m.z};
    }
    j["objects"].push_back(o);
  }
  if (result.between.samples > 0) j["between_objects"] = between_json(*built.world, result.between);
  j["occupancy"] = {{"cells", built.state->map.occupied_cells()},
                    {"bytes", built.state->map.memory_bytes()},
                    {"cell_m", built.state->map.cell_m()}};
  j["budget"] = budget_json(built, result.error);
  j["safety"] = safety_json(scene, built);
  const double seconds = static_cast<double>(result.ticks) * result.dt_s;
  const auto thread = [&](const char* name, double cpu_s) {
    return nlohmann::ordered_json{
        {"name", name}, {"cpu_s", cpu_s}, {"share", seconds > 0.0 ? cpu_s / seconds : 0.0}};
  };
  j["threads"] = nlohmann::ordered_json::array({thread("servo", result.servo_s)});
  if (result.async_results > 0) j["threads"].push_back(thread("relaxation", result.relaxation_s));
  j["relaxed_apart"] = result.async_results;
  if (!result.realtime_note.empty()) {
    j["realtime"] = {{"priority", result.realtime_note},
                     {"late_us", to_json(result.late_us)},
                     {"least_work_share", result.least_work_share},
                     {"ticks_with_less_work", result.ticks_with_less_work}};
  }
  constexpr std::array kEnds{"finished", "stopped", "lost"};
  j["device"] = {{"name", result.device_name},
                 {"end", kEnds[static_cast<std::size_t>(result.end)]},
                 {"messages", result.device_messages}};
  j["path_notes"] = result.path_notes;
  j["notes"] = nlohmann::ordered_json::array();
  for (const BuildNote& note : built.notes) {
    j["notes"].push_back({{"object", note.object},
                          {"severity", note.severity == polygon::Severity::info      ? "info"
                                       : note.severity == polygon::Severity::warning ? "warning"
                                                                                     : "error"},
                          {"text", note.text}});
  }
  j["faults"] = fault_texts(built.state->faults);
  j["build_s"] = built.seconds;
  j["load"] = {{"seconds", built.seconds},
               {"held_memory_bytes", built.resident_bytes},
               {"peak_memory_bytes", built.peak_bytes}};
  j["peak_memory_bytes"] = peak_memory_bytes();
  return j;
}

std::string run_summary(const BuiltScene& built, SessionResult& result) {
  const Percentiles tick = result.tick_us.percentiles();
  std::string text =
      fmt::format("{} ticks of {:.3g} ms ({:.2f} s), {} in contact; force at most {:.3f} N\n", result.ticks,
                  result.dt_s * 1e3, static_cast<double>(result.ticks) * result.dt_s, result.contact_ticks,
                  result.max_force_N);
  text += fmt::format("tick: p50 {:.1f}, p99 {:.1f}, p99.9 {:.1f}, max {:.1f} us\n", tick.p50, tick.p99,
                      tick.p999, tick.max);
  double most_N = 0.0;
  for (const ObjectRow& row : object_rows(built, result)) {
    most_N = std::max(most_N, row.max_force_N);
    text += fmt::format("  {:<16} {:<5} {:>9} {:<9} felt in {} ticks, at most {:.3f} N\n", row.name, row.kind,
                        row.kind == "rigid" ? row.triangles : row.voxels,
                        row.kind == "rigid" ? "triangles" : "voxels", row.contact_ticks, row.max_force_N);
    for (const FeltMaterial& m : row.materials) {
      if (row.materials.size() == 1 && m.name == row.name) continue;
      text += fmt::format("    {:<30} felt in {} ticks, at most {:.3f} N\n", m.name, m.contact_ticks,
                          m.max_force_N);
    }
  }
  if (most_N > kBeyondFelt * result.max_force_N)
    text +=
        "forces by object are those before the limits of the force (soft start, slew, the device's "
        "maximum), and where they oppose, the hand feels their difference\n";
  text += between_words(*built.world, result.between, result.ticks);
  if (result.contact_ticks == 0) {
    text += "nothing was touched: does the [path] lead to an object? They lie in\n";
    for (std::size_t o = 0; o < built.world->object_count(); ++o) {
      const std::size_t rigid = built.world->rigid.size();
      text += fmt::format("  {:<16} {}\n",
                          o < rigid ? built.world->rigid[o].name : built.world->soft[o - rigid].name,
                          in_words(object_box(*built.world, o)));
    }
  }
  if (!built.state->soft.empty()) text += error_words(result.error);
  if (result.async_results > 0) {
    const double seconds = static_cast<double>(result.ticks) * result.dt_s;
    text += fmt::format(
        "processor time by thread: servo {:.1f} %, relaxation {:.1f} % of the session's{}; results of "
        "relaxation were taken {} times\n",
        100.0 * result.servo_s / seconds, 100.0 * result.relaxation_s / seconds,
        result.realtime_note.empty() ? " (simulated: one core did both in turns)" : "", result.async_results);
  }
  if (!result.realtime_note.empty()) {
    text += fmt::format(
        "real time: {}\n  woken late by p50 {:.0f}, p99 {:.0f}, max {:.0f} us; {} deadlines missed\n",
        result.realtime_note, result.late_us.p50, result.late_us.p99, result.late_us.max,
        result.deadline_misses);
    if (result.ticks_with_less_work > 0) {
      text += fmt::format(
          "  to be in time on this machine {} ticks did less than all of the contact's work, {:.0f} % at "
          "least: "
          "tissue follows the hand some ticks later\n",
          result.ticks_with_less_work, 100.0 * result.least_work_share);
    }
  }
  text += safety_words(built);
  for (const std::string& note : result.path_notes) text += fmt::format("path: {}\n", note);
  for (const std::string& message : result.device_messages) text += fmt::format("device: {}\n", message);
  for (const std::string& fault : fault_texts(built.state->faults)) text += fmt::format("fault: {}\n", fault);
  text += fmt::format("state hash {:016x}\n", result.state_hash);
  return text;
}

std::vector<std::string> fault_texts(std::uint32_t faults) {
  std::vector<std::string> texts;
  const auto say = [&](FaultBit bit, const char* text) {
    if ((faults & bit) != 0) texts.emplace_back(text);
  };
  say(fault_nonfinite_input, "the device gave a position that is not finite; the last good one was held");
  say(fault_touch_overflow,
      "more soft voxels near the tool than fit; use a smaller tool or a coarser spacing");
  say(fault_triangle_overflow,
      "more triangles near the proxy than fit; repair the mesh (coincident triangles) or coarsen it");
  say(fault_map_overflow,
      "the occupancy map had no room for a voxel that moved; use a larger [occupancy] cell");
  say(fault_pair_overflow, "more soft voxels press on one another than fit; use a coarser spacing");
  say(fault_tool_in_tissue,
      "the tool got between the voxels of tissue and was in it without being felt; press less deep, use a "
      "larger tool or a finer spacing, or give the tissue narrower limits (stretch, shear)");
  say(fault_nonfinite_body,
      "a free body was pushed by a force that is not finite, and stood still for that tick");
  say(fault_body_squeezed,
      "tissue could not leave the way of a rigid object that moves, for anchors, bone or links at their "
      "limits, "
      "and they overlapped; let it press less deep, or let the tissue stretch further");
  say(fault_body_crowded,
      "a rigid object that moves came to more soft voxels than a tick looks at, and may have overlapped "
      "some; "
      "use a coarser spacing, or a smaller or slower object");
  say(fault_bodies_overlap,
      "a free body was squeezed between rigid objects, or began in one, and they overlapped; give it room, "
      "or "
      "a path that leaves it some");
  say(fault_infeasible, "rigid surfaces left the tool no room; use a smaller tool radius");
  return texts;
}

void save_json(const std::string& file, const nlohmann::ordered_json& report) {
  save_text(file, report.dump(2) + '\n');
}

}  // namespace hybrid
