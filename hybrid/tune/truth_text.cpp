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
      "truth: {}, no thinning, at rest in poses along the path\n"
      "  its own error (p99, from holding each pose half as long): {}\n",
      truth.words, in_words(truth.rest));
  text += "the scene itself, at any setting (p99)\n  its voxels beside ever finer ones of the same shape";
  text += truth.spacing ? fmt::format(", extrapolated: {}\n", in_words(*truth.spacing))
                        : fmt::format(": not measured, {}\n", truth.not_measured);
  if (truth.shape)
    text += fmt::format("  its shapes beside those read at half the spacing: {}\n", in_words(*truth.shape));
  return text;
}

Json to_json(const SettingError& error) {
  return {{"moving", ticks_json(error.moving)}, {"still", ticks_json(error.still)}};
}

Json to_json(const Truth& truth) {
  const auto optional = [](const std::optional<SettingError>& error) {
    return error ? to_json(*error) : Json(nullptr);
  };
  return {{"setting", truth.words},
          {"rest_error", to_json(truth.rest)},
          {"error_jnd", truth.error_jnd()},
          {"scene",
           {{"spacing", optional(truth.spacing)},
            {"shape", optional(truth.shape)},
            {"not_measured", truth.not_measured}}}};
}

}  // namespace hybrid
