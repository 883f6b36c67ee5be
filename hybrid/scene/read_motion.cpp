// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/read_motion.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <string>

#include "hybrid/geometry/mass_properties.h"
#include "hybrid/scene/read_path.h"

namespace hybrid {
namespace {

constexpr std::string_view motions[] = {"fixed", "path", "free"};
constexpr std::string_view of_path[] = {"path", "spin"};
constexpr std::string_view of_free[] = {"mass", "density",      "inertia", "centre_of_mass",
                                        "drag", "angular_drag", "gravity"};
constexpr std::string_view all_keys[] = {"motion",  "path",           "spin", "mass",         "density",
                                         "inertia", "centre_of_mass", "drag", "angular_drag", "gravity"};

void refuse_keys(const TableReader& table, std::span<const std::string_view> keys, std::string_view motion,
                 std::string_view wanted) {
  for (const std::string_view key : keys) {
    if (!table.has(key)) continue;
    table.refuse(key,
                 words("'", key, "' in ", table.what(), " has no meaning with motion = \"", motion, "\""),
                 words("remove it, or write motion = \"", wanted, "\""));
  }
}

SpinDescription read_spin(const TableReader& table, const Pose& pose) {
  static constexpr std::string_view keys[] = {"axis", "about", "rate", "amplitude", "frequency"};
  constexpr double degree = glm::pi<double>() / 180.0;
  const Quantity component{"a number", "1", 1.0, -1e6, 1e6};
  const Quantity rate{"an angle in degrees a second", "90", degree, -1e5, 1e5};
  const Quantity amplitude{"an angle in degrees, above 0", "30", degree, 1e-9, 1e3};
  const Quantity frequency{"a frequency in Hz, above 0", "0.5", 1.0, 1e-6, 1e3};
  table.allow(keys);
  SpinDescription out;
  const glm::dvec3 axis = table.vector("axis", component, out.axis);
  const double length = glm::length(axis);
  if (!(length > 1e-9))
    table.refuse("axis", words("'axis' in ", table.what(), " has no direction"),
                 "write e.g. axis = [0, 0, 1]");
  out.axis = axis / length;
  out.about_m = table.vector("about", table.source().length(), pose.position_m);
  if (table.has("rate") && (table.has("amplitude") || table.has("frequency"))) {
    table.refuse("rate",
                 words(table.what(), " turns on for ever (rate) and to and fro (amplitude, frequency)"),
                 "keep rate, or amplitude with frequency");
  }
  if (table.has("amplitude") || table.has("frequency")) {
    out.amplitude_rad = table.number("amplitude", amplitude);
    out.frequency_hz = table.number("frequency", frequency);
  } else {
    out.rate_rad_per_s = table.number("rate", rate);
  }
  return out;
}

PathMotion read_path_motion(const TableReader& table, const Pose& pose) {
  PathMotion out;
  if (table.has("path")) out.path = read_path(table.table("path"));
  if (table.has("spin")) out.spin = read_spin(table.table("spin"), pose);
  if (!out.path && !out.spin) {
    table.refuse(
        "motion", words(table.what(), " has motion = \"path\", and does not say along which"),
        "add [rigid.path] with kind, as [path] has it, or [rigid.spin] with axis and rate, below it");
  }
  return out;
}

FreeMotion read_free_motion(const TableReader& table) {
  const Quantity mass{"a mass above 0, in kg", "0.1", 1.0, 1e-9, 1e6};
  const Quantity density{"a density above 0, in kg/m³", "1000", 1.0, 1e-6, 1e6};
  const Quantity moment{"a moment of inertia above 0, in kg m²", "1e-4", 1.0, 1e-24, 1e12};
  const Quantity drag{"a drag in N s/m, 0 or more", "0.1", 1.0, 0.0, 1e9};
  const Quantity angular_drag{"a drag in N m s, 0 or more", "1e-4", 1.0, 0.0, 1e9};
  const Quantity gravity{"an acceleration in m/s²", "-9.81", 1.0, -1e4, 1e4};
  FreeMotion out;
  if (table.has("mass") == table.has("density")) {
    if (table.has("mass")) {
      table.refuse("density", words(table.what(), " has both mass and density"), "keep one of them");
    }
    table.refuse("motion", words(table.what(), " moves freely, and has neither mass nor density"),
                 "add mass = 0.1 (kg), or density = 1000 (kg/m³)");
  }
  if (table.has("mass")) out.mass_kg = table.number("mass", mass);
  if (table.has("density")) out.density_kg_per_m3 = table.number("density", density);
  if (table.has("inertia")) {
    if (!out.mass_kg) {
      table.refuse("inertia", words(table.what(), " has an inertia, and no mass"),
                   "write mass in place of density, or remove inertia");
    }
    out.inertia_kg_m2 = table.number_or_vector("inertia", moment);
    if (!possible_inertia(*out.inertia_kg_m2)) {
      table.refuse("inertia", words("'inertia' in ", table.what(), " is not that of any body"),
                   "no moment may be greater than the sum of the other two");
    }
  }
  if (table.has("centre_of_mass")) out.centre_m = table.vector("centre_of_mass", table.source().length());
  out.drag_N_s_per_m = table.number("drag", drag, out.drag_N_s_per_m);
  out.angular_drag_N_m_s = table.number("angular_drag", angular_drag, out.angular_drag_N_m_s);
  out.gravity_m_per_s2 = table.vector("gravity", gravity, out.gravity_m_per_s2);
  return out;
}

}  // namespace

std::span<const std::string_view> motion_keys() {
  return all_keys;
}

MotionDescription read_motion(const TableReader& table, const Pose& pose) {
  const std::size_t motion = table.choice("motion", motions, 0);
  if (motion != 1) refuse_keys(table, of_path, motions[motion], "path");
  if (motion != 2) refuse_keys(table, of_free, motions[motion], "free");
  if (motion == 1) return read_path_motion(table, pose);
  if (motion == 2) return read_free_motion(table);
  return {};
}

}  // namespace hybrid
