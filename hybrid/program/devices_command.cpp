// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "device/phantom/hd_errors.h"
#include "device/phantom/phantom.h"
#include "device/simulated/simulated.h"
#include "hybrid/program/commands.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"

namespace hybrid {
namespace {

using Json = nlohmann::ordered_json;

// Zero stands for an unknown value, and JSON has no infinity. Both become null.
Json null_if_unknown(double value) {
  return std::isfinite(value) && value > 0.0 ? Json(value) : Json(nullptr);
}

Json to_json(const device::DeviceLimits& limits) {
  return {{"max_force_N", null_if_unknown(limits.max_force_N)},
          {"max_stiffness_N_per_m", null_if_unknown(limits.max_stiffness_N_per_m)},
          {"resolution_m", null_if_unknown(limits.resolution_m)},
          {"friction_N", null_if_unknown(limits.friction_N)}};
}

Json to_json(const device::Box& box) {
  if (!(box.high_m.x > box.low_m.x)) return nullptr;
  return {{"low_m", {box.low_m.x, box.low_m.y, box.low_m.z}},
          {"high_m", {box.high_m.x, box.high_m.y, box.high_m.z}}};
}

// Calibrates. If standard input is a terminal, first asks the person to hold the arm.
void calibrate(device::PhantomDevice& phantom) {
  if (isatty(STDIN_FILENO) != 0) {
    std::fprintf(stderr,
                 "Hold the arm in its neutral position, all links at right angles, and press Enter. ");
    while (true) {
      const int key = std::fgetc(stdin);
      if (key == '\n' || key == EOF) break;
    }
  }
  phantom.calibrate();
}

Json phantom_row(const DevicesCommand& command, std::string& text) {
  Json row{{"model", "phantom"}, {"simulated", false}};
  try {
    const auto phantom = device::open_phantom();
    if (command.calibrate) calibrate(*phantom);
    const device::PhantomInfo& info = phantom->info();
    const std::string remedy =
        info.calibrated ? "" : std::string(device::calibration_remedy(info.calibration_style));
    row["connected"] = true;
    row["library"] = info.library;
    row["name"] = info.name;
    row["device"] = info.model;
    row["serial"] = info.serial;
    row["vendor"] = info.vendor;
    row["driver_version"] = info.driver_version;
    row["api_version"] = info.api_version;
    row["firmware"] = null_if_unknown(info.firmware);
    row["rate_hz"] = info.rate_hz;
    row["limits"] = to_json(phantom->limits());
    row["continuous_force_N"] = null_if_unknown(info.continuous_force_N);
    row["workspace"] = to_json(info.workspace);
    row["reach"] = to_json(info.reach);
    row["motor_temperature"] = info.motor_temperature;
    row["calibrated"] = info.calibrated;
    if (!remedy.empty()) row["remedy"] = remedy;
    row["notes"] = info.notes;
    const glm::dvec3 size = info.workspace.high_m - info.workspace.low_m;
    text = fmt::format(
        "phantom      {} {}, serial {}, driver {}, firmware {:.4g} ({})\n"
        "             at most {:.3g} N ({:.3g} N for long), {:.0f} Hz, workspace {:.0f} x {:.0f} x {:.0f} "
        "mm, motors "
        "at {:.0f} %\n             {}\n",
        info.vendor, info.model, info.serial, info.driver_version, info.firmware, info.library,
        phantom->limits().max_force_N, info.continuous_force_N, info.rate_hz, size.x * 1e3, size.y * 1e3,
        size.z * 1e3, 100.0 * info.motor_temperature,
        info.calibrated ? "calibrated: ready to be used, as [device] model = \"phantom\" or --device phantom"
                        : "not calibrated: " + remedy);
  } catch (const device::DeviceError& e) {
    row["connected"] = false;
    row["reason"] = e.what();
    text = fmt::format("phantom      not connected\n             {}\n", e.what());
  }
  return row;
}

Json simulated_row(const char* model, device::DeviceModel which, std::string& text) {
  const device::DeviceLimits limits = device::device_limits(which);
  Json row{
      {"model", model}, {"simulated", true}, {"connected", true}, {"device", device::device_name(which)}};
  row["limits"] = to_json(limits);
  text += fmt::format("{:<12} {}", model, device::device_name(which));
  if (std::isfinite(limits.max_force_N)) {
    text += fmt::format(": {:.3g} N, {:.3g} N/mm, {:.3g} mm, friction {:.3g} N", limits.max_force_N,
                        limits.max_stiffness_N_per_m * 1e-3, limits.resolution_m * 1e3, limits.friction_N);
  } else {
    text += ": no limits; follows its path exactly";
  }
  text += '\n';
  return row;
}

}  // namespace

int devices(const DevicesCommand& command) {
  Outputs outputs;
  outputs.ask_json(command.json);
  Json report = report_head("devices");
  std::string real, simulated;
  report["devices"] = Json::array();
  report["devices"].push_back(phantom_row(command, real));
  report["devices"].push_back(simulated_row("premium-1.5", device::DeviceModel::premium_1_5, simulated));
  report["devices"].push_back(simulated_row("touch", device::DeviceModel::touch, simulated));
  report["devices"].push_back(simulated_row("ideal", device::DeviceModel::ideal, simulated));
  outputs.write_json(command.json, report);
  fmt::print(outputs.words(), "{}{}", real, simulated);
  return outputs.failed() ? 1 : 0;
}

}  // namespace hybrid
