// SPDX-License-Identifier: GPL-3.0-or-later
// A temporary folder for figures, and checks of their text.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "hybrid/snapshot/snapshot.h"

namespace tests {

class Folder {  // removed with its content at the end
 public:
  Folder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() /
            ("hybrid-" + std::string(test->test_suite_name()) + "-" + test->name() + "-" +
             std::to_string(std::hash<const void*>{}(this)));
    std::filesystem::create_directories(path_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  Folder(Folder&&) = delete;
  Folder& operator=(Folder&&) = delete;
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::filesystem::path file(const char* name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

inline std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + what.size())) ++n;
  return n;
}

// Expects that tags open and close in order, attributes are quoted, and entities are known. This is enough to
// catch errors of a hand-written XML writer.
inline void expect_well_formed(const std::string& xml) {
  std::vector<std::string> open;
  std::size_t i = 0;
  while (i < xml.size()) {
    if (xml[i] == '&') {
      const std::size_t end = xml.find(';', i);
      ASSERT_NE(end, std::string::npos);
      const std::string entity = xml.substr(i + 1, end - i - 1);
      EXPECT_TRUE(entity == "amp" || entity == "lt" || entity == "gt" || entity == "quot" || entity == "apos")
          << entity;
      i = end + 1;
    } else if (xml[i] == '<') {
      std::size_t end = i + 1;
      bool quoted = false;
      while (end < xml.size() && (quoted || xml[end] != '>')) {
        if (xml[end] == '"') quoted = !quoted;
        EXPECT_FALSE(xml[end] == '<') << "at " << end;
        ++end;
      }
      ASSERT_LT(end, xml.size());
      const std::string tag = xml.substr(i + 1, end - i - 1);
      const std::string name = tag.substr(0, tag.find_first_of(" /", 1));
      if (tag[0] == '/') {
        ASSERT_FALSE(open.empty());
        EXPECT_EQ("/" + open.back(), tag);
        open.pop_back();
      } else if (tag[0] != '?' && tag.back() != '/') {
        open.push_back(name);
      }
      i = end + 1;
    } else {
      EXPECT_GE(static_cast<unsigned char>(xml[i]), xml[i] == '\n' ? 0x0A : 0x20);
      ++i;
    }
  }
  EXPECT_TRUE(open.empty());
}

inline hybrid::TraceRow row(double t, double force, std::uint32_t contacts = 0) {
  hybrid::TraceRow made;
  made.t_s = t;
  made.force_N = {0.0, 0.0, force};
  made.contacts = contacts;
  return made;
}

}  // namespace tests
