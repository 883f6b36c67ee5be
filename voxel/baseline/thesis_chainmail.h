// SPDX-License-Identifier: GPL-3.0-or-later
// The soft object of the thesis, kept as a baseline for tests, `compare` and `bench`. Sessions do not use it.
//
// It has four parts. ChainMail uses a first-come queue of candidates with their sponsors (Figs 6 to 9).
// Contact tests a point and six directions on a dense occupancy map (Fig 16). The force comes from the three
// lines of links through the touched element (getForce). In relaxation each element moves as its links
// require, damped or not. The implementation is efficient: dense arrays, 16 bytes per element, a queue that
// stops allocating once it has grown. In two respects it differs from the thesis, so that neither rounding
// nor units count against it: it stores displacements from rest instead of absolute positions, and its
// springs have the moduli of `Lattice`. (Springs on a border are whole ones, as in the thesis; `Lattice`
// halves them.)
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <mutex>
#include <span>
#include <vector>

#include "voxel/lattice/lattice.h"
#include "voxel/volume/label_volume.h"

namespace voxel {

struct ThesisChainMailOptions {
  // Movement of a relaxed element. `mean`: to the mean of the places that its links require, weighted by
  // stiffness. `sum`: by the sum of the moves that its links require, as in the thesis's first version (Fig
  // 22).
  enum class Movement : std::uint8_t { mean, sum } movement = Movement::mean;
  double damping = 1.0;    // factor on the movement; 1: undamped. The thesis recommends "some small value"
  bool six_points = true;  // false: the tool is a point (the thesis before Figs 20 and 21)
  bool lock = false;       // locks the object for each element that is visited (Fig 23)
};

class ThesisChainMail {
 public:
  using ElementId = std::uint32_t;  // index into a grid with a border of one element

  // Throws std::invalid_argument if the number of labels does not fit the volume's size, or if the volume
  // with its border has 2^29 cells or more. Materials are not checked (Lattice checks them).
  ThesisChainMail(const LabelVolume& volume, const LatticeOptions& options,
                  const ThesisChainMailOptions& classic = {});

  [[nodiscard]] ElementId at(int i, int j, int k) const;  // element of voxel (i, j, k) of the volume
  [[nodiscard]] bool filled(ElementId v) const { return (elements_[v].info & kFilled) != 0; }
  [[nodiscard]] bool anchored(ElementId v) const { return (elements_[v].info & kAnchored) != 0; }
  [[nodiscard]] glm::vec3 displacement(ElementId v) const {  // (unit: meter)
    const Element& e = elements_[v];
    return {e.u[0], e.u[1], e.u[2]};
  }
  [[nodiscard]] glm::dvec3 rest(ElementId v) const;  // volume frame (unit: meter)
  [[nodiscard]] glm::dvec3 position(ElementId v) const { return rest(v) + glm::dvec3(displacement(v)); }
  [[nodiscard]] std::span<const ElementId> surface() const { return surface_; }

  // Moves the sources by `moves` (m), and the chain after them. Anchored elements stay and sponsor no
  // candidates. The queue may grow, and so allocate. Incompatible sources would push one another endlessly:
  // after kMaxRounds candidates per cell and direction the rest is dropped, and gave_up() is true.
  void move(std::span<const ElementId> sources, std::span<const glm::vec3> moves);
  // Results of the last move(): number of candidates; were candidates dropped?
  [[nodiscard]] std::uint64_t candidates() const { return candidates_; }
  [[nodiscard]] bool gave_up() const { return gave_up_; }
  static constexpr std::uint64_t kMaxRounds = 20;  // candidates per cell and direction

  // One round of the haptic thread (Fig 16); lengths in m in the volume frame. Looks up the tool's centre,
  // then six points at `radius` from it. The first point that finds an element moves to the point this
  // element, or a linked element that is nearer. The other points are ignored.
  struct Touch {
    bool contact = false;
    ElementId element = 0;
    glm::dvec3 force_N{0.0};
  };
  Touch touch(const glm::dvec3& centre, double radius);
  // The thesis names getForce and its cost, which is linear in the object's dimension, but not its formula.
  // Here it is the sum of the spring forces of all links on the three lines through the element.
  [[nodiscard]] glm::dvec3 force_N(ElementId v) const;

  void relax_all();                         // every element once, all at the same time (Jacobi)
  void relax_in_turn(std::uint64_t count);  // the next `count` elements, one after another (Fig 17)

  void reset();  // to rest
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Element {
    std::array<float, 3> u{};  // displacement (unit: meter)
    std::uint32_t info = 0;    // material class, and the flags below
  };
  static_assert(sizeof(Element) == 16);
  static constexpr std::uint32_t kClass = 0xFF, kFilled = 0x100, kAnchored = 0x200, kSurface = 0x400;
  static constexpr ElementId kNone = 0xFFFFFFFFU;
  struct Limits {  // of u(candidate) − u(sponsor) (unit: meter)
    std::array<float, 3> low{}, high{};
  };
  // Directions: 2·axis towards +, 2·axis + 1 towards −.
  static constexpr std::uint32_t kDirections = 6;
  [[nodiscard]] std::size_t pair(std::uint32_t direction, ElementId from, ElementId to) const {
    return (static_cast<std::size_t>(direction) * classes_ + (elements_[from].info & kClass)) * classes_ +
           (elements_[to].info & kClass);
  }

  void fill(const LabelVolume& volume, const LatticeOptions& options);
  void fill_anchors(const LabelVolume& volume, const LatticeOptions& options);
  void fill_tables(const std::vector<LinkMaterial>& materials);
  void sponsor(ElementId v, std::uint32_t except);
  void spread();
  void grow_queue();
  [[nodiscard]] std::array<float, 3> relaxed(ElementId v) const;
  void set(ElementId v, const std::array<float, 3>& u);
  void make_map();
  // Returns the map's size if the position is outside of the map.
  [[nodiscard]] std::size_t cell_of(const glm::dvec3& position) const;
  void enter_in_map(ElementId v);
  void leave_map(ElementId v);
  // The element in the point's cell, or one in a neighbouring cell within half a spacing of the point on each
  // axis. Without neighbouring cells contact would be lost at every border between cells. kNone: no element.
  [[nodiscard]] ElementId element_at(const glm::dvec3& point) const;

  ThesisChainMailOptions options_;
  std::array<int, 3> dims_{};  // padded by one empty element on each side
  std::array<std::int64_t, kDirections> step_{};
  glm::dvec3 spacing_m_;
  std::size_t classes_ = 1;
  std::vector<Element> elements_;
  std::vector<Limits> limits_;                 // [direction][class of sponsor][class of candidate]
  std::vector<std::array<float, 3>> springs_;  // [as limits_] stiffness on each axis (N/m)
  std::vector<ElementId> surface_;
  std::vector<std::uint32_t> queue_;  // ring buffer: candidate · 8 + direction from its sponsor
  std::size_t head_ = 0, tail_ = 0;
  std::vector<ElementId> map_;                 // [cell] an element in it; empty until the first touch()
  std::vector<std::array<float, 3>> relaxed_;  // results of relax_all()
  ElementId next_ = 0;
  std::uint64_t candidates_ = 0;
  bool gave_up_ = false;
  mutable std::mutex mutex_;
};

}  // namespace voxel
