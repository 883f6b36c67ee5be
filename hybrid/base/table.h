// SPDX-License-Identifier: GPL-3.0-or-later
// Tables in plain text, for terminals and logs. A column has a title, a width and a function for the text of
// a cell.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "hybrid/base/letters.h"

namespace hybrid {

enum class Side { left, right };

template <class Row>
class Table {
 public:
  struct Column {
    std::array<std::string, 2> title;  // two lines of the head; the second may be empty
    std::size_t width = 0;             // least width in characters; a wider cell shifts the rest of its line
    Side side = Side::right;
    std::function<std::string(const Row&)> cell;
  };

  explicit Table(std::vector<Column> columns) : columns_(std::move(columns)) {}

  // The head, with a line break at its end. line() has one, too.
  [[nodiscard]] std::string head() const {
    const auto any = [this](std::size_t n) {
      return std::ranges::any_of(columns_, [n](const Column& c) { return !c.title[n].empty(); });
    };
    std::string text;
    for (const std::size_t n : {std::size_t{0}, std::size_t{1}}) {
      if (n == 0 || any(n)) text += joined([n](const Column& c) { return c.title[n]; });
    }
    return text;
  }
  // The line of a row. `note` follows the cells unchanged.
  [[nodiscard]] std::string line(const Row& row, const std::string& note = {}) const {
    return joined([&row](const Column& c) { return c.cell(row); }, note);
  }
  // Makes each column as wide as its widest title and cell.
  void fit(std::span<const Row> rows) {
    for (Column& c : columns_) {
      for (const std::string& title : c.title) c.width = std::max(c.width, letters(title));
      for (const Row& row : rows) c.width = std::max(c.width, letters(c.cell(row)));
    }
  }
  // Head and lines. All columns are as wide as their contents need.
  [[nodiscard]] std::string text(std::span<const Row> rows) const {
    Table fitted = *this;
    fitted.fit(rows);
    std::string out = fitted.head();
    for (const Row& row : rows) out += fitted.line(row);
    return out;
  }

 private:
  template <class Cell>
  [[nodiscard]] std::string joined(const Cell& cell, const std::string& note = {}) const {
    std::string text;
    for (const Column& c : columns_) {
      const std::string words = cell(c);
      const std::string space(c.width - std::min(c.width, letters(words)), ' ');
      if (!text.empty() || &c != columns_.data()) text += ' ';
      text += c.side == Side::left ? words + space : space + words;
    }
    text += note;
    text.erase(text.find_last_not_of(' ') + 1);
    return text + "\n";
  }

  std::vector<Column> columns_;
};

}  // namespace hybrid
