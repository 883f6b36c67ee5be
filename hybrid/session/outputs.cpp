// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/outputs.h"

#include <fmt/format.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): sigaction is POSIX
#include <unistd.h>

#include <array>
#include <utility>

#include "hybrid/base/file_ending.h"
#include "hybrid/base/whole_file.h"

namespace hybrid {
namespace {

void write_words(std::string_view text) noexcept {
  [[maybe_unused]] const ssize_t told = ::write(STDERR_FILENO, text.data(), text.size());
}

extern "C" void hybrid_end_at_once(int signal) {
  remove_unfinished_files();
  write_words("\nended at once by ");
  write_words(signal_in_words(signal));
  write_words("; no file is left half written\n");
  ::_exit(exit_status_of_signal(signal));
}

}  // namespace

void Outputs::ask(std::string_view option, const std::filesystem::path& file,
                  std::initializer_list<std::string_view> endings) {
  if (file.empty()) return;
  if (endings.size() > 0) require_ending(option, file, endings);
  require_writable(file);
  to_standard_output_ = to_standard_output_ || FilePlace(file).descriptor == STDOUT_FILENO;
}

void Outputs::fail(const char* why) {
  failed_ = true;
  fmt::print(stderr, "{}\n", why);
}

void Outputs::say_files() const {
  for (const Written& w : written_) {
    if (w.what != "report") fmt::print(words(), "{}: {}\n", w.what, w.file.string());
  }
}

int Outputs::say_stopped(int signal, const std::string& after) const {
  std::string names;
  for (std::size_t i = 0; i < written_.size(); ++i) {
    if (i > 0 && written_[i].what == written_[i - 1].what) continue;  // several volumes are named once
    names += (names.empty() ? "" : ", ") + written_[i].what;
  }
  fmt::print(stderr, "stopped by {}{}{}; {} written\n", signal_in_words(signal),
             after.empty() ? "" : " after ", after,
             names.empty() ? "nothing was" : names + (written_.size() > 1 ? " were" : " was"));
  return exit_status_of_signal(signal);
}

std::string_view signal_in_words(int signal) {
  switch (signal) {
    case SIGINT:
      return "Ctrl-C";
    case SIGTERM:
      return "SIGTERM";
    case SIGHUP:
      return "SIGHUP";
    default:
      return "a signal";
  }
}

void end_at_once_on_signals() {
  struct sigaction action {};
  action.sa_handler = hybrid_end_at_once;
  sigemptyset(&action.sa_mask);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    // Under nohup, SIGHUP must not end the program.
    if (signal != SIGHUP || before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);
  }
}

}  // namespace hybrid
