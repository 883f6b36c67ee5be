// SPDX-License-Identifier: GPL-3.0-or-later
// Through the C interface a scene feels as in the program, to the bit. Surfaces, edits, recordings and errors
// are those of the session.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <glm/geometric.hpp>
#include <thread>

#include "hybrid/session/recording.h"
#include "hybrid/session/session.h"
#include "hybrid/snapshot/fill_snapshot.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/interface/c_session.h"

namespace {

using tests::CSession;
using tests::expect_ok;
using tests::line;
using tests::vec;

std::filesystem::path shipped(const std::string& name) {
  return tests::source_folder / "scenes" / (name + ".toml");
}

bool same_bits(const double (&a)[3], const glm::dvec3& b) {
  for (int d = 0; d < 3; ++d) {
    if (std::bit_cast<std::uint64_t>(a[d]) != std::bit_cast<std::uint64_t>(b[d])) return false;
  }
  return true;
}

// A session in fixed steps, as `hybrid run` plays it.
struct Reference {
  explicit Reference(const std::filesystem::path& file, bool asynchronous = true, bool measure_error = false)
      : scene(hybrid::load_scene(file)), built(hybrid::build_scene(scene)) {
    hybrid::SessionOptions options;
    options.async_relaxation = asynchronous;
    options.measure_error = measure_error;
    result = hybrid::run_session(scene, built, options);
    for (const hybrid::RecordedTick& tick : result.recording) path_m.push_back(tick.device_m);
  }
  hybrid::Scene scene;
  hybrid::BuiltScene built;
  hybrid::SessionResult result;
  std::vector<glm::dvec3> path_m;
};

class CShippedScene : public ::testing::TestWithParam<const char*> {};

TEST_P(CShippedScene, FeelsAsInTheProgramToTheBit) {
  const Reference reference(shipped(GetParam()));
  ASSERT_GT(reference.result.contact_ticks, 100U);
  const CSession session(shipped(GetParam()));
  session.begin(reference.result.start_m);
  const std::vector<hybrid_felt> felt = session.play(reference.path_m);
  for (std::size_t n = 0; n < felt.size(); ++n) {
    const hybrid::TraceRow& row = reference.result.rows[n];
    ASSERT_TRUE(same_bits(felt[n].force_N, row.force_N)) << "tick " << n;
    ASSERT_TRUE(same_bits(felt[n].proxy_m, row.proxy_m)) << "tick " << n;
    ASSERT_EQ(glm::length(vec(felt[n].rigid_N)), row.rigid_N) << "tick " << n;
    ASSERT_EQ(glm::length(vec(felt[n].soft_N)), row.soft_N) << "tick " << n;
    ASSERT_EQ(felt[n].contact_bits, row.contacts) << "tick " << n;
    ASSERT_EQ(felt[n].contact_count, static_cast<unsigned>(std::popcount(row.contacts))) << "tick " << n;
    ASSERT_EQ(felt[n].hash, reference.result.recording[n].hash) << "tick " << n;
    ASSERT_EQ(felt[n].tick, n);
  }
  EXPECT_EQ(session.state_hash(), reference.result.state_hash);
}
INSTANTIATE_TEST_SUITE_P(Scenes, CShippedScene, ::testing::Values("cube", "wall", "sheet", "moving"),
                         [](const auto& scene) { return std::string(scene.param); });

class CSessionFile : public tests::SceneFile {
 protected:
  // Tissue with a rigid ball beside it. The tool starts at (0, 0, 20) mm.
  static std::string text() {
    return "format = 1\n" + tests::block +
           "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 4\nposition = [16, 0, 0]\n" +
           tests::path;
  }
  [[nodiscard]] std::filesystem::path scene() const { return write("small.toml", text()); }
  static std::vector<glm::dvec3> press() { return line({0.0, 0.0, 0.02}, {0.0, 0.0, 0.003}, 300); }
};

TEST_F(CSessionFile, OneTickAtATimeIsThePlayedPath) {
  const CSession played(scene()), ticked(scene());
  const glm::dvec3 start(0.0, 0.0, 0.02);
  played.begin(start);
  ticked.begin(start);
  const auto path_m = press();
  const auto felt = played.play(path_m);
  for (std::size_t n = 0; n < path_m.size(); ++n) {
    const hybrid_felt one = ticked.tick(path_m[n]);
    ASSERT_EQ(one.hash, felt[n].hash) << "tick " << n;
    ASSERT_EQ(one.tick, n);
  }
  EXPECT_EQ(played.state_hash(), ticked.state_hash());
  hybrid_felt again{.size = sizeof again};
  expect_ok(hybrid_get_felt(ticked.get(), &again));
  EXPECT_EQ(again.hash, felt.back().hash);
}

// A caller with a later header has larger result structs. Each result must go to the start of a struct.
TEST_F(CSessionFile, ResultsOfALaterVersionKeepTheirPlaces) {
  struct Later {
    hybrid_felt felt;
    double more;
  };
  const CSession session(scene());
  session.begin({0.0, 0.0, 0.02});
  const auto path_m = press();
  std::vector<Later> felt(path_m.size(), Later{.felt = {}, .more = 7.0});
  felt.front().felt.size = sizeof(Later);
  expect_ok(hybrid_play(session.get(), &path_m.front().x, path_m.size(), 1e-3, &felt.front().felt));
  for (std::size_t n = 0; n < felt.size(); ++n) {
    ASSERT_EQ(felt[n].felt.tick, n);
    ASSERT_EQ(felt[n].more, 7.0);
  }
}

TEST_F(CSessionFile, PartsOfObjectsAddUpToTheForce) {
  const CSession session(scene());
  session.begin({0.0, 0.0, 0.02});
  const hybrid_felt felt = session.play(press()).back();
  glm::dvec3 sum(0.0);
  for (std::uint32_t o = 0; o < session.info().objects; ++o) {
    double part_N[3];
    int touched = 0;
    expect_ok(hybrid_object_force(session.get(), o, part_N, &touched));
    EXPECT_EQ(touched != 0, (felt.contact_bits >> o & 1U) != 0);
    sum += vec(part_N);
  }
  EXPECT_NEAR(glm::length(sum - vec(felt.rigid_N) - vec(felt.soft_N)), 0.0, 1e-9);
  EXPECT_GT(glm::length(sum), 0.01);
}

// A tool held in a rigid wall must feel K · depth, before and after an edit of K.
TEST_F(CSessionFile, AnEditOfTheStiffnessIsFelt) {
  const CSession session(
      write("box.toml",
            "format = 1\n[tool]\nradius = 2\nstiffness = 1000\n[device]\nmodel = \"ideal\"\n"
            "[[rigid]]\nname = \"box\"\nprimitive = \"box\"\nsize = [40, 40, 20]\n" +
                tests::path));
  session.begin({0.0, 0.0, 0.02});
  const auto settled = [&] { return session.play(std::vector<glm::dvec3>(500, {0.0, 0.0, 0.011})).back(); };
  (void)session.play(line({0.0, 0.0, 0.02}, {0.0, 0.0, 0.011}, 200));
  EXPECT_NEAR(settled().force_N[2], 1000.0 * 0.001, 1e-6);  // touched at 12 mm, held at 11 mm
  expect_ok(hybrid_edit(session.get(), nullptr, "stiffness", 2500.0));
  EXPECT_NEAR(settled().force_N[2], 2500.0 * 0.001, 1e-6);
}

TEST_F(CSessionFile, EveryEditableValueTakesItsOwnRange) {
  const CSession session(scene());
  const std::uint32_t count = session.info().editable;
  EXPECT_GE(count, 6U);  // stiffness, max-force; two frictions and damping of the ball; factor of the tissue
  for (std::uint32_t n = 0; n < count; ++n) {
    hybrid_editable value{.size = sizeof value};
    expect_ok(hybrid_editable_value(session.get(), n, &value));
    EXPECT_LE(value.low, value.in_scene);
    EXPECT_GE(value.high, value.in_scene);
    expect_ok(hybrid_edit(session.get(), value.object, value.quantity, value.high));
    EXPECT_EQ(hybrid_edit(session.get(), value.object, value.quantity, 2.0 * value.high + 1.0),
              HYBRID_BAD_VALUE);
  }
}

// ---- recordings ----

void expect_replay(const std::filesystem::path& file, std::size_t ticks, std::uint64_t hash) {
  const hybrid::Recording recording = hybrid::load_recording(file);
  EXPECT_EQ(recording.ticks.size(), ticks);
  const hybrid::ReplayResult replayed = hybrid::replay(recording, {});
  EXPECT_TRUE(replayed.equal) << "parts at tick " << replayed.first_difference;
  EXPECT_EQ(replayed.state_hash, hash);
}

TEST_F(CSessionFile, ARecordingReplaysToTheSameHash) {
  for (const std::uint32_t relaxation : {HYBRID_RELAX_IN_CALL, HYBRID_RELAX_TICK}) {
    for (const double rate_hz : {0.0, 1700.0}) {
      const CSession session(scene(), {.relaxation = relaxation, .rate_hz = rate_hz, .recorded_ticks = 300});
      session.begin({0.0, 0.0, 0.02});
      const auto path_m = press();
      (void)session.play(std::span(path_m).first(200));
      expect_ok(hybrid_edit(session.get(), "block", "tissue-factor", 3.0));
      expect_ok(hybrid_edit(session.get(), nullptr, "stiffness", 700.0));
      (void)session.play(std::span(path_m).subspan(200));
      expect_ok(hybrid_save_recording(session.get(), (folder_ / "c.rec").c_str()));
      EXPECT_EQ(hybrid::load_recording(folder_ / "c.rec").edits.size(), 2U);
      expect_replay(folder_ / "c.rec", 300, session.state_hash());
    }
  }
}

TEST_F(CSessionFile, ARecordingWithTheRelaxationThreadReplaysToTheSameHash) {
  const CSession session(scene(), {.relaxation = HYBRID_RELAX_THREAD, .recorded_ticks = 300});
  session.begin({0.0, 0.0, 0.02});
  for (const glm::dvec3& at_m : press()) {
    (void)session.tick(at_m);
    std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  expect_ok(hybrid_save_recording(session.get(), (folder_ / "live.rec").c_str()));
  expect_replay(folder_ / "live.rec", 300, session.state_hash());
}

TEST_F(CSessionFile, ASceneGivenAsTextIsThatOfTheFileAndItsRecordingReplays) {
  write("tetra.obj", "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const std::string text = "format = 1\n" + tests::block +
                           "[[rigid]]\nname = \"tetra\"\nmesh = \"tetra.obj\"\nposition = [20, 0, 0]\n" +
                           tests::path;
  const CSession from_file(write("same.toml", text)), from_text(text, folder_, {.recorded_ticks = 300});
  for (const CSession* session : {&from_file, &from_text}) {
    session->begin({0.0, 0.0, 0.02});
    (void)session->play(press());
  }
  EXPECT_EQ(from_text.state_hash(), from_file.state_hash());
  expect_ok(hybrid_save_recording(from_text.get(), (folder_ / "text.rec").c_str()));
  expect_replay(folder_ / "text.rec", 300, from_text.state_hash());
}

// ---- the error ----

TEST_F(CSessionFile, TheErrorIsThatOfTheProgram) {
  const Reference reference(scene(), true, true);
  ASSERT_GT(reference.result.error.all.samples, 0);
  const CSession session(scene(), {.recorded_ticks = reference.path_m.size(), .with_error = 1});
  session.begin(reference.result.start_m);
  (void)session.play(reference.path_m);
  hybrid_error error{.size = sizeof error};
  expect_ok(hybrid_measure_error(session.get(), &error));
  EXPECT_EQ(error.samples, static_cast<std::uint32_t>(reference.result.error.all.samples));
  EXPECT_EQ(error.max_N, reference.result.error.all.max_N);
  EXPECT_EQ(error.p99_jnd, reference.result.error.p99_jnd);
  EXPECT_EQ(error.moving_max_jnd, reference.result.error.moving.max_jnd);
  EXPECT_EQ(session.state_hash(), reference.result.state_hash) << "measuring must not change the session";
}

// ---- surfaces ----

TEST_F(CSessionFile, SurfacesAreThoseOfTheSessionAndSayWhichMoved) {
  const CSession session(scene());
  const auto at_rest = session.vertices(1);
  EXPECT_EQ(session.take().is_fresh, 0U);
  session.begin({0.0, 0.0, 0.02});
  const auto path_m = press();
  (void)session.play(path_m);
  expect_ok(hybrid_publish(session.get()));
  EXPECT_EQ(session.vertices(1), at_rest) << "only the reader takes surfaces";
  const hybrid_snapshot taken = session.take();
  EXPECT_EQ(taken.is_fresh, 1U);
  EXPECT_EQ(taken.tick, path_m.size());
  EXPECT_EQ(taken.device_m[2], path_m.back().z);
  bool ball_changed = true, block_changed = false;
  (void)session.vertices(0, &ball_changed);
  const auto moved = session.vertices(1, &block_changed);
  EXPECT_FALSE(ball_changed);
  EXPECT_TRUE(block_changed);

  // The same ticks, on a world that this test builds itself.
  const hybrid::Scene read = hybrid::load_scene(scene());
  const hybrid::BuiltScene built = hybrid::build_scene(read);
  hybrid::begin_session(read, *built.world, *built.state, {0.0, 0.0, 0.02});
  hybrid::start_async_relaxation(*built.state, hybrid::Arrival::counted);
  hybrid::TickResult felt;
  for (const glm::dvec3& at_m : path_m)
    felt = hybrid::haptic_tick(*built.world, *built.state, {.position_m = at_m}, 1e-3);
  const auto displaced = hybrid::take_snapshot(*built.world, *built.state, felt, 0.0).soft_moved_m[1];
  ASSERT_EQ(displaced.size(), moved.size());
  double deepest_m = 0.0;
  for (std::size_t v = 0; v < moved.size(); ++v) {
    ASSERT_EQ(moved[v], at_rest[v] + glm::dvec3(displaced[v])) << "vertex " << v;
    deepest_m = std::max(deepest_m, glm::distance(moved[v], at_rest[v]));
  }
  EXPECT_GT(deepest_m, 5e-4);

  EXPECT_EQ(session.take().is_fresh, 0U);
  (void)session.vertices(1, &block_changed);
  EXPECT_FALSE(block_changed) << "nothing was published since";
}

TEST(CSurfaces, ABodyOnAPathMoves) {
  const Reference reference(shipped("moving"), true);
  const CSession session(shipped("moving"));
  session.begin(reference.result.start_m);
  (void)session.play(std::span(reference.path_m).first(500));
  expect_ok(hybrid_publish(session.get()));
  (void)session.take();
  unsigned changed_count = 0;
  for (std::uint32_t o = 0; o < session.info().rigid_objects; ++o) {
    bool changed = false;
    (void)session.vertices(o, &changed);
    changed_count += changed ? 1 : 0;
  }
  EXPECT_GE(changed_count, 1U);
}

TEST_F(CSessionFile, TrianglesNameVertices) {
  const CSession session(scene());
  for (std::uint32_t o = 0; o < session.info().objects; ++o) {
    hybrid_object object{.size = sizeof object};
    expect_ok(hybrid_get_object(session.get(), o, &object));
    EXPECT_STREQ(object.name, o == 0 ? "ball" : "block");
    EXPECT_EQ(object.is_soft, o);
    std::vector<std::uint32_t> corners(3 * object.triangles);
    expect_ok(hybrid_triangles(session.get(), o, corners.data(), object.triangles));
    ASSERT_FALSE(corners.empty());
    EXPECT_LT(*std::max_element(corners.begin(), corners.end()), object.vertices);
  }
}

// One thread ticks and publishes, one draws, and one edits. None of them is refused.
TEST_F(CSessionFile, ThreeThreadsMeetInOneSession) {
  const CSession session(scene(), {.relaxation = HYBRID_RELAX_THREAD, .recorded_ticks = 900});
  session.begin({0.0, 0.0, 0.02});
  std::atomic<bool> over{false};
  std::thread reader([&] {
    std::uint64_t newest = 0;
    while (!over) {
      const hybrid_snapshot taken = session.take();
      EXPECT_GE(taken.tick, newest);
      newest = taken.tick;
      (void)session.vertices(1);
    }
    EXPECT_GT(newest, 0U);
  });
  std::thread editor([&] {
    for (int n = 0; n < 100; ++n) {
      expect_ok(hybrid_edit(session.get(), nullptr, "stiffness", 500.0 + n));
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  for (int stroke = 0; stroke < 3; ++stroke) {
    for (const glm::dvec3& at_m : press()) {
      (void)session.tick(at_m);
      expect_ok(hybrid_publish(session.get()));
    }
  }
  editor.join();
  over = true;
  reader.join();
  expect_ok(hybrid_save_recording(session.get(), (folder_ / "three.rec").c_str()));
  expect_replay(folder_ / "three.rec", 900, session.state_hash());
}

}  // namespace
