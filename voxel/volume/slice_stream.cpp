// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/slice_stream.h"

#include <zlib.h>

#include <algorithm>
#include <array>

namespace voxel {

// Inflates zlib or gzip, recognised by the header. Concatenated streams count as one, as in gzip.
class VoxelStream::Inflater {
 public:
  Inflater() { ready_ = inflateInit2(&stream_, 15 + 32) == Z_OK; }
  ~Inflater() {
    if (ready_) inflateEnd(&stream_);
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  // Fills the front of `out` from `file`. Returns the byte count; 0 at the end of the file or if it is
  // damaged.
  std::size_t read(std::ifstream& file, std::span<std::byte> out) {
    stream_.next_out = reinterpret_cast<unsigned char*>(out.data());
    stream_.avail_out = static_cast<uInt>(std::min(out.size(), std::size_t{1} << 30U));
    const uInt asked = stream_.avail_out;
    while (ready_ && !failed_ && stream_.avail_out == asked) {
      if (stream_.avail_in == 0) {
        file.read(reinterpret_cast<char*>(in_.data()), static_cast<std::streamsize>(in_.size()));
        stream_.next_in = in_.data();
        stream_.avail_in = static_cast<uInt>(file.gcount());
        if (stream_.avail_in == 0) break;
      }
      if (ended_) {
        ended_ = false;
        failed_ = inflateReset(&stream_) != Z_OK;
        if (failed_) break;
      }
      const int status = inflate(&stream_, Z_NO_FLUSH);
      ended_ = status == Z_STREAM_END;
      failed_ = status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR;
    }
    return asked - stream_.avail_out;
  }
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] bool failed() const { return failed_ || !ready_; }

 private:
  z_stream stream_{};
  std::vector<unsigned char> in_ = std::vector<unsigned char>(std::size_t{1} << 16U);
  bool ready_ = false, failed_ = false, ended_ = false;
};

VoxelStream::VoxelStream(std::filesystem::path path, const VoxelPlace& place, const VolumeHeader& header)
    : path_(std::move(path)),
      place_(place),
      needed_(bytes_in_file(place, header)),
      file_(place.file, std::ios::binary) {
  file_.seekg(static_cast<std::streamoff>(place.offset));
  if (place.packing != VoxelPlace::Packing::deflate) return;
  inflater_ = std::make_unique<Inflater>();
  skip(place.skipped);
}

VoxelStream::~VoxelStream() = default;

void VoxelStream::refuse(const char* what) const {
  refuse_volume(path_, inflater_ ? "the packed voxels in '" : "the voxels in '", place_.file.string(), "' ",
                what, " ", read_, " of ", needed_, " bytes; ", kDamaged);
}

void VoxelStream::fill(std::span<std::byte> out) {
  while (!out.empty()) {
    std::size_t got = 0;
    if (inflater_) {
      got = inflater_->read(file_, out);
      if (inflater_->failed()) refuse("are damaged after");
    } else {
      file_.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()));
      got = static_cast<std::size_t>(file_.gcount());
    }
    if (got == 0) refuse("end after");
    read_ += got;
    out = out.subspan(got);
  }
}

void VoxelStream::skip(std::uint64_t bytes) {
  std::array<std::byte, 4096> ignored{};
  while (bytes > 0) {
    const std::size_t part = std::min<std::uint64_t>(bytes, ignored.size());
    fill({ignored.data(), part});
    bytes -= part;
  }
  read_ = 0;
}

std::span<const std::byte> VoxelStream::next(std::size_t count, std::size_t component_bytes) {
  slice_.resize(count);
  fill(slice_);
  if (place_.swapped && component_bytes > 1) {
    for (std::size_t n = 0; n + component_bytes <= count; n += component_bytes) {
      const auto begin = slice_.begin() + static_cast<std::ptrdiff_t>(n);
      std::reverse(begin, begin + static_cast<std::ptrdiff_t>(component_bytes));
    }
  }
  return slice_;
}

void VoxelStream::finish() {
  if (!inflater_) return;
  std::array<std::byte, 4096> more{};
  // A file may continue behind the voxels. Read only to the end of the stream that holds the last voxel.
  while (!inflater_->ended() && !inflater_->failed() && inflater_->read(file_, more) > 0) continue;
  if (inflater_->failed()) refuse("are damaged after");
  if (!inflater_->ended()) refuse("end after");
}

}  // namespace voxel
