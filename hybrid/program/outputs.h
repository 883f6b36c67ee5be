// SPDX-License-Identifier: GPL-3.0-or-later
// The files that a command was asked to write: refused before the work if they cannot be written, written
// each by itself after it, and said. How a command ends that a signal stopped.
#pragma once

#include <cstdio>
#include <exception>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hybrid/session/report.h"

namespace hybrid {

class Outputs {
 public:
  // Throws std::runtime_error: the ending names another format, or no file can be written there. An empty
  // name asks for nothing.
  void ask(std::string_view option, const std::filesystem::path& file,
           std::initializer_list<std::string_view> endings);
  void ask_json(const std::string& file) { ask("--json", file, {".json", ".txt"}); }
  void ask_plot(const std::filesystem::path& file) { ask("--plot", file, {".svg"}); }

  // Text for people goes to standard output, unless a file goes there.
  [[nodiscard]] std::FILE* words() const { return to_standard_output_ ? stderr : stdout; }

  // What cannot be written is said, and keeps nothing else from being written.
  template <class Act>
  void attempt(const Act& act) {
    try {
      act();
    } catch (const std::exception& e) {
      fail(e.what());
    }
  }
  void wrote(std::string_view what, const std::filesystem::path& file) { written_.emplace_back(what, file); }
  // Calls save(file), unless the name is empty.
  template <class Save>
  void write(std::string_view what, const std::filesystem::path& file, const Save& save) {
    if (file.empty()) return;
    attempt([&] {
      save(file);
      wrote(what, file);
    });
  }
  void write_json(const std::string& file, const nlohmann::ordered_json& report) {
    write("report", file, [&report](const std::filesystem::path& to) { save_json(to.string(), report); });
  }
  // Names the files that were written, but for the report.
  void say_files() const;
  [[nodiscard]] bool failed() const { return failed_; }

  // "stopped by Ctrl-C after AFTER; trace, report were written", on standard error. Returns the exit status,
  // as a shell would: 128 and the signal's number.
  int say_stopped(int signal, const std::string& after) const;

 private:
  void fail(const char* why);

  struct Written {
    Written(std::string_view name, std::filesystem::path path) : what(name), file(std::move(path)) {}
    std::string what;
    std::filesystem::path file;
  };
  std::vector<Written> written_;
  bool to_standard_output_ = false, failed_ = false;
};

// "Ctrl-C" and the names of the other signals.
std::string_view signal_in_words(int signal);
// The exit status of a program that a signal ended, as a shell has it.
constexpr int exit_status_of_signal(int signal) {
  return 128 + signal;
}

// From now on a signal to stop ends the program at once and is said, unless a StopOnSignal exists.
void end_at_once_on_signals();

}  // namespace hybrid
