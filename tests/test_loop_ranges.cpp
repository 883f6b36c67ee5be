// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the source tree and finds loops over a part of a temporary, and references to one: `for (x :
// f()->list())` and `const X& x = f().list.at(0);`, where f() returns an object or an owning pointer. g++ 12
// and clang 14 do not warn about them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <set>
#include <string>
#include <string_view>

#include "tests/source_tree.h"

namespace {

using namespace tests;

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

// Finds the call that ends before `end`, such as "at" in "rooms().at(part)". Stores its name and returns
// where the name begins. Returns npos if no call ends there.
std::size_t call_before(std::string_view text, std::size_t end, std::string& name) {
  if (end == 0 || text[end - 1] != ')') return std::string_view::npos;
  std::size_t open = end - 1;
  for (std::size_t depth = 1; depth > 0 && open > 0;) {
    --open;
    if (text[open] == ')') ++depth;
    if (text[open] == '(') --depth;
  }
  if (open > 0 && text[open - 1] == '>')
    open = text.rfind('<', open);  // for example std::make_unique<int>(3)
  if (open == std::string_view::npos) return open;
  std::size_t begin = open;
  while (begin > 0 && is_word(text[begin - 1])) --begin;
  name = text.substr(begin, open - begin);
  return begin;
}

// The names of functions that some source declares as returning a reference, a pointer or a span.
const std::set<std::string>& names_of_what_stays() {
  static const std::set<std::string> names = [] {
    // Casts, functions of libraries, and loads of atomic pointers.
    std::set<std::string> found{"static_cast", "const_cast",   "reinterpret_cast", "dynamic_cast",
                                "span",        "emplace_back", "emplace_front",    "GetIO",
                                "GetFile",     "load"};
    for (const SourceFile& file : tree()) {
      if (!is_cpp(file)) continue;
      for (const std::string_view line : file.lines) {
        for (std::size_t open = line.find('('); open != std::string_view::npos;
             open = line.find('(', open + 1)) {
          std::size_t begin = open;
          while (begin > 0 && is_word(line[begin - 1])) --begin;
          if (begin < 2 || line[begin - 1] != ' ') continue;
          const char before = line[begin - 2];
          const bool span = before == '>' && line.substr(0, begin).find("span<") != std::string_view::npos;
          if (before == '&' || before == '*' || span) found.emplace(line.substr(begin, open - begin));
        }
      }
    }
    return found;
  }();
  return names;
}

// Finds a call in the range of a range-for, or in the initialiser of a reference. Its result is destroyed
// before the loop begins, or at the end of the statement. Empty if there is none. C++20 keeps the range
// itself alive, but not a temporary that contains the range, as in f()->notes().
std::string lost_call(std::string_view range) {
  std::size_t end = range.size();
  bool reached_through = range.starts_with("*");  // the result is used by an arrow, a star or a member call
  std::string name;
  while (end > 0) {
    const std::size_t begin = call_before(range, end, name);
    if (begin != std::string_view::npos) {
      if (reached_through && !names_of_what_stays().contains(name)) return name;
      reached_through = true;
      end = begin;
    } else {
      while (end > 0 && is_word(range[end - 1])) --end;
    }
    if (range.substr(0, end).ends_with("->")) {
      reached_through = true;
      end -= 2;
    } else if (range.substr(0, end).ends_with('.')) {
      --end;
    } else {
      break;
    }
  }
  return "";
}

// The range of the range-for that begins at `at`; empty if it is another kind of loop.
std::string range_at(const SourceFile& file, std::size_t line, std::size_t at) {
  std::string text = file.lines[line].substr(at);
  for (std::size_t more = 1; more < 4 && line + more < file.lines.size(); ++more)
    text += file.lines[line + more];
  std::size_t depth = 0, colon = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '(' || text[i] == '[' || text[i] == '{') ++depth;
    if ((text[i] == ')' || text[i] == ']' || text[i] == '}') && --depth == 0) {
      if (colon == 0) return "";
      const std::size_t first = text.find_first_not_of(' ', colon + 1);
      return text.substr(first, i - first);
    }
    if (depth == 1 && text[i] == ':' && text[i - 1] == ' ' && text[i + 1] == ' ') colon = i;
  }
  return "";
}

// The initialiser of the reference that this line declares; empty if the line declares none.
std::string bound_at(const SourceFile& file, std::size_t line) {
  const std::string& text = file.lines[line];
  for (std::size_t at = text.find("& "); at != std::string::npos; at = text.find("& ", at + 1)) {
    std::size_t end = at + 2;
    while (end < text.size() && is_word(text[end])) ++end;
    if (end == at + 2 || text.compare(end, 3, " = ") != 0) continue;
    std::string bound = text.substr(end + 3);
    for (std::size_t more = 1; bound.find(';') == std::string::npos && more < 4; ++more) {
      if (line + more == file.lines.size()) break;
      const std::string& next = file.lines[line + more];
      bound += next.substr(std::min(next.find_first_not_of(' '), next.size()));
    }
    return bound.substr(0, bound.find(';'));
  }
  return "";
}

TEST(LoopRanges, RangesOfLoopsThatAreGoneAreRecognised) {
  EXPECT_EQ(lost_call("scene_path(scene)->notes()"), "scene_path");
  EXPECT_EQ(lost_call("load_scene(file(1)).notes().items"), "load_scene");
  EXPECT_EQ(lost_call("*std::make_unique<int>(3)"), "make_unique");
  EXPECT_EQ(lost_call("*scene_path(scene)"), "scene_path");
  EXPECT_EQ(lost_call("scene_path(scene)->list"), "scene_path");
  EXPECT_EQ(lost_call("hybrid::load_scene(file).materials.at(\"liver\")"), "load_scene");
  for (const char* sound : {"scene_path(scene)", "load_scene(file).items", "object.lattice().surface()",
                            "object.list", "std::span(list).first(3)", "object->list", "list.of[3].items()"})
    EXPECT_EQ(lost_call(sound), "") << sound;
}

TEST(LoopRanges, NoReferenceIsToAPartOfATemporary) {
  for (const SourceFile& file : tree()) {
    if (!is_cpp(file) || file.path == "tests/test_loop_ranges.cpp") continue;
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string lost = lost_call(bound_at(file, i));
      EXPECT_EQ(lost, "") << place(file, i) << "the result of " << lost
                          << "() is gone at the end of the statement: give it a name before";
    }
  }
}

TEST(LoopRanges, NoLoopRunsOverAPartOfATemporary) {
  for (const SourceFile& file : tree()) {
    if (!is_cpp(file) || file.path == "tests/test_loop_ranges.cpp") continue;
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::size_t at = file.lines[i].find("for (");
      if (at == std::string::npos) continue;
      const std::string lost = lost_call(range_at(file, i, at + 4));
      EXPECT_EQ(lost, "") << place(file, i) << "the result of " << lost
                          << "() is gone before the loop begins: give it a name before the loop";
    }
  }
}

}  // namespace
