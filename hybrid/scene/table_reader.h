// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the keys of one table of a scene file: types, units, bounds and unknown keys. Every refusal names its
// place. If errors are gathered, a wrong number, text or file is listed, and a valid value stands in for it.
// So all keys of a table are checked. A violated rule among several keys is an error only if the table has no
// other error.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid/scene/toml_tree.h"

namespace hybrid {

// Requirements on a number. Bounds are inclusive and in SI, after `scale`.
struct Quantity {
  std::string what;     // "a length above 0, in mm"
  std::string example;  // an example for the message
  double scale = 1.0;   // file unit to SI
  double lower = 0.0, upper = 0.0;
};

// An error after which reading can go on, to find further errors.
struct ReaderError : SceneError {
  ReaderError(const std::filesystem::path& file, SourcePlace where, const std::string& what_and_remedy)
      : SceneError(file, where, what_and_remedy), place(where), text(what_and_remedy) {}
  SourcePlace place;
  std::string text;
};

// Properties of the whole file during reading.
struct SceneSource {
  std::filesystem::path file;
  double unit_m = 1e-3;
  std::string unit_name = "mm";

  // List of the errors after which reading goes on; null: each error is thrown.
  std::vector<ReaderError>* errors = nullptr;

  [[noreturn]] void refuse(SourcePlace place, const std::string& what, const std::string& remedy) const;
  // Keeps the error until the end of reading. Throws it if errors are not kept, or if too many are.
  void keep(const ReaderError& error) const;
  [[nodiscard]] std::size_t found() const { return errors == nullptr ? 0 : errors->size(); }
  // Calls read(), and keeps an error that read() throws. If read() kept other errors before, the thrown one
  // is dropped, because it may follow from them.
  template <typename Read>
  void gather(const Read& read) const {
    const std::size_t before = found();
    try {
      read();
    } catch (const ReaderError& error) {
      if (found() == before) keep(error);
    }
  }
  [[nodiscard]] Quantity length() const;    // any sign
  [[nodiscard]] Quantity size() const;      // above 0
  [[nodiscard]] Quantity distance() const;  // 0 or more
  [[nodiscard]] Quantity speed() const;     // above 0, in lengths per second
};

// A key or a value that is not supported yet.
struct UnsupportedKey {
  std::string_view name;
  std::string_view meanwhile;  // an alternative for the user until then
};

// The length units that a person may name, in meters.
const std::map<std::string, double>& length_units();

// Optimal string alignment distance (a swap of neighbours is one edit), ignoring case.
std::size_t edit_distance(std::string_view a, std::string_view b);
// The candidate with the smallest distance, the first of equals; empty if there are none.
std::string_view nearest_name(std::string_view name, std::span<const std::string_view> candidates);
std::string joined(std::span<const std::string_view> names);

class TableReader {
 public:
  // `what` names the table in messages: "[tool]", "[[soft]] 'brain'".
  TableReader(const SceneSource& source, const TreeNode& table, SourcePlace place, std::string what);

  // Refuses every key that is not in `keys`. The message says that keys of `later` are not supported yet, and
  // that keys of `elsewhere` have no meaning with `condition`. Call it first, so that a misspelt key is
  // reported as such and not as a missing one.
  void allow(std::span<const std::string_view> keys, std::span<const UnsupportedKey> later = {},
             std::span<const std::string_view> elsewhere = {}, std::string_view condition = {}) const;

  [[nodiscard]] const TreeEntry* find(std::string_view key) const;
  [[nodiscard]] std::span<const TreeEntry> entries() const { return table_.entries; }
  [[nodiscard]] bool has(std::string_view key) const { return find(key) != nullptr; }
  [[nodiscard]] const TreeEntry& require(std::string_view key, std::string_view example) const;
  [[nodiscard]] SourcePlace place() const { return place_; }
  [[nodiscard]] SourcePlace place_of(std::string_view key) const;  // place of the table if the key is absent
  [[nodiscard]] const std::string& what() const { return what_; }
  [[nodiscard]] const SceneSource& source() const { return source_; }
  [[noreturn]] void refuse(std::string_view key, const std::string& what, const std::string& remedy) const;

  // Each of the following returns its fallback if the key is absent. Without a fallback the key is required.
  [[nodiscard]] double number(std::string_view key, const Quantity& quantity,
                              std::optional<double> fallback = {}) const;
  [[nodiscard]] glm::dvec3 vector(std::string_view key, const Quantity& quantity,
                                  std::optional<glm::dvec3> fallback = {}) const;
  // One number for all three axes, or a list of three.
  [[nodiscard]] glm::dvec3 number_or_vector(std::string_view key, const Quantity& quantity,
                                            std::optional<glm::dvec3> fallback = {}) const;
  [[nodiscard]] std::int64_t integer(std::string_view key, std::int64_t lower, std::int64_t upper,
                                     std::optional<std::int64_t> fallback = {}) const;
  [[nodiscard]] bool boolean(std::string_view key, bool fallback) const;
  [[nodiscard]] std::string text(std::string_view key, std::string_view example) const;
  // The index of the option that the key names.
  [[nodiscard]] std::size_t choice(std::string_view key, std::span<const std::string_view> options,
                                   std::optional<std::size_t> fallback = {},
                                   std::span<const UnsupportedKey> later = {}) const;
  // A length unit by its name, in meters.
  [[nodiscard]] double unit(std::string_view key, double fallback_m) const;
  // A file that exists, resolved against the scene's folder; also a folder if `may_be_folder` (DICOM).
  [[nodiscard]] std::filesystem::path file(std::string_view key, bool may_be_folder) const;

  // A list (not empty), and its items as tables, vectors or whole numbers.
  [[nodiscard]] const TreeNode& list(std::string_view key, std::string_view example) const;
  [[nodiscard]] TableReader table(std::string_view key) const;
  [[nodiscard]] std::vector<TableReader> tables(std::string_view key, std::string_view example) const;
  [[nodiscard]] std::vector<std::int64_t> integers(std::string_view key, std::int64_t lower,
                                                   std::int64_t upper, std::string_view example) const;
  // [lower, upper] of plain numbers, lower <= upper.
  [[nodiscard]] std::pair<double, double> range(std::string_view key) const;

  // The number at `node`, which messages call `name`.
  [[nodiscard]] double number_at(const TreeNode& node, SourcePlace place, const std::string& name,
                                 const Quantity& quantity) const;

 private:
  // Returns the value of read(), or `otherwise` after an error.
  template <typename Value, typename Read>
  [[nodiscard]] Value value_or(std::string_view key, Value otherwise, const Read& read) const {
    try {
      return read();
    } catch (const ReaderError& error) {
      // If a key is missing and another is unknown, the unknown key is probably the missing one, misspelt.
      if (!has_unknown_ || has(key)) source_.keep(error);
      return otherwise;
    }
  }
  [[nodiscard]] std::string text_or_refuse(std::string_view key, std::string_view example) const;
  [[nodiscard]] std::filesystem::path file_or_refuse(std::string_view key, bool may_be_folder) const;
  [[noreturn]] void refuse_key(const TreeEntry& entry, std::span<const std::string_view> keys,
                               std::span<const UnsupportedKey> later,
                               std::span<const std::string_view> elsewhere, std::string_view condition) const;
  [[nodiscard]] glm::dvec3 vector_at(const TreeEntry& entry, const Quantity& quantity) const;
  [[noreturn]] void wrong_type(SourcePlace place, const std::string& name, TreeNode::Kind found,
                               std::string_view wanted, const std::string& example) const;

  const SceneSource& source_;
  const TreeNode& table_;
  SourcePlace place_;
  std::string what_;
  mutable bool has_unknown_ = false;  // found by allow()
};

}  // namespace hybrid
