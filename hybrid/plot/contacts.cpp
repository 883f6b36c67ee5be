// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/contacts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace hybrid {
namespace {

constexpr double kLiftOff_s = 0.05;     // a contact continues if the tool lifted off no longer than this
constexpr double kKeptShare = 0.03;     // share of the whole time that stays before and after each contact
constexpr double kLongShare = 0.08;     // share of the whole time; shorter stretches are not squeezed
constexpr double kLeastForce_N = 1e-9;  // a smaller force has no direction
// A path goes on in steps of this length. Shorter movements may be noise: a PHANToM's encoders have steps of
// 0.03 mm along each axis.
constexpr double kPathStep_m = 1e-4;

bool is_stroke(std::span<const TraceRow> rows, const Contact& contact) {
  double along_m = 0.0, across_m = 0.0;
  for (const TraceRow& row : rows) {
    const double depth_m = contact.depth_m(row.device_m);
    const double aside_m = glm::length(row.device_m - contact.start_m - depth_m * contact.into);
    if (!std::isfinite(depth_m + aside_m)) continue;
    along_m = std::max(along_m, std::abs(depth_m));
    across_m = std::max(across_m, aside_m);
  }
  return across_m > along_m;
}

}  // namespace

Intervals contact_intervals(std::span<const TraceRow> rows, std::uint32_t mask) {
  Intervals intervals;
  bool on = false;
  for (const TraceRow& row : rows) {
    const bool touches = (row.contacts & mask) != 0;
    if (touches && !on) intervals.emplace_back(row.t_s, row.t_s);
    if (touches || on) intervals.back().second = row.t_s;
    on = touches;
  }
  return intervals;
}

double duration(const Intervals& intervals) {
  double sum = 0.0;
  for (const auto& [from, to] : intervals) {
    if (std::isfinite(to - from)) sum += to - from;
  }
  return sum;
}

double Contact::depth_m(const glm::dvec3& device_m) const {
  return glm::dot(device_m - start_m, into);
}

std::vector<Contact> contacts_of(std::span<const TraceRow> rows, const Intervals& touched) {
  std::vector<Contact> contacts;
  for (const auto& [from, to] : touched) {
    if (!contacts.empty() && from - contacts.back().to_s <= kLiftOff_s) {
      contacts.back().to_s = std::max(contacts.back().to_s, to);
    } else if (std::isfinite(from) && std::isfinite(to)) {
      contacts.push_back({.from_s = from, .to_s = to});
    }
  }
  std::size_t n = 0;
  bool started = false;
  for (const TraceRow& row : rows) {
    while (n < contacts.size() && row.t_s > contacts[n].to_s) {
      ++n;
      started = false;
    }
    if (n == contacts.size()) break;
    if (!(row.t_s >= contacts[n].from_s)) continue;
    if (!started) contacts[n].start_m = row.device_m;
    started = true;
    const double force = glm::length(row.force_N);
    if (!std::isfinite(force) || !(force > std::max(contacts[n].most_N, kLeastForce_N))) continue;
    contacts[n].most_N = force;
    contacts[n].into = -row.force_N / force;
  }
  for (Contact& contact : contacts) contact.stroke = is_stroke(rows_in(rows, contact), contact);
  return contacts;
}

std::vector<Contact> most_felt(std::vector<Contact> contacts, std::size_t most) {
  std::ranges::stable_sort(contacts, std::ranges::greater{}, &Contact::most_N);
  if (contacts.size() > most) contacts.resize(most);
  std::ranges::stable_sort(contacts, {}, &Contact::from_s);
  return contacts;
}

std::span<const TraceRow> rows_in(std::span<const TraceRow> rows, const Contact& contact) {
  const auto from = std::ranges::find_if(rows, [&](const TraceRow& r) { return r.t_s >= contact.from_s; });
  const auto to = std::find_if(from, rows.end(), [&](const TraceRow& r) { return r.t_s > contact.to_s; });
  return {from, to};
}

std::vector<double> path_length_m(std::span<const TraceRow> rows) {
  std::vector<double> lengths;
  lengths.reserve(rows.size());
  double passed_m = 0.0;  // up to the last corner
  glm::dvec3 corner_m = rows.empty() ? glm::dvec3(0.0) : rows.front().device_m;
  for (const TraceRow& row : rows) {
    const double from_corner_m = glm::length(row.device_m - corner_m);
    lengths.push_back(passed_m + (std::isfinite(from_corner_m) ? from_corner_m : 0.0));
    if (from_corner_m < kPathStep_m) continue;
    if (std::isfinite(from_corner_m)) passed_m += from_corner_m;
    if (std::isfinite(glm::length(row.device_m))) corner_m = row.device_m;
  }
  return lengths;
}

Intervals merged(Intervals a, const Intervals& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::erase_if(a, [](const auto& i) { return !std::isfinite(i.first) || !std::isfinite(i.second); });
  std::ranges::sort(a);
  Intervals out;
  for (const auto& interval : a) {
    if (!out.empty() && interval.first <= out.back().second) {
      out.back().second = std::max(out.back().second, interval.second);
    } else {
      out.push_back(interval);
    }
  }
  return out;
}

Intervals long_in_the_air(const Intervals& touched, double from_s, double to_s) {
  Intervals air;
  if (touched.empty() || !(to_s > from_s)) return air;
  const double whole = to_s - from_s, kept = kKeptShare * whole;
  double begin = from_s;
  const auto add = [&](double a, double b) {
    if (b - a >= kLongShare * whole) air.emplace_back(a, b);
  };
  for (const auto& [from, to] : touched) {
    add(begin, from - kept);
    begin = to + kept;
  }
  add(begin, to_s);
  return air;
}

}  // namespace hybrid
