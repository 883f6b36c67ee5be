// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/validate/validate.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/validate/cases.h"

namespace hybrid {

bool ValidationRow::inside() const {
  if (bound) return std::fabs(difference()) <= *bound;
  return low && high && ours >= *low && ours <= *high;
}

void say(const ValidationOptions& options, const std::string& text) {
  if (options.progress) options.progress(text);
}

const char* words_of(Energy energy) {
  return energy == Energy::trilinear ? "bricks" : "links";
}

ValidationReport validate(const ValidationOptions& options) {
  set_flush_to_zero();
  const auto start = std::chrono::steady_clock::now();
  ValidationReport report;
  add_closed_forms(options, report);
  add_loop_cases(options, report);
  add_finite_elements(options, report);
  add_silicones(options, report);
  add_probed_tissues(options, report);
  add_cartilage(options, report);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return report;
}

ValidationCount count(const ValidationReport& report) {
  ValidationCount sum;
  for (const ValidationRow& row : report.rows) {
    ++(row.stated ? sum.stated : sum.beside);
    if (!row.inside()) ++(row.stated ? sum.failed : sum.beside_outside);
  }
  return sum;
}

std::string verdict(const ValidationReport& report) {
  const ValidationCount sum = count(report);
  std::string text =
      sum.failed == 0 ? fmt::format("All {} cases that are stated to hold do", sum.stated)
                      : fmt::format("{} of {} cases that are stated to hold do not", sum.failed, sum.stated);
  return text + fmt::format("; of {} shown beside them {} lie outside, each with its reason.", sum.beside,
                            sum.beside_outside);
}

}  // namespace hybrid
