// SPDX-License-Identifier: GPL-3.0-or-later
// Innermost loop of a sweep, in functions of lanes8.h or lanes16.h. For each width, sweep_kernel.cpp includes
// this file in a namespace that uses one of the two. Hence the file has neither guard nor namespace.
// NOLINTBEGIN(llvm-header-guard)

using RowValues = std::array<Floats, kVectors>;

// A displacement that requires no move.
constexpr float no_requirement(bool raise) {
  return raise ? -kUnbounded : kUnbounded;
}

// out[n] = row[n − kStep] by lane, 0 < kStep < kRow; `filler` before the first lane.
template <std::size_t kStep>
HYBRID_INLINE void shift_row_up(const RowValues& row, const Floats& filler, RowValues& out) {
  constexpr std::size_t whole = kStep / kWidth, k = kStep % kWidth;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    const Floats& high = n >= whole ? row[n - whole] : filler;
    const Floats& low = n > whole ? row[n - whole - 1] : filler;
    shift_up_by<k>(low, high, out[n]);
  }
}
template <std::size_t kStep>
HYBRID_INLINE void shift_row_down(const RowValues& row, const Floats& filler, RowValues& out) {
  constexpr std::size_t whole = kStep / kWidth, k = kStep % kWidth;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    const Floats& low = n + whole < kVectors ? row[n + whole] : filler;
    const Floats& high = n + whole + 1 < kVectors ? row[n + whole + 1] : filler;
    shift_down_by<k>(low, high, out[n]);
  }
}

template <bool kUp, std::size_t kStep>
HYBRID_INLINE void shift_row(const RowValues& row, float beyond, RowValues& out) {
  Floats filler;
  broadcast(beyond, filler);
  if (kUp)
    shift_row_up<kStep>(row, filler, out);
  else
    shift_row_down<kStep>(row, filler, out);
}

// Limits of paths twice as long: adds to each lane's limit that of the lane kStep before it (up) or after it
// (down).
template <bool kUp, std::size_t kStep>
HYBRID_INLINE void double_limits(RowValues& limit) {
  RowValues further;
  shift_row<kUp, kStep>(limit, kUnbounded, further);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) limit[n] += further[n];
}
template <bool kRaise, bool kUp, std::size_t kStep>
HYBRID_INLINE void double_path(RowValues& now, RowValues& limit) {
  RowValues from;
  shift_row<kUp, kStep>(now, no_requirement(kRaise), from);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Floats required;
    require<kRaise>(from[n], limit[n], required);
    take_stronger<kRaise>(required, now[n]);
  }
  if (kStep < 16) double_limits<kUp, kStep>(limit);
}

// Finds the displacements that all paths within a row require. In each step the paths double their length:
// one link, two, four, … Five steps suffice, where single links would take up to 31. Paths upwards and
// downwards are independent, because a detour is never stronger than the direct path. Their steps alternate:
// one can run while the other waits for its last result. `up`: limits between lanes n − 1 and n. `down`:
// limits between n and n + 1. False, with `required` undefined: no link requires a move.
template <bool kRaise>
HYBRID_INLINE bool all_paths(const RowValues& now, RowValues& up, RowValues& down, float margin,
                             RowValues& required) {
  Masks any{};
  RowValues from_below, from_above;
  shift_row_up<1>(now, now[0], from_below);
  shift_row_down<1>(now, now[kVectors - 1], from_above);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Masks moves;
    require<kRaise>(from_below[n], up[n], from_below[n]);
    require<kRaise>(from_above[n], down[n], from_above[n]);
    required[n] = from_above[n];
    take_stronger<kRaise>(from_below[n], required[n]);
    compare<kRaise>(required[n], now[n], margin, moves);
    any |= moves;
  }
  if (!any_of(any)) return false;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    take_stronger<kRaise>(now[n], from_below[n]);
    take_stronger<kRaise>(now[n], from_above[n]);
  }
  double_limits<true, 1>(up);
  double_limits<false, 1>(down);
  double_path<kRaise, true, 2>(from_below, up);
  double_path<kRaise, false, 2>(from_above, down);
  double_path<kRaise, true, 4>(from_below, up);
  double_path<kRaise, false, 4>(from_above, down);
  double_path<kRaise, true, 8>(from_below, up);
  double_path<kRaise, false, 8>(from_above, down);
  double_path<kRaise, true, 16>(from_below, up);
  double_path<kRaise, false, 16>(from_above, down);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    required[n] = from_below[n];
    take_stronger<kRaise>(from_above[n], required[n]);
  }
  return true;
}

HYBRID_INLINE void fill(float value, RowValues& out) {
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) broadcast(value, out[n]);
}
HYBRID_INLINE void load_row(const float* at, RowValues& out) {
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) load(at + n * kWidth, out[n]);
}
template <int kRegisters>
HYBRID_INLINE void look_up_row(const float* half, const Indices& labels, RowValues& out) {
  const Table table(half);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) look_up<kRegisters>(table, labels, n * kWidth, out[n]);
}

template <bool kRaise, class Limits>
HYBRID_INLINE void relax_from(const RowValues& from, const Limits& limits, RowValues& now) {
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Floats limit, by;
    limits.in(n, limit);
    require<kRaise>(from[n], limit, by);
    take_stronger<kRaise>(by, now[n]);
  }
}
template <bool kRaise, class Limits>
HYBRID_INLINE void find_revisits(const RowValues& now, Limits& limits, const RowValues& from, float margin,
                                 Masks& any) {
  limits.turn();
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Floats limit, by;
    Masks moves;
    limits.back(n, limit);
    require<kRaise>(now[n], limit, by);
    compare<kRaise>(by, from[n], margin, moves);
    any |= moves;
  }
}

// Limits of the links between a row and the row before it: into the row (in), and in reverse (back, after
// turn()). AlikeLimits are for two rows of one label each, LabelLimits go by the label of each voxel.
struct AlikeLimits {
  Floats in_, back_;
  HYBRID_INLINE AlikeLimits(const LinkHalves& half, std::uint8_t own, std::uint8_t other) {
    broadcast(half.in[own] + half.in[other], in_);
    broadcast(half.back[own] + half.back[other], back_);
  }
  HYBRID_INLINE void in(std::size_t, Floats& out) const { out = in_; }
  HYBRID_INLINE void turn() {}
  HYBRID_INLINE void back(std::size_t, Floats& out) const { out = back_; }
};

template <int kRegisters>
struct LabelLimits {
  const LinkHalves& half;
  const Indices& own;
  Indices other;
  RowValues now;
  HYBRID_INLINE LabelLimits(const LinkHalves& h, const Indices& own_labels, const std::uint8_t* labels)
      : half(h), own(own_labels), other(labels) {
    look_up(half.in);
  }
  HYBRID_INLINE void look_up(const float* table) {
    RowValues a, b;
    look_up_row<kRegisters>(table, own, a);
    look_up_row<kRegisters>(table, other, b);
#pragma GCC unroll 4
    for (std::size_t n = 0; n < kVectors; ++n) now[n] = a[n] + b[n];
  }
  HYBRID_INLINE void in(std::size_t n, Floats& out) const {
    out = now[n];
  }
  HYBRID_INLINE void turn() {
    if (half.in != half.back) look_up(half.back);
  }
  HYBRID_INLINE void back(std::size_t n, Floats& out) const {
    out = now[n];
  }
};

template <bool kRaise, int kRegisters>
HYBRID_INLINE void relax_along(const SweepTask& p, std::uint8_t label, const std::uint8_t* labels,
                               const RowValues& before, RowValues& now, std::array<Masks, kVectors>& moves) {
  RowValues up, down;
  if (label != 0) {
    fill(p.up[label] + p.up[label], up);
    fill(p.down[label] + p.down[label], down);
  } else {
    const Indices own(labels);
    RowValues half, other;
    look_up_row<kRegisters>(p.up, own, half);
    shift_row_up<1>(half, half[0], other);
#pragma GCC unroll 4
    for (std::size_t n = 0; n < kVectors; ++n) up[n] = half[n] + other[n];
    if (p.up != p.down) look_up_row<kRegisters>(p.down, own, half);
    shift_row_down<1>(half, half[0], other);
#pragma GCC unroll 4
    for (std::size_t n = 0; n < kVectors; ++n) down[n] = half[n] + other[n];
  }
  up[0][0] = down[kVectors - 1][kWidth - 1] = kUnbounded;
  RowValues required;
  if (!all_paths<kRaise>(now, up, down, p.margin, required)) return;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Masks more;
    compare<kRaise>(required[n], now[n], p.margin, more);
    select(more, required[n], now[n], now[n]);
    compare<kRaise>(now[n], before[n], p.margin, moves[n]);
  }
}

// The row that is being relaxed, and the end of the row before it in x.
struct RowNow {
  float* u;
  const std::uint8_t* labels;
  std::uint8_t label;  // 0: labels differ and are looked up by voxel
  bool has_y, has_z, has_x, closed;
  const float* x;
  std::uint8_t x_label;
};

template <bool kRaise>
HYBRID_INLINE bool revisits_x(const SweepTask& p, const RowNow& row) {
  const std::size_t end = p.x_above ? kRow - 1 : 0;
  const float* const half = p.along_x.back;
  return exceeds<kRaise>(required_value<kRaise>(row.u[end], half[row.labels[end]] + half[row.x_label]),
                         *row.x, p.margin);
}

// Moves a row as far as its limits require. `y`, `z`: displacements of the row before it in y and in z (m).
// If any voxel of this row moved, `y` afterwards holds the displacements of this row.
template <bool kRaise, int kRegisters, class Limits>
HYBRID_INLINE Moved sweep_row(const SweepTask& p, const RowNow& row, Limits& by_y, Limits& by_z,
                              const RowValues& z, RowValues& y) {
  const std::size_t end = p.x_above ? kRow - 1 : 0;
  RowValues before, now;
  load_row(row.u, before);
  now = before;
  relax_from<kRaise>(y, by_y, now);
  relax_from<kRaise>(z, by_z, now);
  bool closed = row.closed;
  if (row.has_x) {
    const float* const half = p.along_x.in;
    const float required = required_value<kRaise>(*row.x, half[row.labels[end]] + half[row.x_label]);
    if (exceeds<kRaise>(required, p.x_above ? now[kVectors - 1][kWidth - 1] : now[0][0], p.margin)) {
      closed = false;
      if (p.x_above)
        now[kVectors - 1][kWidth - 1] = required;
      else
        now[0][0] = required;
    }
  }
  std::array<Masks, kVectors> moves;
  Masks any{};
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    compare<kRaise>(now[n], before[n], p.margin, moves[n]);
    any |= moves[n];
    select(moves[n], now[n], before[n], now[n]);
  }
  if (!any_of(any)) return kNothingMoved;
  if (!closed) relax_along<kRaise, kRegisters>(p, row.label, row.labels, before, now, moves);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) store(now[n], row.u + n * kWidth);
  Moved what = moved(moves.front(), moves.back());
  Masks back_y{}, back_z{};
  find_revisits<kRaise>(now, by_y, y, p.margin, back_y);
  find_revisits<kRaise>(now, by_z, z, p.margin, back_z);
  if (any_of(back_y | back_z)) {
    if (row.has_y && any_of(back_y)) what |= kRevisitY;
    if (row.has_z && any_of(back_z)) what |= kRevisitZ;
  }
  if (row.has_x && (what & (p.x_above ? kLastMoved : kFirstMoved)) != 0 && revisits_x<kRaise>(p, row))
    what |= kRevisitX;
  y = now;
  return what;
}

// Consecutive rows of one label, whose rows before in z and in x have one label each (0: no row).
struct UniformRows {
  AlikeLimits by_y, by_z;
  float x_in, x_back;
  std::uint8_t label, z_label, x_label;

  HYBRID_INLINE UniformRows(const SweepTask& p, std::uint8_t own, std::uint8_t z, std::uint8_t x)
      : by_y(p.along_y, own, own),
        by_z(p.along_z, own, z),
        x_in(p.along_x.in[own] + p.along_x.in[x]),
        x_back(p.along_x.back[own] + p.along_x.back[x]),
        label(own),
        z_label(z),
        x_label(x) {}
  [[nodiscard]] static HYBRID_INLINE bool one_label(const RowInfo& info) {
    return info.label != 0 || !info.filled;
  }
  // Is row k of the same kind? Rows of one label have no anchors.
  [[nodiscard]] HYBRID_INLINE bool has(const SweepTask& p, std::ptrdiff_t k) const {
    const RowInfo &x = p.x.info[k * p.step], &z = p.z.info[k * p.step];
    return p.own.info[k * p.step].label == label && z.label == z_label && x.label == x_label && one_label(x);
  }
};

// Relaxes a row of one label beside rows of the same label or of labels with tighter limits. Links within the
// row need no check: they allow all moves that the rows before it require. The links back to the row before
// in y need no check either: that row already has its value by a path of equal length, through the row before
// both in z. The links back in z must be checked, because the same argument for z relies on y. If the row
// before in x requires more, the function does nothing and returns false.
template <bool kRaise>
HYBRID_INLINE bool sweep_uniform(const SweepTask& p, UniformRows& rows, std::ptrdiff_t k, RowValues& y,
                                 Moved& what) {
  const std::ptrdiff_t at = k * p.step * kRow;
  const std::size_t end = p.x_above ? kRow - 1 : 0;
  float* const u = p.own.u + at;
  const float x = p.x.u[at + (p.x_above ? 0 : kRow - 1)];
  RowValues now, z;
  std::array<Masks, kVectors> moves;
  Masks any{};
  load_row(p.z.u + at, z);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Floats before, from_y, from_z;
    load(u + n * kWidth, before);
    require<kRaise>(y[n], rows.by_y.in_, from_y);
    require<kRaise>(z[n], rows.by_z.in_, from_z);
    take_stronger<kRaise>(from_y, from_z);
    compare<kRaise>(from_z, before, p.margin, moves[n]);
    any |= moves[n];
    select(moves[n], from_z, before, now[n]);
  }
  if (exceeds<kRaise>(required_value<kRaise>(x, rows.x_in),
                      p.x_above ? now[kVectors - 1][kWidth - 1] : now[0][0], p.margin))
    return false;
  what = kNothingMoved;
  if (!any_of(any)) return true;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) store(now[n], u + n * kWidth);
  what = moved(moves.front(), moves.back());
  Masks back{};
  find_revisits<kRaise>(now, rows.by_z, z, p.margin, back);
  if (any_of(back)) what |= kRevisitZ;
  if ((what & (p.x_above ? kLastMoved : kFirstMoved)) != 0 &&
      exceeds<kRaise>(required_value<kRaise>(u[end], rows.x_back), x, p.margin))
    what |= kRevisitX;
  y = now;
  return true;
}

template <bool kRaise, int kRegisters>
HYBRID_INLINE SweepResult sweep_rows(const SweepTask& p, int most_visits, Moved* moved_out) {
  const std::ptrdiff_t step = p.step, values = step * kRow;
  const bool has_z = p.z.u != nullptr, has_x = p.x.u != nullptr;
  constexpr float nothing = no_requirement(kRaise);
  const std::ptrdiff_t x_end = p.x_above ? 0 : kRow - 1;

  SweepResult result;
  RowValues y, z;
  fill(nothing, y);
  fill(nothing, z);
  bool moved_before = false;  // the row before moved, and is in `y`
  for (int k = 0; k < p.max_rows && (moved_before || k < p.count) && result.visits < most_visits; ++k) {
    std::uint8_t& pending = p.pending[k * step];
    moved_out[k] = kNothingMoved;
    result.end = k + 1;
    if (!moved_before && (pending & p.mask) == 0) continue;
    const RowInfo* const info = p.own.info + k * step;
    if (info->anchored || (p.y && (info - step)->anchored) || (has_z && p.z.info[k * step].anchored) ||
        (has_x && p.x.info[k * step].anchored)) {
      result.end = k;
      return result;
    }
    ++result.visits;
    pending &= static_cast<std::uint8_t>(~p.mask);
    RowNow row{
        p.own.u + k * values, p.own.labels + k * values, info->label, p.y, has_z, has_x, false, nullptr, 0};
    if (has_x) {
      row.x = p.x.u + k * values + x_end;
      row.x_label = p.x.labels[k * values + x_end];
    }
    if (p.y && !moved_before) load_row(row.u - values, y);
    const std::uint8_t label = row.label, z_label = has_z ? p.z.info[k * step].label : label,
                       y_label = p.y ? (info - step)->label : label;
    // Does this label allow all differences within a row that the other label allows?
    const auto allows = [&p, label](std::uint8_t other) {
      return other == label || (p.up[other] <= p.up[label] && p.down[other] <= p.down[label]);
    };
    const bool alike = label != 0 && y_label != 0 && z_label != 0;
    row.closed = alike && allows(y_label) && allows(z_label);
    if (row.closed && p.y && has_z && has_x && label == y_label &&
        p.z.info[(k - 1) * step].label == z_label && UniformRows::one_label(p.x.info[k * step]) &&
        p.along_y.in[z_label] <= p.along_y.in[label] && p.along_y.back[z_label] <= p.along_y.back[label]) {
      // The loop goes on while the present row moved and the next row is of the same kind (UniformRows).
      UniformRows rows(p, label, z_label, p.x.info[k * step].label);
      bool done = false;
      while (sweep_uniform<kRaise>(p, rows, k, y, moved_out[k])) {
        moved_before = moved_out[k] != kNothingMoved;
        done = !moved_before || k + 1 == p.max_rows || result.visits == most_visits || !rows.has(p, k + 1);
        if (done) break;
        ++k;
        ++result.visits;
        result.end = k + 1;
        p.pending[k * step] &= static_cast<std::uint8_t>(~p.mask);
      }
      if (done) continue;
      row.u = p.own.u + k * values;
      row.labels = p.own.labels + k * values;
      row.x = p.x.u + k * values + x_end;
      row.x_label = p.x.labels[k * values + x_end];
    }
    if (has_z) load_row(p.z.u + k * values, z);
    if (alike) {
      AlikeLimits by_y(p.along_y, label, y_label), by_z(p.along_z, label, z_label);
      moved_out[k] = sweep_row<kRaise, kRegisters>(p, row, by_y, by_z, z, y);
    } else {
      row.label = 0;
      const Indices own(row.labels);
      LabelLimits<kRegisters> by_y(p.along_y, own, p.y ? row.labels - values : row.labels),
          by_z(p.along_z, own, has_z ? p.z.labels + k * values : row.labels);
      moved_out[k] = sweep_row<kRaise, kRegisters>(p, row, by_y, by_z, z, y);
    }
    moved_before = moved_out[k] != kNothingMoved;
  }
  return result;
}

template <bool kRaise>
HYBRID_INLINE SweepResult sweep_by_registers(const SweepTask& task, int most_visits, Moved* moves) {
  switch (task.registers) {
    case 1:
      return sweep_rows<kRaise, 1>(task, most_visits, moves);
    case 2:
      return sweep_rows<kRaise, 2>(task, most_visits, moves);
    default:
      return sweep_rows<kRaise, 0>(task, most_visits, moves);
  }
}

// NOLINTEND(llvm-header-guard)
