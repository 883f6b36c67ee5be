// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/study/study_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "hybrid/base/number_text.h"
#include "hybrid/base/table.h"
#include "hybrid/session/report.h"

namespace hybrid {
namespace {

using Json = nlohmann::ordered_json;

bool has_error(const JudgedScan& scan) {
  return scan.session.not_measured.empty();
}

// With three digits, but no decimals from 100 on.
std::string short_number(double value) {
  return with_decimals(value, value < 9.995 ? 2 : value < 99.95 ? 1 : 0);
}

std::string error_text(const JudgedScan& scan, double value) {
  return scan.failed.empty() && has_error(scan) ? short_number(value) : "-";
}

std::string figure_text(const JudgedScan& scan, const std::string& text) {
  return scan.failed.empty() ? text : "-";
}

std::string megabytes(std::uint64_t bytes) {
  return with_decimals(1e-6 * static_cast<double>(bytes), 0);
}

// "4 scans are", "1 scan is".
std::string scans_are(std::size_t count) {
  return fmt::format("{} {}", count, count == 1 ? "scan is" : "scans are");
}

template <class Is>
std::size_t count_of(const Study& study, const Is& is) {
  return static_cast<std::size_t>(
      std::ranges::count_if(study.scans, [&](const StudiedScan& s) { return is(s.judged); }));
}

std::string outlier_words(const StudiedScan& scan) {
  std::string text;
  for (const Outlier& outlier : scan.outliers)
    text += fmt::format("{}{} {:.1f} times the median", text.empty() ? "" : ", ", outlier.figure,
                        outlier.times_median);
  return text;
}

Json session_json(const SessionFigures& session) {
  Json j{{"ticks", session.ticks}, {"contact_ticks", session.contact_ticks}};
  j["seconds"] = session.seconds;
  j["tick_us"] = to_json(session.tick_us);
  j["max_force_N"] = session.max_force_N;
  j["error"] = nullptr;
  if (session.not_measured.empty()) {
    j["error"] = {{"jnd_p99", session.p99_jnd},
                  {"moving_max_jnd", session.moving_max_jnd},
                  {"still_max_jnd", session.still_max_jnd},
                  {"worst_near", session.worst_near}};
  }
  j["not_measured"] = session.not_measured;
  return j;
}

Json tuned_json(const TunedScan& tuned) {
  if (!tuned.not_tuned.empty()) return {{"not_tuned", tuned.not_tuned}};
  return {{"not_tuned", nullptr},         {"verdict", tuned.verdict},
          {"chosen", tuned.words},        {"accurate_in_time", tuned.accurate_in_time},
          {"error_jnd", tuned.error_jnd}, {"p999_us", tuned.p999_us}};
}

Json scan_json(const StudiedScan& scan) {
  const JudgedScan& s = scan.judged;
  Json j{{"name", s.pair.name},
         {"scan", s.pair.scan.string()},
         {"labels", s.pair.labels.string()},
         {"verdict", scan_verdict(s)},
         {"good", s.good()}};
  j["failed"] = s.failed.empty() ? Json(nullptr) : Json(s.failed);
  j["scene"] = s.scene.string();
  if (s.failed.empty()) {
    j["bounds"] = {{"error_jnd", s.bounds.error_jnd}, {"budget_us", s.bounds.budget_us}};
    j["rigid_objects"] = s.rigid_objects;
    j["soft_objects"] = s.soft_objects;
    j["soft_on_patches"] = s.soft_on_patches;
    j["soft_voxels"] = s.soft_voxels;
    j["memory_bytes"] = s.memory_bytes;
    j["load_s"] = s.load_s;
    j["session"] = session_json(s.session);
    j["faults"] = s.faults;
  }
  j["notes"] = s.notes;
  j["outliers"] = Json::array();
  for (const Outlier& outlier : scan.outliers)
    j["outliers"].push_back({{"figure", outlier.figure}, {"times_median", outlier.times_median}});
  j["tuned"] = s.tuned ? tuned_json(*s.tuned) : Json(nullptr);
  return j;
}

}  // namespace

std::string scan_verdict(const JudgedScan& scan) {
  if (!scan.failed.empty()) return "failed";
  std::string text;
  const auto add = [&](bool is, const char* words) {
    if (is) text += (text.empty() ? "" : ", ") + std::string(words);
  };
  add(!scan.faults.empty(), "fault");
  add(!scan.accurate(), "error felt");
  add(!scan.in_time(), "too slow");
  add(text.empty(), "good");
  add(!has_error(scan), "nothing soft felt");
  return text;
}

std::string scan_words(const JudgedScan& scan) {
  if (!scan.failed.empty()) return fmt::format("{}: failed: {}", scan.pair.name, scan.failed);
  std::string text = fmt::format("{}: {}; tick p99.9 {} us, load {} s", scan.pair.name, scan_verdict(scan),
                                 short_number(scan.session.tick_us.p999), short_number(scan.load_s));
  if (has_error(scan)) {
    text += fmt::format("; error {} JND (p99), at most {} moving and {} still",
                        short_number(scan.session.p99_jnd), short_number(scan.session.moving_max_jnd),
                        short_number(scan.session.still_max_jnd));
  }
  if (scan.tuned && scan.tuned->not_tuned.empty()) {
    text += fmt::format("; chosen: {}, {} JND, {} us", scan.tuned->words, short_number(scan.tuned->error_jnd),
                        short_number(scan.tuned->p999_us));
  }
  return text;
}

std::string study_verdict(const Study& study) {
  const std::size_t failed = count_of(study, [](const JudgedScan& s) { return !s.failed.empty(); });
  const auto among_whole = [&](const auto& is) {
    return count_of(study, [&](const JudgedScan& s) { return s.failed.empty() && is(s); });
  };
  const std::size_t felt = among_whole([](const JudgedScan& s) { return !s.accurate(); });
  const std::size_t slow = among_whole([](const JudgedScan& s) { return !s.in_time(); });
  const std::size_t faulty = among_whole([](const JudgedScan& s) { return !s.faults.empty(); });
  const std::size_t good = count_of(study, [](const JudgedScan& s) { return s.good(); });
  std::string text = fmt::format("Of {} {}, {} felt with an error of at most {} JND, in time",
                                 study.scans.size(), study.scans.size() == 1 ? "scan" : "scans",
                                 good == 0   ? "none is"
                                 : good == 1 ? "1 is"
                                             : fmt::format("{} are", good),
                                 with_digits(study.error_jnd, 3));
  if (felt > 0) text += fmt::format("; {} felt with a larger error", scans_are(felt));
  if (slow > 0) text += fmt::format("; {} too slow", scans_are(slow));
  if (faulty > 0)
    text += fmt::format("; {} a fault", faulty == 1 ? "1 scan has" : fmt::format("{} scans have", faulty));
  if (failed > 0) text += fmt::format("; {} failed", failed);
  return text + ".";
}

std::string study_words(const Study& study) {
  using Scan = StudiedScan;
  std::vector<Table<Scan>::Column> columns{
      {{"scan"}, 0, Side::left, [](const Scan& s) { return s.judged.pair.name; }},
      {{"verdict"}, 0, Side::left, [](const Scan& s) { return scan_verdict(s.judged); }},
      {{"error JND", "p99"},
       0,
       Side::right,
       [](const Scan& s) { return error_text(s.judged, s.judged.session.p99_jnd); }},
      {{"moving", "max"},
       0,
       Side::right,
       [](const Scan& s) { return error_text(s.judged, s.judged.session.moving_max_jnd); }},
      {{"still", "max"},
       0,
       Side::right,
       [](const Scan& s) { return error_text(s.judged, s.judged.session.still_max_jnd); }},
      {{"tick us", "p50"},
       0,
       Side::right,
       [](const Scan& s) { return figure_text(s.judged, short_number(s.judged.session.tick_us.p50)); }},
      {{"", "p99.9"},
       0,
       Side::right,
       [](const Scan& s) { return figure_text(s.judged, short_number(s.judged.session.tick_us.p999)); }},
      {{"MB"},
       0,
       Side::right,
       [](const Scan& s) { return figure_text(s.judged, megabytes(s.judged.memory_bytes)); }},
      {{"load s"},
       0,
       Side::right,
       [](const Scan& s) { return figure_text(s.judged, short_number(s.judged.load_s)); }},
      {{"on patches"},
       0,
       Side::right,
       [](const Scan& s) {
         return figure_text(s.judged,
                            fmt::format("{} of {}", s.judged.soft_on_patches, s.judged.soft_objects));
       }},
  };
  std::string text = Table<Scan>(std::move(columns)).text(study.scans);
  const auto add = [&](const Scan& scan, const std::string& words) {
    if (!words.empty()) text += fmt::format("{}: {}\n", scan.judged.pair.name, words);
  };
  text += "\n";
  for (const Scan& scan : study.scans) {
    add(scan, scan.judged.failed);
    for (const std::string& fault : scan.judged.faults) add(scan, fault);
    if (!scan.judged.session.worst_near.empty() && !scan.judged.accurate())
      add(scan, "worst near " + scan.judged.session.worst_near);
    add(scan, outlier_words(scan));
    if (scan.judged.tuned)
      add(scan, scan.judged.tuned->not_tuned.empty() ? scan.judged.tuned->verdict
                                                     : "not tuned: " + scan.judged.tuned->not_tuned);
  }
  return text + study_verdict(study) + "\n";
}

Json study_json(const Study& study) {
  Json j{{"verdict", study_verdict(study)}, {"error_jnd", study.error_jnd}, {"scans", Json::array()}};
  for (const StudiedScan& scan : study.scans) j["scans"].push_back(scan_json(scan));
  return j;
}

}  // namespace hybrid
