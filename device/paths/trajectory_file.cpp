// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/trajectory_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "device/paths/file_columns.h"
#include "device/paths/line_reader.h"
#include "device/paths/row_fields.h"

namespace device {
namespace {

constexpr double kGapFactor = 10.0;  // a step longer than this many median steps is a gap
constexpr double kDay_s = 86'400.0;
// Seconds since 1970, from September 2001 to the end of 2099. If a first time without a unit lies in this
// range when read as ms, µs or ns, it counts milliseconds, microseconds or nanoseconds since 1970.
constexpr double kEpochFrom_s = 1e9, kEpochTo_s = 4.1e9;
constexpr double kLatest_s = 1e11;      // above all seconds since the year 0
constexpr double kSlowestStep_s = 1.0;  // if the median step is this long, the unit may not be seconds
// Largest coordinate (unit: m), as in a scene, and largest force (unit: N). Beyond it, motions between
// samples, and squares of forces, would overflow.
constexpr double kLargest = 1e9;

struct ClockUnit {
  double in_s;
  std::string_view name, ending;
};
constexpr std::array<ClockUnit, 3> kClockUnits{
    {{1e-3, "milliseconds", "_ms"}, {1e-6, "microseconds", "_us"}, {1e-9, "nanoseconds", "_ns"}}};

double median_step_s(const std::vector<double>& t_s) {
  std::vector<double> steps(t_s.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = t_s[i + 1] - t_s[i];
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

Gaps find_gaps(const std::vector<double>& t_s) {
  Gaps gaps;
  if (t_s.size() < 3) return gaps;
  gaps.limit_s = kGapFactor * median_step_s(t_s);
  for (std::size_t i = 0; i + 1 < t_s.size(); ++i) {
    const double step_s = t_s[i + 1] - t_s[i];
    if (step_s <= gaps.limit_s) continue;
    gaps.before.push_back(i);
    if (step_s > gaps.longest_s) {
      gaps.longest_s = step_s;
      gaps.longest_before = i;
    }
  }
  return gaps;
}

std::string gaps_in_words(const std::vector<double>& t_s, const Gaps& gaps) {
  return std::to_string(gaps.before.size()) + (gaps.before.size() == 1 ? " gap" : " gaps") +
         " of more than " + short_number(gaps.limit_s) + " s (10 usual steps), the longest " +
         short_number(gaps.longest_s) + " s at t = " + short_number(t_s[gaps.longest_before]) +
         " s; the hand moves straight across";
}

// Reads the rows below the heading.
class RowReader {
 public:
  RowReader(const MeasuredFile& measured, LineReader& reader, FileColumns columns)
      : measured_(measured), reader_(reader), columns_(std::move(columns)) {
    for (std::string& note : columns_.notes) out_.notes.push_back(std::move(note));
    if (!columns_.role[role_time]) {
      note("without times; taken as " + short_number(measured_.rate_hz) +
           " samples a second (--rate states another)");
    }
    if (!columns_.role[role_x]->unit_is_stated) {
      note("its lengths state no unit; taken as " +
           (measured_.as_path ? "the scene's, " + short_number(1e3 * measured_.unit_m) + " mm" : "mm") +
           " (x_mm in the heading states it)");
    }
  }

  MeasuredTrajectory read(std::string_view line) {
    for (bool more = columns_.has_row; more; more = reader_.next(line)) {
      split_row(reader_, columns_, line, fields_);
      if (!fields_.empty()) add_row();
    }
    if (out_.t_s.empty()) throw PathError(measured_.file.string() + ": has a header but no rows");
    finish();
    return std::move(out_);
  }

 private:
  void note(const std::string& text) {
    out_.notes.push_back(measured_.file.filename().string() + ": " + text);
  }

  template <typename Real = double>
  [[nodiscard]] Real number(std::size_t role) const {
    const std::string_view field = fields_[columns_.role[role]->index];
    if (const auto value = number_in<Real>(field, columns_.mark)) return *value;
    std::string what = shown(field) + " is not a finite number";
    if (columns_.mark == DecimalMark::comma) what += " with a decimal comma, as others of this file";
    what += role == role_time && field.find(':') != std::string_view::npos
                ? "; write times as numbers, in seconds or in the unit of the heading"
                : "; correct or leave out the line";
    reader_.refuse(what);
  }
  [[nodiscard]] double in_si(std::size_t role) const {
    const double value = number(role) * columns_.role[role]->in_si;
    if (role == role_time || std::abs(value) <= kLargest) return value;
    reader_.refuse(shown(fields_[columns_.role[role]->index]) + " is more than " + short_number(kLargest) +
                   (role < role_fx ? " m" : " N") + "; correct or leave out the line");
  }
  [[nodiscard]] glm::dvec3 vector_in_si(std::size_t first) const {
    return {in_si(first), in_si(first + 1), in_si(first + 2)};
  }

  void add_row() {
    const double t_s = time_s();
    const glm::dvec3 position_m = vector_in_si(role_x);
    glm::dvec3 force_N(0.0);
    if (columns_.role[role_fx]) force_N = (measured_.on_object ? -1.0 : 1.0) * vector_in_si(role_fx);
    if (columns_.role[role_strength]) force_N.x = std::abs(in_si(role_strength));
    if (!out_.t_s.empty() && t_s < out_.t_s.back()) {
      reader_.refuse("time runs backwards, by " + short_number(out_.t_s.back() - t_s) +
                     " s; sort the rows by time, or cut the file where a new recording begins");
    }
    if (t_s > kDay_s) {
      reader_.refuse("the recording lasts longer than a day, " + short_number(t_s) +
                     " s so far; state the unit of its times in the heading, as in t_ms or t_ns, or cut it");
    }
    if (!out_.t_s.empty() && t_s == out_.t_s.back()) {  // the later sample replaces the earlier one
      if (repeated_++ == 0) first_repeated_line_ = reader_.line();
    } else {
      out_.t_s.push_back(t_s);
    }
    out_.position_m.resize(out_.t_s.size());
    out_.position_m.back() = position_m;
    if (columns_.role[role_fx]) {
      out_.force_N.resize(out_.t_s.size());
      out_.force_N.back() = force_N;
    } else if (columns_.role[role_strength]) {
      out_.strength_N.resize(out_.t_s.size());
      out_.strength_N.back() = force_N.x;
    }
    ++rows_;
  }

  // Time since the first sample. The first time is subtracted before the conversion to double, because
  // nanoseconds since 1970 have 19 digits.
  double time_s() {
    if (!columns_.role[role_time]) return static_cast<double>(rows_) / measured_.rate_hz;
    FileColumn& column = *columns_.role[role_time];
    if (rows_ == 0) {
      first_ = number<long double>(role_time);
      recognise_clock(column);
    }
    if (first_ == 0.0L) return in_si(role_time);
    return static_cast<double>(number<long double>(role_time) - first_) * column.in_si;
  }

  void recognise_clock(FileColumn& column) {
    const double first = static_cast<double>(first_);
    for (const ClockUnit& unit : kClockUnits) {
      if (column.unit_is_stated || first * unit.in_s < kEpochFrom_s || first * unit.in_s > kEpochTo_s)
        continue;
      column.in_si = unit.in_s;
      column.unit_is_stated = true;
      note("its times name no unit, and by their size are " + std::string(unit.name) +
           " since 1970; taken as such (t" + std::string(unit.ending) + " in the heading states it)");
    }
    if (std::abs(first * column.in_si) <= kLatest_s) return;
    reader_.refuse("its first time is " + short_number(first * column.in_si) +
                   " s, beyond any calendar; state the unit of its times in the heading, as in t_ms or t_ns");
  }

  void finish() {
    if (first_ != 0.0L) {
      note("its first time, " + short_number(static_cast<double>(first_) * columns_.role[role_time]->in_si) +
           " s, is taken as 0");
    }
    if (repeated_ > 0) {
      note(std::to_string(repeated_) + (repeated_ == 1 ? " sample repeats" : " samples repeat") +
           " the time of the one before and stand in its place (the first in line " +
           std::to_string(first_repeated_line_) + ")");
    }
    const auto& time = columns_.role[role_time];
    if (time && !time->unit_is_stated && out_.t_s.size() > 1 && median_step_s(out_.t_s) >= kSlowestStep_s) {
      note("its times name no unit and are taken as seconds, so a usual step is " +
           short_number(median_step_s(out_.t_s)) + " s; if they are others, state it, as in t_ms");
    }
    out_.gaps = find_gaps(out_.t_s);
    if (!out_.gaps.before.empty()) note(gaps_in_words(out_.t_s, out_.gaps));
  }

  const MeasuredFile& measured_;
  LineReader& reader_;
  FileColumns columns_;
  MeasuredTrajectory out_;
  std::vector<std::string_view> fields_;
  long double first_ = 0.0L;  // the first time, in the unit of its column
  std::size_t rows_ = 0, repeated_ = 0, first_repeated_line_ = 0;
};

}  // namespace

MeasuredTrajectory read_measured(const MeasuredFile& measured) {
  LineReader reader(measured.file);
  std::string_view line;
  if (!reader.next(line)) {
    throw PathError(measured.file.string() +
                    (measured.as_path ? ": is empty; it must have a header (t_s,x_m,y_m,z_m) and rows"
                                      : ": is empty; it must have rows of numbers"));
  }
  FileColumns columns = find_file_columns(measured, reader, line);
  return RowReader(measured, reader, std::move(columns)).read(line);
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
