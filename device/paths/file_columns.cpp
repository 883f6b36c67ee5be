// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/file_columns.h"

#include <algorithm>
#include <utility>

#include "device/paths/column_names.h"

namespace device {
namespace {

using namespace std::string_view_literals;

using Names = std::vector<std::string>;

constexpr std::string_view kPathExample = "t_s,x_mm,y_mm,z_mm";
constexpr std::string_view kMeasuredExample = "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N";
constexpr std::array kSeparators{Separator::semicolon, Separator::tab, Separator::comma, Separator::blanks};

std::string how_to_name(const MeasuredFile& measured) {
  return measured.as_path
             ? "name them in a heading, with their units, as in " + std::string(kPathExample)
             : "name them in a heading, or with --columns, as in " + std::string(kMeasuredExample);
}

// The columns of one vector, one for each axis.
struct Vector {
  std::string of_what;
  int rank = 0;
  std::array<std::optional<std::size_t>, 3> columns{};
  std::optional<std::size_t> twice{};  // a second column for an axis

  [[nodiscard]] bool whole() const { return columns[0] && columns[1] && columns[2]; }
  [[nodiscard]] std::string name() const { return of_what.empty() ? "''" : of_what; }
};

// The columns that a list of names describes. `problem` says why they are missing or ambiguous; empty: they
// are clear.
class NamedColumns {
 public:
  NamedColumns(const MeasuredFile& measured, const Names& names) : measured_(measured), names_(names) {
    for (const std::string& name : names) read_.push_back(read_column_name(name));
    for (std::size_t i = 0; i < read_.size(); ++i) {
      if (read_[i].quantity == Quantity::position) add(positions_, i);
      if (read_[i].quantity == Quantity::force) add(forces_, i);
    }
    std::erase_if(forces_, [](const Vector& f) { return !f.whole(); });
    recognised = static_cast<std::size_t>(std::count_if(
        read_.begin(), read_.end(), [](const ColumnName& name) { return name.quantity != Quantity::other; }));
    choose_position();
    choose_time();
    choose_force();
    choose_strength();
    if (problem.empty() && measured_.needs_force && !role[role_fx] && !role[role_strength]) {
      problem =
          "no columns of a force (fx, fy, fz, or fn for its strength alone); a comparison needs what was "
          "measured";
    }
  }

  std::array<std::optional<FileColumn>, roles> role{};
  std::string problem;
  std::size_t recognised = 0;  // number of columns whose quantity is known

 private:
  void add(std::vector<Vector>& vectors, std::size_t i) {
    const ColumnName& name = read_[i];
    auto same = std::find_if(vectors.begin(), vectors.end(), [&](const Vector& v) {
      return v.of_what == name.of_what && v.rank == name.rank;
    });
    if (same == vectors.end()) same = vectors.insert(vectors.end(), {name.of_what, name.rank});
    if (same->columns[name.axis]) {
      same->twice = i;
    } else {
      same->columns[name.axis] = i;
    }
  }

  void take(std::size_t to, std::size_t i, double in_si_without_unit) {
    const ColumnName& name = read_[i];
    if (problem.empty() && !name.unknown_unit.empty()) {
      problem = "the unit " + shown(name.unknown_unit) + " of column " + shown(names_[i]) +
                " is not known; write one of " + std::string(known_units(name.quantity));
    }
    role[to] = FileColumn{i, name.in_si.value_or(in_si_without_unit), name.in_si.has_value()};
  }

  void take(std::size_t first, const Vector& vector, double in_si_without_unit) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      take(first + axis, *vector.columns[axis], in_si_without_unit);
    if (!vector.twice) return;
    const std::size_t axis = read_[*vector.twice].axis;
    say_twice(std::string(1, "xyz"[axis]), *vector.columns[axis], *vector.twice);
  }

  void say_twice(const std::string& what, std::size_t a, std::size_t b) {
    if (!problem.empty()) return;
    problem = "two columns for " + what + ", " + shown(names_[a]) + " and " + shown(names_[b]) +
              "; rename the one to leave out";
    if (!measured_.as_path) problem += ", or state the columns with --columns";
  }

  void choose_position() {
    const Vector* best = nullptr;
    const Vector* other = nullptr;
    for (const Vector& v : positions_) {
      if (!v.whole() || (v.rank == kTranslationRank && !forces_.empty())) continue;
      if (best == nullptr || v.rank < best->rank) {
        best = &v;
        other = nullptr;
      } else if (v.rank == best->rank) {
        other = &v;
      }
    }
    if (best == nullptr) return say_missing();
    if (other != nullptr) {
      problem =
          "several positions, " + best->name() + " and " + other->name() + "; rename those to leave out";
      if (!measured_.as_path) problem += ", or state the columns with --columns";
      return;
    }
    take(role_x, *best, measured_.unit_m);
  }

  void say_missing() {
    std::string missing;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool there = std::any_of(positions_.begin(), positions_.end(),
                                     [&](const Vector& v) { return v.columns[axis].has_value(); });
      if (!there) missing += std::string(missing.empty() ? "" : ", ") + "xyz"[axis];
    }
    problem = missing.empty() ? "no columns x, y and z that belong together"
                              : "no columns x, y and z: nothing is named " + missing;
    problem += list_of_names() + "; " + how_to_name(measured_);
  }

  [[nodiscard]] std::string list_of_names() const {
    constexpr std::size_t kMost = 8;
    std::string list = ". It reads ";
    for (std::size_t i = 0; i < std::min(names_.size(), kMost); ++i)
      list += (i == 0 ? "" : ", ") + shown(names_[i]);
    return list + (names_.size() > kMost ? ", ..." : "");
  }

  void choose_time() {
    std::vector<std::size_t> best;  // columns of the lowest rank
    for (std::size_t i = 0; i < read_.size(); ++i) {
      if (read_[i].quantity != Quantity::time) continue;
      if (!best.empty() && read_[i].rank > read_[best[0]].rank) continue;
      if (!best.empty() && read_[i].rank < read_[best[0]].rank) best.clear();
      best.push_back(i);
    }
    if (!best.empty()) take(role_time, best[0], 1.0);
    if (best.size() > 1) say_twice("the time", best[0], best[1]);
    if (best.empty() && measured_.as_path && problem.empty()) {
      problem = "no column of times" + list_of_names() + "; " + how_to_name(measured_);
    }
  }

  // Chooses the requested force; without a request, the force without a prefix or the only force.
  void choose_force() {
    const std::string wanted = joined_words(measured_.force);
    auto chosen =
        std::find_if(forces_.begin(), forces_.end(), [&](const Vector& f) { return f.of_what == wanted; });
    if (chosen == forces_.end() && wanted.empty() && forces_.size() == 1) chosen = forces_.begin();
    if (chosen != forces_.end()) {
      if (measured_.needs_force) take(role_fx, *chosen, 1.0);
      return;
    }
    if ((forces_.empty() && wanted.empty()) || !measured_.needs_force || !problem.empty()) return;
    std::string known;
    for (const Vector& f : forces_) known += (known.empty() ? "" : ", ") + f.name();
    problem = (wanted.empty() ? std::string("several forces") : "no force '" + measured_.force + "'") +
              " in the columns; choose one with --force: " + (known.empty() ? "there is none" : known);
  }

  void choose_strength() {
    if (!measured_.needs_force || role[role_fx]) return;
    for (std::size_t i = 0; i < read_.size(); ++i) {
      if (read_[i].quantity != Quantity::strength) continue;
      if (role[role_strength]) return say_twice("the strength", role[role_strength]->index, i);
      take(role_strength, i, 1.0);
    }
  }

  const MeasuredFile& measured_;
  const Names& names_;
  std::vector<ColumnName> read_;
  std::vector<Vector> positions_, forces_;
};

Names names_in(std::string_view line, Separator separator) {
  std::vector<std::string_view> fields;
  if (!split_names(line, separator, fields)) return {};
  return {fields.begin(), fields.end()};
}

// The separator of a line like "sep=;", which spreadsheets write first.
std::optional<Separator> stated_separator(std::string_view line) {
  const std::string lower = lower_ascii(line);
  std::string_view text = lower;
  if (text.starts_with('"')) text.remove_prefix(1);
  if (!text.starts_with("sep=")) return std::nullopt;
  for (const Separator separator : {Separator::semicolon, Separator::tab, Separator::comma}) {
    if (text.substr(4).starts_with(static_cast<char>(separator))) return separator;
  }
  return std::nullopt;
}

bool is_row_of_numbers(std::string_view line, Separator separator) {
  std::vector<std::string_view> fields;
  if (!split_fields(line, separator, fields)) return false;
  bool any = false;
  for (const std::string_view field : fields) {
    if (!field.empty() && !looks_like_number(field)) return false;
    any = any || !field.empty();
  }
  return any;
}

// If `line`, below the names, is a row of units: adds the units to the names and returns true.
bool add_units(std::string_view line, Separator separator, Names& names) {
  const Names units = names_in(line, separator);
  Names with_units = names;
  if (units.size() > names.size()) return false;
  bool any = false;
  for (std::size_t i = 0; i < units.size(); ++i) {
    if (units[i].empty() || units[i] == "-") continue;
    std::string_view unit = units[i];
    if (unit.size() > 2 && (unit.front() == '[' || unit.front() == '('))
      unit = unit.substr(1, unit.size() - 2);
    if (!unit_in(unit)) return false;
    with_units[i].append(" [").append(unit).append("]");
    any = true;
  }
  if (any) names = std::move(with_units);
  return any;
}

class Finder {
 public:
  Finder(const MeasuredFile& measured, LineReader& reader, std::string_view& line)
      : measured_(measured), reader_(reader), line_(line) {}

  FileColumns find() {
    std::optional<Separator> stated = stated_separator(line_);
    if (stated && !reader_.next(line_)) reader_.refuse("a file without rows");
    out_.separator = stated.value_or(separator_of_numbers(line_));
    out_.has_row = is_row_of_numbers(line_, out_.separator);
    if (!measured_.columns.empty()) {
      by_user(stated);
    } else if (by_comment()) {
      out_.has_row = true;
    } else if (!out_.has_row) {
      by_heading(stated);
    } else {
      by_count();
    }
    for (const auto& column : out_.role) out_.needed = std::max(out_.needed, column ? column->index + 1 : 0);
    return std::move(out_);
  }

 private:
  [[nodiscard]] std::string file() const { return measured_.file.filename().string(); }

  void take(const Names& names, std::size_t line) {
    const NamedColumns named(measured_, names);
    if (!named.problem.empty()) reader_.refuse(named.problem, line);
    out_.role = named.role;
    out_.count = names.size();
  }

  // Takes the first separator with which the heading names all that is needed. If there is none, takes the
  // separator with the most known names.
  void by_heading(const std::optional<Separator>& stated) {
    Names best;
    std::size_t most = 0;
    if (stated) best = names_in(line_, *stated);
    for (const Separator separator : kSeparators) {
      if (stated) break;
      if (separator != Separator::blanks &&
          line_.find(static_cast<char>(separator)) == std::string_view::npos)
        continue;
      Names names = names_in(line_, separator);
      const NamedColumns named(measured_, names);
      const bool fits = named.problem.empty();
      if (!fits && !best.empty() && named.recognised <= most) continue;
      best = std::move(names);
      most = named.recognised;
      out_.separator = separator;
      if (fits) break;
    }
    const std::size_t heading = reader_.line();
    if (best.empty()) reader_.refuse("a quotation mark that is not closed; close it, or leave it out");
    out_.has_row = reader_.next(line_);
    if (out_.has_row && add_units(line_, out_.separator, best)) out_.has_row = reader_.next(line_);
    take(best, heading);
  }

  void by_user(const std::optional<Separator>& stated) {
    const Names names = names_in(measured_.columns, Separator::comma);
    for (const Separator separator : kSeparators) {
      if (out_.has_row || stated) break;
      if (names_in(line_, separator).size() == names.size()) {
        out_.separator = separator;
        break;
      }
    }
    take(names, reader_.line());
    if (!out_.has_row) out_.has_row = reader_.next(line_);
  }

  // Takes the names from the comment above the first row, if it has a name for each field, and the row has
  // numbers where they are needed. Other fields may hold text.
  bool by_comment() {
    std::vector<std::string_view> fields;
    (void)split_fields(line_, out_.separator, fields);
    for (const Separator separator : kSeparators) {
      const Names names = names_in(reader_.comment(), separator);
      if (names.size() != fields.size()) continue;
      const NamedColumns named(measured_, names);
      const bool fits = std::all_of(named.role.begin(), named.role.end(), [&](const auto& column) {
        return !column || looks_like_number(fields[column->index]);
      });
      if (!named.problem.empty() || !fits) continue;
      take(names, reader_.line());
      return true;
    }
    return false;
  }

  void by_count() {
    std::vector<std::string_view> fields;
    (void)split_fields(line_, out_.separator, fields);
    if (measured_.as_path) {
      reader_.refuse("a row of numbers without a heading; " + how_to_name(measured_));
    }
    constexpr std::array<std::pair<std::size_t, std::string_view>, 4> kLayouts{
        {{5, "t_s,x_mm,y_mm,z_mm,fn_N"},
         {6, "x_mm,y_mm,z_mm,fx_N,fy_N,fz_N"},
         {7, "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N"},
         {8, "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N,fn_N"}}};
    for (const auto& [count, layout] : kLayouts) {
      if (count != fields.size()) continue;
      out_.notes.push_back(file() + ": its " + std::to_string(count) +
                           " columns are not named, and taken as " + std::string(layout) +
                           "; state others with --columns");
      return take(names_in(layout, Separator::comma), reader_.line());
    }
    reader_.refuse(std::to_string(fields.size()) +
                   " columns without a name; state them with --columns, as in " +
                   std::string(kMeasuredExample) + " ('-' for a column to leave out)");
  }

  const MeasuredFile& measured_;
  LineReader& reader_;
  std::string_view& line_;
  FileColumns out_;
};

// Finds the decimal mark, by the first unambiguous number from line `first` on in a column that is read.
void find_decimal_mark(const MeasuredFile& measured, std::size_t first, FileColumns& columns) {
  LineReader reader(measured.file);
  std::vector<std::string_view> fields;
  std::size_t unclear_line = 0;
  std::string unclear;
  for (std::string_view line; reader.next(line);) {
    if (reader.line() < first || !split_fields(line, columns.separator, fields)) continue;
    for (const auto& column : columns.role) {
      if (!column || column->index >= fields.size()) continue;
      const std::string_view field = fields[column->index];
      const ShownMark mark = shown_mark(field);
      if (mark == ShownMark::point) return;
      if (mark == ShownMark::comma) {
        columns.mark = DecimalMark::comma;
        return;
      }
      if (mark == ShownMark::unclear_comma && unclear_line == 0) {
        unclear_line = reader.line();
        unclear = field;
      }
    }
  }
  if (unclear_line == 0) return;
  reader.refuse(shown(unclear) +
                    " has a comma that may part thousands or be the decimal mark, and no number of the file "
                    "tells; write the numbers with a decimal point and without commas",
                unclear_line);
}

}  // namespace

FileColumns find_file_columns(const MeasuredFile& measured, LineReader& reader, std::string_view& line) {
  FileColumns columns = Finder(measured, reader, line).find();
  if (columns.has_row) find_decimal_mark(measured, reader.line(), columns);
  return columns;
}

void split_row(const LineReader& reader, const FileColumns& columns, std::string_view line,
               std::vector<std::string_view>& fields) {
  if (!split_fields(line, columns.separator, fields)) {
    reader.refuse("a quotation mark that is not closed; close it, or leave it out");
  }
  const auto is_empty = [](std::string_view field) { return field.empty(); };
  if (std::all_of(fields.begin(), fields.end(), is_empty)) return fields.clear();
  if (fields.size() < columns.needed) {
    reader.refuse("only " + std::to_string(fields.size()) + " columns where " +
                  std::to_string(columns.needed) + " are needed, parted by " +
                  std::string(separator_in_words(columns.separator)) + "; complete or leave out the line");
  }
  const auto named = static_cast<std::ptrdiff_t>(std::min(fields.size(), columns.count));
  if (std::all_of(fields.begin() + named, fields.end(), is_empty)) return;
  reader.refuse(std::to_string(fields.size()) + " columns where " + std::to_string(columns.count) +
                " are named, parted by " + std::string(separator_in_words(columns.separator)) +
                "; name every column, and put text and numbers that hold a separator into quotation marks");
}

}  // namespace device
