// SPDX-License-Identifier: GPL-3.0-or-later
// The live window: a session on a thread of its own (live_session.h).
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

#include "device/loop/stop_signal.h"
#include "hybrid/program/view/offered_scenes.h"
#include "hybrid/program/view/thread_rates.h"
#include "hybrid/program/view_files.h"
#include "hybrid/program/view_steps.h"
#include "hybrid/session/live_session.h"
#include "hybrid/session/outputs.h"
#include "hybrid/window/frame_meter.h"

namespace hybrid {
namespace {

// Keeps what the window shows of the state between two ticks. To read it the session is held for a moment: a
// simulated hand does not notice, because held time does not count. A real hand would, so with a real device
// it is read only while the session is paused.
template <class Value>
class HeldWatch {
 public:
  template <class Read>
  const Value& follow(bool wanted, const PlayRequest& request, const Player& player, LiveSession& session,
                      std::uint64_t tick, const Read& read) {
    const auto now = std::chrono::steady_clock::now();
    if (!wanted || (player.is_real() && !request.paused)) {
      value_ = {};
      tick_ = kNever;
    } else if (tick != tick_ && now >= next_ && session.hold(request)) {
      value_ = read();
      session.ask(request);
      tick_ = tick;
      const auto end = std::chrono::steady_clock::now();
      next_ = end + std::max<std::chrono::steady_clock::duration>(kEvery, kRest * (end - now));
    }
    return value_;
  }

 private:
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  static constexpr std::chrono::milliseconds kEvery{200};  // least time between two readings
  static constexpr int kRest = 19;  // the session is held for at most one part in 20 of the time
  Value value_{};
  std::uint64_t tick_ = kNever;  // of value_
  std::chrono::steady_clock::time_point next_{};
};

// The window of a session, with the user's files, script and reloads of the scene.
struct LiveWindow {
  const ViewCommand& command;
  Window& window;
  ViewFiles files;
  std::chrono::steady_clock::time_point began;
  ViewScript& script;
  SceneReload reload;
  SceneChanger changer;
  SceneOpener opener;
  ModelDifference difference;
  ChangeComparison comparison{};
  FrameMeter meter{};
  std::string lost{};  // why the window cannot be shown any more; empty: it can
  std::optional<ChangeEffect> effect{};
  std::unique_ptr<OpenedScene> opened{};  // the scene in which the window goes on
  std::vector<OfferedScene> recent = recent_scenes(), shipped = shipped_scenes();
  ThreadRates rates{};
  std::vector<MapBox> boxes{};
};

SessionNotes notes_of(const LiveWindow& live, const Player& player, double t_s) {
  SessionNotes notes = notes_of(player, t_s, live.files.message(), live.effect);
  notes.building = live.changer.building();
  notes.comparing = live.difference.in_words();
  if (!notes.building.empty()) notes.message = notes.building + "; the session goes on meanwhile";
  notes.recent = live.recent;
  notes.shipped = live.shipped;
  notes.rates = live.rates.rates();
  notes.boxes = live.boxes;
  if (live.opener.loading()) notes.message = "opening the scene; the session goes on meanwhile";
  if (live.reload.loading()) notes.message = "loading the scene again; the session goes on meanwhile";
  PastView::add_notes(player, t_s, notes);
  if (!live.reload.error().empty())
    notes.error = live.reload.error() + "\nThe session goes on with the scene as it was.";
  return notes;
}

// Opens the files that the user dropped or chose: a scene in place of this one, a mesh within it.
void open_files(LiveWindow& live, const Player& player, const std::vector<std::filesystem::path>& files) {
  for (const std::filesystem::path& file : files) {
    const DroppedKind kind = kind_of_file(file);
    if (kind == DroppedKind::volume || kind == DroppedKind::other) {
      live.files.say_error(why_not_opened(file));
    } else if (player.is_real()) {
      live.files.say_error(
          "With a real device the scene stays as it is while it is felt. Close the window first.");
    } else if (kind == DroppedKind::scene) {
      live.opener.ask(file);
    } else {
      live.changer.add_mesh(file);
    }
  }
  live.opened = live.opener.poll();
  if (const std::string error = live.opener.take_error(); !error.empty())
    live.files.say_error(error + "\nThe session goes on with the scene as it was.");
}

// The session goes on in the changed scene once that scene is built. Returns true if the scene was changed.
bool take_changed_scene(LiveWindow& live, std::unique_ptr<ViewedScene>& viewed, LiveSession& session,
                        const PlayRequest& request) {
  try {
    auto next = live.changer.poll(*viewed);
    if (next == nullptr) return false;
    ChangeMade made;
    session.change(request, [&] {
      made = viewed->player->change_scene(next->scene, next->built, next->drawn, next->text);
    });
    live.effect = show_changed(live.window, viewed, std::move(next), std::move(made), live.comparison);
    return true;
  } catch (const std::exception& e) {
    live.files.say_error(std::string("The scene is as it was: ") + e.what());
    return false;
  }
}

void go_back(LiveWindow& live, LiveSession& session, const PlayRequest& request, Player& player,
             std::size_t kept) {
  try {
    session.change(request, [&] { player.go_back(kept); });
    PastView::leave(live.window);
  } catch (const std::exception& e) {
    live.files.say(std::string("The session goes on as it was: ") + e.what());
  }
}

// Keeps the session's state if one is due. The session stands still for at most one part in 20 of the time.
void keep_state(LiveSession& session, const PlayRequest& request, Player& player, double now_s,
                std::chrono::steady_clock::time_point& next) {
  constexpr int rest = 19;
  const auto begin = std::chrono::steady_clock::now();
  if (begin < next || request.paused || !player.keeps_at(now_s)) return;
  session.between_ticks(request, [&] { player.keep_state(); });
  const auto end = std::chrono::steady_clock::now();
  next = end + rest * (end - begin);
}

// Runs the window on this thread and the session on another. Ends when the window closes, or when a changed
// scene is ready in `next`. Returns the device's events.
device::ServoReport play_scene(LiveWindow& live, std::unique_ptr<ViewedScene>& viewed, BlackBox& box,
                               std::unique_ptr<ViewedScene>& next) {
  LiveSession session(*viewed->player, box);
  Player& player = *viewed->player;
  Snapshot shown;
  HeldWatch<std::vector<PairPress>> presses;
  HeldWatch<std::vector<MapBox>> boxes;
  PastView past;
  RestWish rest;
  auto keep_next = std::chrono::steady_clock::now();
  bool open = true;
  std::uint64_t at_rest = 0;  // forces at rest that were found
  while (open && !session.ended() && next == nullptr && live.opened == nullptr) {
    live.meter.begin(session.processor_time_s());
    live.script.play(std::chrono::duration<double>(std::chrono::steady_clock::now() - live.began).count(),
                     live.window);
    const WindowInput input = live.window.take_input();
    PlayRequest request = request_of(input);
    for (const Edit& edit : input.edits) player.edit(edit);
    if (player.is_real() && !input.changes.empty())
      live.files.say("The scene is as it was: with a real device it does not change while it is felt.");
    for (const SceneChange& change : input.changes) {
      if (!player.is_real()) live.changer.ask(change);
    }
    if (take_changed_scene(live, viewed, session, request)) {
      live.difference.forget();
      request.asked = nullptr;
      presses = {};
      boxes = {};
    }
    rest.follow(input.compares_with_rest, player, live.files,
                [&](const auto& change) { session.between_ticks(request, change); });
    if (auto forces = live.comparison.poll()) live.effect->forces = forces;
    const auto back = PastView::shown(player, shown.t_s, input.back_s);
    if (back && input.go_on) {
      go_back(live, session, request, player, *back);
      request.asked = nullptr;
    }
    const bool shows_past = back && !input.go_on;
    if (!shows_past) past.forget();  // the kept states change meanwhile
    request.paused = request.paused || shows_past;
    session.ask(request);
    if (!shows_past) keep_state(session, request, player, shown.t_s, keep_next);
    session.shown(viewed->drawn, shown);
    shown.presses = presses.follow(input.wants_presses, request, player, session, shown.tick,
                                   [&] { return player.presses(); });
    live.boxes = boxes.follow(input.wants_boxes, request, player, session, shown.tick,
                              [&] { return map_boxes(*viewed->built.world, player.state()); });
    if (input.comparison) live.difference.ask(*input.comparison, *viewed, shown);
    shown.difference = live.difference.found();
    say_error(live.difference, live.files);
    at_rest += live.window.add_ticks(player.samples(), player.at_rest());
    live.rates.add({.ticks = shown.tick,
                    .answers_at_rest = at_rest,
                    .servo_s = session.servo_s(),
                    .relaxation_s = session.relaxation_s(),
                    .has_tissue = has_soft(viewed->drawn),
                    .compares_with_rest = input.compares_with_rest});
    try {
      open =
          live.window.frame(shows_past ? past.snapshot(player, *back, request.asked.get(), shown.difference)
                                       : std::as_const(shown),
                            notes_of(live, player, shown.t_s));
    } catch (const std::exception& e) {
      live.lost = e.what();
      break;
    }
    live.files.save_what_was_asked(live.window, input, *viewed, shown, [&] { return session.hold(request); });
    open_files(live, player, input.opened);
    if (input.reload) live.reload.ask();
    if (!player.is_real()) next = live.reload.poll();
    live.meter.end(session.processor_time_s());
  }
  live.comparison.cancel();
  return session.stop();
}

// Plays a scene, and the new scene each time that the scene's file has changed.
device::ServoReport play_scenes(LiveWindow& live, std::unique_ptr<ViewedScene> viewed, BlackBox& box) {
  for (;;) {
    std::unique_ptr<ViewedScene> next;
    device::ServoReport report = play_scene(live, viewed, box, next);
    if (live.opened != nullptr) {  // before the old scene is dropped
      live.changer.cancel();
      live.difference.forget();
      live.window.show_scene(live.opened->viewed->drawn);
      live.window.act({.verb = ViewVerb::look, .text = "all"});
      return report;
    }
    if (next == nullptr) {
      if (!live.files.save_at_end(*viewed)) report.messages.emplace_back("the session was not recorded");
      return report;
    }
    live.changer.cancel();
    live.difference.forget();
    live.effect.reset();
    live.window.show_scene(next->drawn);
    viewed = std::move(next);
    print_notes(viewed->built);
    if (live.files.message().empty()) live.files.say("The scene was loaded again.");
  }
}

}  // namespace

LiveEnd play_live(const ViewCommand& command, std::unique_ptr<ViewedScene> viewed, Window& window,
                  ViewScript& script, std::chrono::steady_clock::time_point began) {
  const auto kept = open_black_box_file({}, command.scene, true, viewed->scene.rate_hz);
  LiveWindow live{command,
                  window,
                  ViewFiles(command),
                  began,
                  script,
                  SceneReload(command, viewed->text),
                  SceneChanger(command),
                  SceneOpener(command),
                  ModelDifference(command, true)};
  const device::ServoReport report = play_scenes(live, std::move(viewed), kept->box());
  fmt::print("{}\n", live.meter.in_words());
  if (!live.lost.empty()) fmt::print(stderr, "the session ended: {}\n", live.lost);
  print_fault(*kept);
  for (const std::string& message : report.messages) std::fprintf(stderr, "device: %s\n", message.c_str());
  if (report.end == device::ServoEnd::stopped) return {exit_status_of_signal(device::stop_signal())};
  if (report.end == device::ServoEnd::lost || !live.lost.empty()) return {1};
  return {0, std::move(live.opened)};
}

}  // namespace hybrid
