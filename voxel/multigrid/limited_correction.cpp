// SPDX-License-Identifier: GPL-3.0-or-later
// The set of rows of one limited correction, and its queue.
#include "voxel/multigrid/limited_correction.h"

#include <algorithm>

#include "voxel/lattice/prefetch.h"

namespace voxel {
namespace {

constexpr std::size_t kAhead = 3;  // rows that are prefetched

}  // namespace

LimitedCorrection::LimitedCorrection(std::size_t rows)
    : rows_(std::min(kMost, rows)),
      aims_(std::min(kMost, rows)),
      number_(rows),
      ring_(std::min(kMost, rows) + 1) {}

LimitedCorrection::Row& LimitedCorrection::add(RowId row, LaneSpan span) noexcept {
  // prefetch: waiting for this memory would be half of the cost
  prefetch_range(rows_.data() + std::min(count_ + kAhead, rows_.size() - 1), sizeof(Row));
  Row& r = rows_[count_++];
  r.row = row;
  r.span = span;
  r.asked = r.out = r.cut = r.aims = false;
  number_[row] = static_cast<std::uint32_t>(count_);
  return r;
}

void LimitedCorrection::clear() noexcept {
  for (const Row& r : rows()) number_[r.row] = 0;
  count_ = head_ = tail_ = 0;
}

void LimitedCorrection::ask(RowId row) noexcept {
  if (number_[row] == 0) return;
  Row& r = rows_[number_[row] - std::size_t{1}];
  if (r.asked) return;
  r.asked = true;
  ring_[tail_] = number_[row] - 1;
  tail_ = tail_ + 1 == ring_.size() ? 0 : tail_ + 1;
}

LimitedCorrection::Row* LimitedCorrection::next() noexcept {
  if (head_ == tail_) return nullptr;
  Row& r = rows_[ring_[head_]];
  head_ = head_ + 1 == ring_.size() ? 0 : head_ + 1;
  r.asked = false;
  return &r;
}

}  // namespace voxel
