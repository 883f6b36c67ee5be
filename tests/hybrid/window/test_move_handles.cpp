// SPDX-License-Identifier: GPL-3.0-or-later
// The arrows that move an object follow the pointer, but only along their axis.
#include "hybrid/window/move_handles.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

namespace {

using hybrid::MoveHandles;
using hybrid::PixelRect;

constexpr float kEm = 13.0F;
const PixelRect kPlace{0, 40, 900, 600};

hybrid::DrawnScene scene() {
  hybrid::DrawnScene out;
  out.objects.resize(1);
  out.objects[0].name = "plate";
  out.objects[0].surface.vertices = {{-0.02, -0.01, 0.0}, {0.02, 0.01, 0.0}, {0.0, 0.0, 0.02}};
  out.objects[0].choices.open = true;
  return out;
}
hybrid::Camera camera() {
  return {.target_m = {0.0, 0.0, 0.01}, .distance_m = 0.3, .azimuth_rad = 0.7, .elevation_rad = 0.5};
}

TEST(MoveHandles, AHandleFollowsThePointerAlongItsAxisAlone) {
  const hybrid::Camera view = camera();
  for (std::size_t handle = 0; handle <= MoveHandles::kInView; ++handle) {
    MoveHandles handles{.box = box_of(scene().objects[0])};
    const auto before = handles.pixels(view, kPlace, kEm);
    handles.held = handle;
    const glm::dvec2 along = handle == MoveHandles::kInView
                                 ? glm::dvec2(0.6, -0.8)
                                 : glm::normalize(*before[handle] - *before[MoveHandles::kInView]);
    for (int n = 0; n < 40; ++n) handles.drag(view, kPlace, kEm, along);
    const auto after = handles.pixels(view, kPlace, kEm);
    const glm::dvec2 moved = *after[MoveHandles::kInView] - *before[MoveHandles::kInView];
    EXPECT_NEAR(glm::dot(moved, along), 40.0, 4.0) << handle << ": perspective is not accounted for";
    EXPECT_LT(glm::length(moved - along * glm::dot(moved, along)), 1.0) << handle;
    for (std::size_t d = 0; d < MoveHandles::kInView; ++d) {
      if (handle == MoveHandles::kInView || d == handle) continue;
      EXPECT_EQ(handles.shift_m[static_cast<int>(d)], 0.0);
    }
  }
}

TEST(MoveHandles, NothingMovesAlongAnAxisThatPointsToTheEye) {
  hybrid::Camera view = camera();
  look_along(view, 0);
  MoveHandles handles{.box = box_of(scene().objects[0])};
  view.target_m = handles.box.centre_m();
  handles.held = 0;
  handles.drag(view, kPlace, kEm, {50.0, 50.0});
  EXPECT_LT(glm::length(handles.shift_m), 0.1);
  EXPECT_TRUE(std::isfinite(handles.shift_m.x));
}

TEST(ObjectMover, ADragBecomesAChangeAndItsPlaceStaysUntilTheSceneIsBuilt) {
  const hybrid::DrawnScene drawn = scene();
  const hybrid::Camera view = camera();
  hybrid::ViewState user;
  hybrid::ObjectMover mover;
  mover.place(user, drawn, false);
  EXPECT_EQ(mover.handles(), nullptr) << "nothing is selected";
  user.selected = 0;
  user.moves = true;
  mover.place(user, drawn, false);
  ASSERT_NE(mover.handles(), nullptr);
  const auto tip = mover.handles()->pixels(view, kPlace, kEm)[2];
  EXPECT_FALSE(mover.take(view, kPlace, kEm, *tip + glm::dvec2(60.0, 0.0)));
  ASSERT_TRUE(mover.take(view, kPlace, kEm, *tip + glm::dvec2(3.0, 0.0)));
  EXPECT_FALSE(mover.let_go(drawn)) << "a click moves nothing";
  ASSERT_TRUE(mover.take(view, kPlace, kEm, *tip));
  mover.drag(view, kPlace, kEm, {0.0, -30.0});
  const auto change = mover.let_go(drawn);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->name, "plate");
  EXPECT_GT(change->value.z, 0.0);
  EXPECT_FALSE(mover.take(view, kPlace, kEm, *tip)) << "one move at a time";
  for (int n = 0; n < 200; ++n) mover.place(user, drawn, true);
  EXPECT_EQ(mover.handles()->shift_m, change->value);
  for (int n = 0; n < 3; ++n) mover.place(user, drawn, false);
  EXPECT_EQ(mover.handles()->shift_m, glm::dvec3(0.0)) << "the scene is as it was";
  user.moves = false;
  mover.place(user, drawn, false);
  EXPECT_EQ(mover.handles(), nullptr);
}

}  // namespace
