// SPDX-License-Identifier: GPL-3.0-or-later
// A session of the C interface for tests. It closes itself, and fails the test if a call fails.
#pragma once

#include <gtest/gtest.h>
#include <hybrid.h>

#include <array>
#include <filesystem>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

namespace tests {

inline void expect_ok(hybrid_code code) {
  EXPECT_EQ(code, HYBRID_OK) << hybrid_code_name(code) << ": " << hybrid_error_text();
}

class CSession {
 public:
  explicit CSession(const std::filesystem::path& file, hybrid_options options = {}) {
    options.size = sizeof options;
    expect_ok(hybrid_open(file.c_str(), &options, &session_));
  }
  CSession(const std::string& text, const std::filesystem::path& folder, hybrid_options options) {
    options.size = sizeof options;
    expect_ok(hybrid_open_text(text.c_str(), folder.c_str(), &options, &session_));
  }
  ~CSession() {
    if (session_ != nullptr) expect_ok(hybrid_close(session_));
  }
  CSession(const CSession&) = delete;
  CSession& operator=(const CSession&) = delete;
  CSession(CSession&&) = delete;
  CSession& operator=(CSession&&) = delete;

  [[nodiscard]] hybrid_session* get() const { return session_; }

  [[nodiscard]] hybrid_info info() const {
    hybrid_info info{.size = sizeof info};
    expect_ok(hybrid_get_info(session_, &info));
    return info;
  }
  void begin(const glm::dvec3& at_m) const { expect_ok(hybrid_begin(session_, &at_m.x)); }
  hybrid_felt tick(const glm::dvec3& at_m) const {
    hybrid_felt felt{.size = sizeof felt};
    expect_ok(hybrid_tick(session_, &at_m.x, nullptr, info().period_s, &felt));
    return felt;
  }
  // Ticks along the positions, and returns all results.
  [[nodiscard]] std::vector<hybrid_felt> play(std::span<const glm::dvec3> path_m) const {
    static_assert(sizeof(glm::dvec3) == 3 * sizeof(double));
    std::vector<hybrid_felt> felt(path_m.size());
    felt.front().size = sizeof(hybrid_felt);
    expect_ok(hybrid_play(session_, &path_m.front().x, path_m.size(), info().period_s, felt.data()));
    return felt;
  }
  [[nodiscard]] std::uint64_t state_hash() const {
    std::uint64_t hash = 0;
    expect_ok(hybrid_state_hash(session_, &hash));
    return hash;
  }
  [[nodiscard]] std::vector<glm::dvec3> vertices(std::uint32_t object, bool* changed = nullptr) const {
    hybrid_object found{.size = sizeof found};
    expect_ok(hybrid_get_object(session_, object, &found));
    std::vector<glm::dvec3> vertices(found.vertices);
    int is_changed = 0;
    expect_ok(hybrid_vertices(session_, object, &vertices.front().x, vertices.size(), &is_changed));
    if (changed != nullptr) *changed = is_changed != 0;
    return vertices;
  }
  [[nodiscard]] hybrid_snapshot take() const {
    hybrid_snapshot snapshot{.size = sizeof snapshot};
    expect_ok(hybrid_take_snapshot(session_, &snapshot));
    return snapshot;
  }

 private:
  hybrid_session* session_ = nullptr;
};

inline glm::dvec3 vec(const double (&from)[3]) {
  return {from[0], from[1], from[2]};
}

// `count` positions on a straight line. The last one is `to_m`.
inline std::vector<glm::dvec3> line(const glm::dvec3& from_m, const glm::dvec3& to_m, std::size_t count) {
  std::vector<glm::dvec3> places;
  for (std::size_t n = 1; n <= count; ++n)
    places.push_back(from_m + (to_m - from_m) * (static_cast<double>(n) / static_cast<double>(count)));
  return places;
}

}  // namespace tests
