// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/truth_text.h"

#include <fmt/format.h>

namespace hybrid {
namespace {

using Json = nlohmann::ordered_json;

Json ticks_json(const FeltError& e) {
  return {{"ticks", e.ticks},
          {"jnd_p50", e.p50_jnd},
          {"jnd_p99", e.p99_jnd},
          {"jnd_max", e.max_jnd},
          {"max_t_s", e.ticks > 0 ? Json(e.max_t_s) : Json(nullptr)}};
}

}  // namespace

std::string in_words(const SettingError& error) {
  const auto one = [](const FeltError& e) { return e.ticks > 0 ? fmt::format("{:.2f}", e.p99_jnd) : "-"; };
  return fmt::format("{} JND moving, {} still", one(error.moving), one(error.still));
}

std::string truth_words(const Truth& truth) {
  std::string text = fmt::format(
      "truth: {}, no thinning, played {} times slower; its own error (p99, extrapolated)\n"
      "  of its spacing, from voxels twice as wide{}: {}\n"
      "  of its speed, from twice the speed: {}\n",
      truth.words, kTruthSlower, truth.own_shape ? " of the same shape" : ", whose shape differs",
      in_words(truth.spacing), in_words(truth.rest));
  if (truth.rest.worst_jnd() > 1.0)
    text += "  the truth does not come to rest within 1 JND: played slower still, its force differs\n";
  if (truth.shape) {
    text +=
        fmt::format("  apart from that: read at half the spacing the objects have other shapes, felt by {}\n",
                    in_words(*truth.shape));
  }
  return text;
}

Json to_json(const SettingError& error) {
  return {{"moving", ticks_json(error.moving)}, {"still", ticks_json(error.still)}};
}

Json to_json(const Truth& truth) {
  return {{"setting", truth.words},
          {"slower", kTruthSlower},
          {"spacing_error", to_json(truth.spacing)},
          {"own_shape", truth.own_shape},
          {"rest_error", to_json(truth.rest)},
          {"error_jnd", truth.error_jnd()},
          {"shape", truth.shape ? to_json(*truth.shape) : Json(nullptr)}};
}

}  // namespace hybrid
