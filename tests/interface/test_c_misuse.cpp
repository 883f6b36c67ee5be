// SPDX-License-Identifier: GPL-3.0-or-later
// Every misuse of the C interface gives a code, and a text with the place and a remedy. The session goes on
// as if the call had not been made.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <thread>

#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/interface/c_session.h"

namespace {

using tests::CSession;
using tests::expect_ok;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

class CMisuse : public tests::SceneFile {
 protected:
  [[nodiscard]] std::filesystem::path scene() const {
    return write("small.toml", "format = 1\n" + tests::block +
                                   "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 4\nposition = "
                                   "[16, 0, 0]\n" +
                                   tests::path);
  }

  // Expects the code, and a text with the function (or the scene's file), the words and a remedy.
  static void expect_refusal(hybrid_code got, hybrid_code code, const std::string& where,
                             const std::string& words = "") {
    const std::string text = hybrid_error_text();
    EXPECT_EQ(got, code) << where << ": " << hybrid_code_name(got) << ": " << text;
    EXPECT_NE(text.find(where), std::string::npos) << text;
    EXPECT_NE(text.find(words), std::string::npos) << text;
    EXPECT_TRUE(text.find(';') != std::string::npos) << "no remedy: " << text;
  }

  static constexpr double kAt_m[3] = {0.0, 0.0, 0.02};
};

// A call with a session. All functions check the session in the same way.
struct SessionCall {
  const char* name;
  std::function<hybrid_code(hybrid_session*)> call;
  bool needs_begin;  // refused before hybrid_begin()
};

const std::vector<SessionCall>& session_calls() {
  static const double at_m[3] = {0.0, 0.0, 0.02};
  static double three[3];
  static hybrid_info info{.size = sizeof info};
  static hybrid_object object{.size = sizeof object};
  static hybrid_felt felt{.size = sizeof felt};
  static hybrid_editable editable{.size = sizeof editable};
  static hybrid_snapshot snapshot{.size = sizeof snapshot};
  static hybrid_error error{.size = sizeof error};
  static const char* text;
  static std::uint64_t hash;
  static std::vector<double> vertices(100'000);
  static std::vector<std::uint32_t> corners(300'000);
  static const std::vector<SessionCall> kCalls{
      {"hybrid_get_info", [](auto* s) { return hybrid_get_info(s, &info); }, false},
      {"hybrid_get_object", [](auto* s) { return hybrid_get_object(s, 0, &object); }, false},
      {"hybrid_note", [](auto* s) { return hybrid_note(s, 0, &text); }, false},
      {"hybrid_editable_value", [](auto* s) { return hybrid_editable_value(s, 0, &editable); }, false},
      {"hybrid_edit", [](auto* s) { return hybrid_edit(s, nullptr, "stiffness", 900.0); }, false},
      {"hybrid_take_snapshot", [](auto* s) { return hybrid_take_snapshot(s, &snapshot); }, false},
      {"hybrid_vertices", [](auto* s) { return hybrid_vertices(s, 0, vertices.data(), 30'000, nullptr); },
       false},
      {"hybrid_triangles", [](auto* s) { return hybrid_triangles(s, 0, corners.data(), 100'000); }, false},
      {"hybrid_tick", [](auto* s) { return hybrid_tick(s, at_m, nullptr, 1e-3, &felt); }, true},
      {"hybrid_play", [](auto* s) { return hybrid_play(s, at_m, 1, 1e-3, &felt); }, true},
      {"hybrid_get_felt", [](auto* s) { return hybrid_get_felt(s, &felt); }, true},
      {"hybrid_object_force", [](auto* s) { return hybrid_object_force(s, 0, three, nullptr); }, true},
      {"hybrid_state_hash", [](auto* s) { return hybrid_state_hash(s, &hash); }, true},
      {"hybrid_publish", [](auto* s) { return hybrid_publish(s); }, true},
      {"hybrid_save_recording", [](auto* s) { return hybrid_save_recording(s, "/nowhere/a.rec"); }, true},
      {"hybrid_measure_error", [](auto* s) { return hybrid_measure_error(s, &error); }, true},
      {"hybrid_begin", [](auto* s) { return hybrid_begin(s, at_m); }, false},
      {"hybrid_close", [](auto* s) { return hybrid_close(s); }, false},
  };
  return kCalls;
}

TEST_F(CMisuse, ANullSessionIsRefused) {
  for (const SessionCall& call : session_calls())
    expect_refusal(call.call(nullptr), HYBRID_NULL_ARGUMENT, call.name, "hybrid_open");
}

TEST_F(CMisuse, AClosedSessionIsRefused) {
  hybrid_session* session = nullptr;
  expect_ok(hybrid_open(scene().c_str(), nullptr, &session));
  expect_ok(hybrid_close(session));
  for (const SessionCall& call : session_calls())
    expect_refusal(call.call(session), HYBRID_CLOSED, call.name, "open another");
}

TEST_F(CMisuse, TheOrderOfCallsIsChecked) {
  const CSession session(scene());
  for (const SessionCall& call : session_calls()) {
    if (call.needs_begin)
      expect_refusal(call.call(session.get()), HYBRID_WRONG_ORDER, call.name, "hybrid_begin");
  }
  session.begin({0.0, 0.0, 0.02});
  hybrid_felt felt{.size = sizeof felt};
  double force_N[3];
  expect_refusal(hybrid_get_felt(session.get(), &felt), HYBRID_WRONG_ORDER, "hybrid_get_felt", "hybrid_tick");
  expect_refusal(hybrid_object_force(session.get(), 0, force_N, nullptr), HYBRID_WRONG_ORDER,
                 "hybrid_object_force", "hybrid_tick");
  expect_refusal(hybrid_begin(session.get(), kAt_m), HYBRID_WRONG_ORDER, "hybrid_begin", "another");
}

TEST_F(CMisuse, BadPosesAndTimesDoNoTick) {
  const CSession session(scene()), untouched(scene());
  for (const CSession* s : {&session, &untouched}) {
    const double inside[3] = {0.016, 0.0, 0.0};
    expect_refusal(hybrid_begin(s->get(), inside), HYBRID_REFUSED, "small.toml", "inside something rigid");
    s->begin({0.0, 0.0, 0.02});
  }
  hybrid_felt felt{.size = sizeof felt};
  const auto tick = [&](const double* at_m, const double* turned, double dt_s) {
    return hybrid_tick(session.get(), at_m, turned, dt_s, &felt);
  };
  for (const double bad : {kNaN, kInfinity, -kInfinity, 1e7, -1e300}) {
    for (int d = 0; d < 3; ++d) {
      double at_m[3] = {0.0, 0.0, 0.004};
      at_m[d] = bad;
      expect_refusal(tick(at_m, nullptr, 1e-3), HYBRID_BAD_VALUE, "hybrid_tick", "meters");
      double path_m[9] = {0.0, 0.0, 0.004, 0.0, 0.0, 0.004};
      path_m[6 + d] = bad;
      expect_refusal(hybrid_play(session.get(), path_m, 3, 1e-3, nullptr), HYBRID_BAD_VALUE, "hybrid_play",
                     "no tick");
    }
  }
  for (const double dt_s : {0.0, -1e-3, 0.11, 1e9, kNaN, kInfinity}) {
    expect_refusal(tick(kAt_m, nullptr, dt_s), HYBRID_BAD_VALUE, "hybrid_tick", "dt_s");
    expect_refusal(hybrid_play(session.get(), kAt_m, 1, dt_s, nullptr), HYBRID_BAD_VALUE, "hybrid_play",
                   "dt_s");
  }
  const double zero[4] = {0, 0, 0, 0}, nan[4] = {1, 0, kNaN, 0}, long_one[4] = {1, 1, 0, 0};
  for (const double* turned : {zero, nan, long_one})
    expect_refusal(tick(kAt_m, turned, 1e-3), HYBRID_BAD_VALUE, "hybrid_tick", "quaternion");
  expect_refusal(tick(nullptr, nullptr, 1e-3), HYBRID_NULL_ARGUMENT, "hybrid_tick");
  expect_refusal(hybrid_play(session.get(), nullptr, 3, 1e-3, nullptr), HYBRID_NULL_ARGUMENT, "hybrid_play");
  felt.size = 0;
  expect_refusal(tick(kAt_m, nullptr, 1e-3), HYBRID_BAD_STRUCT, "hybrid_tick", "size");
  expect_refusal(hybrid_play(session.get(), kAt_m, 1, 1e-3, &felt), HYBRID_BAD_STRUCT, "hybrid_play", "size");
  EXPECT_EQ(session.state_hash(), untouched.state_hash()) << "a refused call changed the session";
  const double half[4] = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  felt.size = sizeof felt;
  expect_ok(tick(kAt_m, half, 1e-3));
  EXPECT_EQ(felt.tick, 0U) << "the first tick of this session";
}

TEST_F(CMisuse, ScenesThatAreRefusedSayWhere) {
  hybrid_session* session = nullptr;
  const auto open = [&](const std::string& file) { return hybrid_open(file.c_str(), nullptr, &session); };
  expect_refusal(open("gone.toml"), HYBRID_REFUSED, "gone.toml", "no such file");
  expect_refusal(
      open(write("yuong.toml", "format = 1\n[material.gel]\nyuong = 1\n" + tests::block + tests::path)),
      HYBRID_REFUSED, "yuong.toml:3:1", "did you mean 'young'");
  expect_refusal(hybrid_open_text("format = 2\n", folder_.c_str(), nullptr, &session), HYBRID_REFUSED,
                 "<text>:1:1", "format = 1");
  expect_refusal(
      hybrid_open_text("format = 1\n[[rigid]]\nmesh = \"gone.obj\"\n[path]\nkind = \"press\"\nfrom = [0, "
                       "0, 9]\nto = [0, 0, 0]\n",
                       folder_.c_str(), nullptr, &session),
      HYBRID_REFUSED, "gone.obj");
  expect_refusal(
      open(write("driver.toml", "format = 1\n[device]\nmodel = \"phantom\"\n" + tests::ball + tests::path)),
      HYBRID_REFUSED, "driver.toml", "premium-1.5");
  EXPECT_EQ(session, nullptr);
  expect_refusal(hybrid_open(nullptr, nullptr, &session), HYBRID_NULL_ARGUMENT, "hybrid_open");
  expect_refusal(hybrid_open("a.toml", nullptr, nullptr), HYBRID_NULL_ARGUMENT, "hybrid_open");
  expect_refusal(hybrid_open_text(nullptr, ".", nullptr, &session), HYBRID_NULL_ARGUMENT, "hybrid_open_text");
  expect_refusal(hybrid_open_text("format = 1", nullptr, nullptr, &session), HYBRID_NULL_ARGUMENT,
                 "hybrid_open_text");
}

TEST_F(CMisuse, OptionsOutOfRangeAreRefused) {
  hybrid_session* session = nullptr;
  const auto open = [&](hybrid_options options) { return hybrid_open(scene().c_str(), &options, &session); };
  constexpr std::uint32_t kSize = sizeof(hybrid_options);
  expect_refusal(open({}), HYBRID_BAD_STRUCT, "hybrid_open", "size");
  expect_refusal(open({.size = kSize, .relaxation = 3}), HYBRID_BAD_VALUE, "hybrid_open", "relaxation");
  for (const double hz : {-1.0, 99.0, 1e6, kNaN, kInfinity}) {
    expect_refusal(open({.size = kSize, .rate_hz = hz}), HYBRID_BAD_VALUE, "hybrid_open", "rate_hz");
    if (hz == 99.0) continue;
    expect_refusal(open({.size = kSize, .surfaces_hz = hz}), HYBRID_BAD_VALUE, "hybrid_open", "surfaces_hz");
  }
  const CSession endless(scene(), {.recorded_ticks = std::numeric_limits<std::uint64_t>::max()});
  expect_refusal(hybrid_begin(endless.get(), kAt_m), HYBRID_NO_MEMORY, "hybrid_begin", "recorded_ticks");
}

TEST_F(CMisuse, NamesNumbersAndBuffersAreChecked) {
  const CSession session(scene());
  hybrid_session* const s = session.get();
  hybrid_object object{.size = sizeof object};
  hybrid_editable editable{.size = sizeof editable};
  const char* text = nullptr;
  double vertices[3];
  std::uint32_t corners[3];
  expect_refusal(hybrid_get_object(s, 2, &object), HYBRID_NOT_FOUND, "hybrid_get_object");
  expect_refusal(hybrid_note(s, 1000, &text), HYBRID_NOT_FOUND, "hybrid_note");
  expect_refusal(hybrid_note(s, 0, nullptr), HYBRID_NULL_ARGUMENT, "hybrid_note");
  expect_refusal(hybrid_editable_value(s, 1000, &editable), HYBRID_NOT_FOUND, "hybrid_editable_value");
  expect_refusal(hybrid_vertices(s, 9, vertices, 1, nullptr), HYBRID_NOT_FOUND, "hybrid_vertices");
  expect_refusal(hybrid_vertices(s, 0, vertices, 1, nullptr), HYBRID_TOO_SMALL, "hybrid_vertices",
                 "1 vertices");
  expect_refusal(hybrid_triangles(s, 0, corners, 1), HYBRID_TOO_SMALL, "hybrid_triangles", "1 triangles");
  expect_refusal(hybrid_triangles(s, 0, nullptr, 0), HYBRID_NULL_ARGUMENT, "hybrid_triangles");
  expect_refusal(hybrid_get_info(s, nullptr), HYBRID_NULL_ARGUMENT, "hybrid_get_info");
  object.size = 4;
  expect_refusal(hybrid_get_object(s, 0, &object), HYBRID_BAD_STRUCT, "hybrid_get_object");
  expect_refusal(hybrid_edit(s, "blcok", "damping", 1.0), HYBRID_NOT_FOUND, "hybrid_edit", "ball damping");
  expect_refusal(hybrid_edit(s, "ball", "stiffness", 1.0), HYBRID_NOT_FOUND, "hybrid_edit", "NULL stiffness");
  expect_refusal(hybrid_edit(s, "ball", nullptr, 1.0), HYBRID_NULL_ARGUMENT, "hybrid_edit");
  expect_refusal(hybrid_edit(s, nullptr, "stiffness", kNaN), HYBRID_BAD_VALUE, "hybrid_edit", "out of range");
  for (int n = 0; n < 256; ++n) expect_ok(hybrid_edit(s, nullptr, "stiffness", 500.0));
  expect_refusal(hybrid_edit(s, nullptr, "stiffness", 500.0), HYBRID_FULL, "hybrid_edit", "tick before");
}

TEST_F(CMisuse, WhatASessionWasNotOpenedForIsRefused) {
  const CSession plain(scene(), {.without_surfaces = 1});
  plain.begin({0.0, 0.0, 0.02});
  (void)plain.tick({0.0, 0.0, 0.019});
  hybrid_snapshot snapshot{.size = sizeof snapshot};
  hybrid_error error{.size = sizeof error};
  expect_refusal(hybrid_publish(plain.get()), HYBRID_NOT_AVAILABLE, "hybrid_publish", "without_surfaces");
  expect_refusal(hybrid_take_snapshot(plain.get(), &snapshot), HYBRID_NOT_AVAILABLE, "hybrid_take_snapshot");
  expect_refusal(hybrid_save_recording(plain.get(), (folder_ / "a.rec").c_str()), HYBRID_NOT_AVAILABLE,
                 "hybrid_save_recording", "recorded_ticks");
  expect_refusal(hybrid_measure_error(plain.get(), &error), HYBRID_NOT_AVAILABLE, "hybrid_measure_error",
                 "with_error");

  const CSession recorded(scene(), {.recorded_ticks = 2});
  recorded.begin({0.0, 0.0, 0.02});
  (void)recorded.tick({0.0, 0.0, 0.019});
  expect_refusal(hybrid_save_recording(recorded.get(), (folder_ / "no" / "a.rec").c_str()), HYBRID_FILE,
                 "a.rec");
  expect_refusal(hybrid_save_recording(recorded.get(), nullptr), HYBRID_NULL_ARGUMENT,
                 "hybrid_save_recording");
  expect_ok(hybrid_tick(recorded.get(), kAt_m, nullptr, 2e-3, nullptr));
  expect_refusal(hybrid_save_recording(recorded.get(), (folder_ / "a.rec").c_str()), HYBRID_NOT_AVAILABLE,
                 "hybrid_save_recording", "1 of 2 ticks");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.rec"));
}

// A call that meets another one of its group is refused, and the other one goes on.
TEST_F(CMisuse, TwoThreadsInOneGroupAreRefused) {
  hybrid_session* session = nullptr;
  expect_ok(hybrid_open(scene().c_str(), nullptr, &session));
  expect_ok(hybrid_begin(session, kAt_m));
  const std::vector<glm::dvec3> path_m(50'000, {0.0, 0.0, 0.02});
  std::atomic<bool> over{false};
  std::thread servo([&] {
    hybrid_code code = HYBRID_BUSY;  // the other thread's probes may come first
    while (code == HYBRID_BUSY) code = hybrid_play(session, &path_m.front().x, path_m.size(), 1e-3, nullptr);
    expect_ok(code);
    over = true;
  });
  bool tick_refused = false, close_refused = false;
  std::uint64_t hash = 0;
  while (!over && !(tick_refused && close_refused)) {
    if (hybrid_state_hash(session, &hash) != HYBRID_BUSY) continue;
    expect_refusal(HYBRID_BUSY, HYBRID_BUSY, "hybrid_state_hash", "one thread");
    tick_refused = true;
    const hybrid_code code = hybrid_close(session);
    ASSERT_EQ(code, HYBRID_BUSY) << "the test's path is too short for this machine";
    close_refused = true;
  }
  servo.join();
  EXPECT_TRUE(tick_refused && close_refused);
  hybrid_felt felt{.size = sizeof felt};
  expect_ok(hybrid_get_felt(session, &felt));
  EXPECT_EQ(felt.tick, path_m.size() - 1);
  expect_ok(hybrid_close(session));
}

// Each thread has the text of its own last failure.
TEST_F(CMisuse, ErrorTextsBelongToTheirThreads) {
  hybrid_info info{};
  EXPECT_EQ(hybrid_get_info(nullptr, &info), HYBRID_NULL_ARGUMENT);
  std::thread([] { EXPECT_STREQ(hybrid_error_text(), ""); }).join();
  EXPECT_NE(std::string(hybrid_error_text()).find("hybrid_get_info"), std::string::npos);
}

TEST(CLibrary, NamesItsVersionCodesAndFaults) {
  EXPECT_EQ(hybrid_abi_version(), static_cast<std::uint32_t>(HYBRID_ABI_VERSION));
  EXPECT_EQ(
      std::count(hybrid_version(), hybrid_version() + std::char_traits<char>::length(hybrid_version()), '.'),
      2);
  EXPECT_STREQ(hybrid_code_name(HYBRID_BUSY), "HYBRID_BUSY");
  EXPECT_STREQ(hybrid_code_name(HYBRID_INTERNAL), "HYBRID_INTERNAL");
  EXPECT_STREQ(hybrid_code_name(static_cast<hybrid_code>(99)), "unknown code");
  EXPECT_STREQ(hybrid_fault_text(0), "");
  EXPECT_NE(std::string(hybrid_fault_text(2)).find("use a smaller tool"), std::string::npos);
}

}  // namespace
