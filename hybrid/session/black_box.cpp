// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/black_box.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <string_view>

#include "hybrid/session/report.h"

namespace hybrid {
namespace {

constexpr double kShareAfterFault = 0.25;  // share of the ring that is recorded after a fault
constexpr std::size_t kLongestRow = 1024;  // characters; holds 30 numbers of at most 24

constexpr std::array<std::string_view, 7> kFaultWords{
    "none", "lost", "not_calibrated", "warm_motors", "force_limit", "velocity_limit", "late"};

std::string_view word(device::DeviceFault fault) noexcept {
  return kFaultWords[std::min(static_cast<std::size_t>(fault), kFaultWords.size() - 1)];
}

bool write_all(int descriptor, std::string_view text) noexcept {
  while (!text.empty()) {
    const ssize_t n = ::write(descriptor, text.data(), text.size());
    if (n <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

// Appends to a row of fixed capacity, without locale or allocation.
class Row {
 public:
  template <typename T>
  void add(const T& value) noexcept {
    end_ = std::to_chars(end_, text_.data() + text_.size() - 1, value).ptr;
    *end_++ = ',';
  }
  void add(std::string_view text) noexcept {
    end_ = std::copy(text.begin(), text.end(), end_);
    *end_++ = ',';
  }
  void add(const glm::dvec3& v) noexcept {
    for (int d = 0; d < 3; ++d) add(v[d]);
  }
  [[nodiscard]] std::string_view line() noexcept {
    end_[-1] = '\n';  // replaces the last comma
    return {text_.data(), static_cast<std::size_t>(end_ - text_.data())};
  }

 private:
  std::array<char, kLongestRow> text_{};
  char* end_ = text_.data();
};

bool write_file(const BlackBox& box, const FilePlace& place) noexcept {
  FileOnItsWay file(place);
  return file.open() && box.write_to(file.descriptor()) && file.keep();
}

}  // namespace

BlackBox::BlackBox(double rate_hz)
    : dt_s_(1.0 / rate_hz),
      rows_(static_cast<std::size_t>(std::ceil(kSeconds * rate_hz))),
      left_(static_cast<std::uint64_t>(kShareAfterFault * static_cast<double>(rows_.size()))) {}

BlackBox::Cause BlackBox::cause_of(const BlackBoxRow& row) const noexcept {
  if (row.reported != device::DeviceFault::none) return Cause::device;
  if (row.nonfinite > nonfinite_) return Cause::nonfinite;
  return (row.faults & ~faults_) != 0 ? Cause::tick : Cause::none;
}

void BlackBox::add(const BlackBoxRow& row) noexcept {
  if (cause_ == Cause::none) {
    cause_ = cause_of(row);
    if (cause_ != Cause::none) {
      at_fault_ = row;
      at_fault_.faults &= ~faults_;
    }
  } else if (left_ == 0) {
    return;
  } else {
    --left_;
  }
  faults_ = row.faults;
  nonfinite_ = row.nonfinite;
  rows_[added_ % rows_.size()] = row;
  ++added_;
}

std::optional<std::string> BlackBox::fault() const {
  const double t_s = static_cast<double>(at_fault_.tick) * dt_s_;
  switch (cause_) {
    case Cause::none:
      break;
    case Cause::device:
      return fmt::format("the device said '{}' at {:.3f} s", word(at_fault_.reported), t_s);
    case Cause::nonfinite:
      return fmt::format("a number that is none was held back at {:.3f} s", t_s);
    case Cause::tick:
      return fmt::format("{} (at {:.3f} s)", fault_texts(at_fault_.faults).back(), t_s);
  }
  return std::nullopt;
}

bool BlackBox::write_to(int descriptor) const noexcept {
  if (!write_all(descriptor,
                 "t_s,x_m,y_m,z_m,said_x_m,said_y_m,said_z_m,proxy_x_m,proxy_y_m,proxy_z_m,force_x_N,"
                 "force_y_N,force_z_N,rigid_N,soft_N,contacts,device_fault,faults,nonfinite,late_us,tick_us"))
    return false;
  for (const std::string_view name : kStageNames) {
    if (!write_all(descriptor, ",") || !write_all(descriptor, name) || !write_all(descriptor, "_us"))
      return false;
  }
  bool written = write_all(descriptor, "\n");
  const std::uint64_t kept = std::min<std::uint64_t>(added_, rows_.size());
  for (std::uint64_t n = added_ - kept; n < added_ && written; ++n) {
    const BlackBoxRow& r = rows_[n % rows_.size()];
    Row row;
    row.add(static_cast<double>(r.tick) * dt_s_);
    for (const glm::dvec3& v : {r.felt.device_m, r.reported_m, r.felt.proxy_m, r.felt.force_N}) row.add(v);
    row.add(glm::length(r.felt.rigid_N));
    row.add(glm::length(r.felt.soft_N));
    row.add(r.felt.contacts);
    row.add(word(r.reported));
    row.add(r.faults);
    row.add(r.nonfinite);
    row.add(r.late_us);
    row.add(r.felt.tick_us);
    for (const float us : r.felt.stage_us) row.add(us);
    written = write_all(descriptor, row.line());
  }
  return written;
}

BlackBoxFile::BlackBoxFile(double rate_hz, const std::filesystem::path& file)
    : box_(rate_hz), place_(file), on_crash_(save_now, this) {}

void BlackBoxFile::save_now(void* self) noexcept {
  const auto* const me = static_cast<const BlackBoxFile*>(self);
  write_file(me->box_, me->place_);
}

std::string BlackBoxFile::save_on_fault() const {
  const std::optional<std::string> fault = box_.fault();
  if (!fault) return {};
  if (!write_file(box_, place_))
    throw std::runtime_error(fmt::format("{}: cannot be written ({}); check the folder and the space left",
                                         place_.asked.string(), std::strerror(errno)));
  return fmt::format("{}; the {:g} s around it are in {}", *fault, BlackBox::kSeconds, place_.asked.string());
}

std::unique_ptr<BlackBoxFile> open_black_box_file(const std::filesystem::path& asked,
                                                  const std::filesystem::path& scene, bool live,
                                                  double rate_hz) {
  if (asked.empty() && !live) return nullptr;
  return std::make_unique<BlackBoxFile>(
      rate_hz, asked.empty() ? std::filesystem::path(scene.stem().string() + "-fault.csv") : asked);
}

}  // namespace hybrid
