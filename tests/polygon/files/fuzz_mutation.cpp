// SPDX-License-Identifier: GPL-3.0-or-later
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

#include "tests/polygon/files/fuzz_seeds.h"

namespace tests {
namespace {

constexpr std::size_t kMaxInput = 48U << 10U;

class Mutator {
 public:
  explicit Mutator(std::mt19937_64& random) : random_(random) {}

  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>(random_() % std::max<std::size_t>(n, 1));
  }

  void one_change(std::string& bytes, const std::string& other) {
    if (bytes.empty()) return;
    // Half of the changes go to the first 200 bytes, where the headers are.
    const std::size_t at = below(below(2) == 0 ? std::min<std::size_t>(200, bytes.size()) : bytes.size());
    switch (below(16)) {
      case 0:
        bytes.resize(at);
        break;
      case 1:
        bytes[at] = static_cast<char>(random_());
        break;
      case 2:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random_() % 8)));
        break;
      case 3:
        bytes.erase(at, 1 + below(8));
        break;
      case 4:
        bytes.insert(at, std::string(1 + below(3), "0123456789-. \n/\\e\xff"[below(18)]));
        break;
      case 5:
        bytes.insert(at, bytes.substr(below(bytes.size()), below(60)));
        break;
      case 6:
        bytes.insert(at, other.substr(below(other.size()), below(200)));
        break;
      case 7:  // append the end of another file
        bytes.replace(at, std::string::npos, other.substr(std::min(at, other.size())));
        break;
      case 8:
      case 9:
        word(bytes, at);
        break;
      case 10:
      case 11:
        line(bytes);
        break;
      default:
        token(bytes, other);
    }
  }

 private:
  // Writes special binary values at positions of values.
  void word(std::string& bytes, std::size_t at) {
    static constexpr std::array<std::uint32_t, 12> kWords{0,           1,           3,           0x7fffffffU,
                                                          0x80000000U, 0xffffffffU, 0x7fc00000U, 0x7f800000U,
                                                          0xff800000U, 0x00000001U, 0x5368d4a5U, 0x7f7fffffU};
    if (bytes.size() < 16) return;
    at = std::min(at, bytes.size() - 12);
    if (below(2) == 0) {
      const std::uint32_t value = kWords[below(kWords.size())];
      std::memcpy(bytes.data() + at, &value, 4);
    } else {  // copies 1 to 12 bytes over others: a byte, a number or three numbers
      static constexpr std::array<std::size_t, 4> kLengths{1, 4, 8, 12};
      const std::size_t length = kLengths[below(4)];
      const std::string copy = bytes.substr(below(bytes.size() - length), length);
      bytes.replace(at, length, copy);
    }
  }

  // Removes, repeats or moves a line, which is a vertex or a face. The file stays well-formed.
  void line(std::string& bytes) {
    const auto around = [&](std::size_t at) {
      const std::size_t before = bytes.rfind('\n', at == 0 ? 0 : at - 1);
      const std::size_t begin = before == std::string::npos ? 0 : before + 1;
      const std::size_t end = bytes.find('\n', at);
      return std::pair(std::min(begin, at), end == std::string::npos ? bytes.size() : end + 1);
    };
    const auto [begin, end] = around(below(bytes.size()));
    const std::string text = bytes.substr(begin, end - begin);
    switch (below(3)) {
      case 0:
        bytes.erase(begin, end - begin);
        break;
      case 1:
        bytes.insert(begin, text);
        break;
      default: {
        const auto [begin2, end2] = around(below(bytes.size()));
        bytes.replace(begin2, end2 - begin2, text);
      }
    }
  }

  // Replaces one number or word by another.
  void token(std::string& bytes, const std::string& other) {
    static constexpr std::array<std::string_view, 24> kTokens{
        "nan", "-inf",  "1e308",      "-1e12",      "1e13",       "1e-320",     "0",
        "-0",  "-1",    "1",          "2",          "3",          "4",          "7",
        "255", "65536", "2147483647", "2147483648", "4294967295", "4294967296", "99999999999999999999",
        "1e",  "0x10",  "f"};
    const auto around = [](const std::string& text, std::size_t at) {
      constexpr const char* kSpaces = " \n\t\r";
      const std::size_t begin = text.find_first_not_of(kSpaces, at);
      if (begin == std::string::npos) return std::pair(text.size(), text.size());
      const std::size_t end = text.find_first_of(kSpaces, begin);
      return std::pair(begin, end == std::string::npos ? text.size() : end);
    };
    const auto [begin, end] = around(bytes, below(bytes.size()));
    std::string text;
    switch (below(4)) {
      case 0:
        text = kTokens[below(kTokens.size())];
        break;
      case 1: {
        const auto [from, to] = around(other, below(other.size()));
        text = other.substr(from, to - from);
        break;
      }
      case 2: {
        const auto [from, to] = around(bytes, below(bytes.size()));
        text = bytes.substr(from, to - from);
        break;
      }
      default: {  // a crack: changes the last digits
        text = bytes.substr(begin, end - begin);
        if (!text.empty() && text.back() >= '0' && text.back() <= '9')
          text.back() = static_cast<char>('0' + below(10));
      }
    }
    bytes.replace(begin, std::min<std::size_t>(end - begin, 4096), text);
  }

  std::mt19937_64& random_;
};

}  // namespace

FuzzInput mutated(FuzzInput input, const FuzzInput& other, std::mt19937_64& random) {
  Mutator mutator(random);
  const std::size_t changes = 1 + mutator.below(mutator.below(4) == 0 ? 16 : 4);
  for (std::size_t i = 0; i < changes; ++i) mutator.one_change(input.bytes, other.bytes);
  if (input.bytes.size() > kMaxInput) input.bytes.resize(kMaxInput);
  if (input.bytes.empty()) input.bytes = "\n";
  return input;
}

std::string packed_bytes(const std::string& bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, 1, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) return {};
  std::string packed(deflateBound(&stream, static_cast<uLong>(bytes.size())) + 64, '\0');
  std::string copy = bytes;  // zlib's input is not const
  stream.next_in = reinterpret_cast<Bytef*>(copy.data());
  stream.avail_in = static_cast<uInt>(copy.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

}  // namespace tests
