// SPDX-License-Identifier: GPL-3.0-or-later
// The handles that the C interface gives out, and the checks that come before every call.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "hybrid/scene/scene.h"
#include "interface/hosted_session.h"
#include "interface/hybrid.h"
#include "interface/last_error.h"

// A handle outlives its session, so that a call with a closed handle is an error and not undefined. Its few
// bytes are never freed and never used again.
struct hybrid_session {
  std::atomic<c_interface::HostedSession*> session{nullptr};
  // One for each group of calls: true while a call of the group runs.
  std::atomic<bool> servo{false}, reader{false}, editor{false};
};

namespace c_interface {

// A new handle that owns the session.
hybrid_session* new_handle(std::unique_ptr<HostedSession> session);

// Holds a group of calls while it lives, if no other thread held it.
class Claim {
 public:
  explicit Claim(std::atomic<bool>& group) noexcept
      : group_(group), held_(!group.exchange(true, std::memory_order_acquire)) {}
  ~Claim() {
    if (held_) group_.store(false, std::memory_order_release);
  }
  Claim(const Claim&) = delete;
  Claim& operator=(const Claim&) = delete;
  Claim(Claim&&) = delete;
  Claim& operator=(Claim&&) = delete;
  [[nodiscard]] bool held() const noexcept { return held_; }

 private:
  std::atomic<bool>& group_;
  bool held_;
};

// Runs `act`, which returns a code, and turns exceptions into codes. An exception that concerns neither a
// scene nor memory gives `otherwise`. `where`: name of the function, for errors.
template <class Act>
hybrid_code guarded(const char* where, hybrid_code otherwise, const Act& act) noexcept {
  try {
    return act();
  } catch (const hybrid::SceneError& error) {
    return fail(HYBRID_REFUSED, error.what());
  } catch (const std::bad_alloc&) {
    return fail(HYBRID_NO_MEMORY, where, "out of memory; use a coarser spacing, or close other sessions");
  } catch (const std::length_error&) {
    return fail(HYBRID_NO_MEMORY, where, "more memory than a program can have; lower recorded_ticks");
  } catch (const std::exception& error) {
    try {
      return fail(otherwise, std::string(where) + ": " + error.what());
    } catch (const std::bad_alloc&) {
      return fail(otherwise, where, "failed, and there is no memory for the reason; free some");
    }
  } catch (...) {
    return fail(HYBRID_INTERNAL, where, "an unknown failure; please report it");
  }
}

inline hybrid_code check_handle(const char* where, const hybrid_session* handle) noexcept {
  if (handle == nullptr)
    return fail(HYBRID_NULL_ARGUMENT, where, "the session is NULL; pass the handle that hybrid_open() gave");
  if (handle->session.load(std::memory_order_acquire) == nullptr)
    return fail(HYBRID_CLOSED, where, "the session was closed; open another one");
  return HYBRID_OK;
}

// Runs act(session) without claiming a group. `act` may only read members that never change.
template <class Act>
hybrid_code with_session(const char* where, hybrid_session* handle, const Act& act) noexcept {
  if (const hybrid_code code = check_handle(where, handle); code != HYBRID_OK) return code;
  HostedSession& session = *handle->session.load(std::memory_order_acquire);
  return guarded(where, HYBRID_INTERNAL, [&] { return act(session); });
}

// Runs act(session) in a group of calls.
template <class Act>
hybrid_code in_group(const char* where, hybrid_session* handle, std::atomic<bool> hybrid_session::*group,
                     const Act& act, hybrid_code otherwise = HYBRID_INTERNAL) noexcept {
  if (handle == nullptr) return check_handle(where, handle);
  const Claim claim(handle->*group);
  if (!claim.held()) {
    return fail(HYBRID_BUSY, where,
                "another thread is in a call of this group; call the functions of a group from one thread");
  }
  if (const hybrid_code code = check_handle(where, handle); code != HYBRID_OK) return code;
  HostedSession& session = *handle->session.load(std::memory_order_relaxed);
  return guarded(where, otherwise, [&] { return act(session); });
}

// Like in_group(), for the servo thread of a session that has begun.
template <class Act>
hybrid_code in_servo(const char* where, hybrid_session* handle, const Act& act,
                     hybrid_code otherwise = HYBRID_INTERNAL) noexcept {
  return in_group(
      where, handle, &hybrid_session::servo,
      [&](HostedSession& session) {
        if (!session.begun())
          return fail(HYBRID_WRONG_ORDER, where, "the session has not begun; call hybrid_begin() first");
        return act(session);
      },
      otherwise);
}

// Sizes (bytes) of the structures in their first version. A smaller size is a mistake. A structure that grows
// keeps its first size here, so that older programs still run.
template <class Struct>
inline constexpr std::uint32_t kFirstSize = 0;
template <>
inline constexpr std::uint32_t kFirstSize<hybrid_options> = 40;
template <>
inline constexpr std::uint32_t kFirstSize<hybrid_info> = 96;
template <>
inline constexpr std::uint32_t kFirstSize<hybrid_object> = 32;
template <>
inline constexpr std::uint32_t kFirstSize<hybrid_felt> = 160;
template <>
inline constexpr std::uint32_t kFirstSize<hybrid_editable> = 48;
template <>
inline constexpr std::uint32_t kFirstSize<hybrid_snapshot> = 88;
template <>
inline constexpr std::uint32_t kFirstSize<hybrid_error> = 56;

template <class Struct>
hybrid_code check_struct(const char* where, const Struct* given) noexcept {
  static_assert(std::is_trivially_copyable_v<Struct> && kFirstSize<Struct> != 0);
  static_assert(sizeof(Struct) >= kFirstSize<Struct>, "members are appended, never removed");
  if (given == nullptr)
    return fail(HYBRID_NULL_ARGUMENT, where, "a structure is NULL; pass one, with its size set");
  if (given->size < kFirstSize<Struct>)
    return fail(HYBRID_BAD_STRUCT, where, "a structure has no size; set its first member to its sizeof");
  return HYBRID_OK;
}

inline hybrid_code check_object(const char* where, const HostedSession& session,
                                std::uint32_t object) noexcept {
  if (object < session.world().object_count()) return HYBRID_OK;
  return fail(HYBRID_NOT_FOUND, where, "there is no object of this number; hybrid_get_info() counts them");
}

// Copies the members that both sides know. `to` keeps its size.
template <class Struct>
void give(Struct from, Struct* to) noexcept {
  from.size = to->size;
  std::memcpy(to, &from, std::min<std::size_t>(to->size, sizeof from));
}

}  // namespace c_interface
