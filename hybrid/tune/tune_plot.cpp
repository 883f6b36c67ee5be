// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/tune_plot.h"

#include "hybrid/plot/cost_error_plot.h"

namespace hybrid {

std::string tune_svg(const TuneResult& result, const std::string& title) {
  CostErrorFigure figure{
      .title = title,
      .subtitle =
          "Error against the truth over the cost of a tick. Line: settings that no other one beats; grey: "
          "beaten; area of a mark: memory.",
      .line = result.front,
      .budget_us = result.bounds.budget_us,
      .error_jnd = result.bounds.error_jnd,
      .error_axis = "error, p99, the larger of moving and still (JND)"};
  for (std::size_t n = 0; n < result.settings.size(); ++n) {
    const TunedSetting& s = result.settings[n];
    const bool chosen = n == result.chosen, beaten = !s.whole() || s.dominated_by.has_value();
    figure.marks.push_back({.words = s.words + (chosen  ? " (chosen)"
                                                : s.own ? " (as it is)"
                                                        : ""),
                            .cost_us = s.whole_session ? s.tick_us.p999 : 0.0,
                            .error_jnd = s.error.worst_jnd(),
                            .memory_bytes = s.memory_bytes,
                            .kind = beaten ? CostErrorMark::Kind::grey : CostErrorMark::Kind::usual,
                            .ringed = chosen});
  }
  return cost_error_svg(figure);
}

}  // namespace hybrid
