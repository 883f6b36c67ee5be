// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/reports/compare_reports.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>

#include "hybrid/bench/reports/report_keys.h"

namespace hybrid::bench {
namespace {

using Row = nlohmann::ordered_json;

// The least changes that a user notices: a tick that is longer by one period of 1 kHz, and a wait that is
// longer by a second.
constexpr double kTickPeriod_us = 1e3, kWait_us = 1e6;

struct MatchedRows {
  std::vector<const Row*> olds, news;
};
// The rows of a suite by their identity, in the order of the reports. Pointers refer to the reports.
struct MatchedSuite {
  std::vector<Row> order;
  std::map<std::string, MatchedRows> rows;  // key: the identity as text
  std::set<std::string> old_keys, new_keys;
};

bool identifies(const ReportKey& key) {
  return key.kind == KeyKind::identity || key.kind == KeyKind::detail;
}

Row identity_of(const std::string& suite, const Row& row) {
  Row identity = Row::object();
  for (const ReportKey& key : keys_of(suite)) {
    if (identifies(key) && row.contains(key.name)) identity[std::string(key.name)] = row[key.name];
  }
  return identity;
}

void match_side(std::span<const BenchReport> reports, bool old, std::map<std::string, MatchedSuite>& suites) {
  for (const BenchReport& report : reports) {
    for (const auto& [name, rows] : report.suites.items()) {
      MatchedSuite& suite = suites[name];
      for (const Row& row : rows) {
        const Row identity = identity_of(name, row);
        const auto [found, first] = suite.rows.try_emplace(identity.dump());
        if (first) suite.order.push_back(identity);
        (old ? found->second.olds : found->second.news).push_back(&row);
        for (const auto& [key, value] : row.items()) (old ? suite.old_keys : suite.new_keys).insert(key);
      }
    }
  }
}

// The keys by which the rows of a suite can be told from one another.
std::vector<std::string_view> telling_keys(const std::string& suite, const std::vector<Row>& identities) {
  std::vector<std::string_view> telling;
  for (const bool details : {false, true}) {
    std::set<std::string> labels;
    telling.clear();
    for (const ReportKey& key : keys_of(suite)) {
      if (!identifies(key) || (key.kind == KeyKind::detail && !details)) continue;
      std::set<std::string> values;
      for (const Row& identity : identities) values.insert(value_at(identity, key.name).dump());
      if (values.size() > 1) telling.push_back(key.name);
    }
    for (const Row& identity : identities) {
      std::string label;
      for (const std::string_view key : telling) label += value_at(identity, key).dump() + ' ';
      labels.insert(label);
    }
    if (labels.size() == identities.size()) break;
  }
  return telling;
}

std::string label_of(const std::string& suite, const Row& identity,
                     const std::vector<std::string_view>& telling) {
  std::string label = suite;
  for (const std::string_view key : telling) {
    const Row value = value_at(identity, key);
    if (value.is_null()) continue;
    if (value.is_string()) {
      label += ' ' + value.get<std::string>();
    } else {
      label += fmt::format(" {}={}", key, value.dump());
    }
  }
  return label;
}

// The least change of a figure that a user notices (µs): that of a tick, or that of a wait.
double noticed_us(const ComparedFigure& figure) {
  const auto is = [&figure](const char* key, const char* value) {
    return value_at(figure.identity, key) == value;
  };
  const bool wait = is("case", "load") || is("case", "relax") || is("op", "rebuild");
  return wait || figure.key.ends_with("_ms") ? kWait_us : kTickPeriod_us;
}
double in_us(const std::string& key) {
  if (key.ends_with("_ms")) return 1e3;
  if (key.ends_with("_ns")) return 1e-3;
  const bool us = key.ends_with("_us") || key.starts_with("tick_us.") || key.starts_with("pose_us.");
  return us ? 1.0 : 0.0;  // 0: the figure is no time
}

double number_of(const Row& value) {
  return value.is_null() ? std::numeric_limits<double>::infinity() : value.get<double>();
}
std::vector<double> numbers_of(const std::vector<Row>& values) {
  std::vector<double> numbers;
  numbers.reserve(values.size());
  for (const Row& value : values) numbers.push_back(number_of(value));
  return numbers;
}

bool all_equal(const std::vector<Row>& values) {
  return std::all_of(values.begin(), values.end(), [&](const Row& value) { return value == values.front(); });
}
bool all_null(const std::vector<Row>& values) {
  return values.front().is_null() && all_equal(values);
}
bool all_numbers(const std::vector<Row>& values) {
  return std::all_of(values.begin(), values.end(),
                     [](const Row& value) { return value.is_number() || value.is_null(); });
}

std::vector<Row> values_of(const std::vector<const Row*>& rows, std::string_view key) {
  std::vector<Row> values;
  values.reserve(rows.size());
  for (const Row* row : rows) values.push_back(value_at(*row, key));
  return values;
}

bool same_basis(const MatchedRows& rows, std::string_view basis) {
  if (basis.empty()) return true;
  std::vector<Row> values = values_of(rows.olds, basis);
  const std::vector<Row> news = values_of(rows.news, basis);
  values.insert(values.end(), news.begin(), news.end());
  return all_equal(values);
}

// Is the figure judged by the rank test? Every measured figure is. An exact figure is too if its values
// differ between the old runs. With a single old run, its values in the new runs decide.
bool is_ranked(const ReportKey& key, const MatchedRows& rows, const ComparedFigure& figure) {
  if (key.kind == KeyKind::measured) return true;
  if (!all_numbers(figure.old_values) || !all_numbers(figure.new_values)) return false;
  if (!key.measured_case.empty() && value_at(figure.identity, "case") == key.measured_case) return true;
  if (!same_basis(rows, key.basis)) return true;
  const bool olds_equal = all_equal(figure.old_values), news_equal = all_equal(figure.new_values);
  return !olds_equal || (!news_equal && figure.old_values.size() < 2);
}

void judge_exact(ComparedFigure& figure) {
  const std::vector<Row>&olds = figure.old_values, &news = figure.new_values;
  const bool known = std::all_of(news.begin(), news.end(), [&olds](const Row& value) {
    return std::find(olds.begin(), olds.end(), value) != olds.end();
  });
  figure.verdict = known ? Verdict::same : Verdict::changed;
  const Row &before = olds.front(), &after = news.front();
  if (before.is_number() && after.is_number() && before.get<double>() != 0.0)
    figure.ratio = after.get<double>() / before.get<double>();
}

void judge_ranked(ComparedFigure& figure) {
  const std::vector<double> olds = numbers_of(figure.old_values), news = numbers_of(figure.new_values);
  figure.old_spread = quartiles_of(olds);
  figure.new_spread = quartiles_of(news);
  const double before = figure.old_spread->median, after = figure.new_spread->median;
  if (before != 0.0 && std::isfinite(before) && std::isfinite(after)) figure.ratio = after / before;
  if (const double us = in_us(figure.key); us > 0.0)
    figure.noticed = before == after ? 0.0 : std::fabs(after - before) * us / noticed_us(figure);
  std::vector<double> all = olds;
  all.insert(all.end(), news.begin(), news.end());
  if (std::all_of(all.begin(), all.end(), [&all](double value) { return value == all.front(); })) return;
  figure.test = rank_test(olds, news);
  const bool enough = least_p(olds.size(), news.size()) <= rate_of(figure.family);
  figure.verdict = enough ? Verdict::noise : Verdict::unknown;
}

// Judges the figures of a family together. Figures whose values are all equal are left out: they carry no
// information for any division of the runs into old and new ones.
void judge_family(Family family, ReportComparison& comparison) {
  std::vector<ComparedFigure*> members;
  std::vector<double> p;
  double least = 1.0;
  for (ComparedFigure& figure : comparison.figures) {
    if (!figure.ranked || figure.family != family || figure.verdict == Verdict::same) continue;
    members.push_back(&figure);
    p.push_back(figure.test.p);
    least = std::min(least, least_p(figure.old_values.size(), figure.new_values.size()));
  }
  if (p.empty()) return;
  const double rate = rate_of(family), count = static_cast<double>(p.size());
  ReportComparison::Tested& tested = comparison.tested[static_cast<std::size_t>(family)];
  tested.figures = p.size();
  tested.at_once = least <= rate ? static_cast<std::size_t>(std::ceil(least * count / rate)) : 0;
  tested.runs_for_one = size_for(rate / count);
  const std::vector<double> rates = benjamini_hochberg(p);
  for (std::size_t i = 0; i < p.size(); ++i) {
    members[i]->false_discovery_rate = rates[i];
    if (members[i]->verdict == Verdict::noise && rates[i] <= rate) members[i]->verdict = Verdict::changed;
  }
}

bool is_felt(const ComparedFigure& figure) {
  const std::string& key = figure.key;
  const bool tick = key == "tick_us.p50" || key == "tick_us.p99";
  const bool row = (key.starts_with("p50_") || key.starts_with("p99_")) && !key.ends_with("_ratio");
  return figure.product && (tick || row);
}

bool all_positive(const std::vector<Row>& values) {
  return std::all_of(values.begin(), values.end(),
                     [](const Row& value) { return value.is_number() && value.get<double>() > 0.0; });
}

// Adds an overall figure: for each run, the geometric mean of a felt figure over the rows that have it in
// every run.
void add_overall(const std::string& suite, std::string_view key, ReportComparison& comparison) {
  std::vector<const ComparedFigure*> rows;
  std::size_t olds = 0, news = 0;
  for (const ComparedFigure& figure : comparison.figures) {
    if (figure.suite != suite || figure.key != key || figure.family != Family::felt ||
        !all_positive(figure.old_values) || !all_positive(figure.new_values))
      continue;
    olds = std::max(olds, figure.old_values.size());
    news = std::max(news, figure.new_values.size());
    rows.push_back(&figure);
  }
  std::erase_if(rows, [olds, news](const ComparedFigure* figure) {
    return figure->old_values.size() != olds || figure->new_values.size() != news;
  });
  if (rows.size() < 2) return;
  const auto means = [&rows](std::vector<Row> ComparedFigure::*side, std::size_t runs) {
    std::vector<Row> values;
    for (std::size_t run = 0; run < runs; ++run) {
      double sum = 0.0;
      for (const ComparedFigure* figure : rows) sum += std::log((figure->*side)[run].get<double>());
      values.emplace_back(std::exp(sum / static_cast<double>(rows.size())));
    }
    return values;
  };
  ComparedFigure overall;
  overall.suite = suite;
  overall.row = fmt::format("{}: mean of {} rows", suite, rows.size());
  overall.identity = Row::object();
  overall.key = std::string(key);
  overall.ranked = true;
  overall.family = Family::overall;
  overall.old_values = means(&ComparedFigure::old_values, olds);
  overall.new_values = means(&ComparedFigure::new_values, news);
  judge_ranked(overall);
  comparison.figures.push_back(std::move(overall));
}

// Order: changed figures first. Then exact figures before times, the product before baselines, and the most
// noticed first.
void sort_figures(std::vector<ComparedFigure>& figures) {
  const auto place = [](const ComparedFigure& figure) {
    const double change = figure.ratio > 0.0 ? std::fabs(std::log(figure.ratio)) : 0.0;
    return std::tuple(figure.verdict != Verdict::changed, figure.verdict == Verdict::same, figure.ranked,
                      figure.family != Family::overall, !figure.product, figure.ranked ? 0 : figure.rank,
                      -figure.noticed, -change);
  };
  std::stable_sort(
      figures.begin(), figures.end(),
      [&place](const ComparedFigure& a, const ComparedFigure& b) { return place(a) < place(b); });
}

std::string joined(const std::set<std::string>& texts) {
  std::string list;
  for (const std::string& text : texts)
    list += (list.empty() ? "" : "; ") + (text.empty() ? "unknown" : text);
  return list;
}

void say_differences(std::span<const BenchReport> olds, std::span<const BenchReport> news,
                     std::vector<std::string>& caveats) {
  const auto say = [&](std::string BenchReport::*field, const char* what, const char* so) {
    std::set<std::string> before, after;
    for (const BenchReport& report : olds) before.insert(report.*field);
    for (const BenchReport& report : news) after.insert(report.*field);
    if (before.size() > 1)
      caveats.push_back(fmt::format("old reports of several {}: {}", what, joined(before)));
    if (after.size() > 1)
      caveats.push_back(fmt::format("new reports of several {}: {}", what, joined(after)));
    if (before != after)
      caveats.push_back(
          fmt::format("different {}{}: old {}; new {}", what, so, joined(before), joined(after)));
  };
  say(&BenchReport::machine, "machines", ", so their times cannot be compared");
  say(&BenchReport::build, "builds", "");
  say(&BenchReport::version, "versions", "");
  std::set<bool> quick;
  for (const auto& side : {olds, news}) {
    for (const BenchReport& report : side) {
      quick.insert(report.quick);
      if (report.stopped) caveats.push_back(report.file + " was stopped early: rows are missing");
    }
  }
  for (const BenchReport& before : olds) {
    for (const BenchReport& after : news) {
      if (before.suites == after.suites)
        caveats.push_back(fmt::format(
            "{} of the new side is the same report as {} of the old one; measure one of them anew",
            after.file, before.file));
    }
  }
  if (quick.size() > 1)
    caveats.emplace_back("some reports are of --quick, which measures fewer and other rows");
}

void say_keys(const std::string& name, const MatchedSuite& suite, std::vector<std::string>& caveats) {
  const auto known = [&name](const std::string& key) {
    const auto keys = keys_of(name);
    return std::any_of(keys.begin(), keys.end(),
                       [&key](const ReportKey& k) { return k.name.substr(0, k.name.find('.')) == key; });
  };
  std::set<std::string> unknown;
  for (const auto* keys : {&suite.old_keys, &suite.new_keys}) {
    for (const std::string& key : *keys) {
      if (!known(key)) unknown.insert(key);
    }
  }
  if (!unknown.empty())
    caveats.push_back(
        fmt::format("keys of {} that are unknown here, and not compared: {}", name, joined(unknown)));
}

void compare_suite(const std::string& name, const MatchedSuite& suite, ReportComparison& comparison) {
  const std::vector<std::string_view> telling = telling_keys(name, suite.order);
  bool sampled = false;
  for (const Row& identity : suite.order) {
    const MatchedRows& rows = suite.rows.at(identity.dump());
    const std::string label = label_of(name, identity, telling);
    if (rows.news.empty()) comparison.only_old.push_back(label);
    if (rows.olds.empty()) comparison.only_new.push_back(label);
    if (rows.news.empty() || rows.olds.empty()) continue;
    sampled = sampled || !same_basis(rows, "error_ticks");
    const Row engine = value_at(identity, "engine");
    std::size_t rank = 0;
    for (const ReportKey& key : keys_of(name)) {
      ++rank;
      const std::string whole(key.name.substr(0, key.name.find('.')));
      const bool figure_key = key.kind == KeyKind::exact || key.kind == KeyKind::measured;
      if (!figure_key || !suite.old_keys.contains(whole) || !suite.new_keys.contains(whole)) continue;
      ComparedFigure figure;
      figure.suite = name;
      figure.row = label;
      figure.identity = identity;
      figure.key = std::string(key.name);
      figure.product = engine.is_null() || engine == "hybrid" || engine == "map";
      figure.rank = rank;
      figure.old_values = values_of(rows.olds, key.name);
      figure.new_values = values_of(rows.news, key.name);
      if (all_null(figure.old_values) && all_null(figure.new_values)) continue;
      figure.ranked = is_ranked(key, rows, figure);
      if (figure.ranked) {
        figure.family = is_felt(figure) ? Family::felt : Family::other;
        judge_ranked(figure);
      } else {
        judge_exact(figure);
      }
      comparison.figures.push_back(std::move(figure));
    }
  }
  for (const ReportKey& key : keys_of(name)) {
    if (key.kind == KeyKind::measured) add_overall(name, key.name, comparison);
  }
  if (sampled)
    comparison.caveats.emplace_back(
        "errors against the mesh are of other ticks in each run, as many as time allowed, so they are "
        "compared like times; with `bench rigid --every-tick` they are exact");
}

}  // namespace

ReportComparison compare_reports(std::span<const BenchReport> olds, std::span<const BenchReport> news) {
  std::map<std::string, MatchedSuite> suites;
  match_side(olds, true, suites);
  match_side(news, false, suites);
  ReportComparison comparison;
  say_differences(olds, news, comparison.caveats);
  for (const auto& [name, suite] : suites) {
    say_keys(name, suite, comparison.caveats);
    compare_suite(name, suite, comparison);
  }
  for (const Family family : kFamilies) judge_family(family, comparison);
  sort_figures(comparison.figures);
  return comparison;
}

}  // namespace hybrid::bench
