// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/phantom/phantom_servo.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <glm/geometric.hpp>

#include "device/loop/is_finite.h"
#include "device/phantom/hd_errors.h"

namespace device {
namespace {

constexpr std::uint64_t kTemperatureEvery = 64;  // ticks between readings
constexpr double kWarm = 0.8;  // share of the permitted temperature above which a message is given

long thread_number() noexcept {
  return syscall(SYS_gettid);
}

std::string number(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

}  // namespace

void ErrorTally::add(const hd::ErrorInfo& error) noexcept {
  for (std::size_t i = 0; i < size_; ++i) {
    if (rows_[i].first.code != error.code) continue;
    ++rows_[i].count;
    return;
  }
  if (size_ == rows_.size()) {
    ++beyond_;
    return;
  }
  rows_[size_++] = {error, 1};
}

std::vector<std::string> ErrorTally::in_words() const {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < size_; ++i) {
    std::string text = hd_error_in_words(rows_[i].first);
    if (rows_[i].count > 1) text += " (" + std::to_string(rows_[i].count) + " times)";
    words.push_back(std::move(text));
  }
  if (beyond_ > 0) words.push_back(std::to_string(beyond_) + " errors of still other kinds");
  return words;
}

PhantomServo::PhantomServo(const HdFunctions& call, hd::Handle handle, const PhantomServoOptions& options,
                           ServoFunction tick)
    : call_(call), handle_(handle), options_(options), function_(tick), gate_(options.gate) {}

unsigned int PhantomServo::on_tick(void* servo) noexcept {
  return static_cast<PhantomServo*>(servo)->tick();
}

unsigned int PhantomServo::tick() noexcept {
  if (crashed_.load()) return hold_zero_force();
  if (!begin()) return end_with_zero_force();
  read();
  check_device();
  take_errors();
  if (reason_ != Reason::none) return end_with_zero_force();
  const ServoAnswer answer = compute();
  if (!answer.go_on) return end_with_zero_force();
  if (answer.skip) gate_.close();
  const double share = gate_.pass(options_.dt_s);
  if (share > 0.0) state_.fault = DeviceFault::none;
  set_force(share * options_.fit.force(answer.force_N));
  call_.end_frame(handle_);
  take_errors();  // errors of this force take effect in the next tick, unless they end the session
  if (reason_ == Reason::none) return hd::kContinue;
  call_.begin_frame(handle_);
  return end_with_zero_force();
}

// Begins the frame, which is open when the function returns.
bool PhantomServo::begin() noexcept {
  const std::int64_t now_ns = options_.clock_ns();
  if (last_ns_ == 0) thread_.store(thread_number());
  const double gap_s = last_ns_ == 0 ? options_.dt_s : 1e-9 * static_cast<double>(now_ns - last_ns_);
  last_ns_ = now_ns;
  late_s_ = std::max(0.0, gap_s - options_.dt_s);
  longest_late_s_ = std::max(longest_late_s_, late_s_);
  if (late_s_ > 0.5 * options_.dt_s) ++late_ticks_;
  if (options_.dt_s + late_s_ > options_.deadline_s) {
    ++cut_ticks_;
    gate_.close();
    state_.fault = DeviceFault::late;
  }
  call_.begin_frame(handle_);
  if (stop_.load()) end_for(Reason::stopped);
  if (const hd::Name reported = reported_code_.exchange(0))
    note({reported, reported_internal_.load(), handle_});
  take_errors();
  return reason_ == Reason::none;
}

void PhantomServo::read() noexcept {
  std::array<double, hd::kMaxValues> position{}, velocity{};
  std::array<int, hd::kMaxValues> buttons{};
  call_.get_doubles(hd::kPosition, position.data());
  call_.get_doubles(hd::kVelocity, velocity.data());
  call_.get_integers(hd::kButtons, buttons.data());
  const glm::dvec3 p(position[0], position[1], position[2]), v(velocity[0], velocity[1], velocity[2]);
  state_.buttons = static_cast<std::uint32_t>(buttons[0]);
  if (is_finite(p) && is_finite(v)) {
    state_.position_m = options_.fit.position(hd::kMillimeter * p);
    state_.velocity_m_per_s = options_.fit.velocity(hd::kMillimeter * v);
  } else {  // the last valid position is kept, with zero force
    ++nonfinite_;
    state_.velocity_m_per_s = glm::dvec3(0.0);
    gate_.close();
  }
  if (!options_.has_safety_switch) return;
  std::array<unsigned char, hd::kMaxValues> held{};
  call_.get_booleans(hd::kSafetySwitch, held.data());
  if (held[0] != 0) return;
  ++open_switch_ticks_;
  gate_.close();
}

void PhantomServo::check_device() noexcept {
  const hd::Name calibration = call_.check_calibration();
  if (calibration == hd::kNeedsHand) end_for(Reason::calibration);
  if (calibration == hd::kNeedsUpdate) {  // the position may jump
    ++recalibrated_;
    gate_.close();
    call_.update_calibration(hd::kAutomatic);
  }
  if (ticks() % kTemperatureEvery != 0) return;
  std::array<double, hd::kMaxValues> temperature{};
  call_.get_doubles(hd::kMotorTemperature, temperature.data());
  for (const double one : temperature) {
    if (std::isfinite(one)) hottest_ = std::max(hottest_, one);
  }
}

ServoAnswer PhantomServo::compute() noexcept {
  ticks_.fetch_add(1, std::memory_order_relaxed);
  try {
    const ServoAnswer answer = function_({.device = state_, .dt_s = options_.dt_s, .late_s = late_s_});
    if (!answer.go_on) end_for(Reason::finished);
    return answer;
  } catch (...) {
    thrown_ = std::current_exception();
    end_for(Reason::thrown);
    return {.force_N = glm::dvec3(0.0), .go_on = false};
  }
}

void PhantomServo::set_force(const glm::dvec3& force_device_N) noexcept {
  const double strength = glm::length(force_device_N);
  glm::dvec3 force = force_device_N;
  if (!std::isfinite(strength)) {
    force = glm::dvec3(0.0);
    gate_.close();
  } else if (options_.max_force_N > 0.0 && strength > options_.max_force_N) {
    force *= options_.max_force_N / strength;
  }
  const std::array<double, 3> values{force.x, force.y, force.z};
  call_.set_doubles(hd::kForce, values.data());
}

// Ends the open frame with zero force. It is the session's last frame.
unsigned int PhantomServo::end_with_zero_force() noexcept {
  set_force(glm::dvec3(0.0));
  call_.end_frame(handle_);
  take_errors();
  done_.store(true, std::memory_order_release);
  return hd::kDone;
}

// Called while the program is crashing: sends zero force in every tick. done() stays false, so that no other
// thread continues.
unsigned int PhantomServo::hold_zero_force() noexcept {
  call_.begin_frame(handle_);
  set_force(glm::dvec3(0.0));
  call_.end_frame(handle_);
  crash_zeroed_.store(true);
  return hd::kContinue;
}

void PhantomServo::take_errors() noexcept {
  for (int i = 0; i < hd::kMaxErrors; ++i) {
    const hd::ErrorInfo error = call_.get_error();
    if (error.code == hd::kSuccess) return;
    note(error);
  }
}

void PhantomServo::note(const hd::ErrorInfo& error) noexcept {
  errors_.add(error);
  gate_.close();
  state_.fault = hd_error_text(error.code).fault;
  if (hd_error_text(error.code).outcome == HdOutcome::ended) end_for(Reason::error);
}

void PhantomServo::report_error(const hd::ErrorInfo& error) noexcept {
  reported_internal_.store(error.internal_code);
  reported_code_.store(error.code);
}

void PhantomServo::on_crash(void* servo) noexcept {
  auto& self = *static_cast<PhantomServo*>(servo);
  self.crashed_.store(true);
  if (self.thread_.load() == thread_number()) {
    // The servo thread itself crashed, perhaps within a frame. The zero force may have no effect, because the
    // driver sends forces after the callback has returned, and here the callback will not return.
    constexpr std::array<double, 3> kNothing{};
    self.call_.set_doubles(hd::kForce, kNothing.data());
    self.call_.end_frame(self.handle_);
    return;
  }
  // The next tick of the servo thread sends zero force. This thread waits up to 10 ms for it.
  for (int i = 0; i < 20 && !self.crash_zeroed_.load() && !self.done(); ++i) {
    constexpr timespec kHalfMillisecond{0, 500'000};
    nanosleep(&kHalfMillisecond, nullptr);
  }
}

ServoReport PhantomServo::report() const {
  ServoReport report;
  report.ticks = ticks();
  report.late_ticks = late_ticks_;
  report.priority = "The driver's servo thread runs the loop, at the priority the driver gives it.";
  report.messages = errors_.in_words();
  const auto say = [&report](bool really, const std::string& words) {
    if (really) report.messages.push_back(words);
  };
  switch (reason_) {
    case Reason::finished:
    case Reason::thrown:
    case Reason::none:
      break;
    case Reason::stopped:
      report.end = ServoEnd::stopped;
      report.messages.emplace_back("stopped by a signal; what was felt until then is kept");
      break;
    case Reason::error:
      report.end = ServoEnd::lost;
      report.messages.emplace_back(
          "the device is lost: forces are off, and the session ended; what was felt until "
          "then is kept");
      break;
    case Reason::calibration:
      report.end = ServoEnd::lost;
      report.messages.emplace_back(
          "the device lost its calibration: forces are off, and the session ended; what was felt until then "
          "is "
          "kept; calibrate it (`hybrid devices` says how) and start again");
      break;
  }
  say(cut_ticks_ > 0, std::to_string(cut_ticks_) + " ticks missed the deadline of " +
                          number("%.3g", 1e3 * options_.deadline_s) + " ms (the longest " +
                          number("%.3g", 1e3 * longest_late_s_) +
                          " ms late), and forces were off: close other programs, allow real-time priority "
                          "(device/README.md, Real time), or make the scene cheaper");
  say(nonfinite_ > 0,
      std::to_string(nonfinite_) +
          " positions were not numbers, and forces were off: check the cable, and calibrate again");
  say(open_switch_ticks_ > 0, "the safety switch was not held in " + std::to_string(open_switch_ticks_) +
                                  " ticks, and forces were off: hold it while you touch");
  say(recalibrated_ > 0, "the driver calibrated anew " + std::to_string(recalibrated_) +
                             " times, and forces were off meanwhile: positions before and after may differ");
  say(hottest_ > kWarm, "the motors came to " + number("%.0f", 100.0 * hottest_) +
                            " % of the temperature they bear: rest the device, or lower [safety] max_force");
  return report;
}

}  // namespace device
