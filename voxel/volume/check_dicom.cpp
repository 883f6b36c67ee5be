// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/check_dicom.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <string>
#include <vector>

#include "voxel/volume/check_header.h"
#include "voxel/volume/raw_volume.h"

namespace voxel {
namespace {

constexpr std::uint32_t kUndefined = 0xffffffffU;  // length of an element whose end is marked by an item
// Tags of elements: group in the upper 16 bits, number in the lower (DICOM PS3.5 and PS3.6).
constexpr std::uint32_t kItem = 0xfffee000U;
constexpr std::uint32_t kItemEnd = 0xfffee00dU;
constexpr std::uint32_t kSequenceEnd = 0xfffee0ddU;
constexpr std::uint32_t kPixels = 0x7fe00010U;
constexpr std::uint32_t kFloats = 0x7fe00008U;
constexpr std::uint32_t kDoubles = 0x7fe00009U;
constexpr std::uint32_t kTransferSyntax = 0x00020010U;
constexpr std::uint32_t kFrames = 0x00280008U;
constexpr std::uint32_t kBits = 0x00280100U;
constexpr std::size_t kMostFrames = 1'000'000;  // a header that states more is broken

// One element's header. DICOM PS3.5, chapter 7.
struct Element {
  std::uint32_t tag = 0;
  std::string type;  // the two letters of the value representation; empty if the element is implicit
  std::uint32_t length = 0;
};

// Value representations with a length field of four bytes, and those with a length field of two (PS3.5,
// 7.1.2). GDCM guesses the length of an element with any other representation.
constexpr std::array<const char*, 13> kLongTypes{"OB", "OD", "OF", "OL", "OV", "OW", "SQ",
                                                 "SV", "UC", "UN", "UR", "UT", "UV"};
constexpr std::array<const char*, 21> kShortTypes{"AE", "AS", "AT", "CS", "DA", "DS", "DT",
                                                  "FD", "FL", "IS", "LO", "LT", "PN", "SH",
                                                  "SL", "SS", "ST", "TM", "UI", "UL", "US"};

template <std::size_t Count>
bool is_one_of(const std::array<const char*, Count>& types, const std::string& type) {
  return std::any_of(types.begin(), types.end(), [&](const char* other) { return type == other; });
}

// Walks nested elements without recursion: the content of a sequence or an item is read as the next elements.
// A stack holds the open sequences and items. Each ends at its stated length or at a delimiter.
class Walker {
 public:
  explicit Walker(const std::filesystem::path& path) : path_(path), file_(path, std::ios::binary) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    bytes_ = error ? 0 : bytes;
  }

  DicomFile walk() {
    std::array<char, 132> preamble{};
    if (file_.read(preamble.data(), preamble.size()) && std::memcmp(&preamble[128], "DICM", 4) == 0) {
      at_ = preamble.size();
    } else if (!begins_with_element()) {
      return found_;
    }
    found_.kind = DicomKind::without_image;
    walk_meta();
    if (!syntax_.empty()) implicit_ = syntax_ == "1.2.840.10008.1.2";
    found_.big_endian = big_endian_ = syntax_ == "1.2.840.10008.1.2.2";
    if (syntax_ == "1.2.840.10008.1.2.1.99") {
      refuse_volume(path_, "the DICOM file is deflated as a whole, which is not read; save it uncompressed");
    }
    while (left() >= 8) {
      if (!step()) break;
    }
    return found_;
  }

 private:
  [[nodiscard]] std::uint64_t left() const { return bytes_ > at_ ? bytes_ - at_ : 0; }

  // True if the file begins with an element of group 2 or 8, as DICOM without its preamble does. Sets
  // `implicit_` if that element names no type. A transfer syntax in group 2 overrides `implicit_` later.
  bool begins_with_element() {
    file_.clear();
    file_.seekg(0);
    at_ = 0;
    std::array<unsigned char, 8> start{};
    if (!file_.read(reinterpret_cast<char*>(start.data()), start.size())) return false;
    file_.seekg(0);
    const unsigned group = start[0] | static_cast<unsigned>(start[1]) << 8U;
    const unsigned element = start[2] | static_cast<unsigned>(start[3]) << 8U;
    const std::string type{static_cast<char>(start[4]), static_cast<char>(start[5])};
    const bool typed = is_one_of(kLongTypes, type) || is_one_of(kShortTypes, type);
    implicit_ = !typed;
    // An implicit first element is short, such as the group length, the character set or the image type.
    const bool is_short = start[5] == 0 && start[6] == 0 && start[7] == 0 && start[4] <= 64;
    return (group == 2 || group == 8) && element <= 0x0100 && (typed || is_short);
  }

  std::uint32_t number(std::size_t bytes) {
    std::array<unsigned char, 4> raw{};
    file_.read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(bytes));
    at_ += bytes;
    std::uint32_t value = 0;
    for (std::size_t n = 0; n < bytes; ++n) {
      value |= static_cast<std::uint32_t>(raw[n]) << (8 * (big_endian_ ? bytes - 1 - n : n));
    }
    return value;
  }

  Element header() {
    Element element;
    element.tag = number(2) << 16U;
    element.tag |= number(2);
    const bool delimiter = element.tag >> 16U == 0xfffeU;
    if (implicit_ || delimiter) {
      element.length = number(4);
      return element;
    }
    std::array<char, 2> letters{};
    file_.read(letters.data(), 2);
    at_ += 2;
    element.type.assign(letters.data(), 2);
    const bool is_long = is_one_of(kLongTypes, element.type);
    if (is_long) number(2);
    element.length = number(is_long ? 4 : 2);
    return element;
  }

  [[noreturn]] void refuse(const Element& element) const {
    std::ostringstream tag;
    tag << std::hex << std::setfill('0') << std::setw(4) << (element.tag >> 16U) << ',' << std::setw(4)
        << (element.tag & 0xffffU);
    refuse_volume(path_, "DICOM element (", tag.str(), ") at byte ", at_, " says it is ", element.length,
                  " bytes long, but the file has ", left(), " left; ", kDamaged);
  }

  void pass(const Element& element) {
    if (element.length > left()) refuse(element);
    at_ += element.length;
    file_.seekg(static_cast<std::streamoff>(at_));
  }

  // The file meta elements (group 0002), always explicit and little-endian.
  void walk_meta() {
    while (left() >= 8) {
      const std::uint64_t start = at_;
      const Element element = header();
      if (element.tag >> 16U != 2) {
        at_ = start;
        file_.clear();
        file_.seekg(static_cast<std::streamoff>(at_));
        return;
      }
      if (element.tag == kTransferSyntax && element.length <= 64 && element.length <= left()) {
        syntax_.resize(element.length);
        file_.read(syntax_.data(), element.length);
        at_ += element.length;
        while (!syntax_.empty() && (syntax_.back() == '\0' || syntax_.back() == ' ')) syntax_.pop_back();
      } else {
        pass(element);
      }
    }
  }

  // Walks one element. Returns false if the rest of the file is padding.
  bool step() {
    while (!open_.empty() && at_ >= open_.back().end) close();
    const Element element = header();
    if (element.tag == kItem || element.tag == kItemEnd || element.tag == kSequenceEnd) {
      delimiter(element);
      return true;
    }
    const bool outermost = open_.empty();
    if (element.tag == kPixels && outermost) {
      found_.kind = DicomKind::image;
      found_.pixels_as_bytes = element.type == "OB";
    }
    if (outermost && (element.tag == kFloats || element.tag == kDoubles)) {
      refuse_volume(
          path_,
          "the pixels are real numbers (Float Pixel Data), which are not read from DICOM; export the "
          "series as NIfTI, NRRD or MetaImage");
    }
    const bool known =
        implicit_ || is_one_of(kLongTypes, element.type) || is_one_of(kShortTypes, element.type);
    if (!known) {
      if (found_.kind == DicomKind::image && outermost) return false;
      refuse_volume(path_, "there is no DICOM element at byte ", at_, "; ", kDamaged);
    }
    if (element.length == kUndefined) {
      // Pixels of undefined length are packed into fragments, also those of an icon inside a sequence.
      open_.push_back({kNoEnd, implicit_, element.tag == kPixels});
      // The content of an element of type UN and undefined length is implicit (PS3.5, 6.2.2).
      if (element.type == "UN") implicit_ = true;
      return true;
    }
    if (element.length > left()) refuse(element);
    if (element.type == "SQ" || (implicit_ && element.tag != kPixels && begins_with_item(element))) {
      open_.push_back({at_ + element.length, implicit_, false});
      return true;
    }
    if (element.tag == kFrames && outermost && element.length <= 16) {
      read_frames(element);
    } else if (element.tag == kBits && outermost && element.length == 2) {
      check_bits(number(2));
    } else {
      pass(element);
    }
    return true;
  }

  void check_bits(std::uint32_t bits) const {
    if (bits != 1) return;
    refuse_volume(path_,
                  "each voxel is one bit, as in a DICOM segmentation (SEG), which is not read; export the "
                  "segmentation as NIfTI or NRRD");
  }

  void read_frames(const Element& element) {
    std::string text(element.length, '\0');
    file_.read(text.data(), element.length);
    at_ += element.length;
    const long frames = std::strtol(text.c_str(), nullptr, 10);
    if (frames > static_cast<long>(kMostFrames))
      refuse_volume(path_, "the DICOM file says it has ", frames, " frames; ", kDamaged);
    found_.frames = frames < 1 ? 1 : static_cast<std::size_t>(frames);
  }

  // An implicit element has no type. So a sequence is recognised by its first bytes, as in GDCM.
  bool begins_with_item(const Element& element) {
    if (element.length < 8) return false;
    const std::uint64_t start = at_;
    const std::uint32_t group = number(2);
    const bool item = (group << 16U | number(2)) == kItem;
    at_ = start;
    file_.seekg(static_cast<std::streamoff>(at_));
    return item;
  }

  void close() {
    implicit_ = open_.back().implicit_outside;
    open_.pop_back();
  }

  void delimiter(const Element& element) {
    if (element.tag != kItem) {
      if (!open_.empty()) close();
      return;
    }
    const bool fragment = !open_.empty() && open_.back().fragments;
    if (fragment && element.length != kUndefined) {
      pass(element);  // a fragment of packed pixels holds no elements
    } else if (element.length == kUndefined) {
      if (!fragment) open_.push_back({kNoEnd, implicit_, false});
    } else if (element.length > left()) {
      refuse(element);
    }
  }

  static constexpr std::uint64_t kNoEnd = ~std::uint64_t{0};  // end of a sequence of undefined length

  // An open sequence, item or packed pixel element. An item of known length needs no entry, because its
  // sequence has one.
  struct Open {
    std::uint64_t end = kNoEnd;  // (unit: byte) in the file; kNoEnd if a delimiter ends it
    bool implicit_outside = false;
    bool fragments = false;  // holds packed pixels
  };

  std::filesystem::path path_;
  std::ifstream file_;
  std::uint64_t bytes_ = 0, at_ = 0;
  std::string syntax_;
  bool implicit_ = false, big_endian_ = false;
  DicomFile found_;
  std::vector<Open> open_;
};

}  // namespace

DicomFile check_dicom(const std::filesystem::path& path) {
  return Walker(path).walk();
}

}  // namespace voxel
