// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/models/models_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hybrid/base/number_text.h"
#include "hybrid/base/table.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/models/variants.h"
#include "hybrid/session/report.h"
#include "hybrid/tune/truth_text.h"

namespace hybrid {
namespace {

// A tick counts as cheaper only below this share of the other's time, because other work on the machine
// disturbs the times.
constexpr double kClearlyCheaper = 0.9;
constexpr const char* kByFinger = "stiffness (finger)";

// Does a hand with a tool feel a difference? A difference that only a finger feels does not count.
bool told_through_tool(const ModelRow& row, const ObjectModels& object) {
  return std::ranges::any_of(told_apart_by(row, object),
                             [](const std::string& by) { return by != kByFinger; });
}

// The number in three digits. From 100 on it has no decimals.
std::string short_number(double value) {
  return with_decimals(value, value < 9.995 ? 2 : value < 99.95 ? 1 : 0);
}

std::string error_cells(const FeltError& e) {
  if (e.ticks == 0) return "-";
  return fmt::format("{}/{}/{}", short_number(e.p50_jnd), short_number(e.p99_jnd), short_number(e.max_jnd));
}

std::string direction_cells(const FeltModel& felt) {
  if (!felt.direction_p99_deg) return "-";
  return fmt::format("{}/{}", short_number(*felt.direction_p50_deg), short_number(*felt.direction_p99_deg));
}

std::string stiffness_cell(const ModelRow& row, const ObjectModels& object) {
  if (!row.felt.stiffness_N_per_m) return "-";
  std::string text = fmt::format("{:.0f}", *row.felt.stiffness_N_per_m);
  if (const auto off = stiffness_off(row, object)) text += fmt::format(" ({:+.0f} %)", 100.0 * *off);
  return text;
}

std::string onset_cell(const ModelRow& row, const ObjectModels& object) {
  const auto later = onset_later_ms(row, object);
  return later ? fmt::format("{:+.0f}", *later) : "-";
}

std::string joined(const std::vector<std::string>& parts, const char* nothing) {
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : ", ") + part;
  return text.empty() ? nothing : text;
}

// The names from told_apart_by(). "stiffness" stands in brackets if only a finger feels its error, not a hand
// with a tool.
std::string told_cell(const ModelRow& row, const ObjectModels& object) {
  std::vector<std::string> by = told_apart_by(row, object);
  std::ranges::replace(by, std::string(kByFinger), std::string("(stiffness)"));
  return " " + joined(by, "nothing");
}

// Two tables, each at most 100 columns wide. The first has the force that the hand feels of each model, the
// second its setting, times and memory.
Table<ModelRow> felt_table(const ObjectModels& object) {
  using Row = ModelRow;
  const ObjectModels* const all = &object;
  return Table<Row>({
      {{"model"}, 0, Side::left, [](const Row& r) { return r.name; }},
      {{"moving JND", "p50/p99/max"},
       0,
       Side::right,
       [](const Row& r) { return error_cells(r.felt.error.moving); }},
      {{"still JND", "p50/p99/max"},
       0,
       Side::right,
       [](const Row& r) { return error_cells(r.felt.error.still); }},
      {{"angle deg", "p50/p99"}, 0, Side::right, [](const Row& r) { return direction_cells(r.felt); }},
      {{"stiffness", "N/m (off)"}, 0, Side::right, [all](const Row& r) { return stiffness_cell(r, *all); }},
      {{" told apart", " by"}, 0, Side::left, [all](const Row& r) { return told_cell(r, *all); }},
  });
}

Table<ModelRow> cost_table(const ObjectModels& object) {
  using Row = ModelRow;
  const ObjectModels* const all = &object;
  return Table<Row>({
      {{"model"}, 0, Side::left, [](const Row& r) { return r.name; }},
      {{"values"}, 0, Side::left, [](const Row& r) { return r.words; }},
      {{"force N", "p50/max"},
       0,
       Side::right,
       [](const Row& r) { return fmt::format("{:.3f}/{:.3f}", r.felt.force_p50_N, r.felt.force_max_N); }},
      {{"onset ms", "later"}, 0, Side::right, [all](const Row& r) { return onset_cell(r, *all); }},
      {{"tick us", "p50/p99/p99.9/max"}, 0, Side::right, [](const Row& r) { return in_words(r.tick_us); }},
      {{"MB"},
       0,
       Side::right,
       [](const Row& r) { return fmt::format("{:.1f}", 1e-6 * static_cast<double>(r.memory_bytes)); }},
      {{"load s"}, 0, Side::right, [](const Row& r) { return fmt::format("{:.2f}", r.load_s); }},
  });
}

std::string reference_line(const ObjectModels& object) {
  const FeltModel& felt = object.reference_felt;
  std::string text =
      fmt::format("reference: force p50 {:.3f} N, max {:.3f} N", felt.force_p50_N, felt.force_max_N);
  if (felt.stiffness_N_per_m) text += fmt::format(", stiffness {:.0f} N/m", *felt.stiffness_N_per_m);
  if (felt.onset_s) text += fmt::format(", onset at {:.3f} s", *felt.onset_s);
  return text + "\n";
}

std::string match_line(const StiffnessMatch& m) {
  return fmt::format(
      "matched: {:.0f} N/m, by least squares of the reference's force in the first contact ({:.2f} to {:.2f} "
      "s, up to {:.2f} mm and {:.2f} N);\n  the fit leaves {:.3f} N rms, {:.3f} N at most.\n",
      m.stiffness_N_per_m, m.from_s, m.to_s, 1e3 * m.depth_m, m.force_N, m.rms_N, m.max_N);
}

std::string object_words(const ModelsInScene& models, const ObjectModels& object) {
  std::string text = fmt::format("\"{}\", {} in the scene\n{}\n\n", object.object,
                                 object.rigid ? "rigid" : "soft", models_verdict(models, object));
  std::vector<ModelRow> played;
  for (const ModelRow& row : object.rows) {
    if (row.left_out.empty()) played.push_back(row);
  }
  text += felt_table(object).text(played) + "\n" + cost_table(object).text(played);
  for (const ModelRow& row : object.rows) {
    if (!row.left_out.empty()) text += fmt::format("not played: {}: {}\n", row.name, row.left_out);
  }
  text += reference_line(object);
  if (object.match) text += match_line(*object.match);
  for (const ModelRow& row : object.rows) {
    for (const std::string& fault : row.faults) text += fmt::format("fault of {}: {}\n", row.name, fault);
  }
  return text + "\n";
}

std::string reference_words_of(const ModelsInScene& models) {
  if (!models.truth) {
    return "reference: the scene as given: nothing soft is touched, and the proxy's geometry is exact\n";
  }
  return truth_words(*models.truth);
}

std::string figures_of(const ModelRow& row, const ObjectModels& object) {
  std::string text = fmt::format("{:.2f} JND (p99)", row.felt.error.worst_jnd());
  if (const auto off = stiffness_off(row, object)) text += fmt::format(", stiffness {:+.0f} %", 100.0 * *off);
  return text + fmt::format(", tick p99.9 {:.0f} us", row.tick_us.p999);
}

std::string named(const ModelRow& row) {
  return row.name == kAsGiven ? "the scene's own model" : fmt::format("{} ({})", row.name, row.words);
}

// A warning if the reference itself is not exact. The geometry of a rigid object is always exact.
std::string warning(const ModelsInScene& models, const ObjectModels& object) {
  if (object.rigid || !models.truth || models.truth->error_jnd() <= 1.0) return {};
  return fmt::format(
      "The reference is itself uncertain by {:.2f} JND, so that no model is shown to be within 1 JND of the "
      "truth. ",
      models.truth->error_jnd());
}

// A caveat if the reference's own error leaves open whether the model's error is above one JND.
std::string doubt(const ModelsInScene& models, const ObjectModels& object, const ModelRow& row) {
  const double own = models.truth ? models.truth->error_jnd() : 0.0;
  if (object.rigid || own > 1.0 || std::fabs(row.felt.error.worst_jnd() - 1.0) >= own) return {};
  return fmt::format(
      " The reference is itself uncertain by {:.2f} JND, so its error may lie on the other side of 1 JND.",
      own);
}

// The proxy's sentence: the price of rendering tissue as if it were rigid.
std::string about_proxy(const ObjectModels& object) {
  std::string text;
  for (const ModelRow& row : object.rows) {
    if (!row.left_out.empty() || (row.name != kProxyVariant && row.name != kMatchedVariant)) continue;
    const std::string how =
        row.name == kProxyVariant
            ? "As rigid"
            : fmt::format("With the coupling fitted to it ({:.0f} N/m)", object.match->stiffness_N_per_m);
    text += fmt::format(" {} it is off by {:.1f} JND (p99).", how, row.felt.error.worst_jnd());
    if (row.coupling_N_per_m() && !object.alone)
      text += " That coupling is the tool's: the other objects would be felt through it, too.";
  }
  return text;
}

const ModelRow& nearest(const ObjectModels& object) {
  const ModelRow* best = object.rows.data();
  for (const ModelRow& row : object.rows) {
    if (row.left_out.empty() && row.felt.error.worst_jnd() < best->felt.error.worst_jnd()) best = &row;
  }
  return *best;
}

}  // namespace

std::optional<double> stiffness_off(const ModelRow& row, const ObjectModels& object) {
  const auto own = row.felt.stiffness_N_per_m, right = object.reference_felt.stiffness_N_per_m;
  if (!own || !right || !(*right > 0.0)) return {};
  return *own / *right - 1.0;
}

std::optional<double> onset_later_ms(const ModelRow& row, const ObjectModels& object) {
  if (!row.felt.onset_s || !object.reference_felt.onset_s) return {};
  return 1e3 * (*row.felt.onset_s - *object.reference_felt.onset_s);
}

std::string models_legend(const ModelsInScene& models) {
  std::string text = reference_words_of(models);
  text += fmt::format(
      "force: of the coupling, in the ticks in which the object is touched; 1 JND = max({:.0f} % of the "
      "reference, {:.2f} N)\n"
      "stiffness: slope of the force over the depth of the tool in the undeformed object, while it first "
      "goes deeper\n"
      "told apart by: force, if p99 is above 1 JND; direction, above {} degrees; stiffness, off by more than "
      "{:.0f} % (with\n  a finger on the surface: {:.0f} %, in brackets)\n"
      "ticks: median of three sessions in alternating order, over the whole path, not pinned to a core; "
      "compare ratios\n",
      100.0 * kJndShare, models.floor_N, kDirectionJnd_deg, 100.0 * kStiffnessJndTool,
      100.0 * kStiffnessJndFinger);
  if (!models.untouched.empty())
    text += fmt::format("not touched by the tool, so not varied: {}\n", joined(models.untouched, ""));
  return text;
}

std::vector<std::string> told_apart_by(const ModelRow& row, const ObjectModels& object) {
  std::vector<std::string> by;
  if (row.felt.error.worst_jnd() > 1.0) by.emplace_back("force");
  if (row.felt.direction_p99_deg.value_or(0.0) > kDirectionJnd_deg) by.emplace_back("direction");
  const double off = std::fabs(stiffness_off(row, object).value_or(0.0));
  if (off > kStiffnessJndTool) {
    by.emplace_back("stiffness");
  } else if (off > kStiffnessJndFinger) {
    by.emplace_back(kByFinger);
  }
  return by;
}

std::optional<std::size_t> cheapest_untold(const ObjectModels& object) {
  std::vector<std::size_t> untold;
  double least_us = std::numeric_limits<double>::infinity();
  for (std::size_t n = 0; n < object.rows.size(); ++n) {
    const ModelRow& row = object.rows[n];
    if (!row.left_out.empty() || !row.faults.empty() || told_through_tool(row, object)) continue;
    if (row.coupling_N_per_m() && !object.alone)
      continue;  // another coupling would change the other objects, too
    untold.push_back(n);
    least_us = std::min(least_us, row.tick_us.p999);
  }
  std::optional<std::size_t> best;
  for (const std::size_t n : untold) {
    const ModelRow& row = object.rows[n];
    if (kClearlyCheaper * row.tick_us.p999 > least_us) continue;
    if (n == 0) return n;
    if (!best || row.felt.error.worst_jnd() < object.rows[*best].felt.error.worst_jnd()) best = n;
  }
  return best;
}

std::string models_verdict(const ModelsInScene& models, const ObjectModels& object) {
  const ModelRow& own = object.rows.front();
  std::string text = warning(models, object);
  if (const auto best = cheapest_untold(object)) {
    const ModelRow& row = object.rows[*best];
    text += fmt::format(
        "Of the models of \"{}\", {} is the cheapest that a hand cannot tell from the reference: {}",
        object.object, named(row), figures_of(row, object));
    text += *best == 0 ? "." : fmt::format("; as given: {}.", figures_of(own, object));
    text += doubt(models, object, row);
  } else {
    const ModelRow& row = nearest(object);
    text += fmt::format("A hand tells every model of \"{}\" from the reference; {} is nearest: {}",
                        object.object, named(row), figures_of(row, object));
    text += &row == &own ? "." : fmt::format("; as given: {}.", figures_of(own, object));
    text += doubt(models, object, row);
  }
  return text + about_proxy(object);
}

std::string models_words(const ModelsInScene& models) {
  std::string text;
  for (const ObjectModels& object : models.objects) text += object_words(models, object);
  return text + models_legend(models);
}

}  // namespace hybrid
