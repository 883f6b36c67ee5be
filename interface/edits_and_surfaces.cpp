// SPDX-License-Identifier: GPL-3.0-or-later
// The C interface: values that change during a session, and surfaces for graphics.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "interface/handle.h"

namespace c_interface {
namespace {

bool is_of(const HostedSession& session, const hybrid::EditableValue& value, const char* object) {
  if (value.object == hybrid::Edit::kTool) return object == nullptr;
  return object != nullptr && session.name_of(value.object) == object;
}

// The value of this name; null: there is none.
const hybrid::EditableValue* find(const HostedSession& session, const char* object, const char* quantity) {
  for (const hybrid::EditableValue& value : session.editable()) {
    if (is_of(session, value, object) && hybrid::name_of(value.quantity) == quantity) return &value;
  }
  return nullptr;
}

std::string editable_in_words(const HostedSession& session) {
  std::string text;
  for (const hybrid::EditableValue& value : session.editable()) {
    if (!text.empty()) text += ", ";
    text += value.object == hybrid::Edit::kTool ? std::string("NULL") : session.name_of(value.object);
    text += ' ';
    text += hybrid::name_of(value.quantity);
  }
  return text;
}

hybrid_code check_surfaces(const char* where, const HostedSession& session) noexcept {
  if (session.surfaces() != nullptr) return HYBRID_OK;
  return fail(HYBRID_NOT_AVAILABLE, where,
              "the session was opened with without_surfaces; set it to 0 to have surfaces");
}

hybrid_code too_small(const char* where, const char* what, std::size_t needed, std::size_t given) {
  return fail(HYBRID_TOO_SMALL, std::string(where) + ": the buffer has room for " + std::to_string(given) +
                                    ' ' + what + ", and the object has " + std::to_string(needed) +
                                    "; hybrid_get_object() says how many");
}

}  // namespace
}  // namespace c_interface

using namespace c_interface;  // NOLINT(google-build-using-namespace): these functions cannot be in it

hybrid_code hybrid_editable_value(hybrid_session* session, uint32_t index, hybrid_editable* out) {
  constexpr const char* kWhere = "hybrid_editable_value";
  return with_session(kWhere, session, [&](const HostedSession& opened) {
    if (const hybrid_code code = check_struct(kWhere, out); code != HYBRID_OK) return code;
    if (index >= opened.editable().size())
      return fail(HYBRID_NOT_FOUND, kWhere,
                  "there is no value of this number; hybrid_get_info() counts them");
    const hybrid::EditableValue& value = opened.editable()[index];
    hybrid_editable found{};
    found.object = value.object == hybrid::Edit::kTool ? nullptr : opened.name_of(value.object).c_str();
    found.quantity = hybrid::name_of(value.quantity).data();  // names are literals, so they end in 0
    found.in_scene = value.in_scene;
    found.low = value.range.low;
    found.high = value.range.high;
    give(found, out);
    return HYBRID_OK;
  });
}

hybrid_code hybrid_edit(hybrid_session* session, const char* object, const char* quantity, double value) {
  constexpr const char* kWhere = "hybrid_edit";
  return in_group(kWhere, session, &hybrid_session::editor, [&](HostedSession& opened) {
    if (quantity == nullptr)
      return fail(HYBRID_NULL_ARGUMENT, kWhere, "the quantity is NULL; pass a name such as \"stiffness\"");
    const hybrid::EditableValue* const found = find(opened, object, quantity);
    if (found == nullptr) {
      return fail(HYBRID_NOT_FOUND, std::string(kWhere) + ": " + (object != nullptr ? object : "the tool") +
                                        " has no value '" + quantity +
                                        "' that can be edited; there are: " + editable_in_words(opened));
    }
    if (!found->range.has(value)) {
      return fail(HYBRID_BAD_VALUE, std::string(kWhere) + ": " + quantity + " = " + std::to_string(value) +
                                        " is out of range; use " + std::to_string(found->range.low) + " to " +
                                        std::to_string(found->range.high) + " (SI)");
    }
    if (!opened.edit({.object = found->object, .quantity = found->quantity, .value = value})) {
      return fail(HYBRID_FULL, kWhere,
                  "256 edits wait for a tick, or the session has had 100,000; tick before the next edit, and "
                  "edit once a picture at most");
    }
    return HYBRID_OK;
  });
}

hybrid_code hybrid_publish(hybrid_session* session) {
  constexpr const char* kWhere = "hybrid_publish";
  return in_servo(kWhere, session, [&](HostedSession& opened) {
    if (const hybrid_code code = check_surfaces(kWhere, opened); code != HYBRID_OK) return code;
    opened.publish();
    return HYBRID_OK;
  });
}

hybrid_code hybrid_take_snapshot(hybrid_session* session, hybrid_snapshot* out) {
  constexpr const char* kWhere = "hybrid_take_snapshot";
  return in_group(kWhere, session, &hybrid_session::reader, [&](HostedSession& opened) {
    if (const hybrid_code code = check_struct(kWhere, out); code != HYBRID_OK) return code;
    if (const hybrid_code code = check_surfaces(kWhere, opened); code != HYBRID_OK) return code;
    hybrid_snapshot found{};
    found.is_fresh = opened.take_surfaces() ? 1 : 0;
    if (const hybrid::Snapshot* const taken = opened.surfaces()->taken()) {
      found.tick = taken->tick;
      for (int d = 0; d < 3; ++d) {
        found.device_m[d] = taken->device_m[d];
        found.proxy_m[d] = taken->proxy_m[d];
        found.force_N[d] = taken->force_N[d];
      }
    }
    give(found, out);
    return HYBRID_OK;
  });
}

hybrid_code hybrid_vertices(hybrid_session* session, uint32_t object, double* vertices_m, size_t capacity,
                            int* changed) {
  constexpr const char* kWhere = "hybrid_vertices";
  return in_group(kWhere, session, &hybrid_session::reader, [&](HostedSession& opened) {
    if (const hybrid_code code = check_surfaces(kWhere, opened); code != HYBRID_OK) return code;
    if (const hybrid_code code = check_object(kWhere, opened, object); code != HYBRID_OK) return code;
    const HostedSurfaces& surfaces = *opened.surfaces();
    const std::size_t needed = surfaces.at_rest(object).vertices.size();
    if (vertices_m != nullptr) {
      if (capacity < needed) return too_small(kWhere, "vertices", needed, capacity);
      surfaces.copy_vertices(object, vertices_m);
    }
    if (changed != nullptr) *changed = surfaces.changed(object) ? 1 : 0;
    return HYBRID_OK;
  });
}

hybrid_code hybrid_triangles(hybrid_session* session, uint32_t object, uint32_t* indices, size_t capacity) {
  constexpr const char* kWhere = "hybrid_triangles";
  return with_session(kWhere, session, [&](HostedSession& opened) {
    if (const hybrid_code code = check_surfaces(kWhere, opened); code != HYBRID_OK) return code;
    if (const hybrid_code code = check_object(kWhere, opened, object); code != HYBRID_OK) return code;
    if (indices == nullptr)
      return fail(HYBRID_NULL_ARGUMENT, kWhere, "the place for the indices is NULL; pass a buffer");
    const auto& triangles = opened.surfaces()->at_rest(object).triangles;
    if (capacity < triangles.size()) return too_small(kWhere, "triangles", triangles.size(), capacity);
    for (const polygon::TriangleIndices& corners : triangles)
      indices = std::copy(corners.begin(), corners.end(), indices);
    return HYBRID_OK;
  });
}
