// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/tune.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <stdexcept>

#include "device/loop/stop_signal.h"
#include "hybrid/compare/compare.h"
#include "hybrid/tune/evaluation.h"
#include "hybrid/tune/progress.h"
#include "hybrid/tune/search_motion.h"

namespace hybrid {
namespace {

constexpr double kFirstShare = 1.0 / 3.0;  // share of the contact that the first round plays
// A setting is left out if another is better in cost and error by this margin: after the first round, and
// after the second.
constexpr double kMarginOfPart = 0.3, kMarginOfWhole = 0.1;
// Timed sessions of each setting; odd, so that a median is one of them.
constexpr std::size_t kPasses = 5, kQuickPasses = 3;
constexpr double kOtherSpeed = 1.5;  // factor on the speed of the confirming motion

// A setting under test, with the times of its ticks in each pass.
struct Trial {
  TunedSetting tuned;
  std::vector<std::vector<double>> passes;
};

class Search {
 public:
  Search(const Scene& as_read, const TuneOptions& options)
      : as_read_(as_read),
        options_(options),
        cache_(options.cache, as_read),
        progress_(options.progress),
        step_(progress_.as_step()) {
    result_.objects = tunable_objects(as_read);
    if (result_.objects.empty()) {
      throw std::runtime_error(fmt::format("{}: no [[soft]] object with voxels, so there is nothing to tune",
                                           as_read.file.string()));
    }
    for (const TunableObject& object : result_.objects) {
      names_.push_back(object.own.object);
      if (!object.note.empty()) result_.notes.push_back(object.own.object + ": " + object.note);
    }
    own_ = with_setting(as_read, own_setting(result_.objects));
    motion_ = scene_motion(own_);
    result_.floor_N = jnd_floor_N(as_read);
    result_.period_us = 1e6 / as_read.rate_hz;
    result_.unit_m = as_read.unit_m;
    result_.bounds = {options.error_jnd, options.budget_us.value_or(kBudgetShare * result_.period_us)};
  }

  TuneResult run() {
    const std::vector<Setting> settings = common_settings(result_.objects, options_.quick);
    plan(settings);
    find_truth();
    find_second_motion();
    try_settings(settings);
    match_proxies();
    try_less_work();
    if (result_.objects.size() > 1) refine();
    time_survivors();
    choose();
    confirm();
    result_.seconds = progress_.seconds();
    return std::move(result_);
  }

 private:
  [[nodiscard]] std::size_t passes() const { return options_.quick ? kQuickPasses : kPasses; }
  [[nodiscard]] double dt_s() const { return 1.0 / as_read_.rate_hz; }

  [[nodiscard]] double weight(const Setting& setting) const {
    double heaviest = 0.0;
    for (std::size_t n = 0; n < setting.objects.size(); ++n) {
      if (!setting.objects[n].proxy)
        heaviest = std::max(heaviest, play_weight(scale_of(result_.objects[n], setting.objects[n])));
    }
    return std::max(heaviest, 0.05);
  }

  void plan(const std::vector<Setting>& settings) {
    // The truth along the motion, along the second one and along the confirming one.
    progress_.plan(truth_weight(truth_plan()) + 2.0 * truth_course_weight(truth_plan()));
    for (const Setting& setting : settings) plan_trial(setting);
  }

  // Plans both rounds on both motions, and the timed passes.
  void plan_trial(const Setting& setting) {
    progress_.plan(weight(setting) * (2.0 * kFirstShare + 1.0 + static_cast<double>(passes())));
  }

  void find_truth() {
    result_.truth = measure_truth(truth_plan(), motion_, cache_, step_);
    const ForceCourse& course = result_.truth.course;
    if (felt_ticks(course) == 0) {
      throw std::runtime_error(fmt::format(
          "{}: its path touches nothing soft; give [path] points within an object (`hybrid check` says where "
          "they lie)",
          as_read_.file.string()));
    }
    motions_.push_back({motion_, "", course, part_of(course, kFirstShare)});
  }

  void find_second_motion() {
    for (const double side : {1.0, -1.0}) {
      try {
        SearchMotion second = moved(side, 1.0);
        if (!stays_in_contact(second, motions_.front(), 1.0)) continue;
        second.part_ticks = part_of(second.truth, kFirstShare);
        result_.second_motion = second.words;
        motions_.push_back(std::move(second));
        return;
      } catch (const SceneError&) {  // the tool begins inside an object there
      }
    }
  }

  [[nodiscard]] TruthPlan truth_plan() const {
    return {.as_read = as_read_,
            .objects = result_.objects,
            .names = names_,
            .quick = options_.quick,
            .floor_N = result_.floor_N,
            .dt_s = dt_s()};
  }

  // Plays a setting on all motions of the search, or, with `part`, on the part of each that the first round
  // takes. The errors are the worst of all motions. The other figures are those of the scene's own path.
  Evaluation evaluate_all(const Setting& setting, bool part) {
    const auto on = [&](const SearchMotion& m) {
      return evaluate(setting, {m.motion.path, part ? m.part_ticks : m.motion.ticks}, m.words, m.truth, 0);
    };
    Evaluation evaluation = on(motions_.front());
    for (std::size_t n = 1; n < motions_.size() && evaluation.refused.empty(); ++n) {
      const Evaluation other = on(motions_[n]);
      evaluation.error = worse(evaluation.error, other.error);
      evaluation.at_soft = worse(evaluation.at_soft, other.at_soft);
      for (const std::string& fault : other.faults) {
        if (std::ranges::find(evaluation.faults, fault) == evaluation.faults.end())
          evaluation.faults.push_back(fault);
      }
      evaluation.refused = other.refused;
    }
    return evaluation;
  }

  // One session with a setting: from the cache if it is there, otherwise played.
  Evaluation evaluate(const Setting& setting, const Motion& motion, const std::string& motion_words,
                      const ForceCourse& truth, std::size_t pass) {
    const std::string key = fmt::format("play pass {} {} {}\ntruth {}\n{}", pass, motion.ticks, motion_words,
                                        result_.truth.key, as_toml(setting));
    const std::string words = in_words(setting, result_.unit_m);
    const double share = static_cast<double>(motion.ticks) / static_cast<double>(motion_.ticks);
    Evaluation evaluation;
    step_(words, weight(setting) * share, [&](const Progress& progress) {
      if (const auto kept = cache_.find(key)) {
        evaluation = evaluation_from(*kept);
        return;
      }
      try {
        evaluation = evaluation_of(play_setting(with_setting(as_read_, setting), names_, motion, progress),
                                   truth, result_.floor_N, dt_s(), setting.coupling_N_per_m.has_value());
      } catch (const SceneError& error) {
        evaluation.refused = error.what();
      }
      cache_.keep(key, to_json(evaluation));
    });
    return evaluation;
  }

  // Two rounds. The first round plays a part of the motion with all settings. The second plays the whole
  // motion with the settings that no other setting clearly dominates.
  void try_settings(const std::vector<Setting>& settings) {
    const std::size_t first = trials_.size();
    for (const Setting& setting : settings) {
      Trial trial;
      trial.tuned.setting = setting;
      trial.tuned.words = in_words(setting, result_.unit_m);
      trial.tuned.own = setting == own_setting(result_.objects);
      for (const Fitted& fitted : matches_) {
        if (setting.coupling_N_per_m == fitted.coupling_N_per_m) trial.tuned.match = fitted.match;
      }
      take(trial, evaluate_all(setting, true));
      trials_.push_back(std::move(trial));
    }
    leave_out(first, kMarginOfPart, fmt::format("after {:.0f} % of the contact", 100.0 * kFirstShare));
    for (std::size_t n = first; n < trials_.size(); ++n) {
      Trial& trial = trials_[n];
      if (!trial.tuned.whole()) continue;
      const Evaluation whole = evaluate_all(trial.tuned.setting, false);
      trial.passes = {whole.tick_us};
      trial.tuned.whole_session = whole.refused.empty();
      take(trial, whole);
    }
    leave_out(0, kMarginOfWhole, "after one session");
  }

  static void take(Trial& trial, const Evaluation& evaluation) {
    TunedSetting& tuned = trial.tuned;
    tuned.error = evaluation.error;
    tuned.at_soft = evaluation.at_soft;
    tuned.felt_p99_us = evaluation.felt_p99_us;
    tuned.memory_bytes = evaluation.memory_bytes;
    tuned.soft_voxels = evaluation.soft_voxels;
    tuned.load_s = evaluation.load_s;
    tuned.on_patches = evaluation.on_patches;
    tuned.faults = evaluation.faults;
    if (!evaluation.refused.empty()) tuned.left_out = "refused: " + evaluation.refused;
    std::vector<double> ticks = evaluation.tick_us;
    tuned.tick_us = percentiles(ticks);
  }

  // Leaves out settings from `first` on that are clearly dominated, but never the scene's own setting.
  void leave_out(std::size_t first, double margin, const std::string& when) {
    std::vector<std::size_t> whole;
    std::vector<CostAndError> points;
    for (std::size_t n = first; n < trials_.size(); ++n) {
      if (!trials_[n].tuned.whole()) continue;
      whole.push_back(n);
      points.push_back({trials_[n].tuned.felt_p99_us, trials_[n].tuned.error.worst_jnd(),
                        trials_[n].tuned.faults.empty()});
    }
    for (std::size_t p = 0; p < whole.size(); ++p) {
      TunedSetting& tuned = trials_[whole[p]].tuned;
      const auto better = dominated_by(points, p, margin);
      if (!better || tuned.own) continue;
      tuned.left_out = fmt::format("{}: {} has {:.2g} of its error at {:.2g} of its tick", when,
                                   trials_[whole[*better]].tuned.words,
                                   points[*better].error_jnd / std::max(points[p].error_jnd, 1e-9),
                                   points[*better].cost_us / std::max(points[p].cost_us, 1e-9));
    }
  }

  // For each object that may be rendered by the proxy: tries the proxy with a coupling that fits the truth's
  // force in the first contact with the object. An object that the tool does not touch then is left out.
  void match_proxies() {
    std::vector<Setting> settings;
    for (std::size_t n = 0; n < result_.objects.size(); ++n) {
      if (!result_.objects[n].other_model) continue;
      Setting one = own_setting(result_.objects), all = one;
      one.objects[n].proxy = true;
      for (std::size_t o = 0; o < all.objects.size(); ++o)
        all.objects[o].proxy = all.objects[o].proxy || result_.objects[o].other_model;
      const auto match = fitted(one, names_[n]);
      if (!match) continue;
      for (const Setting& rigid : {one, all}) {
        Setting setting = with_coupling(rigid, match->stiffness_N_per_m);
        if (std::ranges::find(settings, setting) != settings.end()) continue;
        settings.push_back(std::move(setting));
        matches_.push_back({*settings.back().coupling_N_per_m, *match});
        plan_trial(settings.back());
      }
    }
    try_settings(settings);
  }

  // The coupling with which the proxy of `object` is nearest to the truth. `setting` renders the object by
  // the proxy, with the coupling as given. Empty: the tool does not touch the object, or feels nothing there.
  std::optional<StiffnessMatch> fitted(const Setting& setting, const std::string& object) {
    std::optional<StiffnessMatch> match;
    step_("the proxy of " + object, weight(setting), [&](const Progress& progress) {
      const Scene scene = with_setting(as_read_, setting);
      const ForceCourse proxy = play_setting(scene, {object}, motion_, progress).course;
      const auto contact = first_contact(proxy, result_.floor_N, dt_s());
      if (!contact) return;
      match = match_stiffness(result_.truth.course, proxy, scene.tool.stiffness_N_per_m, *contact, dt_s());
    });
    return match;
  }

  // Varies the work in a tick of the settings that no other setting dominates in error and number of voxels.
  // A variation takes as long to play as the setting itself, so dominated settings are not varied. The number
  // of voxels stands for the cost, and settings that were left out count too. So the choice does not depend
  // on measured times, and a search that goes on tries the same settings.
  void try_less_work() {
    std::vector<CostAndError> points;
    for (const Trial& trial : trials_) {
      const TunedSetting& tuned = trial.tuned;
      points.push_back({weight(tuned.setting), tuned.error.worst_jnd(), tuned.faults.empty()});
    }
    std::vector<Setting> settings;
    for (const std::size_t p : pareto_front(points)) {
      const TunedSetting& from = trials_[p].tuned;
      for (Setting& setting : settings_with_less_work(from.setting, from.on_patches)) {
        if (std::ranges::find(settings, setting) != settings.end()) continue;
        plan_trial(setting);
        settings.push_back(std::move(setting));
      }
    }
    try_settings(settings);
  }

  // With several objects: varies one object at a time, from the common setting that would be chosen now.
  void refine() {
    const std::vector<std::size_t> whole = whole_trials();
    const Choice choice = choose_setting(points_of(whole, false), result_.bounds);
    const Setting from = trials_[whole[choice.chosen]].tuned.setting;
    std::vector<Setting> settings;
    for (const Setting& setting : settings_beside(result_.objects, from)) {
      const bool known =
          std::ranges::any_of(trials_, [&](const Trial& trial) { return trial.tuned.setting == setting; });
      if (known) continue;
      settings.push_back(setting);
      plan_trial(setting);
    }
    try_settings(settings);
  }

  [[nodiscard]] std::vector<std::size_t> whole_trials() const {
    std::vector<std::size_t> whole;
    for (std::size_t n = 0; n < trials_.size(); ++n) {
      if (trials_[n].tuned.whole()) whole.push_back(n);
    }
    return whole;
  }

  [[nodiscard]] std::vector<CostAndError> points_of(const std::vector<std::size_t>& which, bool p999) const {
    std::vector<CostAndError> points;
    for (const std::size_t n : which) {
      const TunedSetting& tuned = trials_[n].tuned;
      points.push_back(
          {p999 ? tuned.tick_us.p999 : tuned.felt_p99_us, tuned.error.worst_jnd(), tuned.faults.empty()});
    }
    return points;
  }

  // Plays further passes. Each has the reverse order of the one before, so that a machine that gets slower or
  // faster favours no setting.
  void time_survivors() {
    std::vector<std::size_t> order = whole_trials();
    for (std::size_t pass = 1; pass < passes(); ++pass) {
      std::ranges::reverse(order);
      for (const std::size_t n : order) {
        Trial& trial = trials_[n];
        trial.passes.push_back(
            evaluate(trial.tuned.setting, motion_, "", result_.truth.course, pass).tick_us);
      }
    }
    for (const std::size_t n : order) {
      Trial& trial = trials_[n];
      trial.tuned.tick_us = median_ticks(trial.passes);
      for (std::vector<double> ticks : trial.passes)
        trial.tuned.pass_p999_us.push_back(percentiles(ticks).p999);
    }
  }

  void choose() {
    const std::vector<std::size_t> whole = whole_trials();
    const std::vector<CostAndError> points = points_of(whole, true);
    result_.choice = choose_setting(points, result_.bounds);
    result_.chosen = result_.choice.chosen = whole[result_.choice.chosen];
    if (result_.choice.next_accurate) result_.choice.next_accurate = whole[*result_.choice.next_accurate];
    for (const std::size_t p : pareto_front(points)) result_.front.push_back(whole[p]);
    for (std::size_t p = 0; p < whole.size(); ++p) {
      if (const auto better = dominated_by(points, p)) trials_[whole[p]].tuned.dominated_by = whole[*better];
    }
    for (Trial& trial : trials_) result_.settings.push_back(std::move(trial.tuned));
  }

  // The scene's motion, moved to this side and `speed` times as fast, with the truth along it.
  [[nodiscard]] SearchMotion moved(double side, double speed) {
    SearchMotion motion = moved_motion(motions_.front(), as_read_, side, speed);
    motion.truth = truth_course(truth_plan(), motion.motion, motion.words, cache_, step_).course;
    return motion;
  }

  void confirm() {
    // The side on which the search did not play comes first.
    for (const double side : {-1.0, 1.0}) {
      try {
        confirm_on(moved(side, kOtherSpeed));
        if (result_.confirmation.not_done.empty()) return;
      } catch (const SceneError& error) {  // the tool begins inside an object there
        result_.confirmation = {};
        result_.confirmation.not_done = error.what();
      }
    }
  }

  void confirm_on(const SearchMotion& other) {
    Confirmation& confirmation = result_.confirmation;
    confirmation = {};
    confirmation.motion = other.words;
    if (!stays_in_contact(other, motions_.front(), kOtherSpeed)) {
      confirmation.not_done = "moved sideways the path loses its contact";
      return;
    }
    std::vector<std::vector<double>> passes;
    for (std::size_t pass = 0; pass < kQuickPasses; ++pass) {
      const Evaluation played =
          evaluate(result_.settings[result_.chosen].setting, other.motion, other.words, other.truth, pass);
      if (!played.refused.empty()) throw SceneError(as_read_.file, {}, played.refused);
      confirmation.error = played.error;
      passes.push_back(played.tick_us);
    }
    confirmation.tick_us = median_ticks(passes);
  }

  const Scene& as_read_;
  const TuneOptions& options_;
  EvaluationCache cache_;
  SearchProgress progress_;
  Step step_;
  TuneResult result_;
  Scene own_;
  Motion motion_;
  std::vector<std::string> names_;
  std::vector<SearchMotion> motions_;  // the scene's own first
  std::vector<Trial> trials_;
  struct Fitted {
    double coupling_N_per_m;
    StiffnessMatch match;
  };
  std::vector<Fitted> matches_;
};

}  // namespace

TuneResult tune(const Scene& as_read, const TuneOptions& options) {
  return Search(as_read, options).run();
}

}  // namespace hybrid
