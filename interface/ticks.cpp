// SPDX-License-Identifier: GPL-3.0-or-later
// The C interface: ticks and their results, recordings, errors. hybrid_tick() and hybrid_play() allocate
// nothing, take no lock and throw nothing.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <span>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/session/report.h"
#include "interface/handle.h"

namespace c_interface {
namespace {

constexpr double kFarthest_m = 1e6;   // of a position: beyond it the unit is a mistake
constexpr double kMostDt_s = 0.1;     // ten periods of the slowest servo rate
constexpr double kUnitLength = 1e-3;  // a quaternion's length is 1 within this

bool is_position(const double* at) noexcept {
  return std::all_of(at, at + 3, [](double x) { return std::abs(x) <= kFarthest_m; });  // false for NaN
}

bool is_unit(const double* q) noexcept {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return std::abs(length - 1.0) <= kUnitLength;
}

hybrid_code check_dt(const char* where, double dt_s) noexcept {
  if (dt_s > 0.0 && dt_s <= kMostDt_s) return HYBRID_OK;
  return fail(HYBRID_BAD_VALUE, where,
              "dt_s is not above 0 and at most 0.1 s; pass the seconds since the tick before, such as "
              "info.period_s; no tick was done");
}

constexpr const char* kBadPosition =
    "a position is not finite, or farther than 1e6 m; pass x, y, z in meters in the scene's frame; no tick "
    "was "
    "done";

void set(double (&to)[3], const glm::dvec3& from) noexcept {
  for (int d = 0; d < 3; ++d) to[d] = from[d];
}

hybrid_felt felt_of(const HostedSession& session) noexcept {
  const hybrid::TickResult& felt = session.felt();
  const hybrid::WorldState& state = session.state();
  hybrid_felt out{};
  out.contact_count = static_cast<std::uint32_t>(std::count_if(
      state.feel.begin(), state.feel.end(), [](const hybrid::ObjectFeel& o) { return o.contact; }));
  out.contact_bits = felt.contacts;
  out.faults = state.faults;
  set(out.device_m, felt.device_m);
  set(out.proxy_m, felt.proxy_m);
  set(out.force_N, felt.force_N);
  set(out.rigid_N, felt.rigid_N);
  set(out.soft_N, felt.soft_N);
  out.tick_us = felt.tick_us;
  out.tick = session.ticks() - 1;
  out.hash = session.hash();
  return out;
}

glm::dvec3 vector_of(const double* at) noexcept {
  return {at[0], at[1], at[2]};
}

// Result `n` of an array whose entries have the caller's size.
hybrid_felt* entry(hybrid_felt* first, std::uint32_t size, std::size_t n) noexcept {
  return reinterpret_cast<hybrid_felt*>(reinterpret_cast<std::byte*>(first) + n * size);
}

}  // namespace
}  // namespace c_interface

using namespace c_interface;  // NOLINT(google-build-using-namespace): these functions cannot be in it

hybrid_code hybrid_begin(hybrid_session* session, const double position_m[3]) {
  constexpr const char* kWhere = "hybrid_begin";
  return in_group(kWhere, session, &hybrid_session::servo, [&](HostedSession& opened) {
    if (opened.begun())
      return fail(HYBRID_WRONG_ORDER, kWhere, "the session has begun; open another one to begin anew");
    if (position_m == nullptr)
      return fail(HYBRID_NULL_ARGUMENT, kWhere, "the position is NULL; pass x, y, z");
    if (!is_position(position_m)) return fail(HYBRID_BAD_VALUE, kWhere, kBadPosition);
    opened.begin(vector_of(position_m));
    return HYBRID_OK;
  });
}

hybrid_code hybrid_tick(hybrid_session* session, const double position_m[3], const double orientation_wxyz[4],
                        double dt_s, hybrid_felt* felt) {
  constexpr const char* kWhere = "hybrid_tick";
  return in_servo(kWhere, session, [&](HostedSession& opened) {
    if (position_m == nullptr)
      return fail(HYBRID_NULL_ARGUMENT, kWhere, "the position is NULL; pass x, y, z in meters");
    if (!is_position(position_m)) return fail(HYBRID_BAD_VALUE, kWhere, kBadPosition);
    if (orientation_wxyz != nullptr && !is_unit(orientation_wxyz)) {
      return fail(HYBRID_BAD_VALUE, kWhere,
                  "the orientation is no unit quaternion; pass w, x, y, z of length 1, or NULL");
    }
    if (const hybrid_code code = check_dt(kWhere, dt_s); code != HYBRID_OK) return code;
    if (felt != nullptr) {
      if (const hybrid_code code = check_struct(kWhere, felt); code != HYBRID_OK) return code;
    }
    const hybrid::ScopedFlushToZero flushed;
    opened.tick(vector_of(position_m), dt_s);
    if (felt != nullptr) give(felt_of(opened), felt);
    return HYBRID_OK;
  });
}

hybrid_code hybrid_play(hybrid_session* session, const double* positions_m, size_t count, double dt_s,
                        hybrid_felt* felt) {
  constexpr const char* kWhere = "hybrid_play";
  return in_servo(kWhere, session, [&](HostedSession& opened) {
    if (count == 0) return HYBRID_OK;
    if (positions_m == nullptr)
      return fail(HYBRID_NULL_ARGUMENT, kWhere, "the positions are NULL; pass x, y, z for each tick");
    for (std::size_t n = 0; n < count; ++n) {
      if (!is_position(positions_m + 3 * n)) return fail(HYBRID_BAD_VALUE, kWhere, kBadPosition);
    }
    if (const hybrid_code code = check_dt(kWhere, dt_s); code != HYBRID_OK) return code;
    if (felt != nullptr) {
      if (const hybrid_code code = check_struct(kWhere, felt); code != HYBRID_OK) return code;
    }
    const hybrid::ScopedFlushToZero flushed;
    const std::uint32_t size = felt != nullptr ? felt->size : 0;
    for (std::size_t n = 0; n < count; ++n) {
      opened.tick(vector_of(positions_m + 3 * n), dt_s);
      if (felt == nullptr) continue;
      hybrid_felt* const to = entry(felt, size, n);
      to->size = size;
      give(felt_of(opened), to);
    }
    return HYBRID_OK;
  });
}

hybrid_code hybrid_get_felt(hybrid_session* session, hybrid_felt* felt) {
  constexpr const char* kWhere = "hybrid_get_felt";
  return in_servo(kWhere, session, [&](HostedSession& opened) {
    if (const hybrid_code code = check_struct(kWhere, felt); code != HYBRID_OK) return code;
    if (opened.ticks() == 0)
      return fail(HYBRID_WRONG_ORDER, kWhere, "there was no tick yet; call hybrid_tick() first");
    give(felt_of(opened), felt);
    return HYBRID_OK;
  });
}

hybrid_code hybrid_object_force(hybrid_session* session, uint32_t object, double force_N[3],
                                int* in_contact) {
  constexpr const char* kWhere = "hybrid_object_force";
  return in_servo(kWhere, session, [&](HostedSession& opened) {
    if (const hybrid_code code = check_object(kWhere, opened, object); code != HYBRID_OK) return code;
    if (force_N == nullptr)
      return fail(HYBRID_NULL_ARGUMENT, kWhere, "the place for the force is NULL; pass three numbers");
    if (opened.ticks() == 0)
      return fail(HYBRID_WRONG_ORDER, kWhere, "there was no tick yet; call hybrid_tick() first");
    const hybrid::ObjectFeel& feel = opened.state().feel[object];
    for (int d = 0; d < 3; ++d) force_N[d] = feel.on_hand_N[d];
    if (in_contact != nullptr) *in_contact = feel.contact ? 1 : 0;
    return HYBRID_OK;
  });
}

hybrid_code hybrid_state_hash(hybrid_session* session, uint64_t* hash) {
  constexpr const char* kWhere = "hybrid_state_hash";
  return in_servo(kWhere, session, [&](const HostedSession& opened) {
    if (hash == nullptr)
      return fail(HYBRID_NULL_ARGUMENT, kWhere, "the place for the hash is NULL; pass &hash");
    *hash = hybrid::hash_state(opened.hash(), opened.state());
    return HYBRID_OK;
  });
}

const char* hybrid_fault_text(uint32_t faults) {
  static const auto kTexts = [] {
    std::array<std::string, 32> texts;
    for (std::size_t bit = 0; bit < texts.size(); ++bit) {
      const auto found = hybrid::fault_texts(1U << bit);
      if (!found.empty()) texts[bit] = found.front();
    }
    return texts;
  }();
  return faults == 0 ? "" : kTexts[static_cast<std::size_t>(std::countr_zero(faults))].c_str();
}

hybrid_code hybrid_save_recording(hybrid_session* session, const char* file) {
  constexpr const char* kWhere = "hybrid_save_recording";
  return in_servo(
      kWhere, session,
      [&](const HostedSession& opened) {
        if (file == nullptr) return fail(HYBRID_NULL_ARGUMENT, kWhere, "the file is NULL; pass a path");
        if (const std::string why = opened.not_recorded(); !why.empty())
          return fail(HYBRID_NOT_AVAILABLE, std::string(kWhere) + ": " + why);
        opened.save_recording(file);
        return HYBRID_OK;
      },
      HYBRID_FILE);
}

hybrid_code hybrid_measure_error(hybrid_session* session, hybrid_error* out) {
  constexpr const char* kWhere = "hybrid_measure_error";
  return in_servo(kWhere, session, [&](const HostedSession& opened) {
    if (const hybrid_code code = check_struct(kWhere, out); code != HYBRID_OK) return code;
    const hybrid::ForceError error = opened.measure_error();
    if (!error.not_measured.empty())
      return fail(HYBRID_NOT_AVAILABLE, std::string(kWhere) + ": " + error.not_measured);
    hybrid_error found{};
    found.samples = static_cast<std::uint32_t>(error.all.samples);
    found.max_N = error.all.max_N;
    found.rms_N = error.all.rms_N;
    found.max_jnd = error.all.max_jnd;
    found.p99_jnd = error.p99_jnd;
    found.moving_max_jnd = error.moving.max_jnd;
    found.still_max_jnd = error.still.max_jnd;
    give(found, out);
    return HYBRID_OK;
  });
}
