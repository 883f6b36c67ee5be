// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/column_names.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "device/paths/line_reader.h"

namespace device {
namespace {

using namespace std::string_view_literals;

// Names of one unit in lower case, separated by blanks; µ is written as u.
struct UnitNames {
  std::string_view names;
  Unit unit;
};
constexpr double kInch_m = 0.0254, kFoot_m = 0.3048;                      // exact by definition
constexpr double kPoundForce_N = 4.4482216152605, kKilopond_N = 9.80665;  // exact by definition
constexpr std::array kUnits{
    UnitNames{"s sec secs second seconds", {Dimension::time, 1.0}},
    UnitNames{"ms msec msecs millis millisec millisecs millisecond milliseconds", {Dimension::time, 1e-3}},
    UnitNames{"us usec usecs micros microsec microsecs microsecond microseconds", {Dimension::time, 1e-6}},
    UnitNames{"ns nsec nsecs nanos nanosec nanosecs nanosecond nanoseconds", {Dimension::time, 1e-9}},
    UnitNames{"min mins minute minutes", {Dimension::time, 60.0}},
    UnitNames{"h hr hrs hour hours", {Dimension::time, 3600.0}},
    UnitNames{"m meter meters metre metres", {Dimension::length, 1.0}},
    UnitNames{"dm decimeter decimeters decimetre decimetres", {Dimension::length, 0.1}},
    UnitNames{"cm centimeter centimeters centimetre centimetres", {Dimension::length, 1e-2}},
    UnitNames{"mm millimeter millimeters millimetre millimetres", {Dimension::length, 1e-3}},
    UnitNames{"um micron microns micrometer micrometers micrometre micrometres", {Dimension::length, 1e-6}},
    UnitNames{"nm nanometer nanometers nanometre nanometres", {Dimension::length, 1e-9}},
    UnitNames{"in inch inches", {Dimension::length, kInch_m}},
    UnitNames{"ft foot feet", {Dimension::length, kFoot_m}},
    UnitNames{"n newton newtons", {Dimension::force, 1.0}},
    UnitNames{"mn millinewton millinewtons", {Dimension::force, 1e-3}},
    UnitNames{"un micronewton micronewtons", {Dimension::force, 1e-6}},
    UnitNames{"kn kilonewton kilonewtons", {Dimension::force, 1e3}},
    UnitNames{"lbf", {Dimension::force, kPoundForce_N}},
    UnitNames{"kgf", {Dimension::force, kKilopond_N}},
    UnitNames{"gf", {Dimension::force, 1e-3 * kKilopond_N}},
    UnitNames{"rad rads radian radians mrad deg degs degree degrees nmm mps hz v px pixel pixels %", {}}};

enum class Meaning : std::uint8_t {
  axis,        // x, y or z
  position,    // a word for a position
  bearer,      // a word for the thing at the position (tool, marker), or for a part of a message
  force,       // a word for a force
  strength,    // a word for the magnitude of a force
  time,        // a word for a time
  clock,       // a word for the clock of a time
  nothing,     // a word without effect on the meaning
  turning,     // tx, ty, tz: a torque; in a file without forces a translation
  not_wanted,  // a word for another quantity: the column is not read, whatever its other words
  unknown
};
// Words of one meaning in lower case, separated by blanks.
struct Words {
  std::string_view words;
  Meaning meaning;
};
constexpr std::array kWords{
    Words{"x y z", Meaning::axis},
    Words{"p pos position translation location coord coords coordinate coordinates point", Meaning::position},
    Words{
        "device tool tooltip tip stylus probe pen hand ee eef end effector endeffector tcp hip haptic needle "
        "instrument marker tracker cursor robot pose transform field msg actual measured world",
        Meaning::bearer},
    Words{"f force forces", Meaning::force},
    Words{"fn normal magnitude mag norm strength", Meaning::strength},
    Words{"t time timestamp timestamps ts stamp elapsed", Meaning::time},
    Words{"since start rel relative sim system ros unix epoch utc log header", Meaning::clock},
    Words{"axis component value in of the along", Meaning::nothing},
    Words{"tx ty tz", Meaning::turning},
    Words{"torque moment vel velocity acc acceleration rate dot derivative error err std var cov offset bias "
          "orientation rotation quaternion quat between",
          Meaning::not_wanted}};

// Is `word` one of the words of `list`, which are separated by blanks?
bool is_one_of(std::string_view word, std::string_view list) {
  for (std::size_t at = list.find(word); at != std::string_view::npos; at = list.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || list[at - 1] == ' ') && (end == list.size() || list[end] == ' ')) return !word.empty();
  }
  return false;
}

Meaning meaning_of(std::string_view word) {
  const auto found =
      std::find_if(kWords.begin(), kWords.end(), [&](const Words& w) { return is_one_of(word, w.words); });
  return found == kWords.end() ? Meaning::unknown : found->meaning;
}

bool is_upper(char c) {
  return c >= 'A' && c <= 'Z';
}
bool is_lower(char c) {
  return c >= 'a' && c <= 'z';
}
bool is_word_character(char c) {
  return is_upper(c) || is_lower(c) || (c >= '0' && c <= '9');
}

// Replaces some signs by ASCII: both micro signs by u, the degree sign by deg, the middle dot by * and powers
// by ^ (marks of a compound unit), no-break spaces by blanks. Signs may be in UTF-8 or, as one byte, in
// Latin-1.
std::string in_ascii(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kSigns{{{"\xC2\xB5"sv, "u"sv},
                                                                                  {"\xCE\xBC"sv, "u"sv},
                                                                                  {"\xC2\xB0"sv, "deg"sv},
                                                                                  {"\xC2\xB7"sv, "*"sv},
                                                                                  {"\xE2\x8B\x85"sv, "*"sv},
                                                                                  {"\xE2\x81\xBB"sv, "^"sv},
                                                                                  {"\xC2\xB9"sv, "^"sv},
                                                                                  {"\xC2\xB2"sv, "^"sv},
                                                                                  {"\xC2\xB3"sv, "^"sv},
                                                                                  {"\xC2\xA0"sv, " "sv},
                                                                                  {"\xB5"sv, "u"sv},
                                                                                  {"\xB0"sv, "deg"sv},
                                                                                  {"\xB7"sv, "*"sv},
                                                                                  {"\xA0"sv, " "sv}}};
  std::string out;
  while (!text.empty()) {
    const auto sign =
        std::find_if(kSigns.begin(), kSigns.end(), [&](const auto& s) { return text.starts_with(s.first); });
    out += sign == kSigns.end() ? text.substr(0, 1) : sign->second;
    text.remove_prefix(sign == kSigns.end() ? 1 : sign->first.size());
  }
  return out;
}

struct NamePart {
  std::string text;  // as written
  bool glued;        // only a capital separates it from the word before: "Ms" in "timeMs"
};

// Does a capital at `at` begin a word? It does after a small letter ("timeMs") or before one ("posYMm").
bool begins_word(std::string_view run, std::size_t at) {
  const bool small_follows = at + 1 < run.size() && is_lower(run[at + 1]);
  return is_upper(run[at]) && (is_lower(run[at - 1]) || small_follows);
}

// Splits a name into words of letters and digits, at other characters and at capitals. A unit with a capital
// ("mN") is not split.
std::vector<NamePart> name_parts(std::string_view text) {
  std::vector<NamePart> parts;
  for (std::size_t at = 0; at < text.size();) {
    if (!is_word_character(text[at])) {
      ++at;
      continue;
    }
    std::size_t end = at;
    while (end < text.size() && is_word_character(text[end])) ++end;
    std::string_view run = text.substr(at, end - at);
    at = end;
    bool glued = false;
    while (!unit_in(run)) {
      std::size_t capital = 1;
      while (capital < run.size() && !begins_word(run, capital)) ++capital;
      if (capital == run.size()) break;
      parts.push_back({std::string(run.substr(0, capital)), glued});
      run.remove_prefix(capital);
      glued = true;
    }
    parts.push_back({std::string(run), glued});
  }
  return parts;
}

struct StatedUnit {
  std::optional<Unit> unit{};
  std::string unknown{};  // text in the place of a unit that is no known unit

  void state(std::string_view text, std::optional<Unit> found) {
    if (!found || (unit && (unit->dimension != found->dimension || unit->in_si != found->in_si)))
      unknown = text;
    if (!unit) unit = found;
  }
};

// Removes brackets with their contents. A unit goes to `stated`, words of known meaning stay in the name, and
// all other contents go to `unclear`.
std::string without_brackets(std::string_view text, StatedUnit& stated, std::vector<std::string>& unclear) {
  constexpr std::string_view kOpen = "[({<", kClose = "])}>";
  std::string rest;
  for (std::size_t open = text.find_first_of(kOpen); open != std::string_view::npos;
       open = text.find_first_of(kOpen)) {
    const std::size_t close = std::min(text.find(kClose[kOpen.find(text[open])], open), text.size());
    const std::string_view inside = without_blanks(text.substr(open + 1, close - open - 1));
    rest.append(text.substr(0, open)).append(" ");
    if (const auto unit = unit_in(inside)) {
      stated.state(inside, unit);
    } else if (meaning_of(lower_ascii(inside)) != Meaning::unknown) {
      rest.append(inside).append(" ");
    } else if (!inside.empty()) {
      unclear.emplace_back(inside);
    }
    text.remove_prefix(std::min(close + 1, text.size()));
  }
  return rest.append(text);
}

// Removes a unit after '/', as in "x/mm" and "v/m/s".
void cut_slash(std::string& text, StatedUnit& stated) {
  for (std::size_t slash = text.find('/'); slash != std::string::npos; slash = text.find('/', slash + 1)) {
    const std::string_view behind = without_blanks(std::string_view(text).substr(slash + 1));
    if (without_blanks(std::string_view(text).substr(0, slash)).empty()) continue;
    if (const auto unit = unit_in(behind)) {
      stated.state(behind, unit);
      text.resize(slash);
      return;
    }
  }
}

// Removes words at the end that are units, as in "x_mm", "x_in_mm" (in millimetres) and "x_m_s" (a velocity).
void cut_unit_words(std::vector<NamePart>& parts, StatedUnit& stated) {
  const auto as_unit = [](const NamePart& part) {
    return unit_in(part.glued ? lower_ascii(part.text) : part.text);
  };
  std::size_t first = parts.size();
  while (first > 1 && (as_unit(parts[first - 1]) || lower_ascii(parts[first - 1].text) == "per")) --first;
  if (first == parts.size()) {
    // A text such as "Mm" is neither a word nor a known unit: it is reported as an unknown unit.
    if (parts.size() > 1 && unit_in(lower_ascii(parts.back().text))) {
      stated.state(parts.back().text, std::nullopt);
      parts.pop_back();
    }
    return;
  }
  const std::size_t count = parts.size() - first;
  if (count == 1 || (count == 2 && lower_ascii(parts[first].text) == "in")) {
    stated.state(parts.back().text, as_unit(parts.back()));
  } else {
    stated.state(parts.back().text, Unit{});
  }
  parts.resize(first);
}

// The words of a name in lower case. An axis is split from its quantity: "fx" becomes "f" and "x".
std::vector<std::string> words_of(std::span<const NamePart> parts) {
  std::vector<std::string> words;
  const auto part_axis = [&](std::string_view axis, std::string_view of) {
    if (meaning_of(axis) != Meaning::axis || !is_one_of(of, "p pos position f force")) return false;
    words.emplace_back(of);
    words.emplace_back(axis);
    return true;
  };
  for (const NamePart& part : parts) {
    const std::string word = lower_ascii(part.text);
    const std::string_view view = word;
    const std::size_t last = view.size() - 1;
    if (part_axis(view.substr(last), view.substr(0, last)) || part_axis(view.substr(0, 1), view.substr(1)))
      continue;
    words.push_back(word);
  }
  return words;
}

// The quantity that the words stand for; `dimension` is that of the stated unit.
ColumnName quantity_of(const std::vector<std::string>& words, std::optional<Dimension> dimension) {
  std::array<std::size_t, static_cast<std::size_t>(Meaning::unknown) + 1> count{};
  ColumnName out;
  std::string bearers, others;
  const auto add = [](std::string& list, const std::string& word) {
    list += (list.empty() ? "" : "_") + word;
  };
  for (const std::string& word : words) {
    const Meaning meaning = meaning_of(word);
    ++count[static_cast<std::size_t>(meaning)];
    if (meaning == Meaning::axis) out.axis = static_cast<std::size_t>(word[0] - 'x');
    if (meaning == Meaning::turning) out.axis = static_cast<std::size_t>(word[1] - 'x');
    if (meaning == Meaning::bearer) add(bearers, word);
    if (meaning != Meaning::axis && meaning != Meaning::force && meaning != Meaning::nothing)
      add(others, word);
  }
  const auto has = [&](Meaning meaning) { return count[static_cast<std::size_t>(meaning)]; };
  const auto only = [&](std::initializer_list<Meaning> meanings) {
    std::size_t sum = has(Meaning::nothing);
    for (const Meaning meaning : meanings) sum += has(meaning);
    return sum == words.size();
  };
  const auto fits = [&](Dimension wanted) { return !dimension || *dimension == wanted; };
  if (has(Meaning::not_wanted) > 0) return out;

  if (has(Meaning::time) > 0 && fits(Dimension::time) &&
      only({Meaning::time, Meaning::clock, Meaning::bearer})) {
    out.quantity = Quantity::time;
    out.rank = words.size() == 1 && (words[0] == "t" || words[0] == "time") ? 0 : 1;
    return out;
  }
  if (has(Meaning::axis) == 1 && fits(Dimension::force) &&
      (has(Meaning::force) > 0 || (dimension && only({Meaning::axis})))) {
    out.quantity = Quantity::force;
    out.of_what = others;
    return out;
  }
  const bool is_strength =
      words == std::vector<std::string>{"fn"} || (has(Meaning::force) > 0 && has(Meaning::strength) > 0);
  if (is_strength && fits(Dimension::force) && only({Meaning::force, Meaning::strength})) {
    out.quantity = Quantity::strength;
    return out;
  }
  const bool turning = has(Meaning::turning) == 1 && only({Meaning::turning});
  const bool placed = has(Meaning::axis) == 1 && only({Meaning::axis, Meaning::position, Meaning::bearer});
  if ((placed || turning) && fits(Dimension::length)) {
    out.quantity = Quantity::position;
    out.of_what = bearers;
    out.rank = turning ? kTranslationRank : !bearers.empty() ? 2 : has(Meaning::position) > 0 ? 1 : 0;
  }
  return out;
}

}  // namespace

std::optional<Unit> unit_in(std::string_view written) {
  const std::string ascii = in_ascii(written);
  std::string_view text = without_blanks(ascii);
  if (text.ends_with('.')) text.remove_suffix(1);           // "sec."
  if (text == "Nm" || text == "mNm") return Unit{};         // a torque; nm is a length
  if (is_one_of(text, "MN Mm Ms NM")) return std::nullopt;  // mega-units, or a misplaced capital
  const std::string lower = lower_ascii(text);
  const auto found = std::find_if(kUnits.begin(), kUnits.end(),
                                  [&](const UnitNames& u) { return is_one_of(lower, u.names); });
  if (found != kUnits.end()) return found->unit;
  // A compound that begins with a unit, such as m/s, is of another dimension.
  const std::size_t mark = lower.find_first_of("/*^");
  if (mark == std::string::npos || !unit_in(lower.substr(0, mark))) return std::nullopt;
  return Unit{};
}

ColumnName read_column_name(std::string_view name) {
  std::string ascii = in_ascii(name);
  // Capitals distinguish units (MN, mN) only if the name also has small letters.
  if (std::none_of(ascii.begin(), ascii.end(), is_lower)) ascii = lower_ascii(ascii);
  StatedUnit stated;
  std::vector<std::string> unclear;
  std::string text = without_brackets(ascii, stated, unclear);
  cut_slash(text, stated);
  std::vector<NamePart> parts = name_parts(text);
  cut_unit_words(parts, stated);
  // Text in brackets that is no unit belongs to the name if the unit stands elsewhere.
  for (const std::string& words : unclear) {
    if (!stated.unit) {
      stated.state(words, std::nullopt);
      continue;
    }
    const std::vector<NamePart> more = name_parts(words);
    parts.insert(parts.end(), more.begin(), more.end());
  }
  ColumnName out =
      quantity_of(words_of(parts), stated.unit ? std::optional(stated.unit->dimension) : std::nullopt);
  if (stated.unit) out.in_si = stated.unit->in_si;
  out.unknown_unit = stated.unknown;
  return out;
}

std::string joined_words(std::string_view name) {
  std::string out;
  for (const NamePart& part : name_parts(in_ascii(name)))
    out += (out.empty() ? "" : "_") + lower_ascii(part.text);
  return out;
}

std::string_view known_units(Quantity quantity) {
  switch (quantity) {
    case Quantity::time:
      return "s, ms, us, ns, min, h";
    case Quantity::position:
      return "m, cm, mm, um, nm, in, ft";
    default:
      return "N, mN, kN, lbf, kgf";
  }
}

}  // namespace device
