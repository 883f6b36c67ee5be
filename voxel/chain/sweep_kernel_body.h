// SPDX-License-Identifier: GPL-3.0-or-later
// The innermost loop of a sweep, in whatever lanes the place that includes this has named: sweep_kernel.cpp
// does so once for each width of registers. Hence no guard, and no namespace of its own.
// NOLINTBEGIN(llvm-header-guard)

using RowValues = std::array<Floats, kVectors>;

// That which moves nothing.
constexpr float nobody_asks(bool raise) {
  return raise ? -kNever : kNever;
}

// Lanes n − kStep … of a row, 0 < kStep < kRow, `filler` where that is before its first.
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

// Each lane's, and that of `kStep` lanes before it (up) or after it (down).
template <bool kUp, std::size_t kStep>
HYBRID_INLINE void double_limits(RowValues& limit) {
  RowValues further;
  shift_row<kUp, kStep>(limit, kNever, further);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) limit[n] += further[n];
}
template <bool kRaise, bool kUp, std::size_t kStep>
HYBRID_INLINE void double_path(RowValues& now, RowValues& limit) {
  RowValues from;
  shift_row<kUp, kStep>(now, nobody_asks(kRaise), from);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Floats wanted;
    ask<kRaise>(from[n], limit[n], wanted);
    take_stronger<kRaise>(wanted, now[n]);
  }
  if (kStep < 16) double_limits<kUp, kStep>(limit);
}

// All paths within a row, by doubling: over one link, over two, four, … Five steps, where one link at a time
// takes up to 31. Those that lead up and those that lead down are independent: who goes one way and back
// arrives with less than who goes there at once. (One after the other, rows by label took a sixth longer:
// each step waits for the one before.) `up`: limits between lanes n − 1 and n, `down`: between n and n + 1.
// False, and `wanted` of no use, where no voxel asks one beside it.
template <bool kRaise>
HYBRID_INLINE bool all_paths(const RowValues& now, RowValues& up, RowValues& down, float margin,
                             RowValues& wanted) {
  Masks any{};
  RowValues from_below, from_above;
  shift_row_up<1>(now, now[0], from_below);
  shift_row_down<1>(now, now[kVectors - 1], from_above);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Masks moves;
    ask<kRaise>(from_below[n], up[n], from_below[n]);
    ask<kRaise>(from_above[n], down[n], from_above[n]);
    wanted[n] = from_above[n];
    take_stronger<kRaise>(from_below[n], wanted[n]);
    compare<kRaise>(wanted[n], now[n], margin, moves);
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
    wanted[n] = from_below[n];
    take_stronger<kRaise>(from_above[n], wanted[n]);
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
HYBRID_INLINE void take_from(const RowValues& from, const Limits& limits, RowValues& now) {
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Floats limit, by;
    limits.in(n, limit);
    ask<kRaise>(from[n], limit, by);
    take_stronger<kRaise>(by, now[n]);
  }
}
template <bool kRaise, class Limits>
HYBRID_INLINE void ask_back(const RowValues& now, Limits& limits, const RowValues& from, float margin,
                            Masks& any) {
  limits.turn();
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Floats limit, by;
    Masks moves;
    limits.back(n, limit);
    ask<kRaise>(now[n], limit, by);
    compare<kRaise>(by, from[n], margin, moves);
    any |= moves;
  }
}

// Limits of the links between a row and the one before it, and as that one is asked in turn: where both are
// of one label each, and by the labels of each voxel.
struct AlikeLimits {
  Floats in_, back_;
  HYBRID_INLINE AlikeLimits(const PullHalves& half, std::uint8_t own, std::uint8_t other) {
    broadcast(half.in[own] + half.in[other], in_);
    broadcast(half.back[own] + half.back[other], back_);
  }
  HYBRID_INLINE void in(std::size_t, Floats& out) const { out = in_; }
  HYBRID_INLINE void turn() {}
  HYBRID_INLINE void back(std::size_t, Floats& out) const { out = back_; }
};

template <int kRegisters>
struct LabelLimits {
  const PullHalves& half;
  const Indices& own;
  Indices other;
  RowValues now;
  HYBRID_INLINE LabelLimits(const PullHalves& h, const Indices& own_labels, const std::uint8_t* labels)
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
HYBRID_INLINE void settle_along(const Pull& p, std::uint8_t label, const std::uint8_t* labels,
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
  up[0][0] = down[kVectors - 1][kWidth - 1] = kNever;
  RowValues wanted;
  if (!all_paths<kRaise>(now, up, down, p.margin, wanted)) return;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) {
    Masks more;
    compare<kRaise>(wanted[n], now[n], p.margin, more);
    select(more, wanted[n], now[n], now[n]);
    compare<kRaise>(now[n], before[n], p.margin, moves[n]);
  }
}

// A row that is being dealt with, and the end of one in x.
struct RowNow {
  float* u;
  const std::uint8_t* labels;
  std::uint8_t label;  // 0 where it is by label
  bool has_y, has_z, has_x, closed;
  const float* x;
  std::uint8_t x_label;
};

template <bool kRaise>
HYBRID_INLINE bool asks_x(const Pull& p, const RowNow& row) {
  const std::size_t end = p.x_above ? kRow - 1 : 0;
  const float* const half = p.along_x.back;
  return beyond<kRaise>(asked<kRaise>(row.u[end], half[row.labels[end]] + half[row.x_label]), *row.x,
                        p.margin);
}

// `y`: the row before in y; the row itself afterwards, where it moved.
template <bool kRaise, int kRegisters, class Limits>
HYBRID_INLINE Moved pull_row(const Pull& p, const RowNow& row, Limits& by_y, Limits& by_z, const RowValues& z,
                             RowValues& y) {
  const std::size_t end = p.x_above ? kRow - 1 : 0;
  RowValues before, now;
  load_row(row.u, before);
  now = before;
  take_from<kRaise>(y, by_y, now);
  take_from<kRaise>(z, by_z, now);
  bool closed = row.closed;
  if (row.has_x) {
    const float* const half = p.along_x.in;
    const float wanted = asked<kRaise>(*row.x, half[row.labels[end]] + half[row.x_label]);
    if (beyond<kRaise>(wanted, p.x_above ? now[kVectors - 1][kWidth - 1] : now[0][0], p.margin)) {
      closed = false;
      if (p.x_above)
        now[kVectors - 1][kWidth - 1] = wanted;
      else
        now[0][0] = wanted;
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
  if (!closed) settle_along<kRaise, kRegisters>(p, row.label, row.labels, before, now, moves);
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) store(now[n], row.u + n * kWidth);
  Moved what = moved(moves.front(), moves.back());
  Masks back_y{}, back_z{};
  ask_back<kRaise>(now, by_y, y, p.margin, back_y);
  ask_back<kRaise>(now, by_z, z, p.margin, back_z);
  if (any_of(back_y | back_z)) {
    if (row.has_y && any_of(back_y)) what |= kAsksY;
    if (row.has_z && any_of(back_z)) what |= kAsksZ;
  }
  if (row.has_x && (what & (p.x_above ? kLastMoved : kFirstMoved)) != 0 && asks_x<kRaise>(p, row))
    what |= kAsksX;
  y = now;
  return what;
}

// Rows of one label that follow one another, beside rows of one label in z and in x (0: none there).
struct SmoothRows {
  AlikeLimits by_y, by_z;
  float x_in, x_back;
  std::uint8_t label, z_label, x_label;

  HYBRID_INLINE SmoothRows(const Pull& p, std::uint8_t own, std::uint8_t z, std::uint8_t x)
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
  // Is row k one of them? One of one label has no anchor.
  [[nodiscard]] HYBRID_INLINE bool has(const Pull& p, std::ptrdiff_t k) const {
    const RowInfo &x = p.x.info[k * p.step], &z = p.z.info[k * p.step];
    return p.own.info[k * p.step].label == label && z.label == z_label && x.label == x_label && one_label(x);
  }
};

// Within one label, or out of one whose limits allow less: the row's own links then allow whatever those
// before it ask. Nor does it ask anything of the row before it in y: that has it from the row beside it in z,
// which asked this row's, or its like before that one, by the same way. (One of the two must be looked at: to
// leave out z as well would let each rely on the other.) False, and nothing done, where x asks more.
template <bool kRaise>
HYBRID_INLINE bool pull_smooth(const Pull& p, SmoothRows& rows, std::ptrdiff_t k, RowValues& y, Moved& what) {
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
    ask<kRaise>(y[n], rows.by_y.in_, from_y);
    ask<kRaise>(z[n], rows.by_z.in_, from_z);
    take_stronger<kRaise>(from_y, from_z);
    compare<kRaise>(from_z, before, p.margin, moves[n]);
    any |= moves[n];
    select(moves[n], from_z, before, now[n]);
  }
  if (beyond<kRaise>(asked<kRaise>(x, rows.x_in), p.x_above ? now[kVectors - 1][kWidth - 1] : now[0][0],
                     p.margin))
    return false;
  what = kNothingMoved;
  if (!any_of(any)) return true;
#pragma GCC unroll 4
  for (std::size_t n = 0; n < kVectors; ++n) store(now[n], u + n * kWidth);
  what = moved(moves.front(), moves.back());
  Masks back{};
  ask_back<kRaise>(now, rows.by_z, z, p.margin, back);
  if (any_of(back)) what |= kAsksZ;
  if ((what & (p.x_above ? kLastMoved : kFirstMoved)) != 0 &&
      beyond<kRaise>(asked<kRaise>(u[end], rows.x_back), x, p.margin))
    what |= kAsksX;
  y = now;
  return true;
}

template <bool kRaise, int kRegisters>
HYBRID_INLINE Pulled pulled(const Pull& p, int most_visits, Moved* moved_out) {
  const std::ptrdiff_t step = p.step, values = step * kRow;
  const bool has_z = p.z.u != nullptr, has_x = p.x.u != nullptr;
  constexpr float nobody = nobody_asks(kRaise);
  const std::ptrdiff_t x_end = p.x_above ? 0 : kRow - 1;

  Pulled result;
  RowValues y, z;
  fill(nobody, y);
  fill(nobody, z);
  bool on = false;  // the row before moved, and stands in y
  for (int k = 0; k < p.most && (on || k < p.count) && result.visits < most_visits; ++k) {
    std::uint8_t& asked_by = p.asked[k * step];
    moved_out[k] = kNothingMoved;
    result.end = k + 1;
    if (!on && (asked_by & p.by) == 0) continue;
    const RowInfo* const info = p.own.info + k * step;
    if (info->anchored || (p.y && (info - step)->anchored) || (has_z && p.z.info[k * step].anchored) ||
        (has_x && p.x.info[k * step].anchored)) {
      result.end = k;
      return result;
    }
    ++result.visits;
    asked_by &= static_cast<std::uint8_t>(~p.by);
    RowNow row{
        p.own.u + k * values, p.own.labels + k * values, info->label, p.y, has_z, has_x, false, nullptr, 0};
    if (has_x) {
      row.x = p.x.u + k * values + x_end;
      row.x_label = p.x.labels[k * values + x_end];
    }
    if (p.y && !on) load_row(row.u - values, y);
    const std::uint8_t label = row.label, z_label = has_z ? p.z.info[k * step].label : label,
                       y_label = p.y ? (info - step)->label : label;
    // Limits of one label may allow what another's do.
    const auto allows = [&p, label](std::uint8_t other) {
      return other == label || (p.up[other] <= p.up[label] && p.down[other] <= p.down[label]);
    };
    const bool alike = label != 0 && y_label != 0 && z_label != 0;
    row.closed = alike && allows(y_label) && allows(z_label);
    if (row.closed && p.y && has_z && has_x && label == y_label &&
        p.z.info[(k - 1) * step].label == z_label && SmoothRows::one_label(p.x.info[k * step]) &&
        p.along_y.in[z_label] <= p.along_y.in[label] && p.along_y.back[z_label] <= p.along_y.back[label]) {
      // As long as rows are of the same kind, and one after the other moves.
      SmoothRows rows(p, label, z_label, p.x.info[k * step].label);
      bool done = false;
      while (pull_smooth<kRaise>(p, rows, k, y, moved_out[k])) {
        on = moved_out[k] != kNothingMoved;
        done = !on || k + 1 == p.most || result.visits == most_visits || !rows.has(p, k + 1);
        if (done) break;
        ++k;
        ++result.visits;
        result.end = k + 1;
        p.asked[k * step] &= static_cast<std::uint8_t>(~p.by);
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
      moved_out[k] = pull_row<kRaise, kRegisters>(p, row, by_y, by_z, z, y);
    } else {
      row.label = 0;
      const Indices own(row.labels);
      LabelLimits<kRegisters> by_y(p.along_y, own, p.y ? row.labels - values : row.labels),
          by_z(p.along_z, own, has_z ? p.z.labels + k * values : row.labels);
      moved_out[k] = pull_row<kRaise, kRegisters>(p, row, by_y, by_z, z, y);
    }
    on = moved_out[k] != kNothingMoved;
  }
  return result;
}

template <bool kRaise>
HYBRID_INLINE Pulled pulled_by_registers(const Pull& pull, int most_visits, Moved* moves) {
  switch (pull.registers) {
    case 1:
      return pulled<kRaise, 1>(pull, most_visits, moves);
    case 2:
      return pulled<kRaise, 2>(pull, most_visits, moves);
    default:
      return pulled<kRaise, 0>(pull, most_visits, moves);
  }
}

// NOLINTEND(llvm-header-guard)
