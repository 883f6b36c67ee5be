// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/tick_history.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hybrid {
namespace {

constexpr double kEver = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostSamples = 200'000;  // ten seconds at the highest servo rate

float force_of(const TickSample& sample, ForceSeries series) noexcept {
  switch (series) {
    case ForceSeries::rigid:
      return sample.rigid_N;
    case ForceSeries::soft:
      return sample.soft_N;
    case ForceSeries::friction:
      return sample.friction_N;
    case ForceSeries::damping:
      return sample.damping_N;
    case ForceSeries::limits:
      return sample.limits_N;
    case ForceSeries::passivity:
      return sample.passivity_N;
    default:
      return sample.total_N;
  }
}

double percentile_of(std::vector<float>& sorted, double share) {
  if (sorted.empty()) return 0.0;
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(sorted.size()));
  return static_cast<double>(sorted[std::min(rank, sorted.size() - 1)]);
}

}  // namespace

std::size_t TickTimes::bin_of(double us) noexcept {
  if (!(us > kFirst_us)) return 0;
  const double share = std::log(us / kFirst_us) / std::log(kLast_us / kFirst_us);
  return std::min(static_cast<std::size_t>(share * kBins), kBins - 1);
}

void TickHistory::add(const TickSample& sample) {
  if (!std::isfinite(sample.t_s)) return;
  if (!samples_.empty() && sample.t_s <= samples_.back().t_s) clear();
  samples_.push_back(sample);
  while (samples_.front().t_s <= sample.t_s - seconds_ || samples_.size() > kMostSamples)
    samples_.pop_front();
}

void TickHistory::add(const ForceAtRest& found) {
  if (!at_rest_.empty() && found.t_s <= at_rest_.back().t_s) at_rest_.clear();
  at_rest_.push_back(found);
  while (at_rest_.front().t_s <= end_s() - seconds_) at_rest_.pop_front();
}

// Columns begin at whole multiples of their width in time, not relative to the newest tick. So the ticks of a
// column stay together while the chart scrolls.
std::size_t TickHistory::column_of(const TickSample& sample, std::size_t count) const {
  const double step_s = seconds_ / static_cast<double>(count);
  const auto last = static_cast<std::int64_t>(std::floor(end_s() / step_s));
  const auto column = static_cast<std::int64_t>(std::floor(sample.t_s / step_s)) - last +
                      static_cast<std::int64_t>(count) - 1;
  return static_cast<std::size_t>(std::clamp<std::int64_t>(column, 0, static_cast<std::int64_t>(count) - 1));
}

std::vector<std::optional<ColumnRange>> TickHistory::columns(ForceSeries series, std::size_t count) const {
  std::vector<std::optional<ColumnRange>> columns(count);
  if (count == 0) return columns;
  for (const TickSample& sample : samples_) {
    const float force = force_of(sample, series);
    if (!std::isfinite(force)) continue;
    std::optional<ColumnRange>& at = columns[column_of(sample, count)];
    if (!at) at = ColumnRange{force, force};
    at->least_N = std::min(at->least_N, force);
    at->most_N = std::max(at->most_N, force);
  }
  return columns;
}

std::vector<std::optional<TickHistory::Parts>> TickHistory::parts(std::size_t count) const {
  std::vector<std::optional<Parts>> parts(count);
  std::vector<float> most(count, -1.0F);
  if (count == 0) return parts;
  for (const TickSample& sample : samples_) {
    const std::size_t column = column_of(sample, count);
    if (!(sample.total_N > most[column])) continue;
    most[column] = sample.total_N;
    parts[column] = sample.along_N;
  }
  return parts;
}

std::optional<TickHistory::NumberRange> TickHistory::range(
    const std::function<double(const TickSample&)>& of) const {
  if (samples_.empty()) return std::nullopt;
  const double now = of(samples_.back());
  NumberRange range{now, now, now};
  for (const TickSample& sample : samples_) {
    const double value = of(sample);
    range.least = std::min(range.least, value);
    range.most = std::max(range.most, value);
  }
  return range;
}

void TickHistory::mark(double t_s) {
  // The ticks before an earlier mark belong to yet another scene.
  const double from_s = mark_ ? mark_->t_s : 0.0;
  mark_ = ChangeMark{
      .t_s = t_s, .before = times(from_s, t_s), .most_before_N = most_N(ForceSeries::total, from_s, t_s)};
}

std::vector<glm::dvec3> TickHistory::path_m(std::size_t count) const {
  std::vector<glm::dvec3> path;
  const std::size_t ticks = samples_.size();
  const std::size_t step = std::max<std::size_t>(ticks / std::max<std::size_t>(count, 1) + 1, 1);
  for (std::size_t n = 0; n < ticks; n += step) path.push_back(samples_[n].device_m);
  if (ticks > 0) path.push_back(samples_.back().device_m);
  return path;
}

double TickHistory::most_N(ForceSeries series) const {
  return most_N(series, 0.0, kEver);
}

double TickHistory::most_N(ForceSeries series, double from_s, double to_s) const {
  float most = 0.0F;
  for (const TickSample& sample : samples_) {
    const float force = force_of(sample, series);
    if (sample.t_s >= from_s && sample.t_s < to_s && std::isfinite(force)) most = std::max(most, force);
  }
  return static_cast<double>(most);
}

double TickHistory::most_N() const {
  double most = 0.0;
  for (std::size_t s = 0; s < kForceSeries; ++s) most = std::max(most, most_N(static_cast<ForceSeries>(s)));
  return most;
}

TickTimes TickHistory::times() const {
  return times(0.0, kEver);
}

TickTimes TickHistory::times(double from_s, double to_s) const {
  TickTimes times;
  std::vector<float> sorted;
  sorted.reserve(samples_.size());
  for (const TickSample& sample : samples_) {
    if (sample.t_s < from_s || sample.t_s >= to_s) continue;
    ++times.bins[TickTimes::bin_of(static_cast<double>(sample.tick_us))];
    times.late += sample.late ? 1 : 0;
    sorted.push_back(sample.tick_us);
    for (std::size_t s = 0; s < kStages; ++s) times.stage_us[s] += static_cast<double>(sample.stage_us[s]);
  }
  times.ticks = sorted.size();
  for (double& mean : times.stage_us) mean /= std::max(1.0, static_cast<double>(times.ticks));
  std::sort(sorted.begin(), sorted.end());
  times.p50_us = percentile_of(sorted, 0.5);
  times.p99_us = percentile_of(sorted, 0.99);
  times.most_us = percentile_of(sorted, 1.0);
  return times;
}

}  // namespace hybrid
