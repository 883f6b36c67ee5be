# SPDX-License-Identifier: GPL-3.0-or-later
# What people look at: picture, window and plots. Libraries of the screen stay inside this target.
# Imported targets are GLOBAL, because tests in other folders link them through this one.
find_package(PkgConfig REQUIRED)
find_package(glfw3 3.3 REQUIRED GLOBAL)
find_package(PNG REQUIRED GLOBAL)
pkg_check_modules(EPOXY REQUIRED IMPORTED_TARGET GLOBAL epoxy)
pkg_check_modules(IMGUI REQUIRED IMPORTED_TARGET GLOBAL imgui)

add_library(hybrid_drawing STATIC
  ${CMAKE_CURRENT_LIST_DIR}/camera.cpp
  ${CMAKE_CURRENT_LIST_DIR}/draw_geometry.cpp
  ${CMAKE_CURRENT_LIST_DIR}/felt_geometry.cpp
  ${CMAKE_CURRENT_LIST_DIR}/renderer.cpp
  ${CMAKE_CURRENT_LIST_DIR}/occupancy_plot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/legend.cpp
  ${CMAKE_CURRENT_LIST_DIR}/overlay.cpp
  ${CMAKE_CURRENT_LIST_DIR}/overlay_legend.cpp
  ${CMAKE_CURRENT_LIST_DIR}/overlay_parts.cpp
  ${CMAKE_CURRENT_LIST_DIR}/pen.cpp
  ${CMAKE_CURRENT_LIST_DIR}/frame_painter.cpp
  ${CMAKE_CURRENT_LIST_DIR}/png_file.cpp
  ${CMAKE_CURRENT_LIST_DIR}/picture.cpp
  ${CMAKE_CURRENT_LIST_DIR}/window.cpp
  ${CMAKE_CURRENT_LIST_DIR}/svg_figure.cpp
  ${CMAKE_CURRENT_LIST_DIR}/decimate.cpp
  ${CMAKE_CURRENT_LIST_DIR}/plot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/settling_plot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/stability_plot.cpp)
add_library(hybrid::drawing ALIAS hybrid_drawing)
hybrid_target(hybrid_drawing)
target_link_libraries(hybrid_drawing PRIVATE PkgConfig::EPOXY PkgConfig::IMGUI glfw PNG::PNG ${CMAKE_DL_LIBS})
