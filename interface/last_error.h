// SPDX-License-Identifier: GPL-3.0-or-later
// The error of a call through the C interface: each thread keeps the text of its last failure.
#pragma once

#include <string>

#include "interface/hybrid.h"

namespace c_interface {

// Both functions keep a text for the calling thread and return `code`.
// For use in a tick: allocates nothing. Both texts must live for ever. The error's text is "where: what".
hybrid_code fail(hybrid_code code, const char* where, const char* what) noexcept;
// Allocates.
hybrid_code fail(hybrid_code code, const std::string& text) noexcept;

// The text of the last failure in the calling thread, or "".
const char* error_text() noexcept;

}  // namespace c_interface
