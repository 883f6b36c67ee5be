// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/compare_plot.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "hybrid/base/number_text.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/plot/contacts.h"
#include "hybrid/plot/svg_figure.h"

namespace hybrid {
namespace {

constexpr double kGapInLine = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostContactPanels = 3;  // contacts with a panel of force over depth or path length
constexpr double kTurned_deg = 15.0;           // the panel of angles is drawn if an angle exceeds this
// Share of a contact's largest force; a pull beyond it is drawn with its sign.
constexpr double kReversedShare = 0.1;
constexpr double kShownOutside_m = 1e-3;  // force over depth begins this far outside the object
// A model whose largest force in a contact is this many times that of the reference would flatten the other
// lines. It has a panel of its own.
constexpr double kFlattens = 4.0;
constexpr const char* kReferenceColour = "#8a8a8a";

// y at each x of `at`, linear between samples. There are gaps outside the range of x and beside samples that
// are not finite.
std::vector<double> sampled(std::span<const double> x, std::span<const double> y,
                            std::span<const double> at) {
  std::vector<double> out;
  out.reserve(at.size());
  std::size_t i = 0;
  for (const double t : at) {
    while (i + 1 < x.size() && x[i + 1] < t) ++i;
    if (x.empty() || !(t >= x.front()) || !(t <= x.back())) {
      out.push_back(kGapInLine);
    } else if (i + 1 >= x.size() || !(x[i + 1] > x[i])) {
      out.push_back(y[i]);
    } else {
      const double share = std::clamp((t - x[i]) / (x[i + 1] - x[i]), 0.0, 1.0);
      out.push_back(share == 0.0 ? y[i] : (share == 1.0 ? y[i + 1] : y[i] + share * (y[i + 1] - y[i])));
    }
  }
  return out;
}

struct Course {
  std::vector<double> t_s;
  std::vector<glm::dvec3> force_N;
};

Course course_of(const ComparedModel& model) {
  Course course;
  for (const TraceRow& row : model.rows) {
    course.t_s.push_back(row.t_s);
    course.force_N.push_back(row.force_N);
  }
  return course;
}

// The model's force at the reference's times, linear between samples.
std::vector<glm::dvec3> at_times(const Course& model, const std::vector<double>& t_s) {
  std::vector<glm::dvec3> out(t_s.size());
  std::vector<double> own(model.force_N.size());
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < own.size(); ++i) own[i] = model.force_N[i][axis];
    const std::vector<double> there = sampled(model.t_s, own, t_s);
    for (std::size_t i = 0; i < out.size(); ++i) out[i][axis] = there[i];
  }
  return out;
}

// Angle between two forces (degrees); a gap if either force is too small to have a direction.
double angle_between(const glm::dvec3& a, const glm::dvec3& b, double floor_N) {
  const double size = glm::length(a) * glm::length(b);
  if (!(glm::length(a) > floor_N) || !(glm::length(b) > floor_N) || !std::isfinite(size)) return kGapInLine;
  return angle_between_deg(a, b);
}

class ComparePlot {
 public:
  ComparePlot(std::span<const ComparedModel> models, std::span<const ReferenceCurve> curves,
              const ComparePlotOptions& options)
      : models_(models), curves_(curves), options_(options), reference_(models[options.reference]) {
    for (const ComparedModel& model : models) {
      courses_.push_back(course_of(model));
      if (model.apart) continue;
      touched_ = merged(std::move(touched_), contact_intervals(model.rows, ~0U));
      for (const double t : courses_.back().t_s) time_.add(t);
    }
    contacts_ = contacts_of(reference_.rows, touched_);
    for (const ComparedModel& model : models) with_sign_ = with_sign_ || (!model.apart && reverses(model));
  }

  Figure draw(const std::string& title) const {
    Figure figure;
    figure.title = title;
    figure.notes.push_back(reference_note(reference_.name, options_));
    if (with_sign_) {
      figure.notes.emplace_back(
          "Some force turns round: drawn is the part along the reference's largest force of each contact; "
          "below 0 it pulls the tool on.");
    }
    PanelGroup group;
    group.x_label = "time (s)";
    if (!time_.empty()) group.squeezed = long_in_the_air(touched_, time_.from, time_.to);
    if (!group.squeezed.empty())
      figure.notes.emplace_back("Grey: long times in the air, drawn short; below them their length (s).");
    add_model(group, options_.reference);
    for (std::size_t m = 0; m < models_.size(); ++m) {
      if (m != options_.reference && !models_[m].apart) add_model(group, m);
    }
    Panel direction = direction_panel();
    if (!direction.series.empty()) group.panels.push_back(std::move(direction));
    figure.groups.push_back(std::move(group));
    const std::vector<Contact> drawn = most_felt(contacts_, kMostContactPanels);
    for (const Contact& contact : drawn) figure.groups.push_back(contact_group(contact));
    if (contacts_.size() > drawn.size()) {
      figure.groups.back().panels.back().note =
          std::to_string(contacts_.size() - drawn.size()) + " contacts that were felt less are not drawn";
    }
    for (std::size_t m = 0; m < models_.size(); ++m) {
      if (!models_[m].apart || m == options_.reference) continue;
      PanelGroup& apart = figure.groups.emplace_back();
      apart.x_label = "time (s)";
      add_model(apart, m);
    }
    return figure;
  }

 private:
  const Contact* contact_at(double t_s) const {
    const auto next = std::ranges::find_if(contacts_, [&](const Contact& c) { return t_s <= c.to_s; });
    return next != contacts_.end() && t_s >= next->from_s ? &*next : nullptr;
  }

  // Is there a contact in which the model pushes opposite to the reference's largest force?
  bool reverses(const ComparedModel& model) const {
    return std::ranges::any_of(model.rows, [&](const TraceRow& row) {
      const Contact* const contact = contact_at(row.t_s);
      return contact != nullptr && glm::dot(row.force_N, contact->into) > kReversedShare * contact->most_N;
    });
  }

  double shown(double t_s, const glm::dvec3& force_N) const {
    const Contact* const contact = with_sign_ ? contact_at(t_s) : nullptr;
    return contact != nullptr ? -glm::dot(force_N, contact->into) : glm::length(force_N);
  }

  std::vector<double> shown(const Course& course) const {
    std::vector<double> out;
    for (std::size_t i = 0; i < course.t_s.size(); ++i)
      out.push_back(shown(course.t_s[i], course.force_N[i]));
    return out;
  }

  // Adds the panel of force over time. For all but the reference also adds the panel of the difference.
  void add_model(PanelGroup& group, std::size_t m) const {
    const ComparedModel& model = models_[m];
    const Course& reference = courses_[options_.reference];
    const bool is_reference = m == options_.reference;
    Panel force;
    force.title = model.name + (is_reference ? " (reference)" : "");
    force.y_label = "force (N)";
    force.height = 120.0;
    force.from_zero = true;
    if (!is_reference)
      force.series.push_back({reference_.name, reference.t_s, shown(reference), kReferenceColour, 1.2});
    force.series.push_back({is_reference ? "" : model.name, courses_[m].t_s, shown(courses_[m]),
                            series_colour(m), 1.8, m >= kSeriesColours});
    group.panels.push_back(std::move(force));
    if (is_reference) return;
    Panel difference;
    difference.title = model.name + ": difference from " + reference_.name;
    difference.y_label = "difference (JND)";
    difference.height = 130.0;
    difference.y_scale = Scale::symmetric;
    std::vector<double> jnd;
    const std::vector<glm::dvec3> there = at_times(courses_[m], reference.t_s);
    for (std::size_t i = 0; i < there.size(); ++i)
      jnd.push_back(signed_jnd(there[i], reference.force_N[i], options_));
    if (!reference.t_s.empty()) {
      const std::vector<double> ends{reference.t_s.front(), reference.t_s.back()};
      difference.areas.push_back(not_felt_area(ends));
    }
    difference.series.push_back(
        {"", reference.t_s, std::move(jnd), series_colour(m), 1.6, m >= kSeriesColours});
    group.panels.push_back(std::move(difference));
  }

  // Angle between each model's force and the reference's force, at the reference's ticks. A model that has
  // its own times counts with its last tick up to then. There is no series if all angles are small.
  Panel direction_panel() const {
    Panel panel;
    panel.title = "Direction: angle to the force of " + reference_.name;
    panel.y_label = "angle (degrees)";
    panel.height = 150.0;
    panel.from_zero = true;
    double most = 0.0;
    const Course& reference = courses_[options_.reference];
    for (std::size_t m = 0; m < models_.size(); ++m) {
      const Course& course = courses_[m];
      if (m == options_.reference || models_[m].apart || course.t_s.empty()) continue;
      std::vector<double> angle;
      std::size_t i = 0;
      for (std::size_t n = 0; n < reference.t_s.size(); ++n) {
        while (i + 1 < course.t_s.size() && course.t_s[i + 1] <= reference.t_s[n]) ++i;
        angle.push_back(angle_between(course.force_N[i], reference.force_N[n], options_.jnd_floor_N));
        if (angle.back() > most) most = angle.back();
      }
      panel.series.push_back(
          {models_[m].name, reference.t_s, std::move(angle), series_colour(m), 1.6, m >= kSeriesColours});
    }
    if (most < kTurned_deg) panel.series.clear();
    return panel;
  }

  // A stroke has force over path length, except where the depth is given.
  [[nodiscard]] bool over_path_length(const Contact& contact) const {
    return contact.stroke && curves_.empty() && std::ranges::all_of(models_, [](const ComparedModel& model) {
             return model.apart || model.depth_m.empty();
           });
  }

  Series line_of(std::size_t m, const Contact& contact) const {
    const ComparedModel& model = models_[m];
    Series line{.name = model.name,
                .x = {},
                .y = {},
                .colour = series_colour(m),
                .width = m == options_.reference ? 2.4 : 1.6,
                .dashed = m >= kSeriesColours};
    const std::span<const TraceRow> rows = rows_in(model.rows, contact);
    const auto first = static_cast<std::size_t>(rows.data() - model.rows.data());
    const std::vector<double> path_m =
        over_path_length(contact) ? path_length_m(rows) : std::vector<double>();
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const std::size_t i = first + r;
      const double depth_m = i < model.depth_m.size() ? model.depth_m[i] : contact.depth_m(rows[r].device_m);
      const double x_m = path_m.empty() ? depth_m : path_m[r];
      line.x.push_back(x_m >= -kShownOutside_m ? x_m * 1e3 : kGapInLine);
      line.y.push_back(shown(rows[r].t_s, rows[r].force_N));
    }
    return line;
  }

  PanelGroup contact_group(const Contact& contact) const {
    const bool stroke = over_path_length(contact);
    Panel panel;
    panel.title = (stroke ? "Force over path length, contact from " : "Force over depth, contact from ") +
                  with_decimals(contact.from_s, 2) + " to " + with_decimals(contact.to_s, 2) + " s";
    panel.y_label = "force (N)";
    panel.from_zero = true;
    // The reference is drawn first, so that it hides no other line.
    const Series reference = line_of(options_.reference, contact);
    bool known = !reference_.depth_m.empty();
    panel.series.push_back(reference);
    std::vector<Panel> stronger;
    for (std::size_t m = 0; m < models_.size(); ++m) {
      if (models_[m].apart || m == options_.reference) continue;
      known = known || !models_[m].depth_m.empty();
      Series line = line_of(m, contact);
      if (largest(line) <= kFlattens * largest(reference)) {
        panel.series.push_back(std::move(line));
        continue;
      }
      Panel own;
      own.title = models_[m].name + (stroke ? ": force over path length" : ": force over depth");
      own.y_label = "force (N)";
      own.height = 120.0;
      own.from_zero = true;
      own.series = {{reference.name, reference.x, reference.y, kReferenceColour, 1.2}, std::move(line)};
      stronger.push_back(std::move(own));
    }
    for (const ReferenceCurve& curve : curves_) {
      std::vector<double> depth_mm = curve.depth_m;
      for (double& depth : depth_mm) depth *= 1e3;
      panel.series.push_back({curve.name, std::move(depth_mm), curve.force_N, "#333333", 1.8, true});
    }
    PanelGroup group;
    group.x_label = stroke  ? "path length of the device since the first touch (mm)"
                    : known ? "depth of the device (mm)"
                            : "depth of the device since the first touch (mm)";
    group.panels.push_back(std::move(panel));
    std::ranges::move(stronger, std::back_inserter(group.panels));
    return group;
  }

  // The largest force of a line (N); gaps do not count.
  static double largest(const Series& line) {
    double most = 0.0;
    for (std::size_t i = 0; i < line.y.size(); ++i) {
      if (std::isfinite(line.x[i]) && line.y[i] > most) most = line.y[i];
    }
    return most;
  }

  std::span<const ComparedModel> models_;
  std::span<const ReferenceCurve> curves_;
  const ComparePlotOptions& options_;
  const ComparedModel& reference_;
  std::vector<Course> courses_;
  Intervals touched_;
  ValueRange time_;
  std::vector<Contact> contacts_;
  bool with_sign_ = false;
};

}  // namespace

double signed_jnd(const glm::dvec3& force, const glm::dvec3& reference, const ComparePlotOptions& options) {
  const double size = glm::length(reference);
  const double jnd = glm::length(force - reference) / std::max(options.jnd_share * size, options.jnd_floor_N);
  return glm::length(force) < size ? -jnd : jnd;
}

std::string reference_note(const std::string& name, const ComparePlotOptions& options) {
  return "Reference: " + name + ". One JND: " + with_digits(100.0 * options.jnd_share, 3) +
         " % of its force, at least " + with_digits(options.jnd_floor_N, 3) + " N.";
}

Area not_felt_area(const std::vector<double>& ends) {
  return {"not felt: within ±1 JND", ends, {-1.0, -1.0}, {1.0, 1.0}, "#dfe8f2"};
}

Figure compare_figure(std::span<const ComparedModel> models, std::span<const ReferenceCurve> curves,
                      const std::string& title, const ComparePlotOptions& options) {
  if (options.reference >= models.size())
    throw std::invalid_argument("compare_figure: the reference is no model");
  return ComparePlot(models, curves, options).draw(title);
}

void save_compare_plot(const std::filesystem::path& svg, std::span<const ComparedModel> models,
                       std::span<const ReferenceCurve> curves, const std::string& title,
                       const ComparePlotOptions& options) {
  save_svg(svg, compare_figure(models, curves, title, options));
}

}  // namespace hybrid
