// SPDX-License-Identifier: GPL-3.0-or-later
// The output files of a command. Files that cannot be written are refused before the work begins. When the
// work is done, each file is written independently of the others, and its name is printed. Also prints the
// last words of a command that a signal stopped.
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
  // Registers an output file; an empty name asks for nothing. Throws std::runtime_error if the name's ending
  // is that of another format, or if no file can be written there.
  void ask(std::string_view option, const std::filesystem::path& file,
           std::initializer_list<std::string_view> endings);
  void ask_json(const std::string& file) { ask("--json", file, {".json", ".txt"}); }
  void ask_plot(const std::filesystem::path& file) { ask("--plot", file, {".svg"}); }

  // Stream of the text for people: standard output, or standard error if an output file is standard output.
  [[nodiscard]] std::FILE* words() const { return to_standard_output_ ? stderr : stdout; }

  // Runs `act`. An error is printed and does not keep other files from being written.
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
  // Prints the names of the files that were written, except that of the report.
  void say_files() const;
  [[nodiscard]] bool failed() const { return failed_; }

  // Prints "stopped by Ctrl-C after AFTER; trace, report were written" to standard error. Returns the exit
  // status that a shell gives: 128 plus the signal's number.
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

// Name of the signal: "Ctrl-C", "SIGTERM", "SIGHUP".
std::string_view signal_in_words(int signal);
// The exit status that a shell gives to a program that a signal ended.
constexpr int exit_status_of_signal(int signal) {
  return 128 + signal;
}

// From now on a signal to stop prints a line and ends the program at once, except while a StopOnSignal
// exists.
void end_at_once_on_signals();

}  // namespace hybrid
