// SPDX-License-Identifier: GPL-3.0-or-later
// The C interface: the library, opening, the scene, closing.
#include <algorithm>
#include <cstring>
#include <forward_list>
#include <iterator>
#include <limits>
#include <mutex>

#include "hybrid/base/flush_to_zero.h"
#include "interface/handle.h"

namespace c_interface {
namespace {

// Every handle that was given out. The list keeps them reachable, so that none counts as leaked memory.
std::mutex handles_lock;
std::forward_list<hybrid_session>& handles() {
  static auto* const all = new std::forward_list<hybrid_session>;  // never destroyed: threads may outlive it
  return *all;
}

constexpr double kLeastRate_hz = 100.0, kMostRate_hz = 20'000.0;  // of scenes as well
constexpr double kUsualSurfaces_hz = 30.0;

hybrid_code read_options(const char* where, const hybrid_options* asked, HostOptions& out) noexcept {
  if (asked == nullptr) return HYBRID_OK;
  if (const hybrid_code code = check_struct(where, asked); code != HYBRID_OK) return code;
  hybrid_options known{};  // members that the caller does not have stay 0
  std::memcpy(&known, asked, std::min<std::size_t>(asked->size, sizeof known));
  const hybrid_options* const given = &known;
  if (given->relaxation > HYBRID_RELAX_TICK)
    return fail(HYBRID_BAD_VALUE, where, "options.relaxation is unknown; use a value of hybrid_relaxation");
  if (given->rate_hz != 0.0 && !(given->rate_hz >= kLeastRate_hz && given->rate_hz <= kMostRate_hz))
    return fail(HYBRID_BAD_VALUE, where, "options.rate_hz is out of range; use 100 to 20000, or 0");
  if (given->surfaces_hz != 0.0 && !(given->surfaces_hz > 0.0 && given->surfaces_hz <= kMostRate_hz))
    return fail(HYBRID_BAD_VALUE, where, "options.surfaces_hz is out of range; use 1 to 20000, or 0");
  out.relaxation = static_cast<Relaxation>(given->relaxation);
  if (given->rate_hz != 0.0) out.rate_hz = given->rate_hz;
  out.recorded_ticks = given->recorded_ticks;
  out.surfaces_hz = given->surfaces_hz != 0.0 ? given->surfaces_hz : kUsualSurfaces_hz;
  out.surfaces = given->without_surfaces == 0;
  out.error = given->with_error != 0;
  return HYBRID_OK;
}

// Opens the scene that `source` reads.
template <class Source>
hybrid_code open(const char* where, const hybrid_options* options, hybrid_session** session,
                 const Source& source) noexcept {
  if (session == nullptr)
    return fail(HYBRID_NULL_ARGUMENT, where, "the place for the session is NULL; pass &session");
  *session = nullptr;
  HostOptions host;
  if (const hybrid_code code = read_options(where, options, host); code != HYBRID_OK) return code;
  // Host programs treat denormal numbers in different ways. The result of a scene must not depend on that.
  const hybrid::ScopedFlushToZero flushed;
  return guarded(where, HYBRID_REFUSED, [&] {
    *session = new_handle(std::make_unique<HostedSession>(source(), host));
    return HYBRID_OK;
  });
}

hybrid_info info_of(const HostedSession& session) {
  const hybrid::World& world = session.world();
  hybrid_info info{};
  info.objects = static_cast<std::uint32_t>(world.object_count());
  info.rigid_objects = static_cast<std::uint32_t>(world.rigid.size());
  info.notes = static_cast<std::uint32_t>(session.notes().size());
  info.editable = static_cast<std::uint32_t>(session.editable().size());
  info.is_punch = world.tool.shape == hybrid::Tool::Shape::punch ? 1 : 0;
  info.tool_radius_m = world.tool.radius_m;
  info.period_s = session.period_s();
  info.max_force_N = world.limits.max_force_N;
  for (int d = 0; d < 3; ++d) {
    info.low_m[d] = std::numeric_limits<double>::infinity();
    info.high_m[d] = -info.low_m[d];
  }
  for (std::size_t o = 0; o < world.object_count(); ++o) {
    const hybrid::ObjectBox box = hybrid::object_box(world, o);
    for (int d = 0; d < 3; ++d) {
      info.low_m[d] = std::min(info.low_m[d], box.low[d]);
      info.high_m[d] = std::max(info.high_m[d], box.high[d]);
    }
  }
  return info;
}

}  // namespace

hybrid_session* new_handle(std::unique_ptr<HostedSession> session) {
  const std::scoped_lock lock(handles_lock);
  hybrid_session& handle = handles().emplace_front();
  handle.session.store(session.release(), std::memory_order_release);
  return &handle;
}

}  // namespace c_interface

using namespace c_interface;  // NOLINT(google-build-using-namespace): these functions cannot be in it

const char* hybrid_version(void) {
  return HYBRID_VERSION;
}

uint32_t hybrid_abi_version(void) {
  return HYBRID_ABI_VERSION;
}

const char* hybrid_error_text(void) {
  return error_text();
}

const char* hybrid_code_name(hybrid_code code) {
  static constexpr const char* kNames[] = {
      "HYBRID_OK",        "HYBRID_NULL_ARGUMENT", "HYBRID_CLOSED",     "HYBRID_WRONG_ORDER",
      "HYBRID_BUSY",      "HYBRID_BAD_VALUE",     "HYBRID_BAD_STRUCT", "HYBRID_NOT_FOUND",
      "HYBRID_TOO_SMALL", "HYBRID_FULL",          "HYBRID_REFUSED",    "HYBRID_NOT_AVAILABLE",
      "HYBRID_FILE",      "HYBRID_NO_MEMORY",     "HYBRID_INTERNAL"};
  static_assert(std::size(kNames) == HYBRID_INTERNAL + 1);
  const auto number = static_cast<std::size_t>(code);
  return number < std::size(kNames) ? kNames[number] : "unknown code";
}

hybrid_code hybrid_open(const char* scene_file, const hybrid_options* options, hybrid_session** session) {
  if (session != nullptr) *session = nullptr;
  if (scene_file == nullptr)
    return fail(HYBRID_NULL_ARGUMENT, "hybrid_open",
                "the scene's file is NULL; pass the path of a .toml file");
  return open("hybrid_open", options, session, [&] { return scene_from_file(scene_file); });
}

hybrid_code hybrid_open_text(const char* scene_text, const char* folder, const hybrid_options* options,
                             hybrid_session** session) {
  if (session != nullptr) *session = nullptr;
  if (scene_text == nullptr || folder == nullptr) {
    return fail(HYBRID_NULL_ARGUMENT, "hybrid_open_text",
                "the scene's text or its folder is NULL; pass both (\".\" is the present folder)");
  }
  return open("hybrid_open_text", options, session, [&] { return scene_from_text(scene_text, folder); });
}

hybrid_code hybrid_close(hybrid_session* session) {
  constexpr const char* kWhere = "hybrid_close";
  if (session == nullptr) return check_handle(kWhere, session);
  const Claim servo(session->servo), reader(session->reader), editor(session->editor);
  if (!servo.held() || !reader.held() || !editor.held()) {
    return fail(HYBRID_BUSY, kWhere,
                "another thread is within the session; let it end before the session is closed");
  }
  if (const hybrid_code code = check_handle(kWhere, session); code != HYBRID_OK) return code;
  return guarded(kWhere, HYBRID_INTERNAL, [&] {
    delete session->session.exchange(nullptr, std::memory_order_acq_rel);
    return HYBRID_OK;
  });
}

hybrid_code hybrid_get_info(hybrid_session* session, hybrid_info* info) {
  constexpr const char* kWhere = "hybrid_get_info";
  return with_session(kWhere, session, [&](const HostedSession& opened) {
    if (const hybrid_code code = check_struct(kWhere, info); code != HYBRID_OK) return code;
    give(info_of(opened), info);
    return HYBRID_OK;
  });
}

hybrid_code hybrid_get_object(hybrid_session* session, uint32_t object, hybrid_object* out) {
  constexpr const char* kWhere = "hybrid_get_object";
  return with_session(kWhere, session, [&](HostedSession& opened) {
    if (const hybrid_code code = check_struct(kWhere, out); code != HYBRID_OK) return code;
    if (const hybrid_code code = check_object(kWhere, opened, object); code != HYBRID_OK) return code;
    hybrid_object found{};
    found.is_soft = object < opened.world().rigid.size() ? 0 : 1;
    found.name = opened.name_of(object).c_str();
    if (const HostedSurfaces* surfaces = opened.surfaces()) {
      found.vertices = surfaces->at_rest(object).vertices.size();
      found.triangles = surfaces->at_rest(object).triangles.size();
    }
    give(found, out);
    return HYBRID_OK;
  });
}

hybrid_code hybrid_note(hybrid_session* session, uint32_t note, const char** text) {
  constexpr const char* kWhere = "hybrid_note";
  return with_session(kWhere, session, [&](const HostedSession& opened) {
    if (text == nullptr)
      return fail(HYBRID_NULL_ARGUMENT, kWhere, "the place for the text is NULL; pass &text");
    if (note >= opened.notes().size())
      return fail(HYBRID_NOT_FOUND, kWhere, "there is no note of this number; hybrid_get_info() counts them");
    *text = opened.notes()[note].c_str();
    return HYBRID_OK;
  });
}
