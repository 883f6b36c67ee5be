// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/session_plot.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>

#include "hybrid/base/number_text.h"
#include "hybrid/plot/contacts.h"
#include "hybrid/plot/svg_figure.h"

namespace hybrid {
namespace {

constexpr const char* kTouchedColour = "#eaf2e3";
constexpr std::size_t kMostContacts = 6;  // greatest number of lines of presses, and of strokes
constexpr std::size_t kLookUpEvery = 10;  // ticks between two look-ups of the material beneath the tool
constexpr std::uint8_t kNoPart = 255;     // the material is unknown

std::vector<double> times_of(std::span<const TraceRow> rows) {
  std::vector<double> t;
  t.reserve(rows.size());
  for (const TraceRow& row : rows) t.push_back(row.t_s);
  return t;
}

// For example "largest force 2.31 N at 0.412 s"; another text if there is no finite force.
std::string largest(std::span<const TraceRow> rows) {
  double most = -1.0;
  double when = 0.0;
  std::size_t not_finite = 0;
  for (const TraceRow& row : rows) {
    const double force = glm::length(row.force_N);
    if (!std::isfinite(force)) {
      ++not_finite;
    } else if (force > most) {
      most = force;
      when = row.t_s;
    }
  }
  std::string words =
      most < 0.0 ? "no finite force"
                 : "largest force " + with_digits(most, 3) + " N" + " at " + with_decimals(when, 3) + " s";
  if (not_finite > 0) words += "; " + std::to_string(not_finite) + " ticks without a finite force (gaps)";
  return words;
}

// Does the object touch in this row? All objects from the 32nd on share the last bit. They count as touching
// while they have a force.
bool touches(std::span<const TraceRow> rows, const PlottedObject& object, std::size_t number,
             std::size_t row) {
  constexpr std::size_t shared = 31;
  if (number < shared || object.force_N.size() != rows.size())
    return (rows[row].contacts & (1U << std::min(number, shared))) != 0;
  return object.force_N[row] > 0.0;
}

// A thing that the figure names: an object that the tool touched, or a part of one.
struct Touched {
  std::string name;
  bool soft = false;
  Intervals intervals{};
  std::vector<double> force_N{};  // [row]; empty: not recorded
  double felt_Ns = 0.0;           // force integrated over time; if there are no forces, the time of contact
};

Touched touched_thing(std::span<const TraceRow> rows, const PlottedObject& object, std::size_t number,
                      std::optional<std::size_t> part) {
  Touched thing{.name = part ? object.parts[*part] : object.name, .soft = object.soft};
  const bool has_force = object.force_N.size() == rows.size();
  if (has_force) thing.force_N.assign(rows.size(), 0.0);
  bool on = false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool now = touches(rows, object, number, i) &&
                     (!part || (i < object.touched_part.size() && object.touched_part[i] == *part));
    if (now && !on) thing.intervals.emplace_back(rows[i].t_s, rows[i].t_s);
    if (now || on) thing.intervals.back().second = rows[i].t_s;
    on = now;
    if (!now || !has_force) continue;
    thing.force_N[i] = object.force_N[i];
    const double dt = i + 1 < rows.size() ? rows[i + 1].t_s - rows[i].t_s : 0.0;
    if (std::isfinite(object.force_N[i] * dt)) thing.felt_Ns += object.force_N[i] * dt;
  }
  if (!has_force) thing.felt_Ns = duration(thing.intervals);
  return thing;
}

// The things that were touched, the one felt most first.
std::vector<Touched> touched_things(std::span<const TraceRow> rows, std::span<const PlottedObject> objects,
                                    std::size_t& untouched) {
  std::vector<Touched> things;
  untouched = 0;
  for (std::size_t o = 0; o < objects.size(); ++o) {
    const std::size_t before = things.size();
    const PlottedObject& object = objects[o];
    const auto add = [&](std::optional<std::size_t> part) {
      Touched thing = touched_thing(rows, object, o, part);
      if (!thing.intervals.empty()) things.push_back(std::move(thing));
    };
    for (std::size_t part = 0; part < object.parts.size(); ++part) add(part);
    if (object.parts.empty()) add({});
    if (things.size() == before) ++untouched;
  }
  std::ranges::stable_sort(things, std::ranges::greater{}, &Touched::felt_Ns);
  return things;
}

Panel force_panel(std::span<const TraceRow> rows, const std::vector<double>& t,
                  std::span<const Touched> things, const Intervals& any) {
  Panel panel;
  panel.title = "Force on the hand";
  panel.y_label = "force (N)";
  panel.height = 230.0;
  panel.from_zero = true;
  panel.bands.push_back({"in contact", any, kTouchedColour});
  std::vector<double> total, rigid, soft;
  for (const TraceRow& row : rows) {
    total.push_back(glm::length(row.force_N));
    rigid.push_back(row.rigid_N);
    soft.push_back(row.soft_N);
  }
  panel.series.push_back({"total", t, std::move(total), "#000000", 2.2});
  const auto count = [&](bool is_soft) {
    return std::ranges::count_if(things, [&](const Touched& thing) { return thing.soft == is_soft; });
  };
  if (count(false) > 0) panel.series.push_back({"rigid objects", t, std::move(rigid), series_colour(0)});
  if (count(true) > 0) panel.series.push_back({"soft objects", t, std::move(soft), series_colour(1)});
  // If there are several things of a kind, each gets a dashed line. Its force is a part of the sums above.
  // The last colour, black, is the total's.
  std::size_t colour = 2;
  for (const Touched& thing : things) {
    if (thing.force_N.empty() || count(thing.soft) < 2 || colour + 1 >= kSeriesColours) continue;
    panel.series.push_back({thing.name, t, thing.force_N, series_colour(colour++), 1.4, true});
  }
  return panel;
}

Panel contact_panel(std::span<const Touched> things, std::size_t untouched) {
  Panel panel;
  panel.title = "Touched, the most felt first";
  for (const Touched& thing : things) {
    panel.lanes.push_back(
        {thing.name, (thing.soft ? "soft, " : "rigid, ") + with_decimals(duration(thing.intervals), 3) + " s",
         thing.intervals, series_colour(thing.soft ? 1 : 0)});
  }
  if (untouched > 0) {
    panel.note =
        untouched == 1 ? "1 object was not touched" : std::to_string(untouched) + " objects were not touched";
  }
  return panel;
}

// Clearance of tissue to rigid objects and to other tissue. There is no series if nothing comes near.
Panel clearance_panel(const ClearanceCourse& near) {
  Panel panel;
  panel.title = "Between objects (0: they touch; below: they overlap)";
  panel.y_label = "gap (mm)";
  panel.height = 130.0;
  panel.from_zero = true;
  const auto add = [&](const char* name, const std::vector<double>& gap_m, std::size_t colour) {
    std::vector<double> gap_mm;
    double deepest = 0.0;
    for (const double g : gap_m) {
      gap_mm.push_back(g * 1e3);
      if (g < deepest) deepest = g;
    }
    if (std::ranges::none_of(gap_mm, [](double g) { return std::isfinite(g); })) return;
    const std::string percent = with_decimals(std::abs(100.0 * deepest / near.cell_m), 2);
    const std::string overlap =
        percent != with_decimals(0.0, 2) ? ", overlap at most " + percent + " % of a voxel" : ", no overlap";
    panel.series.push_back({name + overlap, near.t_s, std::move(gap_mm), series_colour(colour)});
  };
  add("tissue and rigid", near.rigid_m, 0);
  add("tissue and tissue", near.soft_m, 1);
  return panel;
}

// Times of the ticks. There is no series if no tick was timed.
Panel tick_time_panel(std::span<const TraceRow> rows, const std::vector<double>& t, double period_s) {
  Panel panel;
  panel.title = "Time that each tick takes";
  panel.y_label = "time";
  panel.y_unit = "s";
  panel.y_scale = Scale::logarithmic;
  panel.height = 130.0;
  panel.lines.push_back({period_s, quantity_text(period_s, "s") + ": the next tick begins", "#a02020"});
  std::vector<double> taken_s;
  for (const TraceRow& row : rows) taken_s.push_back(row.tick_us * 1e-6);
  if (std::ranges::any_of(taken_s, [](double s) { return s > 0.0 && plottable(s); }))
    panel.series.push_back({"", t, std::move(taken_s), series_colour(5), 1.0});
  return panel;
}

// The name of a contact: that of the thing that was felt most in it.
std::string name_in(const Contact& contact, std::span<const Touched> things, std::span<const TraceRow> rows) {
  std::string name;
  double most = -1.0;
  for (const Touched& thing : things) {
    double felt = 0.0;  // sum of forces, or the time of contact if the trace has no forces
    for (std::size_t i = 0; i < thing.force_N.size(); ++i) {
      if (rows[i].t_s >= contact.from_s && rows[i].t_s <= contact.to_s) felt += thing.force_N[i];
    }
    if (thing.force_N.empty()) {
      for (const auto& [from, to] : thing.intervals)
        felt += std::max(std::min(to, contact.to_s) - std::max(from, contact.from_s), 0.0);
    }
    if (!(felt > most)) continue;
    most = felt;
    name = thing.name;
  }
  return name;
}

// Force over depth for presses, over path length for strokes.
Series course_of(const Contact& contact, std::span<const TraceRow> rows) {
  Series line;
  const std::span<const TraceRow> own = rows_in(rows, contact);
  if (contact.stroke) line.x = path_length_m(own);
  for (const TraceRow& row : own) {
    if (!contact.stroke) line.x.push_back(contact.depth_m(row.device_m));
    line.y.push_back(glm::length(row.force_N));
  }
  for (double& x : line.x) x *= 1e3;  // mm
  line.width = 1.6;
  return line;
}

// Adds a group with a line for each press, or for each stroke, of a session. Without any, adds no group.
void add_courses(Figure& figure, std::span<const TraceRow> rows, std::span<const Touched> things,
                 std::vector<Contact> contacts, bool strokes) {
  std::erase_if(contacts, [&](const Contact& contact) { return contact.stroke != strokes; });
  if (contacts.empty()) return;
  const std::vector<Contact> shown = most_felt(contacts, kMostContacts);
  PanelGroup& group = figure.groups.emplace_back();
  group.x_label = strokes ? "path length of the device since the first touch (mm)"
                          : "depth of the device since the first touch, against the largest force (mm)";
  Panel& panel = group.panels.emplace_back();
  panel.title = strokes ? "Force over path length, one line for each stroke"
                        : "Force over depth, one line for each press";
  panel.y_label = "force (N)";
  panel.from_zero = true;
  for (std::size_t c = 0; c < shown.size(); ++c) {
    Series line = course_of(shown[c], rows);
    line.name = with_decimals(shown[c].from_s, 2) + " s: " + name_in(shown[c], things, rows);
    line.colour = series_colour(c);
    panel.series.push_back(std::move(line));
  }
  if (contacts.size() > shown.size())
    panel.note = std::to_string(contacts.size() - shown.size()) + " that were felt less are not drawn";
}

// Index of the material of the surface vertex nearest to a point.
std::uint8_t nearest_material(const DrawnObject& object, const glm::dvec3& at_m) {
  double least = std::numeric_limits<double>::infinity();
  std::uint8_t material = kNoPart;
  for (std::size_t v = 0; v < object.surface.vertices.size(); ++v) {
    const glm::dvec3 way = object.surface.vertices[v] - at_m;
    const double squared = glm::dot(way, way);
    if (!(squared < least)) continue;
    least = squared;
    material = object.vertex_material[v];
  }
  return material;
}

}  // namespace

std::vector<PlottedObject> plotted_objects(const DrawnScene& scene, std::span<const TraceRow> rows,
                                           const std::vector<std::vector<double>>& force_N) {
  std::vector<PlottedObject> objects;
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const DrawnObject& drawn = scene.objects[o];
    PlottedObject object{.name = drawn.name, .soft = drawn.soft, .force_N = force_N[o]};
    if (!drawn.materials.empty() && drawn.vertex_material.size() == drawn.surface.vertices.size()) {
      object.parts = drawn.materials;
      object.touched_part.assign(rows.size(), kNoPart);
      std::size_t known_until = 0;
      std::uint8_t part = kNoPart;
      for (std::size_t i = 0; i < rows.size(); ++i) {
        if (!touches(rows, object, o, i)) {
          known_until = 0;
          continue;
        }
        if (i >= known_until) {
          part = nearest_material(drawn, rows[i].proxy_m);
          known_until = i + kLookUpEvery;
        }
        object.touched_part[i] = part;
      }
    } else if (!drawn.material.empty() && drawn.material != drawn.name) {
      object.name += " (" + drawn.material + ")";
    }
    objects.push_back(std::move(object));
  }
  return objects;
}

Figure session_figure(std::span<const TraceRow> rows, std::span<const PlottedObject> objects,
                      const std::string& title, const SessionPlotOptions& options) {
  const std::vector<double> t = times_of(rows);
  const Intervals any = contact_intervals(rows, ~0U);
  std::size_t untouched = 0;
  const std::vector<Touched> things = touched_things(rows, objects, untouched);
  ValueRange time;
  for (const double at : t) time.add(at);

  Figure figure;
  figure.title = title;
  figure.notes.push_back(std::to_string(rows.size()) + " ticks" +
                         (time.empty() ? "" : ", " + with_decimals(time.to - time.from, 3) + " s") +
                         "; in contact " + with_decimals(duration(any), 3) + " s" + "; " + largest(rows));
  PanelGroup group;
  group.x_label = "time (s)";
  if (!time.empty()) group.squeezed = long_in_the_air(any, time.from, time.to);
  if (!group.squeezed.empty())
    figure.notes.emplace_back("Grey: long times in the air, drawn short; below them their length (s).");

  group.panels.push_back(force_panel(rows, t, things, any));
  Panel contact = contact_panel(things, untouched);
  if (!contact.lanes.empty()) {
    group.panels.push_back(std::move(contact));
  } else if (!contact.note.empty()) {
    group.panels.back().note = contact.note;
  }
  Panel depth;
  depth.title = "Distance from the device to the tool as felt (proxy)";
  depth.y_label = "distance (mm)";
  depth.height = 130.0;
  depth.from_zero = true;
  depth.bands.push_back({"", any, kTouchedColour});
  std::vector<double> distance_mm;
  for (const TraceRow& row : rows) distance_mm.push_back(glm::length(row.device_m - row.proxy_m) * 1e3);
  depth.series.push_back({"", t, std::move(distance_mm), series_colour(2)});
  group.panels.push_back(std::move(depth));
  for (Panel panel : {clearance_panel(options.near), tick_time_panel(rows, t, options.period_s)}) {
    if (panel.series.empty()) continue;
    panel.bands.push_back({"", any, kTouchedColour});
    group.panels.push_back(std::move(panel));
  }
  figure.groups.push_back(std::move(group));

  for (const bool strokes : {false, true}) add_courses(figure, rows, things, contacts_of(rows, any), strokes);
  return figure;
}

void save_session_plot(const std::filesystem::path& svg, std::span<const TraceRow> rows,
                       std::span<const PlottedObject> objects, const std::string& title,
                       const SessionPlotOptions& options) {
  save_svg(svg, session_figure(rows, objects, title, options));
}

}  // namespace hybrid
