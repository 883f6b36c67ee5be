// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/tune_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "hybrid/base/table.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/report.h"
#include "hybrid/tune/truth_text.h"

namespace hybrid {
namespace {

// Share of the passes that must agree before a comparison of costs is reported as certain.
constexpr double kTold = 0.75;

struct PassRange {
  double low = 0.0, high = 0.0;
};

PassRange range_of(const TunedSetting& setting) {
  if (setting.pass_p999_us.empty()) return {setting.tick_us.p999, setting.tick_us.p999};
  const auto [low, high] = std::ranges::minmax(setting.pass_p999_us);
  return {low, high};
}

const char* rule_name(ChoiceRule rule) {
  switch (rule) {
    case ChoiceRule::cheapest_accurate:
      return "cheapest under the error's bound, within the budget";
    case ChoiceRule::most_accurate_in_time:
      return "most accurate within the budget";
    case ChoiceRule::cheapest:
      return "cheapest";
  }
  return "";
}

// A sentence about changes of the scene that would make the tick fit the budget.
std::string remedy_in_time(const TuneResult& result) {
  const TunedSetting& chosen = result.settings[result.chosen];
  return fmt::format(
      "{} is {:.2g} times the budget; a smaller tool, a shallower path, or a scene with fewer soft voxels "
      "(here "
      "{}) would make it fit, and --budget-us says what your machine can spare",
      "its tick", chosen.tick_us.p999 / result.bounds.budget_us, chosen.soft_voxels);
}

// Is the truth's own error too large to tell which settings are under the error's bound?
bool truth_hides_bound(const TuneResult& result) {
  return result.truth.error_jnd() >= result.bounds.error_jnd;
}

std::string doubt_about_error(const TuneResult& result) {
  const TunedSetting& chosen = result.settings[result.chosen];
  const double own = result.truth.error_jnd(), bound = result.bounds.error_jnd;
  std::string text;
  if (!truth_hides_bound(result) && std::fabs(chosen.error.worst_jnd() - bound) < own) {
    text = fmt::format(
        " The truth is itself uncertain by {:.2f} JND, so its error may lie on the other side of {:.2g} JND.",
        own, bound);
  }
  const double confirmed = result.confirmation.error.worst_jnd();
  if (chosen.error.worst_jnd() < bound && confirmed >= bound)
    text += fmt::format(" On another motion it is off by {:.2f} JND, more than the bound.", confirmed);
  return text;
}

// Text before a verdict that cannot be trusted, because the truth is too uncertain; otherwise empty.
std::string truth_warning(const TuneResult& result) {
  if (!truth_hides_bound(result)) return {};
  return fmt::format(
      "The truth is itself uncertain by {:.2f} JND, so no setting is shown to be under {:.2g} JND; measured "
      "against it, ",
      result.truth.error_jnd(), result.bounds.error_jnd);
}

std::string doubt_about_cost(const TuneResult& result) {
  const TunedSetting& chosen = result.settings[result.chosen];
  const PassRange passes = range_of(chosen);
  std::string text;
  const auto over = static_cast<double>(std::ranges::count_if(
      chosen.pass_p999_us, [&](double p999) { return p999 > result.bounds.budget_us; }));
  const double share = over / std::max<double>(1.0, static_cast<double>(chosen.pass_p999_us.size()));
  if (std::max(share, 1.0 - share) < kTold)
    text += fmt::format(
        " Single sessions took {:.0f} to {:.0f} us: the machine is too noisy to tell whether it keeps the "
        "budget.",
        passes.low, passes.high);
  if (const auto next = result.choice.next_accurate; next &&
                                                     result.choice.rule == ChoiceRule::cheapest_accurate &&
                                                     cost_hidden(chosen, result.settings[*next])) {
    text += fmt::format(" Noise hides whether {} is cheaper.", result.settings[*next].words);
  }
  return text;
}

// Says that the scene's own voxels are too wide for this path. No setting can change this error. Empty if the
// error cannot be felt.
std::string about_scene(const TuneResult& result) {
  const Truth& truth = result.truth;
  if (!truth.spacing || truth.spacing->worst_jnd() < result.bounds.error_jnd) return {};
  return fmt::format(
      " Whatever the setting, the scene's own voxels ({}) differ from ever finer ones by about {:.1f} JND: "
      "if "
      "the tissue is known more finely, give the scene a smaller spacing, and tune it again.",
      truth.words, truth.spacing->worst_jnd());
}

bool voxels_left(const Setting& setting) {
  return std::ranges::any_of(setting.objects, [](const ObjectSetting& one) { return !one.proxy; });
}

// Says whether a proxy is enough, and otherwise the error of the most accurate proxy.
std::string about_proxies(const TuneResult& result) {
  const TunedSetting& chosen = result.settings[result.chosen];
  const bool enough = !voxels_left(chosen.setting) && result.choice.rule == ChoiceRule::cheapest_accurate;
  std::string said = enough ? " A proxy is enough here: no voxels are needed." : "";
  if (chosen.match) {
    return fmt::format(
        "{} Its coupling is the tool's, so it is felt at every object. It fits depths up to {:.2f} mm, as on "
        "this path.",
        said, 1e3 * chosen.match->depth_m);
  }
  if (!voxels_left(chosen.setting)) return said;
  const TunedSetting* nearest = nullptr;
  for (const TunedSetting& s : result.settings) {
    if (s.match && (nearest == nullptr || s.error.worst_jnd() < nearest->error.worst_jnd())) nearest = &s;
  }
  if (nearest == nullptr) return {};
  const double everywhere = nearest->error.worst_jnd(), at_soft = nearest->at_soft.worst_jnd();
  if (everywhere < result.bounds.error_jnd) return {};  // another rule decided
  std::string text =
      fmt::format(" A proxy is not enough here: {} is off by {:.2g} JND", nearest->words, at_soft);
  if (everywhere > at_soft)
    text +=
        fmt::format(" at soft objects, and by {:.2g} JND where its coupling meets others, too", everywhere);
  return text + ".";
}

std::string marked_words(const TunedSetting& s) {
  return s.words + (s.own ? " (as it is)" : "");
}

// `mark`: gives the letter before a setting.
Table<TunedSetting> setting_table(const std::function<char(const TunedSetting&)>& mark) {
  const auto p99 = [](const FeltError& e) { return e.ticks > 0 ? fmt::format("{:.2f}", e.p99_jnd) : "-"; };
  return Table<TunedSetting>({
      {{""}, 1, Side::left, [mark](const TunedSetting& s) { return std::string(1, mark(s)); }},
      {{"setting"}, 0, Side::left, marked_words},
      {{"moving", "JND p99"}, 7, Side::right, [p99](const TunedSetting& s) { return p99(s.error.moving); }},
      {{"still", "JND p99"}, 7, Side::right, [p99](const TunedSetting& s) { return p99(s.error.still); }},
      {{"tick us", "p50/p99/p99.9/max"},
       17,
       Side::right,
       [](const TunedSetting& s) { return in_words(s.tick_us); }},
      {{"p99.9 of", "single passes"},
       13,
       Side::right,
       [](const TunedSetting& s) {
         const PassRange passes = range_of(s);
         return fmt::format("{:.0f} to {:.0f}", passes.low, passes.high);
       }},
      {{"MB"},
       8,
       Side::right,
       [](const TunedSetting& s) {
         return fmt::format("{:.1f}", 1e-6 * static_cast<double>(s.memory_bytes));
       }},
      {{"voxels"}, 9, Side::right, [](const TunedSetting& s) { return std::to_string(s.soft_voxels); }},
  });
}

std::string table_of_front(const TuneResult& result) {
  const TunedSetting* const all = result.settings.data();
  const auto is_on_front = [&](const TunedSetting& s) {
    return std::ranges::find(result.front, static_cast<std::size_t>(&s - all)) != result.front.end();
  };
  Table<TunedSetting> table = setting_table([&](const TunedSetting& s) {
    return &s == all + result.chosen ? '*' : is_on_front(s) ? ' ' : '-';
  });
  table.fit(result.settings);
  std::string text = table.head();
  for (const std::size_t n : result.front) text += table.line(result.settings[n]);
  bool any = false;
  for (const TunedSetting& s : result.settings) {
    if (!s.whole() || !s.dominated_by) continue;
    if (!any) text += "dominated: another one is as cheap and as accurate\n";
    any = true;
    text += table.line(s);
  }
  return text;
}

std::string left_out_words(const TuneResult& result) {
  std::string text;
  for (const TunedSetting& s : result.settings) {
    if (!s.whole()) text += fmt::format("left out {}, {}\n", s.words, s.left_out);
  }
  for (const std::size_t n : result.front) {
    for (const std::string& fault : result.settings[n].faults)
      text += fmt::format("fault of {}, which so is not chosen: {}\n", result.settings[n].words, fault);
  }
  return text;
}

std::string truth_in_words(const TuneResult& result) {
  return fmt::format(
             "errors: p99 of the difference from the truth in its poses, where something soft is felt, on an "
             "ideal device\n  {}\n  1 JND = max({:.0f} % of the truth's force, {:.2f} N)\n",
             result.second_motion.empty() ? "on one motion, as the path moved sideways loses its contact"
                                          : "the worse of two motions: the path, and " + result.second_motion,
             100.0 * kJndShare, result.floor_N) +
         truth_words(result.truth);
}

std::string confirmation_words(const TuneResult& result) {
  const Confirmation& c = result.confirmation;
  if (!c.not_done.empty()) return "not confirmed on another motion: " + c.not_done + "\n";
  const double before = result.settings[result.chosen].error.worst_jnd(), now = c.error.worst_jnd();
  return fmt::format(
      "confirmed on a motion that was not used, {}: {} ({:.2g} times the error), tick p99.9 {:.0f} "
      "us ({:.2g} times)\n",
      c.motion, in_words(c.error), now / std::max(before, 1e-9), c.tick_us.p999,
      c.tick_us.p999 / std::max(result.settings[result.chosen].tick_us.p999, 1e-9));
}

nlohmann::ordered_json setting_report(const TuneResult& result, std::size_t n) {
  const TunedSetting& s = result.settings[n];
  nlohmann::ordered_json row{{"name", s.words}, {"toml", as_toml(s.setting)}, {"as_it_is", s.own}};
  row["match"] = s.match ? to_json(*s.match) : nlohmann::ordered_json(nullptr);
  row["on_front"] = std::ranges::find(result.front, n) != result.front.end();
  row["dominated_by"] = s.dominated_by ? nlohmann::ordered_json(result.settings[*s.dominated_by].words)
                                       : nlohmann::ordered_json(nullptr);
  row["left_out"] = s.whole() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(s.left_out);
  row["error"] = to_json(s.error);
  row["error_at_soft"] = to_json(s.at_soft);
  row["tick_us"] = to_json(s.tick_us);
  row["pass_p999_us"] = s.pass_p999_us;
  row["memory_bytes"] = s.memory_bytes;
  row["soft_voxels"] = s.soft_voxels;
  row["load_s"] = s.load_s;
  row["faults"] = s.faults;
  return row;
}

}  // namespace

bool cost_hidden(const TunedSetting& a, const TunedSetting& b) {
  const std::size_t passes = std::min(a.pass_p999_us.size(), b.pass_p999_us.size());
  std::size_t cheaper = 0;
  for (std::size_t p = 0; p < passes; ++p) cheaper += a.pass_p999_us[p] < b.pass_p999_us[p] ? 1 : 0;
  return kTold * static_cast<double>(passes) > static_cast<double>(std::max(cheaper, passes - cheaper));
}

std::string tune_verdict(const TuneResult& result) {
  const TunedSetting& s = result.settings[result.chosen];
  const Bounds& b = result.bounds;
  const std::string what = fmt::format("{}{}: {} (p99), tick p99.9 {:.0f} us", s.words,
                                       s.own ? " (as it is)" : "", in_words(s.error), s.tick_us.p999);
  std::string text;
  switch (result.choice.rule) {
    case ChoiceRule::cheapest_accurate:
      text = fmt::format("{} is the cheapest setting under {:.2g} JND, within the budget of {:.0f} us.", what,
                         b.error_jnd, b.budget_us);
      break;
    case ChoiceRule::most_accurate_in_time:
      text = fmt::format(
          "{} is the most accurate setting within the budget of {:.0f} us; none is under {:.2g} "
          "JND there.",
          what, b.budget_us, b.error_jnd);
      if (const auto next = result.choice.next_accurate) {
        text += fmt::format(" {} would be, at {:.0f} us.", result.settings[*next].words,
                            result.settings[*next].tick_us.p999);
      } else {
        text += " Slower motion or a wider tool lowers the error.";
      }
      break;
    case ChoiceRule::cheapest:
      text = fmt::format("{} is the cheapest setting, and none keeps the budget of {:.0f} us: {}.", what,
                         b.budget_us, remedy_in_time(result));
      break;
  }
  if (!result.choice.any_sound) text += " Every setting had a fault.";
  return truth_warning(result) + text + about_proxies(result) + doubt_about_error(result) +
         doubt_about_cost(result) + about_scene(result);
}

std::string tune_reason(const TuneResult& result) {
  const TunedSetting& s = result.settings[result.chosen];
  const std::string fitted =
      s.match ? fmt::format("; its coupling fits the truth's force up to {:.2f} mm deep, {:.2f} N",
                            1e3 * s.match->depth_m, s.match->force_N)
              : "";
  return fmt::format(
      "{}: {} (p99, from {} at rest, itself uncertain by {:.2f}), tick p99.9 {:.0f} us; {} ({:.2g} JND, "
      "{:.0f} us){}.",
      s.words, in_words(s.error), result.truth.words, result.truth.error_jnd(), s.tick_us.p999,
      rule_name(result.choice.rule), result.bounds.error_jnd, result.bounds.budget_us, fitted);
}

std::string tune_words(const TuneResult& result) {
  std::string text = tune_verdict(result) + "\n\n" + table_of_front(result) + "\n";
  return text + left_out_words(result) + tune_legend(result) + "*: chosen\n";
}

std::string tune_legend(const TuneResult& result) {
  std::string text = truth_in_words(result) + confirmation_words(result);
  for (const std::string& note : result.notes) text += "note: " + note + "\n";
  return text +
         fmt::format(
             "ticks: each one's median over the passes, whose order alternates; the search took {:.0f} "
             "s\n",
             result.seconds);
}

nlohmann::ordered_json tune_json(const TuneResult& result) {
  nlohmann::ordered_json j;
  j["verdict"] = tune_verdict(result);
  j["bounds"] = {{"error_jnd", result.bounds.error_jnd},
                 {"budget_us", result.bounds.budget_us},
                 {"period_us", result.period_us}};
  j["jnd"] = {{"share", kJndShare}, {"floor_N", result.floor_N}};
  j["truth"] = to_json(result.truth);
  j["second_motion"] = result.second_motion;
  j["chosen"] = result.settings[result.chosen].words;
  j["rule"] = rule_name(result.choice.rule);
  j["front"] = nlohmann::ordered_json::array();
  for (const std::size_t n : result.front) j["front"].push_back(result.settings[n].words);
  j["settings"] = nlohmann::ordered_json::array();
  for (std::size_t n = 0; n < result.settings.size(); ++n) j["settings"].push_back(setting_report(result, n));
  const Confirmation& c = result.confirmation;
  if (c.not_done.empty()) {
    j["confirmation"] = {{"motion", c.motion}, {"error", to_json(c.error)}, {"tick_us", to_json(c.tick_us)}};
  } else {
    j["confirmation"] = {{"not_done", c.not_done}};
  }
  j["notes"] = result.notes;
  j["seconds"] = result.seconds;
  return j;
}

}  // namespace hybrid
