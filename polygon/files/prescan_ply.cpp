// SPDX-License-Identifier: GPL-3.0-or-later
// Prescan of PLY: text, or binary in either byte order, with any scalar types and any further elements and
// lists.
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <type_traits>

#include "polygon/files/prescan.h"

namespace polygon {
namespace {

enum class Encoding : std::uint8_t { text, little, big };
enum class Scalar : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct Property {
  std::string name;
  Scalar value = Scalar::float32;
  bool is_list = false;
  Scalar count = Scalar::uint8;  // type of a list's length
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::text;
  std::vector<Element> elements;
};

std::size_t size_of(Scalar type) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};  // bytes, in the order of Scalar
  return kSizes.at(static_cast<std::size_t>(type));
}

bool parse_scalar(std::string_view word, Scalar& type) {
  struct Name {
    std::string_view name;
    Scalar type;
  };
  static constexpr std::array<Name, 16> kNames{{{"char", Scalar::int8},
                                                {"int8", Scalar::int8},
                                                {"uchar", Scalar::uint8},
                                                {"uint8", Scalar::uint8},
                                                {"short", Scalar::int16},
                                                {"int16", Scalar::int16},
                                                {"ushort", Scalar::uint16},
                                                {"uint16", Scalar::uint16},
                                                {"int", Scalar::int32},
                                                {"int32", Scalar::int32},
                                                {"uint", Scalar::uint32},
                                                {"uint32", Scalar::uint32},
                                                {"float", Scalar::float32},
                                                {"float32", Scalar::float32},
                                                {"double", Scalar::float64},
                                                {"float64", Scalar::float64}}};
  const auto* found =
      std::find_if(kNames.begin(), kNames.end(), [&](const Name& n) { return n.name == word; });
  if (found == kNames.end()) return false;
  type = found->type;
  return true;
}

bool is_integer(Scalar type) {
  return type != Scalar::float32 && type != Scalar::float64;
}

// Offset at which the body begins, or the size of the file if there is no 'end_header'. If the header's lines
// end with '\r' alone, a '\n' after the last '\r' belongs to the body.
std::size_t header_end(std::string_view bytes) {
  constexpr std::string_view kLast = "end_header";
  const std::size_t last = bytes.find(kLast);
  if (last == std::string_view::npos) return bytes.size();
  const std::size_t end = bytes.find_first_of("\r\n", last);
  if (end == std::string_view::npos) return bytes.size();
  if (bytes[end] == '\n') return end + 1;
  const bool returns = !bytes.substr(bytes.find('\r')).starts_with("\r\n");
  return end + (!returns && bytes.substr(end).starts_with("\r\n") ? 2 : 1);
}

// Reads the header and moves `text` past it.
Header read_header(const std::filesystem::path& file, TextCursor& text) {
  Header header;
  std::string_view line = text.next_line();
  if (take_word(line) != "ply") refuse_mesh(file, "does not begin with 'ply'; is it another kind of file?");
  bool has_format = false;
  for (;;) {
    if (text.at_end())
      refuse_mesh(file, "the PLY header has no 'end_header'; it is cut short: copy it again");
    const std::string place = "line " + std::to_string(text.line()) + ": ";
    line = text.next_line();
    const std::string_view keyword = take_word(line);
    if (keyword == "end_header") break;
    if (keyword == "format") {
      const std::string_view format = take_word(line);
      has_format = true;
      if (format == "ascii") {
        header.encoding = Encoding::text;
      } else if (format == "binary_little_endian") {
        header.encoding = Encoding::little;
      } else if (format == "binary_big_endian") {
        header.encoding = Encoding::big;
      } else {
        refuse_mesh(file,
                    place + "unknown PLY format; it must be ascii or binary_little_endian or _big_endian");
      }
    } else if (keyword == "element") {
      Element element;
      element.name = take_word(line);
      std::int64_t count = 0;
      if (!parse_integer(take_word(line), count) || count < 0) {
        refuse_mesh(file, place + "an element needs a name and a count; export the mesh again");
      }
      element.count = static_cast<std::uint64_t>(count);
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      Property property;
      std::string_view type = take_word(line);
      bool good = !header.elements.empty();
      if (type == "list") {
        property.is_list = true;
        good = parse_scalar(take_word(line), property.count) && is_integer(property.count) && good;
        type = take_word(line);
      }
      good = parse_scalar(type, property.value) && good;
      property.name = take_word(line);
      if (!good || property.name.empty()) {
        refuse_mesh(file, place +
                              "a property needs a known type and a name, and an element before it; "
                              "export the mesh again");
      }
      header.elements.back().properties.push_back(std::move(property));
    }
    // comment, obj_info and other lines are ignored
  }
  if (!has_format) refuse_mesh(file, "the PLY header has no 'format' line; export the mesh again");
  return header;
}

// Reads the values of the body in sequence, never past its end.
class Body {
 public:
  Body(const std::filesystem::path& file, Encoding encoding, std::string_view bytes, std::size_t line)
      : file_(file), encoding_(encoding), bytes_(bytes), size_(bytes.size()), text_(bytes, line) {}

  [[nodiscard]] std::size_t remaining() const {
    return encoding_ == Encoding::text ? text_.remaining() : bytes_.size();
  }
  // Fewest bytes that a value takes.
  [[nodiscard]] std::size_t least_bytes(Scalar type) const {
    return encoding_ == Encoding::text ? 2 : size_of(type);
  }
  [[nodiscard]] std::string place() const {
    return encoding_ == Encoding::text ? "line " + std::to_string(text_.line())
                                       : "byte " + std::to_string(size_ - bytes_.size()) + " of the body";
  }

  double number(Scalar type) {
    if (encoding_ == Encoding::text) {
      double value = 0.0;
      const std::string_view word = text_.next_word();
      if (!parse_number(word, value)) refuse_word(word);
      return value;
    }
    switch (type) {
      case Scalar::int8:
        return take<std::int8_t>();
      case Scalar::uint8:
        return take<std::uint8_t>();
      case Scalar::int16:
        return take<std::int16_t>();
      case Scalar::uint16:
        return take<std::uint16_t>();
      case Scalar::int32:
        return take<std::int32_t>();
      case Scalar::uint32:
        return take<std::uint32_t>();
      case Scalar::float32:
        return static_cast<double>(std::bit_cast<float>(take<std::uint32_t>()));
      case Scalar::float64:
        break;
    }
    return std::bit_cast<double>(take<std::uint64_t>());
  }

  std::int64_t integer(Scalar type) {
    const double value = number(type);
    // Every 32-bit integer is exact in a double. A text may hold any number here, so the range is checked.
    if (!(value >= -9e15 && value <= 9e15)) return -1;
    return static_cast<std::int64_t>(value);
  }

  void skip(const Property& property) {
    std::int64_t values = 1;
    if (property.is_list) values = list_length(property);
    if (encoding_ == Encoding::text) {
      for (std::int64_t i = 0; i < values; ++i) number(property.value);
    } else {
      need(static_cast<std::size_t>(values) * size_of(property.value));
      bytes_.remove_prefix(static_cast<std::size_t>(values) * size_of(property.value));
    }
  }

  // The length is checked against the rest of the file before it is used.
  std::int64_t list_length(const Property& property) {
    const std::int64_t length = integer(property.count);
    if (length < 0 || static_cast<std::uint64_t>(length) > remaining() / least_bytes(property.value) + 1) {
      refuse_mesh(file_,
                  place() + ": a list announces " + std::to_string(length) +
                      " values, which the file does not hold; it is cut short or damaged: copy or export it "
                      "again");
    }
    return length;
  }

 private:
  [[noreturn]] void refuse_word(std::string_view word) const {
    if (word.empty()) cut_short();
    refuse_mesh(file_, place() + ": a number was expected; export the mesh again");
  }
  [[noreturn]] void cut_short() const {
    refuse_mesh(file_,
                "ends before its elements do (" + place() + "); it is cut short: copy or export it again");
  }
  void need(std::size_t bytes) const {
    if (bytes > bytes_.size()) cut_short();
  }
  template <typename Integer>
  Integer take() {
    need(sizeof(Integer));
    std::make_unsigned_t<Integer> value = 0;
    std::memcpy(&value, bytes_.data(), sizeof(Integer));
    bytes_.remove_prefix(sizeof(Integer));
    if (encoding_ == Encoding::big) {
      auto raw = std::bit_cast<std::array<unsigned char, sizeof(Integer)>>(value);
      std::reverse(raw.begin(), raw.end());
      value = std::bit_cast<std::make_unsigned_t<Integer>>(raw);
    }
    return static_cast<Integer>(value);
  }

  const std::filesystem::path& file_;
  Encoding encoding_;
  std::string_view bytes_;
  std::size_t size_;
  TextCursor text_;
};

void read_vertices(const Element& element, Body& body, std::vector<glm::dvec3>& coordinates) {
  // [property] its coordinate, 0 to 2; -1 if it is none.
  std::vector<int> axis(element.properties.size(), -1);
  for (std::size_t p = 0; p < axis.size(); ++p) {
    const Property& property = element.properties[p];
    if (!property.is_list && property.name.size() == 1 && property.name[0] >= 'x' &&
        property.name[0] <= 'z') {
      axis[p] = property.name[0] - 'x';
    }
  }
  coordinates.reserve(element.count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    glm::dvec3 v(0.0);
    for (std::size_t p = 0; p < axis.size(); ++p) {
      if (axis[p] < 0) {
        body.skip(element.properties[p]);
      } else {
        v[axis[p]] = body.number(element.properties[p].value);
      }
    }
    coordinates.push_back(v);
  }
}

bool holds_corners(const Property& property) {
  return property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

void read_faces(const Element& element, Body& body, std::string& faces, PrescannedFile& prescanned) {
  // Reserves room for triangles, the usual case. The count has been checked, but in a text file it may still
  // be far too large. So at most twice the rest of the file is reserved.
  constexpr std::size_t kTriangle = 4 * sizeof(std::int32_t);
  faces.reserve(std::min(element.count * kTriangle, 2 * body.remaining()));
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      if (!holds_corners(property)) {
        body.skip(property);
        continue;
      }
      const std::int64_t corners = body.list_length(property);
      if (corners < 3) {
        if (prescanned.short_faces++ == 0) prescanned.first_short_face = "face " + std::to_string(i);
        for (std::int64_t c = 0; c < corners; ++c) body.integer(property.value);
        continue;
      }
      append_raw(faces, static_cast<std::int32_t>(corners));
      for (std::int64_t c = 0; c < corners; ++c) {
        const std::int64_t index = body.integer(property.value);
        const bool fits = index >= 0 && index < std::numeric_limits<std::int32_t>::max();
        append_raw(faces, static_cast<std::int32_t>(fits ? index : -1));
      }
      ++prescanned.faces;
    }
  }
}

void check_element(const std::filesystem::path& file, const Element& element, const Body& body) {
  std::size_t least = 0;
  for (const Property& p : element.properties) least += body.least_bytes(p.is_list ? p.count : p.value);
  if (least > 0 && element.count > body.remaining() / least + 1) {
    refuse_mesh(file, "announces " + std::to_string(element.count) + " of '" + element.name + "' (at least " +
                          std::to_string(least) + " bytes each), but only " +
                          std::to_string(body.remaining()) +
                          " bytes are left; it is cut short or damaged: copy or export it again");
  }
  const auto has = [&](auto&& wanted) {
    return std::count_if(element.properties.begin(), element.properties.end(), wanted) == 1;
  };
  if (element.name == "vertex") {
    for (const std::string_view axis : {"x", "y", "z"}) {
      if (!has([&](const Property& p) { return p.name == axis && !p.is_list; })) {
        refuse_mesh(file, "its vertices have no property '" + std::string(axis) +
                              "' (or two); export the mesh again");
      }
    }
    if (element.count >= std::numeric_limits<std::int32_t>::max()) {
      refuse_mesh(file, "has more than 2^31 - 1 vertices; split it");
    }
  }
  if (element.name == "face" && element.count > 0 && !has(holds_corners)) {
    refuse_mesh(
        file,
        "its faces have no list 'vertex_indices' (or two); export it as a mesh, not as points or strips");
  }
}

}  // namespace

PrescannedFile prescan_ply(const std::filesystem::path& file, std::span<char> bytes) {
  const std::size_t header_bytes = header_end(std::string_view(bytes.data(), bytes.size()));
  const std::string_view head = plain_text(file, bytes.first(header_bytes));
  const std::size_t mark = header_bytes - head.size();
  TextCursor text(std::string_view(bytes.data(), bytes.size()).substr(mark));
  const Header header = read_header(file, text);
  const std::span<char> rest = bytes.last(text.remaining());
  if (header.encoding == Encoding::text) mend_line_ends(rest);
  Body body(file, header.encoding, std::string_view(rest.data(), rest.size()), text.line());
  for (const std::string_view once : {"vertex", "face"}) {
    const auto n = std::count_if(header.elements.begin(), header.elements.end(),
                                 [&](const Element& e) { return e.name == once; });
    if (n != 1) {
      refuse_mesh(file, "has " + std::to_string(n) + " elements called '" + std::string(once) +
                            "' where one is needed; export it as a mesh, not as points or strips");
    }
  }

  PrescannedFile prescanned;
  std::string faces;
  for (const Element& element : header.elements) {
    check_element(file, element, body);
    if (element.name == "vertex") {
      read_vertices(element, body, prescanned.coordinates);
    } else if (element.name == "face") {
      read_faces(element, body, faces, prescanned);
    } else if (!element.properties.empty()) {
      for (std::uint64_t i = 0; i < element.count; ++i) {
        for (const Property& property : element.properties) body.skip(property);
      }
    }
  }
  if (header.encoding != Encoding::text) prescanned.trailing_bytes = body.remaining();

  write_ply_dialect(prescanned, faces);
  return prescanned;
}

}  // namespace polygon
