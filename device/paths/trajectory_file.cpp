// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/trajectory_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace device {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kExample = "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N";
constexpr std::array<Unit, 2> kForceUnits{{{"_mn", 1e-3}, {"_n", 1.0}}};

enum Role : std::size_t { time, x, y, z, fx, fy, fz, strength, roles };

struct MeasuredColumn {
  std::size_t index = 0;
  double in_si = 1.0;
};
using MeasuredColumns = std::array<std::optional<MeasuredColumn>, roles>;

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

// Fields between commas if there is one, otherwise between blanks or semicolons.
std::vector<std::string_view> fields_of(std::string_view line) {
  if (line.find(',') != std::string_view::npos) return comma_fields(line);
  std::vector<std::string_view> fields;
  constexpr std::string_view kBlank = " \t;";
  for (std::size_t at = line.find_first_not_of(kBlank); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
    fields.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBlank, end);
  }
  return fields;
}

bool is_number(std::string_view text) {
  double value = 0.0;
  const auto [stopped, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && stopped == text.data() + text.size();
}

// The axis (0 to 2) of a name such as fx, force_x, giver_fx or f_x, and the prefix before it.
std::optional<std::size_t> force_axis(std::string_view stem, std::string& of_what) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const std::string_view kind : {"force_"sv, "f_"sv, "f"sv}) {
      const std::string ending = std::string(kind) + "xyz"[axis];
      if (!stem.ends_with(ending)) continue;
      const std::string_view before = stem.substr(0, stem.size() - ending.size());
      if (!before.empty() && before.back() != '_') continue;
      of_what = before.empty() ? "" : std::string(before.substr(0, before.size() - 1));
      return axis;
    }
  }
  return std::nullopt;
}

class ColumnFinder {
 public:
  ColumnFinder(const MeasuredFile& measured, const LineReader& reader, std::vector<std::string>& notes)
      : measured_(measured), reader_(reader), notes_(notes) {}

  MeasuredColumns by_name(const std::vector<std::string_view>& names) {
    for (std::size_t i = 0; i < names.size(); ++i) take(i, names[i]);
    choose_force();
    return columns_;
  }

  // MeasuredColumns of numbers without names.
  MeasuredColumns by_count(std::size_t count) {
    constexpr std::array<std::pair<std::size_t, std::string_view>, 4> kLayouts{
        {{5, "t_s,x_mm,y_mm,z_mm,fn_N"},
         {6, "x_mm,y_mm,z_mm,fx_N,fy_N,fz_N"},
         {7, "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N"},
         {8, "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N,fn_N"}}};
    for (const auto& [columns, layout] : kLayouts) {
      if (columns != count) continue;
      notes_.push_back(name() + ": its " + std::to_string(count) + " columns are not named, and taken as " +
                       std::string(layout) + "; state others with --columns");
      return by_name(comma_fields(layout));
    }
    reader_.refuse(std::to_string(count) + " columns without a name; state them with --columns, as in " +
                   std::string(kExample) + " ('-' for a column to leave out)");
  }

 private:
  [[nodiscard]] std::string name() const { return measured_.file.filename().string(); }

  void set(Role role, std::size_t index, double in_si) {
    if (!columns_[role]) columns_[role] = MeasuredColumn{index, in_si};
  }

  void take(std::size_t index, std::string_view written) {
    const std::string full = lower(written);
    if (unit_of(full, kTimeUnits) && full.starts_with("t")) {
      const std::string_view stem = std::string_view(full).substr(0, full.rfind('_'));
      if (stem == "t" || stem == "time" || stem == "timestamp") {
        return set(time, index, *unit_of(full, kTimeUnits));
      }
    }
    if (full == "t" || full == "time" || full == "timestamp") return set(time, index, 1.0);

    const std::optional<double> newton = unit_of(full, kForceUnits);
    const std::string_view force_stem = newton ? std::string_view(full).substr(0, full.rfind('_')) : full;
    if (force_stem == "fn" || force_stem == "f_normal" || force_stem == "normal_force") {
      return set(strength, index, newton.value_or(1.0));
    }
    std::string of_what;
    if (const auto axis = force_axis(force_stem, of_what)) {
      auto group =
          std::find_if(forces_.begin(), forces_.end(), [&](const Force& f) { return f.of_what == of_what; });
      if (group == forces_.end()) group = forces_.insert(forces_.end(), {of_what, {}});
      group->columns[*axis] = MeasuredColumn{index, newton.value_or(1.0)};
      return;
    }

    const std::optional<double> length = unit_of(full, kLengthUnits);
    const std::string_view stem = length ? std::string_view(full).substr(0, full.rfind('_')) : full;
    for (const Role role : {x, y, z}) {
      const char axis = "xyz"[role - x];
      for (const std::string_view before : {""sv, "p"sv, "pos_"sv, "position_"sv, "device_"sv, "tool_"sv}) {
        if (stem == std::string(before) + axis) set(role, index, length.value_or(measured_.unit_m));
      }
    }
  }

  // The requested force, the one without a prefix, or the only one.
  void choose_force() {
    const auto whole = [](const Force& f) { return f.columns[0] && f.columns[1] && f.columns[2]; };
    std::erase_if(forces_, [&](const Force& f) { return !whole(f); });
    auto chosen = std::find_if(forces_.begin(), forces_.end(),
                               [&](const Force& f) { return f.of_what == lower(measured_.force); });
    if (chosen == forces_.end() && measured_.force.empty() && forces_.size() == 1) chosen = forces_.begin();
    if (chosen == forces_.end()) {
      if ((forces_.empty() && measured_.force.empty()) || !measured_.needs_force) return;
      std::string known;
      for (const Force& f : forces_)
        known += (known.empty() ? "" : ", ") + (f.of_what.empty() ? "''" : f.of_what);
      reader_.refuse(
          (measured_.force.empty() ? std::string("several forces") : "no force '" + measured_.force + "'") +
          " in the columns; choose one with --force: " + (known.empty() ? "there is none" : known));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) columns_[fx + axis] = chosen->columns[axis];
  }

  struct Force {
    std::string of_what;
    std::array<std::optional<MeasuredColumn>, 3> columns;
  };
  const MeasuredFile& measured_;
  const LineReader& reader_;
  std::vector<std::string>& notes_;
  MeasuredColumns columns_;
  std::vector<Force> forces_;
};

// The columns; `is_row` tells whether the first line is already a row of numbers.
MeasuredColumns find_measured_columns(const MeasuredFile& measured, const LineReader& reader,
                                      std::string_view first, bool& is_row, std::vector<std::string>& notes) {
  ColumnFinder finder(measured, reader, notes);
  const std::vector<std::string_view> fields = fields_of(first);
  is_row = !fields.empty() && std::all_of(fields.begin(), fields.end(), is_number);
  if (!measured.columns.empty()) return finder.by_name(comma_fields(measured.columns));
  if (!is_row) return finder.by_name(fields);
  const std::vector<std::string_view> commented = fields_of(reader.comment());
  if (commented.size() == fields.size()) {
    const MeasuredColumns columns = ColumnFinder(measured, reader, notes).by_name(commented);
    if (columns[x] && columns[y] && columns[z]) return columns;
  }
  return finder.by_count(fields.size());
}

void require(const MeasuredFile& measured, const LineReader& reader, const MeasuredColumns& columns) {
  if (!columns[x] || !columns[y] || !columns[z]) {
    reader.refuse("no columns x, y and z; name them in a header, or with --columns, as in " +
                  std::string(kExample));
  }
  if (measured.needs_force && !columns[fx] && !columns[strength]) {
    reader.refuse(
        "no columns of a force (fx, fy, fz, or fn for its strength alone); a comparison needs what was "
        "measured");
  }
}

}  // namespace

MeasuredTrajectory read_measured(const MeasuredFile& measured) {
  LineReader reader(measured.file);
  MeasuredTrajectory result;
  std::string_view line;
  if (!reader.next(line))
    throw PathError(measured.file.string() + ": is empty; it must have rows of numbers");
  bool is_row = false;
  const MeasuredColumns columns = find_measured_columns(measured, reader, line, is_row, result.notes);
  require(measured, reader, columns);
  std::size_t last = 0;
  for (const auto& column : columns) last = std::max(last, column ? column->index : 0);
  const std::string name = measured.file.filename().string();
  if (!columns[time]) {
    result.notes.push_back(name + ": without times; taken as " + short_number(measured.rate_hz) +
                           " samples a second (--rate states another)");
  }

  const double sign = measured.on_object ? -1.0 : 1.0;
  double first_t_s = 0.0;
  std::size_t rows = 0, repeated = 0;
  for (bool more = is_row || reader.next(line); more; more = reader.next(line), ++rows) {
    const std::vector<std::string_view> fields = fields_of(line);
    if (fields.size() <= last) {
      reader.refuse("only " + std::to_string(fields.size()) + " columns where " + std::to_string(last + 1) +
                    " are needed; complete or leave out the line");
    }
    const auto value = [&](std::size_t role) {
      return columns[role] ? reader.number(fields[columns[role]->index]) * columns[role]->in_si : 0.0;
    };
    const double file_time_s = columns[time] ? value(time) : static_cast<double>(rows) / measured.rate_hz;
    if (rows == 0) first_t_s = file_time_s;
    const double t_s = file_time_s - first_t_s;
    if (!result.t_s.empty() && t_s < result.t_s.back()) {
      reader.refuse("time runs backwards, by " + short_number(result.t_s.back() - t_s) +
                    " s; sort the rows by time, or cut the file where a new recording begins");
    }
    if (!result.t_s.empty() && t_s == result.t_s.back()) {  // the later sample replaces the earlier
      ++repeated;
      result.t_s.pop_back();
      result.position_m.pop_back();
      if (!result.force_N.empty()) result.force_N.pop_back();
      if (!result.strength_N.empty()) result.strength_N.pop_back();
    }
    result.t_s.push_back(t_s);
    result.position_m.emplace_back(value(x), value(y), value(z));
    if (columns[fx]) {
      result.force_N.push_back(sign * glm::dvec3(value(fx), value(fy), value(fz)));
    } else if (columns[strength]) {
      result.strength_N.push_back(std::abs(value(strength)));
    }
  }
  if (result.t_s.empty()) throw PathError(measured.file.string() + ": has a header but no rows");
  if (repeated > 0) {
    result.notes.push_back(name + ": " + std::to_string(repeated) +
                           (repeated == 1 ? " sample repeats" : " samples repeat") +
                           " the time of the one before and stand in its place");
  }
  result.gaps = find_gaps(result.t_s);
  if (std::string words = gaps_in_words(name, result.t_s, result.gaps); !words.empty()) {
    result.notes.push_back(std::move(words));
  }
  return result;
}

bool measured_at(const MeasuredTrajectory& trajectory, double t_s, std::size_t& before,
                 double& share) noexcept {
  const std::vector<double>& t = trajectory.t_s;
  const auto after = std::upper_bound(t.begin(), t.end(), t_s);
  before = after == t.begin() ? 0 : static_cast<std::size_t>(after - t.begin()) - 1;
  share = after == t.begin() || after == t.end() ? 0.0 : (t_s - t[before]) / (t[before + 1] - t[before]);
  const bool exact = share == 0.0;
  return exact || !std::binary_search(trajectory.gaps.before.begin(), trajectory.gaps.before.end(), before);
}

}  // namespace device
