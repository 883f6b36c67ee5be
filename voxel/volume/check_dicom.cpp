// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/check_dicom.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <string>
#include <vector>

#include "voxel/volume/check_header.h"
#include "voxel/volume/raw_volume.h"

namespace voxel {
namespace {

constexpr std::uint32_t kUndefined = 0xffffffffU;
constexpr std::uint32_t kItem = 0xfffee000U;
constexpr std::uint32_t kItemEnd = 0xfffee00dU;
constexpr std::uint32_t kSequenceEnd = 0xfffee0ddU;
constexpr std::uint32_t kPixels = 0x7fe00010U;
constexpr std::uint32_t kTransferSyntax = 0x00020010U;

// One element's header. DICOM PS3.5, chapter 7.
struct Element {
  std::uint32_t tag = 0;
  std::string type;  // the two letters of its value representation; empty where implicit
  std::uint32_t length = 0;
};

// Walks sequences and items flat: after the header of a sequence or an item, its content follows as elements.
class Walker {
 public:
  explicit Walker(const std::filesystem::path& path) : path_(path), file_(path, std::ios::binary) {
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    bytes_ = error ? 0 : bytes;
  }

  DicomKind walk() {
    std::array<char, 132> preamble{};
    if (!file_.read(preamble.data(), preamble.size()) || std::memcmp(&preamble[128], "DICM", 4) != 0) {
      return DicomKind::none;
    }
    at_ = preamble.size();
    walk_meta();
    implicit_ = syntax_ == "1.2.840.10008.1.2";
    big_endian_ = syntax_ == "1.2.840.10008.1.2.2";
    if (syntax_ == "1.2.840.10008.1.2.1.99") {
      refuse_volume(path_, "the DICOM file is deflated as a whole, which is not read; save it uncompressed");
    }
    while (left() >= 8) {
      if (!step()) break;
    }
    return image_ ? DicomKind::image : DicomKind::without_image;
  }

 private:
  [[nodiscard]] std::uint64_t left() const { return bytes_ > at_ ? bytes_ - at_ : 0; }

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
    constexpr std::array<const char*, 13> kLong{"OB", "OD", "OF", "OL", "OV", "OW", "SQ",
                                                "SV", "UC", "UN", "UR", "UT", "UV"};
    bool is_long = false;
    for (const char* type : kLong) is_long = is_long || element.type == type;
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
    const Element element = header();
    const bool pixels = element.tag == kPixels && open_.empty();
    image_ = image_ || pixels;
    if (element.tag == kItem || element.tag == kItemEnd || element.tag == kSequenceEnd) {
      delimiter(element);
      return true;
    }
    const bool known = implicit_ || (element.type[0] >= 'A' && element.type[0] <= 'Z' &&
                                     element.type[1] >= 'A' && element.type[1] <= 'Z');
    if (!known) {
      if (image_ && open_.empty()) return false;
      refuse_volume(path_, "there is no DICOM element at byte ", at_, "; ", kDamaged);
    }
    if (element.length == kUndefined) {
      // The content of an element of type UN and undefined length is implicit (PS3.5, 6.2.2).
      open_.push_back({implicit_, pixels});
      if (element.type == "UN") implicit_ = true;
      return true;
    }
    if (element.length > left()) refuse(element);
    if (element.type == "SQ" || (implicit_ && begins_with_item(element))) return true;
    pass(element);
    return true;
  }

  // An implicit element has no type. As GDCM does, a sequence is recognised by its first bytes.
  bool begins_with_item(const Element& element) {
    if (element.length < 8) return false;
    const std::uint64_t start = at_;
    const std::uint32_t group = number(2);
    const bool item = (group << 16U | number(2)) == kItem;
    at_ = start;
    file_.seekg(static_cast<std::streamoff>(at_));
    return item;
  }

  void delimiter(const Element& element) {
    if (element.tag != kItem) {
      if (!open_.empty()) {
        implicit_ = open_.back().implicit_outside;
        open_.pop_back();
      }
      return;
    }
    const bool fragment = !open_.empty() && open_.back().pixels;
    if (element.length == kUndefined && !fragment) {
      open_.push_back({implicit_, false});
    } else if (fragment) {
      pass(element);  // a fragment of packed pixels holds no elements
    } else if (element.length > left()) {
      refuse(element);
    }
  }

  // A sequence or item of undefined length; a delimiter ends it.
  struct Open {
    bool implicit_outside = false;
    bool pixels = false;
  };

  std::filesystem::path path_;
  std::ifstream file_;
  std::uint64_t bytes_ = 0, at_ = 0;
  std::string syntax_;
  bool implicit_ = false, big_endian_ = false, image_ = false;
  std::vector<Open> open_;
};

}  // namespace

DicomKind check_dicom(const std::filesystem::path& path) {
  return Walker(path).walk();
}

}  // namespace voxel
