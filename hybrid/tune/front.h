// SPDX-License-Identifier: GPL-3.0-or-later
// Cost against error: what is dominated, and the rules by which a setting is chosen.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace hybrid {

// A setting as the choice sees it.
struct CostAndError {
  double cost_us = 0.0;    // tick p99.9
  double error_jnd = 0.0;  // the larger of moving and still
  bool sound = true;       // its session was without a fault
};

// Index of a point that is at least (1 + margin) times better in both, and better in one of them; empty if
// there is none. Of equal points the first one stays.
std::optional<std::size_t> dominated_by(std::span<const CostAndError> points, std::size_t point,
                                        double margin = 0.0);

// Points that no other one dominates, by rising cost.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> points);

struct Bounds {
  double error_jnd = 1.0;
  double budget_us = 500.0;
};

// Which rule decided.
enum class ChoiceRule : unsigned char {
  cheapest_accurate,      // under the error's bound, within the budget: the cheapest
  most_accurate_in_time,  // none of these: the most accurate one within the budget
  cheapest,               // nothing is within the budget: the cheapest
};

struct Choice {
  std::size_t chosen = 0;
  ChoiceRule rule = ChoiceRule::cheapest_accurate;
  bool any_sound = true;                     // false: every session had a fault, so faults did not count
  std::optional<std::size_t> next_accurate;  // the next cheapest under the error's bound
};

// Faulty settings are chosen only if all are. Throws std::invalid_argument: no points.
Choice choose_setting(std::span<const CostAndError> points, const Bounds& bounds);

}  // namespace hybrid
