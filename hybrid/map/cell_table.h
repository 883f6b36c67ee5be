// SPDX-License-Identifier: GPL-3.0-or-later
// A hash table from the coordinates of a brick (or block) of cells to a layer's entry. The table itself holds
// the entries. A byte per place selects the place to read, and these bytes fit into a cache. So a look-up in
// a large table waits for memory once.
//
// Places are in chunks of seven. A chunk's word has a tag for each place (0: free). It also has the number of
// entries that found the chunk full and passed on to a later chunk. A search for a missing entry therefore
// ends without reading an entry (Bronson & Shi 2019, F14). Adding or erasing moves no other entry: indices of
// places are valid until the table grows, which happens on load only.
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

// Compares in registers; the array's own comparison would store the coordinates first.
[[nodiscard]] inline bool same(const CellCoordinates& a, const CellCoordinates& b) noexcept {
  return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
}

// First coordinate of a free place; no cell has it.
inline constexpr std::int32_t kNoPlace = std::numeric_limits<std::int32_t>::min();

// A caller's cache between queries, so that queries along a path need no hashing. It contains the place of
// the last entry, the direction of the path, and the places of eight neighbouring entries. There is one for
// each parity of the three coordinates, so all entries of a box of 2×2×2 fit. The contents are hints only:
// results are the same with any trail and any table. Each thread needs its own.
struct CellTrail {
  std::uint32_t here = 0;  // place of the last entry found
  std::array<std::uint32_t, 8> place{};
  CellCoordinates last{};  // coordinates of the last query that `here` did not answer
  std::array<std::int32_t, 3> step{1, 1, 1};
};

// Entry: free when default constructed; its first member is `CellCoordinates at{kNoPlace, 0, 0}`. start(at)
// resets a place to an empty entry at `at`.
template <class Entry>
class CellTable {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  CellTable() { allocate(1); }

  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::uint32_t places() const noexcept { return static_cast<std::uint32_t>(entries_.size()); }
  [[nodiscard]] bool is_used(std::uint32_t place) const noexcept { return entries_[place].at[0] != kNoPlace; }
  [[nodiscard]] Entry& operator[](std::uint32_t place) noexcept { return entries_[place]; }
  [[nodiscard]] const Entry& operator[](std::uint32_t place) const noexcept { return entries_[place]; }

  // Index of the entry's place; kNone if there is none.
  [[nodiscard]] std::uint32_t find(const CellCoordinates& at) const noexcept { return find(at, hash(at)); }
  [[nodiscard]] std::uint32_t find(const CellCoordinates& at, std::uint64_t h) const noexcept {
    std::size_t chunk = home(h);
    for (std::size_t n = 0; n < chunks_.size(); ++n) {
      const std::uint64_t word = chunks_[chunk];
      for (std::uint64_t m = matches(word, h); m != 0; m &= m - 1) {
        const std::uint32_t place = place_of(chunk, m);
        prefetch_rest(place);
        if (same(entries_[place].at, at)) return place;
      }
      if (word >> kPassedShift == 0) return kNone;
      if (++chunk == chunks_.size()) chunk = 0;
    }
    return kNone;
  }

  // For paths: the entry of the last query if it is at `at`, else null.
  [[nodiscard, gnu::always_inline]] const Entry* last_entry_at(const CellCoordinates& at,
                                                               const CellTrail& trail) const noexcept {
    return is_at(trail.here, at) ? &entries_[trail.here] : nullptr;
  }
  // The place of a previous or expected query if it is at `at`, else kNone.
  [[nodiscard]] std::uint32_t hinted(const CellCoordinates& at, const CellTrail& trail) const noexcept {
    const std::uint32_t hint = trail.place[parity(at)];
    return is_at(hint, at) ? hint : kNone;
  }
  // Searches, and keeps the place as a hint.
  [[nodiscard]] std::uint32_t find(const CellCoordinates& at, CellTrail& trail) const noexcept {
    const std::uint32_t place = find(at);
    if (place != kNone) trail.place[parity(at)] = place;
    return place;
  }
  // Searches, and prefetches the entries in the direction of the path.
  [[nodiscard]] std::uint32_t find_ahead(const CellCoordinates& at, CellTrail& trail) const noexcept {
    const bool ahead = large() && !same(at, trail.last) && update_path(at, trail);
    std::uint32_t place = hinted(at, trail);
    if (place == kNone) place = find(at, trail);
    if (place != kNone) trail.here = place;
    if (ahead) prefetch_ahead(at, trail);
    return place;
  }
  // Is the table larger than the cache of one core, so that prefetching helps?
  [[nodiscard]] bool large() const noexcept {
    return entries_.size() * sizeof(Entry) > (std::size_t{1} << 19);
  }

  // Prefetches for a find() that follows. Several prefetches wait for memory together. always_inline is
  // needed: GCC 12 considers a function that only prefetches to be without effect, and drops its calls.
  [[gnu::always_inline]] void prefetch(const CellCoordinates& at) const noexcept { (void)prefetch(hash(at)); }
  // Returns the probable place, judged by its tag alone; kNone: the entry is probably missing.
  [[gnu::always_inline]] std::uint32_t prefetch(std::uint64_t h) const noexcept {
    const std::uint64_t m = matches(chunks_[home(h)], h);
    // Without a match some address is prefetched too, because a branch would wait for the tags.
    const std::uint32_t place = place_of(home(h), m | static_cast<std::uint64_t>(m == 0) << 7);
    __builtin_prefetch(&entries_[place]);
    prefetch_rest(place);
    return m == 0 ? kNone : place;
  }

  // Index of the entry's place; a missing entry is added and started. Returns kNone only if there is no room
  // and allocation is not allowed. If the table grew, moved(entry, its new place) was called for all.
  template <class Moved>
  std::uint32_t find_or_add(const CellCoordinates& at, bool may_allocate, Moved&& moved) {
    const std::uint64_t h = hash(at);
    const std::uint32_t found = find(at, h);
    return found != kNone ? found : add(at, h, may_allocate, moved);
  }
  // Adds and starts an entry that is known to be missing. Otherwise like find_or_add().
  template <class Moved>
  std::uint32_t add(const CellCoordinates& at, bool may_allocate, Moved&& moved) {
    return add(at, hash(at), may_allocate, moved);
  }
  [[nodiscard]] bool has_room() const noexcept { return size_ < most_; }

  // Removes the entry and frees its place.
  void erase(std::uint32_t place) noexcept {
    const std::size_t last = place / kPlaces;
    const std::uint64_t h = hash(entries_[place].at);
    for (std::size_t chunk = home(h); chunk != last; chunk = chunk + 1 == chunks_.size() ? 0 : chunk + 1) {
      if (chunks_[chunk] >> kPassedShift != kMostPassed) chunks_[chunk] -= kOnePassed;
    }
    chunks_[last] &= ~(0xFFULL << (8 * (place % kPlaces)));
    entries_[place].at[0] = kNoPlace;  // start() resets the rest
    --size_;
  }

  // Reserves room for about `more` entries, so that loading does not grow the table step by step.
  template <class Moved>
  void expect(std::size_t more, Moved&& moved) {
    const std::size_t chunks = chunks_for(size_ + more);
    if (chunks > chunks_.size()) grow(chunks, moved);
  }
  // Makes room for exactly `more` further entries, and gives back most of the spare memory.
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
      if (is_used(place)) visit(entries_[place], place);
    }
  }

  // Prefetches the entry.
  [[gnu::always_inline]] void prefetch_place(std::uint32_t place) const noexcept {
    __builtin_prefetch(&entries_[place]);
    prefetch_rest(place);
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return entries_.capacity() * sizeof(Entry) + chunks_.capacity() * sizeof(std::uint64_t);
  }

  // For tests: every entry is found at its place, and every chunk counts the entries that passed it.
  [[nodiscard]] bool validate() const {
    std::vector<std::uint64_t> passed(chunks_.size(), 0);
    std::size_t found_entries = 0;
    for (std::uint32_t place = 0; place < entries_.size(); ++place) {
      const std::size_t last = place / kPlaces;
      const bool tagged = (chunks_[last] >> (8 * (place % kPlaces)) & 0xFF) != 0;
      if (tagged != is_used(place)) return false;
      if (!tagged) continue;
      ++found_entries;
      if (find(entries_[place].at) != place) return false;
      for (std::size_t c = home(hash(entries_[place].at)); c != last; c = (c + 1) % chunks_.size())
        ++passed[c];
    }
    for (std::size_t c = 0; c < chunks_.size(); ++c) {
      const std::uint64_t counted = chunks_[c] >> kPassedShift;
      if (counted != kMostPassed && counted != passed[c]) return false;
    }
    return found_entries == size_;
  }

 private:
  static constexpr std::size_t kPlaces = 7;  // places of a chunk
  static constexpr int kPassedShift = 56;    // position of the count in a chunk's word
  static constexpr std::uint64_t kOnePassed = 1ULL << kPassedShift,
                                 kMostPassed = 0xFF;             // the count saturates here
  static constexpr std::uint64_t kOnes = 0x0101010101010101ULL;  // the lowest bit of each byte
  static constexpr std::size_t kSpare = 8;  // a saving of less than 1/kSpare is not worth moving all entries
  static constexpr std::size_t kMostPlaces = std::size_t{1} << 26;  // places of the table

  [[nodiscard]] static std::uint64_t hash(const CellCoordinates& c) noexcept {
    return finalised(part(0, c[0]) ^ part(1, c[1]) ^ part(2, c[2]));
  }
  // Three odd multipliers and a finaliser (Teschner et al. 2003 mix the same way, with worse low bits).
  [[nodiscard]] static std::uint64_t part(std::size_t axis, std::int32_t c) noexcept {
    constexpr std::array<std::uint64_t, 3> odd{0x9E3779B97F4A7C15ULL, 0xC2B2AE3D27D4EB4FULL,
                                               0x165667B19E3779F9ULL};
    return static_cast<std::uint32_t>(c) * odd[axis];
  }
  [[nodiscard]] static std::uint64_t finalised(std::uint64_t h) noexcept {
    h ^= h >> 29;
    h *= 0xBF58476D1CE4E5B9ULL;
    return h ^ h >> 32;
  }
  // The upper half of the hash selects the chunk, its lowest byte is the tag.
  [[nodiscard]] std::size_t home(std::uint64_t h) const noexcept { return (h >> 32) * chunks_.size() >> 32; }
  [[nodiscard]] static std::uint64_t tag(std::uint64_t h) noexcept {
    const std::uint64_t low = h & 0xFF;
    return low + (low == 0 ? 1 : 0);
  }
  // Bit 8 n + 7 is set for each place n with this tag. Bits above the lowest set bit may be wrong.
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
  // Prefetches the part of the entry beyond its first cache line.
  [[gnu::always_inline]] void prefetch_rest(std::uint32_t place) const noexcept {
    if constexpr (sizeof(Entry) > 32)
      __builtin_prefetch(reinterpret_cast<const char*>(&entries_[place]) + sizeof(Entry) - 1);
  }
  // Updates the direction of the path. False: the query jumped.
  [[gnu::always_inline]] static bool update_path(const CellCoordinates& at, CellTrail& trail) noexcept {
    bool far = false;
    for (std::size_t d = 0; d < 3; ++d) {
      const std::uint32_t step =
          static_cast<std::uint32_t>(at[d]) - static_cast<std::uint32_t>(trail.last[d]);
      far |= step + 2 > 4;
      const std::int32_t sign = static_cast<std::int32_t>(step) < 0 ? -1 : 1;
      trail.step[d] = step != 0 ? sign : trail.step[d];  // branchless: the axis is unpredictable
    }
    trail.last = at;
    return !far;
  }
  // The next query of a path is a neighbour: prefetches the three entries ahead and stores their places as
  // hints.
  [[gnu::always_inline]] void prefetch_ahead(const CellCoordinates& at, CellTrail& trail) const noexcept {
    std::array<std::array<std::uint64_t, 3>, 3> parts{};  // [axis][steps ahead]
    for (std::size_t d = 0; d < 3; ++d) {
      for (std::int32_t n = 0; n < 3; ++n)
        parts[d][static_cast<std::size_t>(n)] = part(d, at[d] + n * trail.step[d]);
    }
    const std::size_t here = parity(at);
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
      const std::uint64_t beside = parts[e][0] ^ parts[f][0];
      const std::uint32_t place = prefetch(finalised(parts[d][1] ^ beside));
      std::uint32_t& hint = trail.place[here ^ (1U << d)];
      hint = place != kNone ? place : hint;
      // Also prefetches the tags of the places two steps ahead and diagonally ahead. Tags must be read before
      // an entry there can be prefetched.
      __builtin_prefetch(&chunks_[home(finalised(parts[d][2] ^ beside))]);
      __builtin_prefetch(&chunks_[home(finalised(parts[d][1] ^ parts[e][1] ^ parts[f][0]))]);
    }
  }

  std::uint32_t take_place(std::uint64_t h) noexcept {
    std::size_t chunk = home(h);
    for (;;) {  // a free place exists: most_ is less than the number of places
      std::uint64_t& word = chunks_[chunk];
      // Only the lowest set bit of `free` is used, and it is exact.
      const std::uint64_t free = (word - kOnes) & ~word & 0x0080808080808080ULL;
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
  void allocate(std::size_t chunks) {
    if (chunks * kPlaces > kMostPlaces) throw std::length_error("the occupancy map is too large");
    chunks_.assign(chunks, 0);
    entries_ = std::vector<Entry, HugePages<Entry>>(chunks * kPlaces);
    most_ = chunks * kPlaces * 3 / 4;
  }
  template <class Moved>
  void grow(std::size_t chunks, Moved&& moved) {
    const auto old = std::exchange(entries_, {});
    allocate(chunks);
    for (const Entry& entry : old) {
      if (entry.at[0] == kNoPlace) continue;
      const std::uint32_t place = take_place(hash(entry.at));
      entries_[place] = entry;
      moved(entry, place);
    }
  }

  std::vector<std::uint64_t> chunks_;  // bytes 0 to 6: tags; byte 7: number of entries that passed
  std::vector<Entry, HugePages<Entry>> entries_;
  std::size_t size_ = 0, most_ = 0;
};

}  // namespace hybrid
