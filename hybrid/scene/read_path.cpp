// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/read_path.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

namespace hybrid {
namespace {

constexpr double longest_s = 86'400.0;

Quantity duration() {
  return {"a time in s, 0 or more", "0.5", 1.0, 0.0, longest_s};
}

device::PressPath read_press(const TableReader& table) {
  device::PressPath out;
  out.from_m = table.vector("from", table.source().length());
  out.to_m = table.vector("to", table.source().length());
  out.speed_m_per_s = table.number("speed", table.source().speed(), out.speed_m_per_s);
  out.hold_s = table.number("hold", duration(), out.hold_s);
  out.repeat = static_cast<int>(table.integer("repeat", 1, 1'000'000, out.repeat));
  return out;
}

device::SlidePath read_slide(const TableReader& table) {
  device::SlidePath out;
  out.from_m = table.vector("from", table.source().length());
  out.to_m = table.vector("to", table.source().length());
  out.lift_m = table.vector("lift", table.source().length(), out.lift_m);
  out.speed_m_per_s = table.number("speed", table.source().speed(), out.speed_m_per_s);
  return out;
}

device::WaypointPath read_waypoints(const TableReader& table) {
  device::WaypointPath out;
  out.speed_m_per_s = table.number("speed", table.source().speed(), out.speed_m_per_s);
  const TreeNode& points = table.list("points", "[[0, 0, 40], [0, 0, 20, 0.5]]");
  std::size_t number = 0;
  for (const TreeNode& point : points.items) {
    const std::string name = words("point ", ++number, " of 'points'");
    const bool right =
        point.kind == TreeNode::Kind::array && (point.items.size() == 3 || point.items.size() == 4);
    if (!right) {
      table.source().refuse(point.place, words(name, " in ", table.what(), " is no point"),
                            "write three numbers, or four when the hand holds there: [x, y, z, seconds]");
    }
    device::Waypoint waypoint;
    for (glm::length_t axis = 0; axis < 3; ++axis) {
      const TreeNode& item = point.items[static_cast<std::size_t>(axis)];
      waypoint.position_m[axis] = table.number_at(
          item, item.place, words(name, " (", std::string(1, "xyz"[axis]), ")"), table.source().length());
    }
    if (point.items.size() == 4) {
      waypoint.hold_s =
          table.number_at(point.items[3], point.items[3].place, words(name, " (hold)"), duration());
    }
    out.points.push_back(waypoint);
  }
  return out;
}

device::LissajousPath read_lissajous(const TableReader& table) {
  const Quantity frequency{"a frequency in Hz, 0 or more", "0.5", 1.0, 0.0, 1e4};
  const Quantity phase{"an angle in degrees", "90", glm::pi<double>() / 180.0, -1e3, 1e3};
  device::LissajousPath out;
  out.centre_m = table.vector("centre", table.source().length());
  out.amplitude_m = table.vector("amplitude", table.source().length());
  out.frequency_hz = table.number_or_vector("frequency", frequency);
  out.phase_rad = table.number_or_vector("phase", phase, out.phase_rad);
  out.duration_s = table.number("duration", duration(), out.duration_s);
  return out;
}

device::CsvPath read_csv(const TableReader& table) {
  device::CsvPath out;
  out.file = table.file("file", false);
  out.unit_m = table.unit("unit", table.source().unit_m);
  out.offset_m = table.vector("offset", table.source().length(), out.offset_m);
  return out;
}

// Duration of the path (s); 0 for a CSV file, whose duration is unknown until it is read.
double seconds(const device::PathDescription& path) {
  if (const auto* press = std::get_if<device::PressPath>(&path)) {
    const double leg_s = glm::distance(press->from_m, press->to_m) / press->speed_m_per_s;
    return (2.0 * leg_s + press->hold_s) * press->repeat;
  }
  if (const auto* slide = std::get_if<device::SlidePath>(&path)) {
    return (2.0 * glm::length(slide->lift_m) + glm::distance(slide->from_m, slide->to_m)) /
           slide->speed_m_per_s;
  }
  if (const auto* waypoints = std::get_if<device::WaypointPath>(&path)) {
    double sum_s = 0.0;
    for (std::size_t i = 0; i < waypoints->points.size(); ++i) {
      sum_s += waypoints->points[i].hold_s;
      if (i == 0) continue;
      sum_s += glm::distance(waypoints->points[i - 1].position_m, waypoints->points[i].position_m) /
               waypoints->speed_m_per_s;
    }
    return sum_s;
  }
  const auto* lissajous = std::get_if<device::LissajousPath>(&path);
  return lissajous == nullptr ? 0.0 : lissajous->duration_s;
}

}  // namespace

device::PathDescription read_path(const TableReader& table) {
  static constexpr std::string_view kinds[] = {"press", "slide", "waypoints", "lissajous", "csv"};
  static constexpr std::string_view of_press[] = {"kind", "from", "to", "speed", "hold", "repeat"};
  static constexpr std::string_view of_slide[] = {"kind", "from", "to", "lift", "speed"};
  static constexpr std::string_view of_waypoints[] = {"kind", "points", "speed"};
  static constexpr std::string_view of_lissajous[] = {"kind",      "centre", "amplitude",
                                                      "frequency", "phase",  "duration"};
  static constexpr std::string_view of_csv[] = {"kind", "file", "unit", "offset"};
  static constexpr std::span<const std::string_view> keys[] = {of_press, of_slide, of_waypoints, of_lissajous,
                                                               of_csv};
  static constexpr std::string_view all[] = {
      "kind",   "from",      "to",        "speed", "hold",     "repeat", "lift", "points",
      "centre", "amplitude", "frequency", "phase", "duration", "file",   "unit", "offset"};

  table.allow(all);
  const std::size_t kind = table.choice("kind", kinds);
  table.allow(keys[kind], {}, all, words("kind = \"", kinds[kind], "\""));
  device::PathDescription out;
  switch (kind) {
    case 0:
      out = read_press(table);
      break;
    case 1:
      out = read_slide(table);
      break;
    case 2:
      out = read_waypoints(table);
      break;
    case 3:
      out = read_lissajous(table);
      break;
    default:
      out = read_csv(table);
  }
  if (const double time_s = seconds(out); !(time_s <= longest_s)) {
    table.refuse(kind == 0 && table.has("repeat") ? "repeat" : "speed",
                 words("the path of ", table.what(), " takes ", in_words(time_s), " s"),
                 words("make it shorter than a day (", in_words(longest_s),
                       " s): raise the speed, or hold and repeat less"));
  }
  return out;
}

}  // namespace hybrid
