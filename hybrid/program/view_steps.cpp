// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/view_steps.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace hybrid {
namespace {

// The changes that the second scene has and the first one lacks.
std::string changes_between(const ViewedScene& before, const ViewedScene& after) {
  const auto since = static_cast<std::ptrdiff_t>(before.changes.size());
  return fmt::format("{}", fmt::join(after.changes.begin() + since, after.changes.end(), ", "));
}

}  // namespace

PlayRequest request_of(const WindowInput& input) {
  return {.dragging = input.dragged_goal_m.has_value(),
          .paused = input.paused,
          .speed = input.speed,
          .restarts = input.restarts,
          .single_ticks = input.single_ticks,
          .asked = input.asked,
          .goal_m = input.dragged_goal_m.value_or(glm::dvec3(0.0))};
}

SessionNotes notes_of(const Player& player, double t_s, const std::string& message,
                      const std::optional<ChangeEffect>& effect) {
  return {.real_device = player.is_real(),
          .recorded_s = t_s,
          .refused_edits = player.refused_edits(),
          .unseen_ticks = player.unseen_ticks(),
          .message = message,
          .effect = effect};
}

ChangeEffect show_changed(Window& window, std::unique_ptr<ViewedScene>& viewed,
                          std::unique_ptr<ViewedScene> next, ChangeMade made, ChangeComparison& comparison) {
  made.effect.words = changes_between(*viewed, *next);
  window.add_ticks(viewed->player->samples());
  window.show_scene(next->drawn, made.effect.t_s);
  next->player = std::move(viewed->player);
  std::swap(viewed, next);
  comparison.begin(std::move(next), *viewed, std::move(made.after));
  return std::move(made.effect);
}

void say_error(ModelDifference& difference, ViewFiles& files) {
  if (const std::string error = difference.take_error(); !error.empty())
    files.say("The models are not compared: " + error);
}

void PastView::add_notes(const Player& player, double now_s, SessionNotes& notes) {
  for (const KeptState& kept : player.kept()) {
    notes.kept_s.push_back(now_s - player.time_of(kept));
    notes.kept_bytes += kept.bytes;
  }
}

std::optional<std::size_t> PastView::shown(const Player& player, double now_s, double back_s) {
  if (!(back_s > 0.0) || player.kept().empty()) return {};
  std::size_t nearest = 0;
  const auto apart = [&](std::size_t n) {
    return std::abs(now_s - back_s - player.time_of(player.kept()[n]));
  };
  for (std::size_t n = 1; n < player.kept().size(); ++n) {
    if (apart(n) < apart(nearest)) nearest = n;
  }
  return nearest;
}

const Snapshot& PastView::snapshot(const Player& player, std::size_t n, const AskedPoints* asked,
                                   const std::shared_ptr<const FeltDifference>& difference) {
  const KeptState& kept = player.kept()[n];
  const std::uint64_t number = asked != nullptr ? asked->number : 0;
  if (state_ != kept.state.get() || snapshot_.asked.number != number) {
    player.snapshot_of(kept, snapshot_, asked);
    snapshot_.presses = player.presses_of(*kept.state);
    state_ = kept.state.get();
  }
  snapshot_.difference = difference;
  return snapshot_;
}

void PastView::leave(Window& window) {
  window.act({.verb = ViewVerb::look_back, .numbers = {0.0}});
}

}  // namespace hybrid
