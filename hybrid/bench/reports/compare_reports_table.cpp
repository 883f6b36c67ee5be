// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "hybrid/bench/reports/compare_reports.h"

namespace hybrid::bench {
namespace {

// Greatest numbers of rows in the table, unless all rows are asked for.
constexpr std::size_t kMostChanged = 60, kMostUnchanged = 10, kMostRowsOfOne = 20;
// Greatest number of values that are listed for an exact figure that differs between runs.
constexpr std::size_t kMostValues = 4;

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::same:
      return "same";
    case Verdict::changed:
      return "changed";
    case Verdict::noise:
      return "noise";
    case Verdict::unknown:
      return "unknown";
  }
  return "";
}

nlohmann::ordered_json spread_json(const std::optional<Quartiles>& spread) {
  if (!spread) return nullptr;
  const auto finite = [](double value) {
    return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
  };
  return {{"q1", finite(spread->q1)}, {"median", finite(spread->median)}, {"q3", finite(spread->q3)}};
}

std::string figure_text(double value) {
  if (!std::isfinite(value)) return "never";
  if (value >= 1e4 && value < 1e7) return fmt::format("{:.0f}", value);
  return fmt::format("{:.4g}", value);
}

// The values of an exact figure, each listed once: "3", or "3, 4" if runs differ.
std::string exact_text(const std::vector<nlohmann::ordered_json>& values) {
  std::vector<std::string> texts;
  for (const auto& value : values) {
    std::string text = value.is_null() ? std::string("none") : value.dump();
    if (std::find(texts.begin(), texts.end(), text) == texts.end()) texts.push_back(std::move(text));
  }
  std::string list;
  for (std::size_t i = 0; i < texts.size() && i < kMostValues; ++i) list += (i > 0 ? ", " : "") + texts[i];
  return texts.size() > kMostValues ? list + ", ..." : list;
}

std::string compared_line(const ComparedFigure& f, std::size_t width) {
  const std::string ratio = f.ratio > 0.0 ? fmt::format("{:.3f}", f.ratio) : "-";
  if (!f.ranked)
    return fmt::format("{:<{}}  {:<18} {} -> {}, exactly\n", f.row, width, f.key, exact_text(f.old_values),
                       exact_text(f.new_values));
  const auto spread = [](const std::optional<Quartiles>& s, std::size_t runs) {
    return s && runs > 1 ? fmt::format("[{}, {}]", figure_text(s->q1), figure_text(s->q3)) : std::string();
  };
  return fmt::format("{:<{}}  {:<18} {:>9} {:<18} {:>9} {:<18} {:>7} {:>8}\n", f.row, width, f.key,
                     figure_text(f.old_spread->median), spread(f.old_spread, f.old_values.size()),
                     figure_text(f.new_spread->median), spread(f.new_spread, f.new_values.size()), ratio,
                     f.verdict == Verdict::unknown ? "~" : fmt::format("{:.2g}", f.test.p));
}

std::string compared_head(std::size_t width) {
  return fmt::format("{:<{}}  {:<18} {:>9} {:<18} {:>9} {:<18} {:>7} {:>8}\n", "row", width, "figure", "old",
                     "quartiles", "new", "quartiles", "new/old", "p");
}

// The figures from `from` to `to`, at most `most` of them.
std::string section_text(const std::vector<ComparedFigure>& figures, std::size_t from, std::size_t to,
                         std::size_t most) {
  const std::size_t end = std::min(to, from + most);
  std::size_t width = 0;
  for (std::size_t i = from; i < end; ++i) width = std::max(width, figures[i].row.size());
  std::string text;
  bool head = false;
  for (std::size_t i = from; i < end; ++i) {
    if (figures[i].ranked && !head) text += compared_head(width);
    head = head || figures[i].ranked;
    text += compared_line(figures[i], width);
  }
  if (end < to) text += fmt::format("... and {} more; --all lists them\n", to - end);
  return text;
}

std::string only_text(const char* side, const std::vector<std::string>& rows, std::size_t most) {
  if (rows.empty()) return {};
  std::string text = fmt::format("\n{} only in the {} reports:\n", rows.size() == 1 ? "a row" : "rows", side);
  for (std::size_t i = 0; i < rows.size() && i < most; ++i) text += "  " + rows[i] + "\n";
  if (rows.size() > most) text += fmt::format("  ... and {} more; --all lists them\n", rows.size() - most);
  return text;
}

struct Tally {
  std::size_t exact = 0, ranked = 0, changed_exact = 0, longer = 0, shorter = 0, unknown = 0;
  [[nodiscard]] std::size_t changed() const { return changed_exact + longer + shorter; }
};
Tally tally_of(const ReportComparison& comparison) {
  Tally tally;
  for (const ComparedFigure& f : comparison.figures) {
    ++(f.ranked ? tally.ranked : tally.exact);
    if (f.verdict == Verdict::unknown) ++tally.unknown;
    if (f.verdict != Verdict::changed) continue;
    if (!f.ranked) {
      ++tally.changed_exact;
    } else {
      ++(f.new_spread->median > f.old_spread->median ? tally.longer : tally.shorter);
    }
  }
  return tally;
}

std::size_t tested_in(const ReportComparison& comparison) {
  std::size_t tested = 0;
  for (const auto& family : comparison.tested) tested += family.figures;
  return tested;
}

const char* family_name(Family family) {
  switch (family) {
    case Family::overall:
      return "overall";
    case Family::felt:
      return "felt";
    case Family::other:
      return "other";
  }
  return "";
}

// The number of runs needed to detect a change of a single figure.
std::string runs_text(const ReportComparison& comparison) {
  static constexpr std::array kNames{"means over rows", "medians and p99 of rows", "other measured figures"};
  std::string text;
  for (const Family family : kFamilies) {
    const auto place = static_cast<std::size_t>(family);
    const auto& tested = comparison.tested[place];
    if (tested.figures == 0 || tested.at_once == 1) continue;
    const std::string now =
        tested.at_once == 0 || tested.at_once > tested.figures
            ? std::string("these runs can name none")
            : fmt::format("these runs can name {} or more that change at once", tested.at_once);
    text += fmt::format("to name a single change among {} {} takes {} runs on each side, in turns; {}\n",
                        tested.figures, kNames[place], tested.runs_for_one, now);
  }
  return text;
}

}  // namespace

std::string comparison_summary(const ReportComparison& comparison) {
  const Tally tally = tally_of(comparison);
  if (comparison.figures.empty()) return "no row is in the reports of both sides: nothing can be compared";
  std::string text = fmt::format("{} of {} figures changed", tally.changed(), comparison.figures.size());
  if (tally.changed() > 0)
    text += fmt::format(": {} of {} errors and counts, and of {} measured ones {} went up, {} down",
                        tally.changed_exact, tally.exact, tally.ranked, tally.longer, tally.shorter);
  if (tested_in(comparison) == 0)
    return text + (tally.changed() > 0 ? "; the rest is exactly the same" : ": all are exactly the same");
  if (tally.unknown == tested_in(comparison))
    return text + fmt::format("; {} measured ones differ, but so few runs say nothing of them (~)",
                              tested_in(comparison));
  return text + "; the rest cannot be told from noise" +
         (tally.exact > tally.changed_exact ? ", or is exactly the same" : "");
}

std::string in_words(const ReportComparison& comparison, bool all) {
  std::string text;
  for (const std::string& caveat : comparison.caveats) text += "caution: " + caveat + "\n";
  text += comparison_summary(comparison) + "\n" + runs_text(comparison);
  const auto& figures = comparison.figures;
  const auto first_that = [&figures](const auto& is) {
    return static_cast<std::size_t>(std::find_if(figures.begin(), figures.end(), is) - figures.begin());
  };
  const std::size_t open = first_that([](const auto& f) { return f.verdict != Verdict::changed; });
  const std::size_t same = first_that([](const auto& f) { return f.verdict == Verdict::same; });
  const std::size_t any = figures.size();
  if (open > 0) text += "\nchanged:\n" + section_text(figures, 0, open, all ? any : kMostChanged);
  if (same > open)
    text += "\nnot told from noise, the most noticeable first:\n" +
            section_text(figures, open, same, all ? any : kMostUnchanged);
  text += only_text("old", comparison.only_old, all ? comparison.only_old.size() : kMostRowsOfOne);
  text += only_text("new", comparison.only_new, all ? comparison.only_new.size() : kMostRowsOfOne);
  return text;
}

nlohmann::ordered_json to_json(const ReportComparison& comparison) {
  const Tally tally = tally_of(comparison);
  nlohmann::ordered_json json;
  json["caveats"] = comparison.caveats;
  json["summary"] = comparison_summary(comparison);
  json["compared"] = comparison.figures.size();
  json["changed"] = tally.changed();
  for (const Family family : kFamilies) {
    const auto& tested = comparison.tested[static_cast<std::size_t>(family)];
    json["tested"][family_name(family)] = {
        {"rate", rate_of(family)},
        {"figures", tested.figures},
        {"changes_at_once",
         tested.at_once > 0 ? nlohmann::ordered_json(tested.at_once) : nlohmann::ordered_json(nullptr)},
        {"runs_for_one", tested.runs_for_one}};
  }
  nlohmann::ordered_json& figures = json["figures"] = nlohmann::ordered_json::array();
  for (const ComparedFigure& f : comparison.figures) {
    nlohmann::ordered_json row{
        {"suite", f.suite}, {"row", f.identity}, {"key", f.key}, {"verdict", verdict_name(f.verdict)}};
    row["old_values"] = f.old_values;
    row["new_values"] = f.new_values;
    row["ratio"] = f.ratio > 0.0 ? nlohmann::ordered_json(f.ratio) : nlohmann::ordered_json(nullptr);
    if (f.ranked) {
      row["family"] = family_name(f.family);
      row["old"] = spread_json(f.old_spread);
      row["new"] = spread_json(f.new_spread);
      const bool tested = f.verdict == Verdict::noise || f.verdict == Verdict::changed;
      row["p"] = tested ? nlohmann::ordered_json(f.test.p) : nlohmann::ordered_json(nullptr);
      row["false_discovery_rate"] =
          tested ? nlohmann::ordered_json(f.false_discovery_rate) : nlohmann::ordered_json(nullptr);
    }
    figures.push_back(std::move(row));
  }
  json["only_old"] = comparison.only_old;
  json["only_new"] = comparison.only_new;
  return json;
}

}  // namespace hybrid::bench
