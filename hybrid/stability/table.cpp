// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stability/table.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "hybrid/base/table.h"

namespace hybrid {
namespace {

nlohmann::ordered_json or_null(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json row_json(const StabilityRow& row) {
  const LoopSetting& s = row.setting;
  nlohmann::ordered_json j{
      {"kind", name_of(row.kind)},
      {"stiffness_N_per_m", row.coupling_N_per_m.value_or(row.measured.value_or(row.stiffest))},
      {"damping_N_s_per_m", row.damping_N_s_per_m()},
      {"wall_damping_N_s_per_m", s.wall_damping_N_s_per_m},
      {"rate_hz", s.rate_hz},
      {"delay_s", s.delay_ticks * s.period_s()},
      {"quantisation_m", s.encoder_m()},
      {"friction_N", s.friction_N()},
      {"mass_kg", held_loop(s).mass_kg},
      {"grip", row.grip},
      {"device", row.device.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(row.device)},
      {"measured", or_null(row.measured)},
      {"theory", or_null(row.theory)},
      {"theory_name",
       row.theory_name.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(row.theory_name)},
      {"error", or_null(row.error())},
      {"lower_bound", or_null(row.lower_bound)},
      {"varied", title_of(row.sweep)}};
  if (row.young_Pa) j["young_Pa"] = *row.young_Pa;
  j["unit"] = row.coupling_N_per_m ? "Pa" : "N/m";  // unit of the measured figure
  if (row.kind == Boundary::buzz) {
    j["frequency_hz"] = row.measured ? nlohmann::ordered_json(row.vibration.frequency_hz) : nullptr;
    j["amplitude_m"] = row.measured ? nlohmann::ordered_json(row.vibration.amplitude_m) : nullptr;
    j["nominal_stiffness_N_per_m"] = or_null(row.nominal_N_per_m);
    j["felt_at_nominal"] = or_null(row.felt_at_nominal);
  }
  return j;
}

std::string number(const std::optional<double>& value) {
  return value ? fmt::format("{:.0f}", *value) : "-";
}

std::string measured_text(const StabilityRow& row) {
  const double unit = row.coupling_N_per_m ? 1e3 : 1.0;  // moduli are shown in kPa
  return row.measured ? fmt::format("{:.0f}", *row.measured / unit)
                      : fmt::format("> {:.0f}", row.stiffest / unit);
}

std::string note_of(const StabilityRow& row) {
  std::string note;
  if (!row.device.empty()) note = row.device.substr(0, row.device.find(" (")) + "; ";
  if (row.coupling_N_per_m) note += fmt::format("kPa, of a coupling of {:.0f} N/m; ", *row.coupling_N_per_m);
  if (row.young_Pa) note += fmt::format("{:.0f} kPa; ", *row.young_Pa / 1e3);
  if (row.lower_bound) note += fmt::format("at least {:.0f}; ", *row.lower_bound);
  if (row.kind == Boundary::buzz && row.measured)
    note +=
        fmt::format("{:.0f} Hz, {:.3g} µm; ", row.vibration.frequency_hz, row.vibration.amplitude_m * 1e6);
  if (row.felt_at_nominal) {
    const double felt = *row.felt_at_nominal;
    const std::string share = felt < 1e-3 ? "at rest" : fmt::format("{:.2g} of what is felt", felt);
    note += fmt::format("at its nominal {:.0f} N/m {} ({}); ", *row.nominal_N_per_m,
                        felt > 1.0 ? "it buzzes" : "calm", share);
  }
  if (!note.empty()) note.resize(note.size() - 2);
  return note;
}

const Table<StabilityRow>& sweep_table() {
  const auto format = [](const char* form, auto value) {
    return [form, value](const StabilityRow& row) { return fmt::format(fmt::runtime(form), value(row)); };
  };
  static const Table<StabilityRow> table({
      {{"kind"}, 8, Side::left, [](const StabilityRow& row) { return std::string(name_of(row.kind)); }},
      {{"b"},
       6,
       Side::right,
       format("{:.3g}", [](const StabilityRow& row) { return row.damping_N_s_per_m(); })},
      {{"wall B"},
       6,
       Side::right,
       format("{:.3g}", [](const StabilityRow& row) { return row.setting.wall_damping_N_s_per_m; })},
      {{"rate Hz"},
       7,
       Side::right,
       format("{:.0f}", [](const StabilityRow& row) { return row.setting.rate_hz; })},
      {{"delay"},
       6,
       Side::right,
       format("{}", [](const StabilityRow& row) { return row.setting.delay_ticks; })},
      {{"mm"},
       6,
       Side::right,
       format("{:.3g}", [](const StabilityRow& row) { return row.setting.encoder_m() * 1e3; })},
      {{"N"},
       6,
       Side::right,
       format("{:.3g}", [](const StabilityRow& row) { return row.setting.friction_N(); })},
      {{"grip"}, 7, Side::left, [](const StabilityRow& row) { return row.grip; }},
      {{"K N/m"}, 9, Side::right, measured_text},
      {{"theory"}, 9, Side::right, [](const StabilityRow& row) { return number(row.theory); }},
      {{"off by"},
       7,
       Side::right,
       [](const StabilityRow& row) {
         return row.error() ? fmt::format("{:+.2f} %", 100.0 * *row.error()) : std::string();
       }},
  });
  return table;
}

void add_sweep(std::string& text, const StabilityReport& report, StabilitySweep sweep) {
  bool first = true;
  for (const StabilityRow& row : report.rows) {
    if (row.sweep != sweep) continue;
    if (first) text += fmt::format("\n{}\n{}", title_of(sweep), sweep_table().head());
    first = false;
    text += sweep_table().line(row, " " + note_of(row));
  }
}

}  // namespace

void add_to_json(const StabilityReport& report, nlohmann::ordered_json& json) {
  json["scene"] = report.scene;
  json["seconds"] = report.seconds;
  json["processor_seconds"] = report.processor_seconds;
  for (const Boundary kind : {Boundary::stable, Boundary::passive}) {
    const Agreement all = agreement(report, kind);
    json["agreement"][std::string(name_of(kind))] = {{"rows", all.rows}, {"worst_error", all.worst}};
  }
  json["rows_below_bound"] = below_bound(report);
  json["rows"] = nlohmann::ordered_json::array();
  for (const StabilityRow& row : report.rows) json["rows"].push_back(row_json(row));
}

std::string stability_tables(const StabilityReport& report) {
  std::string text =
      "K is the stiffness of the virtual coupling up to which the loop is stable or passive, or at which a "
      "steady\n"
      "press begins to buzz. b and B in N s/m, delay in ticks, encoder in mm, Coulomb friction in N.\n";
  for (const StabilitySweep sweep : {StabilitySweep::damping, StabilitySweep::wall_damping,
                                     StabilitySweep::rate, StabilitySweep::grip, StabilitySweep::quantisation,
                                     StabilitySweep::account, StabilitySweep::device, StabilitySweep::tissue})
    add_sweep(text, report, sweep);
  text += '\n';
  for (const Boundary kind : {Boundary::stable, Boundary::passive}) {
    const Agreement all = agreement(report, kind);
    if (all.rows == 0) continue;
    fmt::format_to(std::back_inserter(text), "{}: {} rows beside theory, at most {:.2f} % off\n",
                   name_of(kind), all.rows, 100.0 * all.worst);
  }
  int bounded = 0;
  for (const StabilityRow& row : report.rows) bounded += row.lower_bound ? 1 : 0;
  if (bounded > 0)
    fmt::format_to(std::back_inserter(text),
                   "lower bound of friction and quantisation: {} rows, {} below it\n", bounded,
                   below_bound(report));
  fmt::format_to(std::back_inserter(text), "{:.0f} s, {:.0f} s of one core\n", report.seconds,
                 report.processor_seconds);
  return text;
}

}  // namespace hybrid
