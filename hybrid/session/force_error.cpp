// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/force_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/equilibrium.h"

namespace hybrid {
namespace {

// A force that changes by less than this share of the floor of the JND, over dozens of relaxation cycles, is
// at rest.
constexpr double kAtRestShare = 0.02;
// First delay of still samples after the device stopped, and the ratio from one delay to the next.
constexpr double kFirstDelay_s = 0.01, kDelayRatio = 3.16227766;
constexpr double kApart_s = 0.02;  // least time between two fastest changes

// The ticks of a course that can be sampled.
class Choice {
 public:
  Choice(const ForceCourse& course, double dt_s) : course_(course), dt_s_(dt_s), since_(course.size(), 0) {
    for (std::size_t t = 0; t < course.size(); ++t) {
      since_[t] = t == 0 || moves(t) || moves(t - 1) ? 0 : since_[t - 1] + 1;
      if (course[t].soft) (moves(t) ? moving_ : still_).push_back(t);
    }
  }

  [[nodiscard]] std::vector<ErrorSample> pick(std::size_t count) {
    add(largest_force());
    const std::size_t of_moving = still_.empty() ? count : count / 2;
    add_fastest_changes(of_moving / 2);
    const auto moving = static_cast<std::size_t>(
        std::count_if(chosen_.begin(), chosen_.end(), [this](std::size_t t) { return moves(t); }));
    add_spread(moving_, of_moving - std::min(of_moving, moving));
    add_after_stops(count);
    add_spread(still_, count - std::min(count, chosen_.size()));
    add_spread(moving_, count - std::min(count, chosen_.size()));
    std::sort(chosen_.begin(), chosen_.end());
    std::vector<ErrorSample> samples;
    for (const std::size_t t : chosen_) {
      samples.push_back({t, moves(t), moves(t) ? 0.0 : static_cast<double>(since_[t] + 1) * dt_s_});
    }
    return samples;
  }

 private:
  [[nodiscard]] bool moves(std::size_t t) const { return course_[t].speed_m_per_s > kStill_m_per_s; }

  [[nodiscard]] std::optional<std::size_t> largest_force() const {
    std::optional<std::size_t> most;
    for (std::size_t t = 0; t < course_.size(); ++t) {
      if (course_[t].soft && (!most || glm::length(course_[t].force_N) > glm::length(course_[*most].force_N)))
        most = t;
    }
    return most;
  }

  bool add(std::optional<std::size_t> t) {
    if (!t || std::find(chosen_.begin(), chosen_.end(), *t) != chosen_.end()) return false;
    chosen_.push_back(*t);
    return true;
  }

  // Change of the force in a tick, in shares of the force or of the floor.
  [[nodiscard]] double change(std::size_t t) const {
    if (t == 0) return 0.0;
    return glm::length(course_[t].force_N - course_[t - 1].force_N) /
           std::max(kJndShare * glm::length(course_[t].force_N), kJndFloor_N);
  }

  void add_fastest_changes(std::size_t count) {
    std::vector<std::size_t> order;
    for (const auto* list : {&moving_, &still_}) order.insert(order.end(), list->begin(), list->end());
    std::vector<double> changes(course_.size(), 0.0);
    for (const std::size_t t : order) changes[t] = change(t);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return changes[a] != changes[b] ? changes[a] > changes[b] : a < b;
    });
    const auto apart = static_cast<std::size_t>(std::lround(kApart_s / dt_s_));
    std::vector<std::size_t> taken;
    for (const std::size_t t : order) {
      if (taken.size() >= std::max<std::size_t>(count, 1)) break;
      const auto near = [&](std::size_t other) { return (t > other ? t - other : other - t) < apart; };
      if (std::any_of(taken.begin(), taken.end(), near)) continue;
      taken.push_back(t);
      add(t);
    }
  }

  // Adds up to `count` evenly spread ticks of `list`.
  void add_spread(const std::vector<std::size_t>& list, std::size_t count) {
    count = std::min(count, list.size());
    std::size_t added = 0;
    for (std::size_t n = 0; n < count; ++n)
      added += add(list[(2 * n + 1) * list.size() / (2 * count)]) ? 1 : 0;
    for (std::size_t n = 0; n < list.size() && added < count; ++n) added += add(list[n]) ? 1 : 0;
  }

  // Still ticks at rising delays after the device stopped; the stop with the largest force first.
  void add_after_stops(std::size_t most) {
    std::vector<std::pair<std::size_t, std::size_t>> stops;  // first tick, count
    for (const std::size_t t : still_) {
      if (!stops.empty() && stops.back().first + stops.back().second == t && since_[t] != 0)
        ++stops.back().second;
      else
        stops.emplace_back(t, 1);
    }
    std::stable_sort(stops.begin(), stops.end(), [&](const auto& a, const auto& b) {
      return glm::length(course_[a.first].force_N) > glm::length(course_[b.first].force_N);
    });
    for (const auto& [first, ticks] : stops) {
      for (double delay_s = kFirstDelay_s; chosen_.size() < most; delay_s *= kDelayRatio) {
        const auto delay = static_cast<std::size_t>(std::lround(delay_s / dt_s_));
        if (delay > ticks) break;
        add(first + std::max<std::size_t>(delay, 1) - 1);
      }
    }
  }

  const ForceCourse& course_;
  double dt_s_;
  std::vector<std::size_t> since_;  // [tick] ticks since the device moved
  std::vector<std::size_t> moving_, still_, chosen_;
};

void add_to(ErrorRange& range, double error_N, double jnd, double t_s) {
  ++range.samples;
  range.max_N = std::max(range.max_N, error_N);
  range.rms_N += error_N * error_N;  // a sum until result() ends it
  if (range.samples > 1 && jnd <= range.max_jnd) return;
  range.max_jnd = jnd;
  range.worst_t_s = t_s;
}

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const auto i = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  return values[std::min(i, values.size() - 1)];
}

}  // namespace

std::vector<ErrorSample> choose_error_samples(const ForceCourse& course, std::size_t count, double dt_s) {
  return Choice(course, dt_s).pick(count);
}

void ForceErrorSampler::take(const World& world, const WorldState& state, const glm::dvec3& force_N,
                             double t_s) {
  const ErrorSample sample = samples_[next_++];
  const auto reference = equilibrium_force(world, state, kAtRestShare * floor_N_);
  if (!reference) {
    ++unsettled_;
    return;
  }
  taken_.push_back({sample, t_s, glm::length(force_N - *reference), jnd_of(force_N, *reference, floor_N_)});
}

std::string ForceErrorSampler::progress() const {
  return fmt::format("comparing the force with its equilibrium: {} of {}", next_ + 1, samples_.size());
}

ForceError ForceErrorSampler::result() const {
  ForceError error;
  error.wanted = static_cast<int>(samples_.size());
  error.unsettled = unsettled_;
  std::vector<double> errors_N, jnds;
  double last_beyond_s = 0.0;
  for (const Taken& t : taken_) {
    for (ErrorRange* range : {&error.all, t.sample.moving ? &error.moving : &error.still})
      add_to(*range, t.error_N, t.jnd, t.t_s);
    errors_N.push_back(t.error_N);
    jnds.push_back(t.jnd);
    if (t.sample.moving) continue;
    if (t.jnd > 1.0) last_beyond_s = std::max(last_beyond_s, t.sample.still_s);
  }
  if (samples_.empty()) error.not_measured = "nothing soft was touched";
  if (!samples_.empty() && taken_.empty()) error.not_measured = "no sampled state came to rest";
  if (taken_.empty()) return error;
  for (ErrorRange* range : {&error.all, &error.moving, &error.still})
    range->rms_N = range->samples > 0 ? std::sqrt(range->rms_N / range->samples) : 0.0;
  error.p99_N = percentile(errors_N, 0.99);
  error.p99_jnd = percentile(jnds, 0.99);
  // The first sampled delay after the last one beyond 1 JND.
  std::optional<double> after;
  for (const Taken& t : taken_) {
    if (!t.sample.moving && t.sample.still_s > last_beyond_s && (!after || t.sample.still_s < *after))
      after = t.sample.still_s;
  }
  error.within_after_s = after;
  return error;
}

std::string in_words(const ForceError& error) {
  if (error.all.samples == 0) return "not known";
  if (error.all.max_jnd <= 1.0) return "felt as at rest: within 1 JND at every sample";
  std::string text;
  if (error.moving.samples > 0)
    text += fmt::format("up to {:.1f} JND while the tool moves", error.moving.max_jnd);
  if (error.still.samples == 0) return text;
  if (!text.empty()) text += ", ";
  if (error.still.max_jnd <= 1.0) return text + "within 1 JND when it is still";
  text += fmt::format("up to {:.1f} JND when it is still", error.still.max_jnd);
  if (error.within_after_s)
    return text + fmt::format(", within 1 JND from {:.2g} s after it stopped", *error.within_after_s);
  return text + ", to the longest time that was sampled";
}

}  // namespace hybrid
