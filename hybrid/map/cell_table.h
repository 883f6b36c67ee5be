// SPDX-License-Identifier: GPL-3.0-or-later
// A hash table from the coordinates of a brick (or block) of cells to what is known of it, made such that a
// look-up in a large table waits for the memory once: the entry lies in the table itself, and which of its
// places to read is known from a byte a place, which are few enough for a cache.
//
// Places are in chunks of seven. A chunk's word has a tag of each place (0: free) and how many entries found
// no room here and went on to the next chunk, so that a search for what is not there ends without reading an
// entry (Bronson & Shi 2019, F14). Nothing moves when an entry is added or erased: the number of its place
// stays valid until the table grows, which it does on load only.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "hybrid/map/huge_page_allocator.h"

namespace hybrid {

using CellCoordinates = std::array<std::int32_t, 3>;

// In registers, as coordinates mostly are; the array's own comparison would have to store them first.
[[nodiscard]] inline bool same(const CellCoordinates& a, const CellCoordinates& b) noexcept {
  return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
}

// In place of the first coordinate of what is not there: no cell has it.
inline constexpr std::int32_t kNoPlace = std::numeric_limits<std::int32_t>::min();

// What the caller of a table remembers from one question to the next, so that a path costs no hash: where the
// last one was, where others before it were or those beside it will be, one for each parity of the three
// coordinates (so that a box over two along each axis has all its eight), and where to. Only hints: whatever
// they say, and to whatever table they are given, answers are the same. One for each thread that asks.
struct CellTrail {
  std::uint32_t here = 0;  // of the last that was there
  std::array<std::uint32_t, 8> place{};
  CellCoordinates last{};  // the last that another was before
  std::array<std::int32_t, 3> step{1, 1, 1};
};

// Entry: default constructed it is free; `CellCoordinates at{kNoPlace, 0, 0}` is its first member. start(at)
// makes of whatever it was before one that knows nothing yet.
template <class Entry>
class CellTable {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  CellTable() { lay_out(1); }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::uint32_t places() const noexcept { return static_cast<std::uint32_t>(entries_.size()); }
  [[nodiscard]] bool holds(std::uint32_t place) const noexcept { return entries_[place].at[0] != kNoPlace; }
  [[nodiscard]] Entry& operator[](std::uint32_t place) noexcept { return entries_[place]; }
  [[nodiscard]] const Entry& operator[](std::uint32_t place) const noexcept { return entries_[place]; }

  // The place of the entry; kNone: there is none.
  [[nodiscard]] std::uint32_t find(const CellCoordinates& at) const noexcept { return find(at, hash(at)); }
  [[nodiscard]] std::uint32_t find(const CellCoordinates& at, std::uint64_t h) const noexcept {
    std::size_t chunk = home(h);
    for (std::size_t n = 0; n < chunks_.size(); ++n) {
      const std::uint64_t word = chunks_[chunk];
      for (std::uint64_t m = matches(word, h); m != 0; m &= m - 1) {
        const std::uint32_t place = place_of(chunk, m);
        fetch_rest(place);
        if (same(entries_[place].at, at)) return place;
      }
      if (word >> kPassedShift == 0) return kNone;
      if (++chunk == chunks_.size()) chunk = 0;
    }
    return kNone;
  }

  // The same along a path. Of what the last question was about: its entry, at once; else null.
  [[nodiscard, gnu::always_inline]] const Entry* still_in(const CellCoordinates& at,
                                                          const CellTrail& trail) const noexcept {
    return is_at(trail.here, at) ? &entries_[trail.here] : nullptr;
  }
  // Of what was asked of before, or was on the way: its place if it is there.
  [[nodiscard]] std::uint32_t hinted(const CellCoordinates& at, const CellTrail& trail) const noexcept {
    const std::uint32_t hint = trail.place[parity(at)];
    return is_at(hint, at) ? hint : kNone;
  }
  // Of what was not.
  [[nodiscard]] std::uint32_t find(const CellCoordinates& at, CellTrail& trail) const noexcept {
    const std::uint32_t place = find(at);
    if (place != kNone) trail.place[parity(at)] = place;
    return place;
  }
  // Of any but the last, and where the trail leads to will be in a cache when it gets there.
  [[nodiscard]] std::uint32_t find_and_look_ahead(const CellCoordinates& at,
                                                  CellTrail& trail) const noexcept {
    const bool ahead = large() && !same(at, trail.last) && follow(at, trail);
    std::uint32_t place = hinted(at, trail);
    if (place == kNone) place = find(at, trail);
    if (place != kNone) trail.here = place;
    if (ahead) look_ahead(at, trail);
    return place;
  }
  // Larger than a cache that a core has for itself: then it is worth to tell the memory early.
  [[nodiscard]] bool large() const noexcept {
    return entries_.size() * sizeof(Entry) > (std::size_t{1} << 19);
  }

  // Tells the memory that find() of it will follow: of several that are told first, one waits for all.
  // (GCC 12 takes a function that only prefetches for one that does nothing, and leaves out its calls.)
  [[gnu::always_inline]] void fetch(const CellCoordinates& at) const noexcept { (void)fetch(hash(at)); }
  // The place where it is if anywhere, by its tag alone; kNone: probably nowhere.
  [[gnu::always_inline]] std::uint32_t fetch(std::uint64_t h) const noexcept {
    const std::uint64_t m = matches(chunks_[home(h)], h);
    // Without a match, too, some address: a branch would have to wait for the tags.
    const std::uint32_t place = place_of(home(h), m | static_cast<std::uint64_t>(m == 0) << 7);
    __builtin_prefetch(&entries_[place]);
    fetch_rest(place);
    return m == 0 ? kNone : place;
  }

  // The place of the entry, which is new and started when there was none. kNone only when it may not allocate
  // and there is no room. If the table grew, moved(entry, its new place) was called for all.
  template <class Moved>
  std::uint32_t find_or_add(const CellCoordinates& at, bool may_allocate, Moved&& moved) {
    const std::uint64_t h = hash(at);
    const std::uint32_t found = find(at, h);
    return found != kNone ? found : add(at, h, may_allocate, moved);
  }
  // The same of what is known not to be there.
  template <class Moved>
  std::uint32_t add(const CellCoordinates& at, bool may_allocate, Moved&& moved) {
    return add(at, hash(at), may_allocate, moved);
  }
  [[nodiscard]] bool has_room() const noexcept { return size_ < most_; }

  // The entry is no more: its room is for any other.
  void erase(std::uint32_t place) noexcept {
    const std::size_t last = place / kPlaces;
    const std::uint64_t h = hash(entries_[place].at);
    for (std::size_t chunk = home(h); chunk != last; chunk = chunk + 1 == chunks_.size() ? 0 : chunk + 1) {
      if (chunks_[chunk] >> kPassedShift != kMostPassed) chunks_[chunk] -= kOnePassed;
    }
    chunks_[last] &= ~(0xFFULL << (8 * (place % kPlaces)));
    entries_[place].at[0] = kNoPlace;  // the rest when it is started again
    --size_;
  }

  // Room for about so many more, which are expected on load: so that it need not grow step by step.
  template <class Moved>
  void expect(std::size_t more, Moved&& moved) {
    const std::size_t chunks = chunks_for(size_ + more);
    if (chunks > chunks_.size()) grow(chunks, moved);
  }
  // Room for so many more, and no more than that, in memory for hardly more.
  template <class Moved>
  void seal(std::size_t more, Moved&& moved) {
    const std::size_t most = size_ + more;
    const std::size_t chunks = chunks_for(most);
    if (chunks > chunks_.size() || chunks + chunks / kSpare < chunks_.size()) grow(chunks, moved);
    most_ = most;
  }

  template <class Visit>
  void each(Visit&& visit) const {  // visit(entry, place)
    for (std::uint32_t place = 0; place < entries_.size(); ++place) {
      if (holds(place)) visit(entries_[place], place);
    }
  }

  // The entry's memory will be read soon.
  [[gnu::always_inline]] void fetch_place(std::uint32_t place) const noexcept {
    __builtin_prefetch(&entries_[place]);
    fetch_rest(place);
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return entries_.capacity() * sizeof(Entry) + chunks_.capacity() * sizeof(std::uint64_t);
  }

  // For tests: every entry is found where it lies, and every chunk counts who went past it.
  [[nodiscard]] bool validate() const {
    std::vector<std::uint64_t> passed(chunks_.size(), 0);
    std::size_t held = 0;
    for (std::uint32_t place = 0; place < entries_.size(); ++place) {
      const std::size_t last = place / kPlaces;
      const bool tagged = (chunks_[last] >> (8 * (place % kPlaces)) & 0xFF) != 0;
      if (tagged != holds(place)) return false;
      if (!tagged) continue;
      ++held;
      if (find(entries_[place].at) != place) return false;
      for (std::size_t c = home(hash(entries_[place].at)); c != last; c = (c + 1) % chunks_.size())
        ++passed[c];
    }
    for (std::size_t c = 0; c < chunks_.size(); ++c) {
      const std::uint64_t says = chunks_[c] >> kPassedShift;
      if (says != kMostPassed && says != passed[c]) return false;
    }
    return held == size_;
  }

 private:
  static constexpr std::size_t kPlaces = 7;  // of a chunk
  static constexpr int kPassedShift = 56;
  static constexpr std::uint64_t kOnePassed = 1ULL << kPassedShift,
                                 kMostPassed = 0xFF;  // it counts no further
  static constexpr std::uint64_t kOnes = 0x0101010101010101ULL;
  static constexpr std::size_t kSpare = 8;  // a part of so many is not worth to move all
  static constexpr std::size_t kMostPlaces = std::size_t{1} << 26;

  [[nodiscard]] static std::uint64_t hash(const CellCoordinates& c) noexcept {
    return finished(part(0, c[0]) ^ part(1, c[1]) ^ part(2, c[2]));
  }
  // Three odd multipliers and a finaliser (Teschner et al. 2003 mix the same way, with worse low bits).
  [[nodiscard]] static std::uint64_t part(std::size_t axis, std::int32_t c) noexcept {
    constexpr std::array<std::uint64_t, 3> odd{0x9E3779B97F4A7C15ULL, 0xC2B2AE3D27D4EB4FULL,
                                               0x165667B19E3779F9ULL};
    return static_cast<std::uint32_t>(c) * odd[axis];
  }
  [[nodiscard]] static std::uint64_t finished(std::uint64_t h) noexcept {
    h ^= h >> 29;
    h *= 0xBF58476D1CE4E5B9ULL;
    return h ^ h >> 32;
  }
  // By the upper half of the hash, the tag by the lowest byte.
  [[nodiscard]] std::size_t home(std::uint64_t h) const noexcept { return (h >> 32) * chunks_.size() >> 32; }
  [[nodiscard]] static std::uint64_t tag(std::uint64_t h) noexcept {
    const std::uint64_t low = h & 0xFF;
    return low + (low == 0 ? 1 : 0);
  }
  // Bit 8 n + 7 for place n with this tag; above the first of them perhaps one too many.
  [[nodiscard]] static std::uint64_t matches(std::uint64_t word, std::uint64_t h) noexcept {
    const std::uint64_t x = word ^ kOnes * tag(h);
    return (x - kOnes) & ~x & 0x0080808080808080ULL;
  }
  [[nodiscard]] static std::uint32_t place_of(std::size_t chunk, std::uint64_t match) noexcept {
    return static_cast<std::uint32_t>(chunk * kPlaces +
                                      static_cast<std::size_t>(std::countr_zero(match) / 8));
  }
  [[nodiscard]] static std::size_t parity(const CellCoordinates& at) noexcept {
    const auto odd = [&at](std::size_t d) { return static_cast<std::size_t>(at[d] & 1); };
    return odd(0) + 2 * odd(1) + 4 * odd(2);
  }
  [[nodiscard]] bool is_at(std::uint32_t place, const CellCoordinates& at) const noexcept {
    return place < entries_.size() && same(entries_[place].at, at);
  }
  // What of an entry lies beyond its first cache line comes together with it.
  [[gnu::always_inline]] void fetch_rest(std::uint32_t place) const noexcept {
    if constexpr (sizeof(Entry) > 32)
      __builtin_prefetch(reinterpret_cast<const char*>(&entries_[place]) + sizeof(Entry) - 1);
  }
  // The trail now leads from here, in the direction in which it has gone so far. False: it jumped.
  [[gnu::always_inline]] static bool follow(const CellCoordinates& at, CellTrail& trail) noexcept {
    bool far = false;
    for (std::size_t d = 0; d < 3; ++d) {
      const std::uint32_t step =
          static_cast<std::uint32_t>(at[d]) - static_cast<std::uint32_t>(trail.last[d]);
      far |= step + 2 > 4;
      const std::int32_t sign = static_cast<std::int32_t>(step) < 0 ? -1 : 1;
      trail.step[d] = step != 0 ? sign : trail.step[d];  // no branch: which axis is next is not foreseen
    }
    trail.last = at;
    return !far;
  }
  // Along a path the next one is beside this: its entry is on the way when the path gets there, and where it
  // is in the trail.
  [[gnu::always_inline]] void look_ahead(const CellCoordinates& at, CellTrail& trail) const noexcept {
    std::array<std::array<std::uint64_t, 3>, 3> parts{};  // [axis][steps ahead]
    for (std::size_t d = 0; d < 3; ++d) {
      for (std::int32_t n = 0; n < 3; ++n)
        parts[d][static_cast<std::size_t>(n)] = part(d, at[d] + n * trail.step[d]);
    }
    const std::size_t here = parity(at);
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
      const std::uint64_t beside = parts[e][0] ^ parts[f][0];
      const std::uint32_t place = fetch(finished(parts[d][1] ^ beside));
      std::uint32_t& hint = trail.place[here ^ (1U << d)];
      hint = place != kNone ? place : hint;
      // Of those beyond it the tags: fetching an entry has to read them.
      __builtin_prefetch(&chunks_[home(finished(parts[d][2] ^ beside))]);
      __builtin_prefetch(&chunks_[home(finished(parts[d][1] ^ parts[e][1] ^ parts[f][0]))]);
    }
  }

  std::uint32_t take_place(std::uint64_t h) noexcept {
    std::size_t chunk = home(h);
    for (;;) {  // there is a free place: most_ is less than the places
      std::uint64_t& word = chunks_[chunk];
      const std::uint64_t free = (word - kOnes) & ~word & 0x0080808080808080ULL;  // the first is one
      if (free != 0) {
        word |= tag(h) << (std::countr_zero(free) - 7);
        return place_of(chunk, free);
      }
      if (word >> kPassedShift != kMostPassed) word += kOnePassed;
      if (++chunk == chunks_.size()) chunk = 0;
    }
  }
  template <class Moved>
  std::uint32_t add(const CellCoordinates& at, std::uint64_t h, bool may_allocate, Moved&& moved) {
    if (size_ >= most_) {
      if (!may_allocate) return kNone;
      grow(2 * chunks_.size(), moved);
    }
    ++size_;
    const std::uint32_t place = take_place(h);
    entries_[place].start(at);
    return place;
  }
  [[nodiscard]] static std::size_t chunks_for(std::size_t most) noexcept {
    return std::max<std::size_t>(1, (most * 4 + 3 * kPlaces - 1) / (3 * kPlaces));
  }
  void lay_out(std::size_t chunks) {
    if (chunks * kPlaces > kMostPlaces) throw std::length_error("the occupancy map is too large");
    chunks_.assign(chunks, 0);
    entries_ = std::vector<Entry, HugePages<Entry>>(chunks * kPlaces);
    most_ = chunks * kPlaces * 3 / 4;
  }
  template <class Moved>
  void grow(std::size_t chunks, Moved&& moved) {
    const auto old = std::exchange(entries_, {});
    lay_out(chunks);
    for (const Entry& entry : old) {
      if (entry.at[0] == kNoPlace) continue;
      const std::uint32_t place = take_place(hash(entry.at));
      entries_[place] = entry;
      moved(entry, place);
    }
  }

  std::vector<std::uint64_t> chunks_;  // byte 0 to 6: tags; 7: how many went on
  std::vector<Entry, HugePages<Entry>> entries_;
  std::size_t size_ = 0, most_ = 0;
};

}  // namespace hybrid
