// SPDX-License-Identifier: GPL-3.0-or-later
// A study in words, as a table for a terminal, as JSON, and as a page.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid/page/page.h"
#include "hybrid/study/study.h"

namespace hybrid {

// The result of a scan: "good", "error felt", "too slow", both of them, "fault", "failed". If the error is
// not known because nothing soft was felt, ", nothing soft felt" follows.
std::string scan_verdict(const JudgedScan& scan);
// The scan with its figures in one line, without a line break.
std::string scan_words(const JudgedScan& scan);
// How many scans are good, and how many are not, and why.
std::string study_verdict(const Study& study);
// Table, reasons of failures, outliers and verdict.
std::string study_words(const Study& study);
// Keys of `hybrid study --json`, to be added to report_head().
nlohmann::ordered_json study_json(const Study& study);

Page study_page(const Study& study, const std::string& title);
// Error over the time of a tick, a mark for each scan with figures.
std::string study_svg(const Study& study, const std::string& title);

}  // namespace hybrid
