// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/session_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "hybrid/base/number_text.h"
#include "hybrid/plot/svg_figure.h"

namespace hybrid {
namespace {

using Intervals = std::vector<std::pair<double, double>>;

constexpr double gap = std::numeric_limits<double>::quiet_NaN();
constexpr const char* touched_colour = "#eaf2e3";

// A contact lasts from its tick to the next tick.
Intervals contact_intervals(std::span<const TraceRow> rows, std::uint32_t mask) {
  Intervals intervals;
  bool on = false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool touches = (rows[i].contacts & mask) != 0;
    if (touches && !on) intervals.emplace_back(rows[i].t_s, rows[i].t_s);
    if (!touches && on) intervals.back().second = rows[i].t_s;
    if (touches) intervals.back().second = rows[i].t_s;
    on = touches;
  }
  return intervals;
}

double duration(const Intervals& intervals) {
  double sum = 0.0;
  for (const auto& [from, to] : intervals) {
    if (std::isfinite(to - from)) sum += to - from;
  }
  return sum;
}

std::vector<double> times(std::span<const TraceRow> rows) {
  std::vector<double> t;
  t.reserve(rows.size());
  for (const TraceRow& row : rows) t.push_back(row.t_s);
  return t;
}

std::vector<double> forces(std::span<const TraceRow> rows) {
  std::vector<double> force;
  force.reserve(rows.size());
  for (const TraceRow& row : rows) force.push_back(glm::length(row.force_N));
  return force;
}

// "largest 2.31 N at 0.412 s", or a text for no force.
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

std::uint32_t bit_of(std::size_t object) {
  return 1U << std::min<std::size_t>(object, 31);
}

// y at each of `at`, linear between samples; a gap outside the range of x and beside samples that are not
// finite.
std::vector<double> sampled(std::span<const double> x, std::span<const double> y,
                            std::span<const double> at) {
  std::vector<double> out;
  out.reserve(at.size());
  std::size_t i = 0;
  for (const double t : at) {
    while (i + 1 < x.size() && x[i + 1] < t) ++i;
    if (x.empty() || !(t >= x.front()) || !(t <= x.back())) {
      out.push_back(gap);
    } else if (i + 1 >= x.size() || !(x[i + 1] > x[i])) {
      out.push_back(y[i]);
    } else {
      const double share = std::clamp((t - x[i]) / (x[i + 1] - x[i]), 0.0, 1.0);
      out.push_back(share == 0.0 ? y[i] : (share == 1.0 ? y[i + 1] : y[i] + share * (y[i + 1] - y[i])));
    }
  }
  return out;
}

// The origin of depth (the first contact in any model) and its direction.
struct DepthFrame {
  glm::dvec3 start_m{0.0};
  glm::dvec3 into{0.0, 0.0, -1.0};
};

DepthFrame depth_frame(std::span<const ComparedModel> models, const ComparedModel& reference) {
  DepthFrame frame;
  double first = std::numeric_limits<double>::infinity();
  for (const ComparedModel& model : models) {
    const auto touch =
        std::ranges::find_if(model.rows, [](const TraceRow& row) { return row.contacts != 0; });
    if (touch != model.rows.end() && touch->t_s < first) {
      first = touch->t_s;
      frame.start_m = touch->device_m;
    }
  }
  double most = 1e-9;
  for (const TraceRow& row : reference.rows) {
    const double force = glm::length(row.force_N);
    if (std::isfinite(force) && force > most) {
      most = force;
      frame.into = -row.force_N / force;
    }
  }
  return frame;
}

constexpr double kTurned_deg =
    15.0;  // a model's angle is shown if its force turns further than this from the reference

// Angle between two forces (degrees); a gap if either force is too small to have a direction.
double angle_between(const glm::dvec3& a, const glm::dvec3& b, double floor_N) {
  const double size = glm::length(a) * glm::length(b);
  if (!(glm::length(a) > floor_N) || !(glm::length(b) > floor_N) || !std::isfinite(size)) return gap;
  return std::acos(std::clamp(glm::dot(a, b) / size, -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

// Angle of each model's force to the reference's force, at the reference's ticks. A model with its own times
// contributes its last tick before. No series if no model turns far enough.
Panel direction_panel(std::span<const ComparedModel> models, const ComparedModel& reference, double floor_N) {
  Panel panel;
  panel.title = "Direction: angle to the force of " + reference.name;
  panel.y_label = "angle (degrees)";
  panel.height = 150.0;
  panel.from_zero = true;
  double most = 0.0;
  for (std::size_t m = 0; m < models.size(); ++m) {
    const std::span<const TraceRow> rows = models[m].rows;
    if (&models[m] == &reference || rows.empty()) continue;
    std::vector<double> angle;
    std::size_t i = 0;
    for (const TraceRow& row : reference.rows) {
      while (i + 1 < rows.size() && rows[i + 1].t_s <= row.t_s) ++i;
      angle.push_back(angle_between(rows[i].force_N, row.force_N, floor_N));
      if (angle.back() > most) most = angle.back();
    }
    panel.series.push_back({models[m].name, times(reference.rows), angle, series_colour(m), 1.6, m >= 7});
  }
  if (most < kTurned_deg) panel.series.clear();
  return panel;
}

// True if some model pushes against the direction of the reference's largest force by more than a tenth of
// that force.
bool any_model_reverses(std::span<const ComparedModel> models, const ComparedModel& reference,
                        const glm::dvec3& into) {
  double floor_N = 0.0;
  for (const TraceRow& row : reference.rows) floor_N = std::max(floor_N, -0.1 * glm::dot(row.force_N, into));
  return std::ranges::any_of(models, [&](const ComparedModel& model) {
    return std::ranges::any_of(model.rows,
                               [&](const TraceRow& row) { return glm::dot(row.force_N, into) > floor_N; });
  });
}

// Clearance of tissue to rigid objects and to other tissue. No series if nothing comes near.
Panel clearance_panel(const ClearanceCourse& near) {
  Panel panel;
  panel.title = "Between objects (0: they touch; below: they overlap)";
  panel.y_label = "gap (mm)";
  panel.height = 150.0;
  panel.from_zero = true;
  const auto add = [&](const char* name, const std::vector<double>& gap_m, std::size_t colour) {
    std::vector<double> gap_mm;
    double deepest = 0.0;
    for (const double g : gap_m) {
      gap_mm.push_back(g * 1e3);
      if (g < deepest) deepest = g;
    }
    if (std::ranges::none_of(gap_mm, [](double g) { return std::isfinite(g); })) return;
    panel.series.push_back({std::string(name) + ", at most " +
                                with_decimals(100.0 * std::fabs(deepest) / near.cell_m, 2) + " %" +
                                " of a cell deep",
                            near.t_s, std::move(gap_mm), series_colour(colour)});
  };
  add("tissue and rigid", near.rigid_m, 0);
  add("tissue and tissue", near.soft_m, 1);
  return panel;
}

}  // namespace

void save_session_plot(const std::filesystem::path& svg, std::span<const TraceRow> rows,
                       std::span<const PlottedObject> objects, const std::string& title,
                       const ClearanceCourse& near) {
  const std::vector<double> t = times(rows);
  const Intervals any = contact_intervals(rows, ~0U);
  Figure figure;
  figure.title = title;
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  for (const double at : t) {
    if (!std::isfinite(at)) continue;
    first = std::min(first, at);
    last = std::max(last, at);
  }
  figure.notes.push_back(std::to_string(rows.size()) + " ticks" +
                         (first <= last ? ", " + with_decimals(last - first, 3) + " s" : "") +
                         "; in contact " + with_decimals(duration(any), 3) + " s" + "; " + largest(rows));

  Panel force;
  force.title = "What the hand feels";
  force.y_label = "force (N)";
  force.height = 230.0;
  force.from_zero = true;
  force.bands.push_back({"in contact", any, touched_colour});
  std::vector<double> rigid;
  std::vector<double> soft;
  std::vector<double> distance_mm;
  for (const TraceRow& row : rows) {
    rigid.push_back(row.rigid_N);
    soft.push_back(row.soft_N);
    distance_mm.push_back(glm::length(row.device_m - row.proxy_m) * 1e3);
  }
  force.series.push_back({"total", t, forces(rows), "#000000", 2.2});
  const auto has = [&](bool is_soft) {
    return objects.empty() ||
           std::ranges::any_of(objects, [&](const PlottedObject& o) { return o.soft == is_soft; });
  };
  if (has(false)) force.series.push_back({"rigid objects", t, rigid, series_colour(0)});
  if (has(true)) force.series.push_back({"soft objects", t, soft, series_colour(1)});
  // Objects get lines of their own if a kind has more than one; dashed, because they are parts of the sums
  // above.
  std::size_t colour = 2;
  for (const PlottedObject& object : objects) {
    const auto same =
        std::ranges::count_if(objects, [&](const PlottedObject& o) { return o.soft == object.soft; });
    if (object.force_N.empty() || same < 2 || colour >= 7) continue;
    force.series.push_back({object.name, t, object.force_N, series_colour(colour++), 1.4, true});
  }

  Panel contact;
  contact.title = "What the tool touches";
  for (std::size_t i = 0; i < objects.size(); ++i) {
    Lane lane;
    lane.name = objects[i].name;
    lane.intervals = contact_intervals(rows, bit_of(i));
    lane.note = (objects[i].soft ? "soft, " : "rigid, ") + with_decimals(duration(lane.intervals), 3) + " s";
    lane.colour = series_colour(objects[i].soft ? 1 : 0);
    contact.lanes.push_back(std::move(lane));
  }

  Panel depth;
  depth.title = "How far the device is from where the tool may be (proxy)";
  depth.y_label = "|device − proxy| (mm)";
  depth.height = 150.0;
  depth.from_zero = true;
  depth.bands.push_back({"", any, touched_colour});
  depth.series.push_back({"", t, distance_mm, series_colour(2)});

  PanelGroup group;
  group.x_label = "time (s)";
  group.panels.push_back(std::move(force));
  if (!contact.lanes.empty()) group.panels.push_back(std::move(contact));
  group.panels.push_back(std::move(depth));
  Panel gaps = clearance_panel(near);
  if (!gaps.series.empty()) {
    gaps.bands.push_back({"", any, touched_colour});
    group.panels.push_back(std::move(gaps));
  }
  figure.groups.push_back(std::move(group));
  save_svg(svg, figure);
}

void save_compare_plot(const std::filesystem::path& svg, std::span<const ComparedModel> models,
                       std::span<const ReferenceCurve> curves, const std::string& title,
                       const ComparePlotOptions& options) {
  if (options.reference >= models.size())
    throw std::invalid_argument("save_compare_plot: the reference is no model");
  const ComparedModel& reference = models[options.reference];
  const std::vector<double> t = times(reference.rows);
  const DepthFrame frame = depth_frame(models, reference);
  // A force that reverses shows only with its sign: then the component along the reference's largest force is
  // drawn.
  const bool with_sign = any_model_reverses(models, reference, frame.into);
  const auto drawn = [&](std::span<const TraceRow> rows) {
    std::vector<double> out = forces(rows);
    for (std::size_t i = 0; with_sign && i < out.size(); ++i) out[i] = -glm::dot(rows[i].force_N, frame.into);
    return out;
  };
  const std::vector<double> felt = drawn(reference.rows);

  Figure figure;
  figure.title = title;
  figure.notes.push_back("reference: " + reference.name +
                         "; one JND: " + with_digits(100.0 * options.jnd_share, 3) + " %" +
                         " of its force, at least " + with_digits(options.jnd_floor_N, 3) + " N");
  if (with_sign) {
    figure.notes.emplace_back(
        "some force turns round: drawn is the part along the largest force of the reference; below 0 it "
        "pulls the "
        "tool on");
  }

  Panel over_time;
  over_time.title = "Force on the hand";
  over_time.y_label = "force (N)";
  over_time.height = 230.0;
  over_time.from_zero = true;
  Panel difference;
  difference.title = "Difference from " + reference.name;
  difference.y_label = "difference (N)";
  difference.height = 170.0;
  difference.from_zero = true;
  Area band{"not felt: within ±1 JND", t, {}, {}, "#dfe8f2"};
  for (const double force : felt) {
    const double jnd =
        std::isfinite(force) ? std::max(options.jnd_share * std::fabs(force), options.jnd_floor_N) : gap;
    band.low.push_back(-jnd);
    band.high.push_back(jnd);
  }
  difference.areas.push_back(std::move(band));
  Panel over_depth;
  over_depth.title = "Force over depth";
  over_depth.y_label = "force (N)";
  over_depth.height = 260.0;
  over_depth.from_zero = true;

  for (std::size_t m = 0; m < models.size(); ++m) {
    const ComparedModel& model = models[m];
    const bool is_reference = m == options.reference;
    const std::string colour = series_colour(m);
    const bool dashed = m >= 7;
    const std::vector<double> own_t = times(model.rows);
    std::vector<double> own = drawn(model.rows);
    std::vector<double> depth_mm;
    for (std::size_t i = 0; i < model.rows.size(); ++i) {
      const double depth_m = i < model.depth_m.size()
                                 ? model.depth_m[i]
                                 : glm::dot(model.rows[i].device_m - frame.start_m, frame.into);
      // Far from the object there is nothing to compare, and the approach would fill the axis.
      depth_mm.push_back(depth_m >= -1e-3 ? depth_m * 1e3 : gap);
    }
    if (!is_reference) {
      std::vector<double> gaps = sampled(own_t, own, t);
      for (std::size_t i = 0; i < gaps.size(); ++i) gaps[i] -= felt[i];
      difference.series.push_back({model.name, t, std::move(gaps), colour, 1.6, dashed});
    }
    const double width = is_reference ? 2.4 : 1.6;
    over_depth.series.push_back({model.name, std::move(depth_mm), own, colour, width, dashed});
    over_time.series.push_back(
        {model.name + (is_reference ? " (reference)" : ""), own_t, std::move(own), colour, width, dashed});
  }
  for (const ReferenceCurve& curve : curves) {
    std::vector<double> depth_mm = curve.depth_m;
    for (double& depth : depth_mm) depth *= 1e3;
    over_depth.series.push_back({curve.name, std::move(depth_mm), curve.force_N, "#333333", 1.8, true});
  }
  PanelGroup time_group{"time (s)", {}};
  time_group.panels.push_back(std::move(over_time));
  time_group.panels.push_back(std::move(difference));
  Panel direction = direction_panel(models, reference, options.jnd_floor_N);
  if (!direction.series.empty()) time_group.panels.push_back(std::move(direction));
  PanelGroup depth_group{"depth of the device (mm)", {}};
  depth_group.panels.push_back(std::move(over_depth));
  figure.groups.push_back(std::move(time_group));
  figure.groups.push_back(std::move(depth_group));
  save_svg(svg, figure);
}

}  // namespace hybrid
