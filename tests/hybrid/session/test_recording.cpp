// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded session replays bit for bit. A damaged file is refused or detected.
#include "hybrid/session/recording.h"
#include "hybrid/tick/tissue/async_relaxation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <sstream>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/tick/tissue/work_budget.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/shared_data.h"

namespace {

using hybrid::Recording;

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

Recording recording_of(const std::filesystem::path& file, const hybrid::Scene& scene,
                       const hybrid::SessionResult& result, bool asynchronous) {
  return {.scene_file = file,
          .scene_text = read(file),
          .dt_s = result.dt_s,
          .device = hybrid::scene_limits(scene),
          .async_relaxation = asynchronous,
          .state_hash = result.state_hash,
          .start_m = result.start_m,
          .ticks = result.recording};
}

Recording record(const std::filesystem::path& file, std::optional<double> seconds, bool asynchronous = false,
                 bool realtime = false) {
  const hybrid::Scene scene = hybrid::load_scene(file);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  hybrid::SessionOptions options;
  options.seconds = seconds;
  options.keep_rows = false;
  options.async_relaxation = asynchronous;
  options.realtime = realtime;
  const hybrid::SessionResult result = hybrid::run_session(scene, built, options);
  EXPECT_GT(result.contact_ticks, 50U);
  EXPECT_GE(result.async_results, asynchronous ? 10U : 0U);
  return recording_of(file, scene, result, asynchronous);
}

class RecordingFile : public tests::SceneFile {
 protected:
  // A small scene that runs quickly: tissue with a rigid object on it.
  std::filesystem::path small_scene() const {
    return write("small.toml",
                 "format = 1\n" + tests::block +
                     "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 4\nposition = [9, 0, 8]\n"
                     "[path]\nkind = \"waypoints\"\nspeed = 100\npoints = [[0, 0, 20], [0, 0, 4, 0.2], [8, "
                     "0, 12, 0.1]]\n");
  }
  std::string refusal_of(const std::string& bytes) const {
    const auto file = write("bad.rec", bytes);
    try {
      (void)hybrid::load_recording(file);
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("bad.rec"), std::string::npos) << error.what();
      return error.what();
    }
    return {};
  }
};

class ShippedScene : public RecordingFile, public ::testing::WithParamInterface<const char*> {};

TEST_P(ShippedScene, RunSavedLoadedAndReplayedIsTheSameToTheBit) {
  const std::string name = GetParam();
  const auto file = tests::source_folder / "scenes" / (name + ".toml");
  Recording recorded;
  try {
    recorded = record(file, name == "head" ? std::optional<double>(1.2) : std::nullopt);
  } catch (const hybrid::SceneError& error) {
    NEED_DATA(name != "head", error.what());
    throw;
  }
  hybrid::save_recording(folder_ / "a.rec", recorded);
  const Recording loaded = hybrid::load_recording(folder_ / "a.rec");
  ASSERT_EQ(loaded.ticks.size(), recorded.ticks.size());
  EXPECT_EQ(loaded.scene_file, file);
  const hybrid::ReplayResult result = hybrid::replay(loaded, {});
  EXPECT_TRUE(result.equal) << "parts at tick " << result.first_difference;
  EXPECT_EQ(result.ticks, recorded.ticks.size());
  EXPECT_EQ(result.state_hash, recorded.state_hash);
}
INSTANTIATE_TEST_SUITE_P(Replays, ShippedScene,
                         ::testing::Values("cube", "sheet", "two-soft", "head", "thin-sheet",
                                           "textured-plate", "moving", "pushed-tissue", "dropped-weight",
                                           "layers"),
                         [](const auto& scene) {
                           std::string name = scene.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

// The arrival of the relaxation thread's results depends on the machine, and is recorded.
TEST_F(RecordingFile, WithTheRelaxationThreadItIsTheSameToTheBit) {
  for (const bool realtime : {true, false}) {
    const Recording recorded = record(small_scene(), std::nullopt, true, realtime);
    hybrid::save_recording(folder_ / "a.rec", recorded);
    const Recording loaded = hybrid::load_recording(folder_ / "a.rec");
    EXPECT_TRUE(loaded.async_relaxation);
    const hybrid::ReplayResult result = hybrid::replay(loaded, {});
    EXPECT_TRUE(result.equal) << "parts at tick " << result.first_difference
                              << (realtime ? ", in real time" : "");
    EXPECT_EQ(result.state_hash, recorded.state_hash);
  }
}

// As with `run --device`. The ideal device has neither passivity control nor a limit on energy.
TEST_F(RecordingFile, TheReplayHasTheDeviceThatWasUsedNotTheScenes) {
  using enum device::DeviceModel;
  struct Case {
    const char* written;
    device::DeviceModel used;
  };
  for (const Case& c : {Case{"[device]\nmodel = \"touch\"\n[safety]\npassivity = true\n", ideal},
                        Case{"[device]\nmodel = \"ideal\"\n", touch}}) {
    const auto file = write("other.toml", read(small_scene()) + c.written);
    hybrid::Scene scene = hybrid::load_scene(file);
    scene.device_model = c.used;
    hybrid::BuiltScene built = hybrid::build_scene(scene);
    hybrid::SessionOptions options;
    options.keep_rows = false;
    const hybrid::SessionResult result = hybrid::run_session(scene, built, options);
    hybrid::save_recording(folder_ / "a.rec", recording_of(file, scene, result, false));
    const hybrid::ReplayResult again = hybrid::replay(hybrid::load_recording(folder_ / "a.rec"), {});
    EXPECT_TRUE(again.equal) << "parts at tick " << again.first_difference;
    EXPECT_EQ(again.state_hash, result.state_hash);
  }
}

// ---- edits ----

std::vector<hybrid::Edit> some_edits(const hybrid::World& world) {
  using enum hybrid::EditedQuantity;
  std::vector<hybrid::Edit> edits;
  const auto at = [&](std::uint64_t tick, std::uint32_t object, hybrid::EditedQuantity quantity,
                      double value) {
    edits.push_back({tick, object, quantity, value});
  };
  at(0, hybrid::Edit::kTool, coupling_stiffness, 700.0);
  at(150, 0, static_friction, 0.6);
  at(150, 0, damping, 1.5);
  at(200, hybrid::Edit::kTool, max_force, 0.5 * world.limits.max_force_N);
  if (!world.soft.empty()) at(260, static_cast<std::uint32_t>(world.rigid.size()), tissue_factor, 2.5);
  at(300, hybrid::Edit::kTool, coupling_stiffness, 450.0);
  at(420, 0, dynamic_friction, 0.1);
  at(500, hybrid::Edit::kTool, coupling_stiffness, -1.0);  // this edit is refused
  return edits;
}

Recording record_edited(const std::filesystem::path& file, bool asynchronous) {
  const hybrid::Scene scene = hybrid::load_scene(file);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  hybrid::SessionOptions options;
  options.seconds = 0.8;
  options.keep_rows = false;
  options.async_relaxation = asynchronous;
  options.edits = some_edits(*built.world);
  const hybrid::SessionResult result = hybrid::run_session(scene, built, options);
  EXPECT_EQ(result.edits.size(), options.edits.size() - 1) << "one is refused";
  Recording recording = recording_of(file, scene, result, asynchronous);
  recording.edits = result.edits;
  return recording;
}

TEST_F(RecordingFile, AnEditedSessionReplaysToTheBitWithBothKindsOfRelaxation) {
  for (const bool asynchronous : {false, true}) {
    const Recording recorded = record_edited(small_scene(), asynchronous);
    hybrid::save_recording(folder_ / "a.rec", recorded);
    Recording loaded = hybrid::load_recording(folder_ / "a.rec");
    EXPECT_EQ(loaded.edits, recorded.edits);
    const hybrid::ReplayResult result = hybrid::replay(loaded, {});
    EXPECT_TRUE(result.equal) << "parts at tick " << result.first_difference;
    EXPECT_EQ(result.state_hash, recorded.state_hash);
    loaded.edits[1].value += 0.1;
    loaded.edits.pop_back();
    EXPECT_FALSE(hybrid::replay(loaded, {}).equal) << "edits are inputs";
  }
}

TEST_F(RecordingFile, WithoutEditsItIsAFileOfTheVersionBefore) {
  Recording recorded = record(small_scene(), 0.3);
  hybrid::save_recording(folder_ / "a.rec", recorded);
  EXPECT_EQ(read(folder_ / "a.rec").substr(0, 8), "hybridR4");
  recorded.edits.push_back({});
  hybrid::save_recording(folder_ / "b.rec", recorded);
  const std::string bytes = read(folder_ / "b.rec");
  EXPECT_EQ(bytes.substr(0, 8), "hybridR5");
  EXPECT_EQ(refusal_of(bytes), "");
  EXPECT_NE(refusal_of(bytes.substr(0, bytes.size() - 1)), "") << "a part of an edit";
  std::string wrong = bytes;
  wrong[wrong.size() - 12] = 99;  // changes the quantity
  EXPECT_NE(refusal_of(wrong).find("damaged edits"), std::string::npos);
  recorded.edits = {{.tick = 7}, {.tick = 3}};  // a replay would apply the second one late
  hybrid::save_recording(folder_ / "b.rec", recorded);
  EXPECT_NE(refusal_of(read(folder_ / "b.rec")).find("damaged edits"), std::string::npos);
}

// A device that moves between the start of a session and its first tick, as if the first tick were late.
class MovesOn final : public device::HapticDevice {
 public:
  explicit MovesOn(std::shared_ptr<const device::Path> path) : path_(std::move(path)) {}
  [[nodiscard]] device::DeviceState read() noexcept override {
    const double late_s = reads_++ == 0 ? 0.0 : 0.019;
    return {.position_m = path_->position(t_s_ + late_s)};
  }
  void write(const glm::dvec3& /*force_N*/, double dt_s) noexcept override { t_s_ += dt_s; }
  [[nodiscard]] device::DeviceLimits limits() const noexcept override { return {.max_force_N = 8.0}; }
  [[nodiscard]] std::string_view name() const noexcept override { return "moves on"; }

 private:
  std::shared_ptr<const device::Path> path_;
  double t_s_ = 0.0;
  int reads_ = 0;
};

TEST_F(RecordingFile, AFirstTickThatComesLateIsNoMatter) {
  const auto file = small_scene();
  const hybrid::Scene scene = hybrid::load_scene(file);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  MovesOn hand(hybrid::scene_path(scene));
  hybrid::SessionOptions options;
  options.real_device = &hand;
  options.async_relaxation = true;
  options.seconds = 0.8;
  const hybrid::SessionResult result = hybrid::run_session(scene, built, options);
  EXPECT_NE(result.start_m, result.recording.front().device_m);
  hybrid::save_recording(folder_ / "a.rec", recording_of(file, scene, result, true));
  const hybrid::ReplayResult again = hybrid::replay(hybrid::load_recording(folder_ / "a.rec"), {});
  EXPECT_TRUE(again.equal) << "parts at tick " << again.first_difference;
}

// The work share of each tick, which in real time depends on the machine, is recorded too.
TEST_F(RecordingFile, TheShareOfWorkThatTicksHadIsOnRecord) {
  Recording recorded = record(tests::source_folder / "scenes" / "tissue.toml", std::nullopt, true);
  const hybrid::Scene scene = hybrid::load_scene(recorded.scene_file);
  const hybrid::BuiltScene built = hybrid::build_scene(scene);
  hybrid::begin_session(scene, *built.world, *built.state, recorded.start_m);
  hybrid::start_async_relaxation(*built.state, hybrid::Arrival::recorded);
  std::uint64_t hash = hybrid::kHashBegin;
  {
    const hybrid::ScopedFlushToZero flushed;
    for (std::size_t n = 0; n < recorded.ticks.size(); ++n) {
      hybrid::RecordedTick& tick = recorded.ticks[n];
      tick.work_share = static_cast<std::uint8_t>(n / 40 % (hybrid::WorkShare::kMostSteps + 1));
      hybrid::restore_tick_timing(tick, *built.state);
      hash = hybrid::hash_tick(hash, hybrid::haptic_tick(*built.world, *built.state,
                                                         {.position_m = tick.device_m}, recorded.dt_s));
      tick.hash = hash;
    }
  }
  recorded.state_hash = hybrid::hash_state(hash, *built.state);
  hybrid::save_recording(folder_ / "a.rec", recorded);
  const Recording loaded = hybrid::load_recording(folder_ / "a.rec");
  const hybrid::ReplayResult result = hybrid::replay(loaded, {});
  EXPECT_TRUE(result.equal) << "parts at tick " << result.first_difference;
  EXPECT_EQ(result.state_hash, recorded.state_hash);
  for (hybrid::RecordedTick& tick : recorded.ticks) tick.work_share = 0;
  EXPECT_FALSE(hybrid::replay(recorded, {}).equal);
}

TEST_F(RecordingFile, WithMotionAndSurfaceFeelItIsTheSameToTheBit) {
  polygon::save_ply(folder_ / "ball.ply", polygon::make_ball_mesh(0.02, 3));
  const std::string feel =
      "friction = [0.5, 0.3]\ndamping = 2\nshading = true\ntexture = { pattern = \"bumps\", size = 3, height "
      "= 0.3 }\n";
  const auto file =
      write("moving.toml",
            "format = 1\n[[rigid]]\nname = \"ball\"\nmesh = \"ball.ply\"\nunit = \"m\"\n" + feel +
                "motion = \"path\"\n[rigid.path]\nkind = \"lissajous\"\ncentre = [0, 0, 0]\namplitude = [3, "
                "0, 2]\nfrequency "
                "= 0.7\n[rigid.spin]\naxis = [0, 1, 0.2]\nrate = 80\n[[rigid]]\nname = \"puck\"\nprimitive = "
                "\"box\"\nsize = "
                "[10, 20, 20]\nposition = [40, 0, 20]\nmotion = \"free\"\ndensity = 1000\ndrag = 0.5\n" +
                feel +
                "[path]\nkind = \"waypoints\"\nspeed = 80\npoints = [[0, 0, 40], [0, 0, 18, 1.0], [18, 2, "
                "20], [45, 3, 20]]\n");
  const Recording a = record(file, std::nullopt);
  const hybrid::ReplayResult again = hybrid::replay(a, {});
  EXPECT_TRUE(again.equal) << "parts at tick " << again.first_difference;
  EXPECT_EQ(again.state_hash, a.state_hash);
  const hybrid::Scene scene = hybrid::load_scene(file);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  const hybrid::SessionResult result =
      hybrid::run_session(scene, built, {.seconds = std::nullopt, .progress = {}});
  EXPECT_GT(result.object_contact_ticks[0], 500U);
  EXPECT_GT(result.object_contact_ticks[1], 50U) << "the puck is pushed";
  EXPECT_GT(built.state->rigid[1].pose.position_m.x, 0.041);
  EXPECT_EQ(built.state->faults, 0U);
  // The bodies' state is part of the hash.
  built.state->rigid[1].free.velocity_m_per_s.x += 1e-15;
  EXPECT_NE(hybrid::hash_state(0, *built.state), hybrid::hash_state(0, *hybrid::build_scene(scene).state));
  const std::uint64_t before = hybrid::hash_state(0, *built.state);
  built.state->rigid[1].free.spin_rad_per_s.z += 1e-12;
  EXPECT_NE(hybrid::hash_state(0, *built.state), before);
}

// A wall far stiffer than the loop can keep stable. So the limits and the passivity controller use all their
// memory.
TEST_F(RecordingFile, WithPassivityControlDelayAndLateTicksItIsTheSameToTheBit) {
  const auto file =
      write("wall.toml",
            "format = 1\n[tool]\nstiffness = 30000\n[device]\ndelay_ticks = 1\nwatchdog_ms = 5\n"
            "[hand]\ngrip = \"firm\"\ntremor_mm = 0.05\n[safety]\npassivity = true\nmax_energy = 0.01\n"
            "[[rigid]]\nname = \"wall\"\nprimitive = \"box\"\nsize = [100, 100, 20]\n"
            "[path]\nkind = \"press\"\nfrom = [0, 0, 20]\nto = [0, 0, 6]\nhold = 0.3\n");
  const hybrid::Scene scene = hybrid::load_scene(file);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  hybrid::SessionOptions options;
  const hybrid::SessionResult result = hybrid::run_session(scene, built, options);
  EXPECT_GT(built.state->passive.acted, 10U);
  // The energy given to the hand, computed from the trace, is at most the largest work of one tick plus 0.1
  // µJ.
  double given_J = 0.0, worst_J = 0.0;
  for (std::size_t n = 1; n < result.rows.size(); ++n) {
    const double work =
        glm::dot(result.rows[n - 1].force_N, result.rows[n].device_m - result.rows[n - 1].device_m);
    given_J += work;
    worst_J = std::max(worst_J, std::abs(work));
    ASSERT_LE(given_J, worst_J + 1e-7) << n;
  }
  EXPECT_TRUE(hybrid::replay(record(file, std::nullopt), {}).equal);

  // Late ticks and a lost device are recorded inputs.
  Recording faulty = record(file, std::nullopt);
  hybrid::BuiltScene again = hybrid::build_scene(scene);
  hybrid::begin_session(scene, *again.world, *again.state, faulty.start_m);
  std::uint64_t hash = hybrid::kHashBegin;
  for (std::size_t n = 0; n < faulty.ticks.size(); ++n) {
    auto& tick = faulty.ticks[n];
    if (n % 200 == 150) tick.fault = device::DeviceFault::late;
    if (n % 200 > 190) tick.fault = device::DeviceFault::lost;
    const hybrid::TickResult felt = haptic_tick(
        *again.world, *again.state, {.position_m = tick.device_m, .fault = tick.fault}, faulty.dt_s);
    if (tick.fault != device::DeviceFault::none) {
      ASSERT_EQ(felt.force_N, glm::dvec3(0.0)) << n;
    }
    hash = tick.hash = hybrid::hash_tick(hash, felt);
  }
  faulty.state_hash = hybrid::hash_state(hash, *again.state);
  hybrid::save_recording(folder_ / "faulty.rec", faulty);
  EXPECT_TRUE(hybrid::replay(hybrid::load_recording(folder_ / "faulty.rec"), {}).equal);
  EXPECT_GT(again.state->limit.late, 1U);
  EXPECT_GT(again.state->limit.lost, 10U);
}

TEST_F(RecordingFile, TwoRunsOfASceneEndInTheSameState) {
  const auto file = small_scene();
  const Recording a = record(file, std::nullopt), b = record(file, std::nullopt);
  EXPECT_EQ(a.state_hash, b.state_hash);
  ASSERT_EQ(a.ticks.size(), b.ticks.size());
  for (std::size_t n = 0; n < a.ticks.size(); ++n) ASSERT_EQ(a.ticks[n].hash, b.ticks[n].hash) << n;
}

TEST_F(RecordingFile, AFlippedBitOfAnInputIsNoticedAtItsTick) {
  const Recording good = record(small_scene(), std::nullopt);
  ASSERT_TRUE(hybrid::replay(good, {}).equal);
  hybrid::save_recording(folder_ / "a.rec", good);
  const std::string bytes = read(folder_ / "a.rec");
  constexpr std::size_t kTickBytes = 48;
  const std::size_t first = bytes.size() - kTickBytes * good.ticks.size();
  for (const std::size_t tick : {std::size_t{0}, std::size_t{50}, std::size_t{200}, good.ticks.size() - 1}) {
    std::string flipped = bytes;
    flipped[first + kTickBytes * tick + 16 + 5] = static_cast<char>(
        flipped[first + kTickBytes * tick + 16 + 5] ^ 0x10);  // changes z by a few micrometers
    const auto result = hybrid::replay(hybrid::load_recording(write("b.rec", flipped)), {});
    EXPECT_FALSE(result.equal);
    EXPECT_EQ(result.first_difference, tick);
  }
}

TEST_F(RecordingFile, AStateThatEndsElsewhereIsNoticedAtTheEnd) {
  Recording recorded = record(small_scene(), std::nullopt);
  recorded.state_hash ^= 1;
  const auto result = hybrid::replay(recorded, {});
  EXPECT_FALSE(result.equal);
  EXPECT_EQ(result.first_difference, recorded.ticks.size());
}

TEST_F(RecordingFile, ASceneThatHasChangedSinceIsRefused) {
  const auto file = small_scene();
  const Recording recorded = record(file, 0.3);
  std::ofstream(file, std::ios::app) << "# a comment\n";
  EXPECT_THROW((void)hybrid::replay(recorded, {}), std::runtime_error);
  std::filesystem::remove(file);
  EXPECT_THROW((void)hybrid::replay(recorded, {}), std::runtime_error);
}

TEST_F(RecordingFile, TruncatedAndGarbageFilesAreRefusedInWords) {
  hybrid::save_recording(folder_ / "a.rec", record(small_scene(), 0.3));
  const std::string bytes = read(folder_ / "a.rec");
  EXPECT_EQ(refusal_of(bytes), "");
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1}, std::size_t{7}, std::size_t{8}, std::size_t{47}, std::size_t{48},
        std::size_t{60}, bytes.size() / 2, bytes.size() - 1}) {
    EXPECT_NE(refusal_of(bytes.substr(0, size)), "") << size << " bytes";
  }
  EXPECT_NE(refusal_of(bytes + "x"), "");
  EXPECT_NE(refusal_of("this is no recording, though it is longer than the head of one is"), "");
  EXPECT_NE(refusal_of(std::string(1000, '\0')), "");
  EXPECT_THROW((void)hybrid::load_recording(folder_ / "missing.rec"), std::runtime_error);
  EXPECT_THROW((void)hybrid::load_recording(folder_), std::runtime_error);
  // Impossible counts must not lead to an allocation.
  for (const std::size_t field : {std::size_t{8}, std::size_t{16}, std::size_t{24}}) {
    for (const std::uint64_t value :
         {std::uint64_t{1} << 63, ~std::uint64_t{0}, std::uint64_t{1} << 59, std::uint64_t{1'000'000'000}}) {
      std::string wrong = bytes;
      std::memcpy(wrong.data() + field, &value, sizeof value);
      EXPECT_NE(refusal_of(wrong), "") << "field at " << field << " = " << value;
    }
  }
  // Invalid time steps.
  for (const double dt : {0.0, -1e-3, std::nan(""), HUGE_VAL, 1e-310, 1e300}) {
    std::string wrong = bytes;
    std::memcpy(wrong.data() + 32, &dt, sizeof dt);
    EXPECT_NE(refusal_of(wrong), "") << dt;
  }
  // A name with a zero byte, which would end every message.
  std::string cut_name = bytes;
  cut_name[104] = '\0';
  EXPECT_NE(refusal_of(cut_name).find("damaged name of its scene"), std::string::npos);
  // A tick with values that no session writes, for its fault and for its share of work.
  const std::size_t last_tick = bytes.size() - 48;
  for (const std::size_t field : {std::size_t{32}, std::size_t{33}, std::size_t{36}, std::size_t{37}}) {
    std::string wrong = bytes;
    wrong[last_tick + field] = 77;
    EXPECT_NE(refusal_of(wrong).find("damaged ticks"), std::string::npos) << "byte " << field;
  }
  EXPECT_THROW(hybrid::save_recording(folder_ / "no" / "folder" / "a.rec", {}), std::runtime_error);
}

}  // namespace
