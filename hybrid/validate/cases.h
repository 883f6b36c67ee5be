// SPDX-License-Identifier: GPL-3.0-or-later
// The cases of `hybrid validate`. Each function adds its rows, and its panels if it has any.
#pragma once

#include "hybrid/validate/validate.h"

namespace hybrid {

void add_closed_forms(const ValidationOptions& options, ValidationReport& report);
void add_loop_cases(const ValidationOptions& options, ValidationReport& report);  // through whole sessions
void add_finite_elements(const ValidationOptions& options, ValidationReport& report);
void add_silicones(const ValidationOptions& options, ValidationReport& report);
void add_probed_tissues(const ValidationOptions& options, ValidationReport& report);
void add_cartilage(const ValidationOptions& options, ValidationReport& report);

// Quantity of a row; `strain` is an index into kSiliconeStrains.
std::string silicone_quantity(std::size_t strain);
void say(const ValidationOptions& options, const std::string& text);
const char* words_of(Energy energy);  // "bricks", "links"

}  // namespace hybrid
