// SPDX-License-Identifier: GPL-3.0-or-later
// Cost against error: dominated settings, the Pareto front, and the rules by which a setting is chosen.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hybrid {

// The data of a setting that the choice depends on.
struct CostAndError {
  double cost_us = 0.0;    // time of a tick, a percentile that the caller chooses
  double error_jnd = 0.0;  // the larger of the errors while moving and while still
  bool sound = true;       // false: its session had a fault
};

// Index of a point that dominates `point`: it is at least (1 + margin) times better in both cost and error,
// and strictly better in one of them. Empty if there is none. Without a margin, the first of equal points
// dominates the others.
std::optional<std::size_t> dominated_by(std::span<const CostAndError> points, std::size_t point,
                                        double margin = 0.0);

// The points that no other point dominates, by rising cost.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> points);

// Default budget of a tick's p99.9, as a share of the device's period.
inline constexpr double kBudgetShare = 0.5;

struct Bounds {
  double error_jnd = 1.0;
  double budget_us = 500.0;
};

// The rule that decided.
enum class ChoiceRule : unsigned char {
  cheapest_accurate,      // the cheapest of those under the error's bound and within the budget
  most_accurate_in_time,  // if there are none: the most accurate within the budget
  cheapest,               // if none is within the budget: the cheapest of all
};

struct Choice {
  std::size_t chosen = 0;
  ChoiceRule rule = ChoiceRule::cheapest_accurate;
  bool any_sound = true;                     // false: every session had a fault, so faults were ignored
  std::optional<std::size_t> next_accurate;  // the next cheapest setting under the error's bound
};

// Chooses by the first rule that applies. Settings with a fault are chosen only if all have one. Throws
// std::invalid_argument if there are no points.
Choice choose_setting(std::span<const CostAndError> points, const Bounds& bounds);

}  // namespace hybrid
