// SPDX-License-Identifier: GPL-3.0-or-later
#include "interface/last_error.h"

#include <new>

namespace c_interface {
namespace {

// Initial-exec storage is there before the thread's first call, so that a tick never allocates it. A library
// that is loaded at run time has little of it, hence two pointers and no buffer.
struct LastError {
  const char* where = "";
  const char* what = "";
};
[[gnu::tls_model("initial-exec")]] constinit thread_local LastError last{};

// The joined text. Allocates at its first use in a thread.
std::string& joined() {
  thread_local std::string text;
  return text;
}

}  // namespace

hybrid_code fail(hybrid_code code, const char* where, const char* what) noexcept {
  last = {.where = where, .what = what};
  return code;
}

hybrid_code fail(hybrid_code code, const std::string& text) noexcept {
  try {
    joined() = text;
    last = {.where = "", .what = joined().c_str()};
  } catch (const std::bad_alloc&) {
    last = {.where = "", .what = "out of memory, also for the text of the error; free some"};
  }
  return code;
}

const char* error_text() noexcept {
  if (*last.where == '\0') return last.what;
  try {
    joined() = std::string(last.where) + ": " + last.what;
    return joined().c_str();
  } catch (const std::bad_alloc&) {
    return last.what;
  }
}

}  // namespace c_interface
