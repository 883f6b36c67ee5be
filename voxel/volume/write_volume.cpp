// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/write_volume.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <iomanip>
#include <locale>
#include <memory>
#include <sstream>

#include "voxel/volume/check_header.h"
#include "voxel/volume/length_unit.h"
#include "voxel/volume/raw_volume.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRemedy = "check the folder's permissions and free space";

enum class Packing { raw, gzip, zlib };

// Writes a file completely or not at all. keep() moves it to the path, or to the target if the path is a
// symbolic link. Until then, if the file system allows it, the file has no name and vanishes with the
// process.
class TemporaryFile {
 public:
  explicit TemporaryFile(fs::path path)
      : path_(std::move(path)),
        target_(behind_links(path_)),
        part_(target_.string() + ".part" + std::to_string(getpid())) {
    std::error_code error;
    const fs::file_status status = fs::status(target_, error);
    beside_ = !fs::exists(status) || fs::is_regular_file(status);  // a device is written directly
    // A rename would replace an empty folder by the file.
    if (!fs::is_directory(status)) open();
    if (!out_.is_open()) refuse_volume(path_, "the file cannot be written; ", kRemedy);
  }
  ~TemporaryFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    std::error_code ignored;
    if (beside_ && !kept_) fs::remove(part_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(const void* bytes, std::size_t count) {
    if (!out_.write(static_cast<const char*>(bytes), static_cast<std::streamsize>(count))) refuse();
    written_ += count;
  }
  void write(const std::string& text) { write(text.data(), text.size()); }
  void rewrite(std::uint64_t at, const std::string& text) {
    out_.seekp(static_cast<std::streamoff>(at));
    write(text);
  }
  [[nodiscard]] std::uint64_t written() const { return written_; }

  void keep() {
    out_.close();
    if (!out_) refuse();
    if (beside_ && !put_in_place()) refuse();
    kept_ = true;
  }

 private:
  static fs::path behind_links(fs::path path) {
    constexpr int kMostLinks = 40;  // as in the operating system
    std::error_code error;
    for (int n = 0; n < kMostLinks && fs::is_symlink(fs::symlink_status(path, error)); ++n) {
      const fs::path to = fs::read_symlink(path, error);
      path = to.is_absolute() ? to : path.parent_path() / to;
    }
    return path;
  }

  [[nodiscard]] std::string open_file() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

  void open() {
    constexpr mode_t kMode = 0666;  // less the umask
    const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
    if (beside_ && ::access("/proc/self/fd", X_OK) == 0)
      descriptor_ = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, kMode);
    unnamed_ = descriptor_ >= 0;
    if (beside_ && !unnamed_)
      descriptor_ = ::open(part_.c_str(), O_CREAT | O_RDWR | O_TRUNC | O_CLOEXEC, kMode);
    if (beside_ && descriptor_ < 0) return;
    out_.open(beside_ ? open_file() : target_.string(), std::ios::binary);
  }

  bool put_in_place() {
    if (::fsync(descriptor_) != 0) return false;
    std::error_code error;
    if (unnamed_) {
      fs::remove(part_, error);  // left by a killed process that had the same number
      if (::linkat(AT_FDCWD, open_file().c_str(), AT_FDCWD, part_.c_str(), AT_SYMLINK_FOLLOW) != 0)
        return false;
    }
    return ::rename(part_.c_str(), target_.c_str()) == 0;
  }

  [[noreturn]] void refuse() const {
    refuse_volume(path_, "the volume was not written (", std::strerror(errno), "); ", kRemedy);
  }

  fs::path path_, target_, part_;
  std::ofstream out_;
  int descriptor_ = -1;
  std::uint64_t written_ = 0;
  bool beside_ = true, unnamed_ = false, kept_ = false;
};

class Packer {
 public:
  Packer(TemporaryFile& file, Packing packing) : file_(file), packing_(packing) {
    if (packing == Packing::raw) return;
    // Level 1 is fast, and enough for labels and fields that are mostly zero.
    if (deflateInit2(&stream_, 1, Z_DEFLATED, packing == Packing::gzip ? 15 + 16 : 15, 9,
                     Z_DEFAULT_STRATEGY) != Z_OK)
      throw std::bad_alloc();
  }
  ~Packer() {
    if (packing_ != Packing::raw) deflateEnd(&stream_);
  }
  Packer(const Packer&) = delete;
  Packer& operator=(const Packer&) = delete;

  void write(const void* bytes, std::size_t count) {
    if (packing_ == Packing::raw) {
      file_.write(bytes, count);
      return;
    }
    constexpr std::size_t kMost = std::size_t{1} << 30U;  // zlib counts in 32 bits
    const auto* from = static_cast<const unsigned char*>(bytes);
    while (count > 0) {
      const std::size_t part = std::min(count, kMost);
      pack(from, part, Z_NO_FLUSH);
      from += part;
      count -= part;
    }
  }
  void finish() {
    if (packing_ != Packing::raw) pack(nullptr, 0, Z_FINISH);
  }

 private:
  void pack(const unsigned char* bytes, std::size_t count, int flush) {
    stream_.next_in = const_cast<unsigned char*>(bytes);  // zlib's interface; it only reads
    stream_.avail_in = static_cast<uInt>(count);
    do {
      stream_.next_out = out_.data();
      stream_.avail_out = static_cast<uInt>(out_.size());
      deflate(&stream_, flush);
      file_.write(out_.data(), out_.size() - stream_.avail_out);
    } while (stream_.avail_out == 0);
  }

  TemporaryFile& file_;
  Packing packing_;
  z_stream stream_{};
  std::vector<unsigned char> out_ = std::vector<unsigned char>(std::size_t{1} << 16U);
};

// Frame and kind of a volume to be saved, common to the three formats. Lengths are in the file's unit.
struct Saved {
  fs::path path;
  VolumeFrame frame;
  bool vectors = false;
  double unit_m = 1e-3;
  glm::dvec3 spacing{1.0}, origin{0.0};
  glm::dmat3 direction{1.0};

  [[nodiscard]] bool ends_with(const char* end) const {
    const std::string name = path.string(), tail = end;
    return name.size() >= tail.size() && name.compare(name.size() - tail.size(), tail.size(), tail) == 0;
  }
};

Saved check_path(const fs::path& path, const VolumeFrame& frame, bool vectors, double unit_m) {
  const VolumeFormat format = format_of(path);
  if (!(std::isfinite(unit_m) && unit_m > 0.0)) {
    refuse_volume(path, "the file's length unit is given as ", unit_m,
                  " m; it must be above 0 (1e-3 for mm)");
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int n = frame.dims[axis];
    if (n < 1) refuse_volume(path, "a volume of ", n, " voxels along axis ", axis + 1, " cannot be saved");
    if (format == VolumeFormat::nifti && n > 32767) {
      refuse_volume(path, "NIfTI cannot hold ", n,
                    " voxels along an axis (at most 32,767); save it as .nrrd");
    }
  }
  std::error_code error;
  if (!path.parent_path().empty() && !fs::is_directory(path.parent_path(), error)) {
    refuse_volume(path, "there is no folder '", path.parent_path().string(), "'; make it first");
  }
  return {path,
          frame,
          vectors,
          unit_m,
          frame.spacing_m / unit_m,
          frame.origin_m / unit_m,
          glm::mat3_cast(glm::normalize(frame.rotation))};
}

// ---- headers

// NIfTI's code for a length unit; 0 if NIfTI has none.
char nifti_unit(double unit_m) {
  const std::string unit = unit_in_words(unit_m);
  return static_cast<char>(unit == "m" ? 1 : unit == "mm" ? 2 : unit == "um" ? 3 : 0);
}

// NIfTI-1 (nifti1.h of the NIfTI working group), in its RAS frame: x and y of LPS change sign.
std::string nifti_header(const Saved& s) {
  std::string header(352, '\0');
  const auto put = [&header](std::size_t at, auto value) { std::memcpy(&header[at], &value, sizeof(value)); };
  put(0, std::int32_t{348});
  const std::array<std::int16_t, 8> dims{std::int16_t{static_cast<std::int16_t>(s.vectors ? 5 : 3)},
                                         static_cast<std::int16_t>(s.frame.dims[0]),
                                         static_cast<std::int16_t>(s.frame.dims[1]),
                                         static_cast<std::int16_t>(s.frame.dims[2]),
                                         1,
                                         std::int16_t{static_cast<std::int16_t>(s.vectors ? 3 : 1)},
                                         1,
                                         1};
  put(40, dims);
  constexpr std::int16_t kVectors = 1007, kLabels = 1002;  // NIFTI_INTENT_VECTOR, _LABEL
  put(68, s.vectors ? kVectors : kLabels);
  put(70, static_cast<std::int16_t>(s.vectors ? 16 : 2));  // float32, uint8
  put(72, static_cast<std::int16_t>(s.vectors ? 32 : 8));
  put(76, std::array<float, 8>{1.0F, static_cast<float>(s.spacing.x), static_cast<float>(s.spacing.y),
                               static_cast<float>(s.spacing.z), 1.0F, 1.0F, 1.0F, 1.0F});
  put(108, 352.0F);
  put(112, 1.0F);
  put(123, nifti_unit(s.unit_m));
  put(252, std::int16_t{1});  // qform and sform: scanner coordinates
  put(254, std::int16_t{1});
  glm::dquat q = glm::dquat(0.0, 0.0, 0.0, 1.0) * glm::normalize(s.frame.rotation);  // half a turn about z
  if (q.w < 0.0) q = -q;
  put(256, std::array<float, 3>{static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)});
  const glm::dvec3 turned(-1.0, -1.0, 1.0);
  const glm::dvec3 origin = s.origin * turned;
  put(268, std::array<float, 3>{static_cast<float>(origin.x), static_cast<float>(origin.y),
                                static_cast<float>(origin.z)});
  for (int row = 0; row < 3; ++row) {
    std::array<float, 4> affine{};
    for (int axis = 0; axis < 3; ++axis) {
      affine[static_cast<std::size_t>(axis)] =
          static_cast<float>(s.direction[axis][row] * s.spacing[axis] * turned[row]);
    }
    affine[3] = static_cast<float>(origin[row]);
    put(280 + 16 * static_cast<std::size_t>(row), affine);
  }
  std::memcpy(&header[344], "n+1", 4);
  return header;
}

std::string nrrd_header(const Saved& s, const std::string& data_file) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << std::setprecision(17) << "NRRD0005\n"
      << "type: " << (s.vectors ? "float" : "uint8") << "\ndimension: " << (s.vectors ? 4 : 3)
      << "\nspace: left-posterior-superior\nsizes: " << (s.vectors ? "3 " : "") << s.frame.dims[0] << ' '
      << s.frame.dims[1] << ' ' << s.frame.dims[2] << "\nspace directions:" << (s.vectors ? " none" : "");
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 way = s.direction[axis] * s.spacing[axis];
    out << " (" << way.x << ',' << way.y << ',' << way.z << ')';
  }
  out << "\nkinds:" << (s.vectors ? " vector" : "") << " domain domain domain\n";
  if (s.vectors) out << "endian: little\n";
  // Readers take the millimeter where no unit is stated.
  const std::string unit = unit_in_words(s.unit_m);
  if (unit != "mm" && length_unit_m(unit))
    out << "space units: \"" << unit << "\" \"" << unit << "\" \"" << unit << "\"\n";
  out << "encoding: gzip\nspace origin: (" << s.origin.x << ',' << s.origin.y << ',' << s.origin.z << ")\n";
  if (!data_file.empty()) out << "data file: " << data_file << '\n';
  if (data_file.empty()) out << '\n';
  return out.str();
}

constexpr int kSizeDigits = 20;  // digits that are reserved for the size of the data (bytes)

std::string meta_header(const Saved& s, const std::string& data_file) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << std::setprecision(17)
      << "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
         "True\nCompressedDataSize = "
      << std::string(kSizeDigits, '0') << "\nTransformMatrix =";
  for (int axis = 0; axis < 3; ++axis) {
    for (int row = 0; row < 3; ++row) out << ' ' << s.direction[axis][row];
  }
  out << "\nOffset = " << s.origin.x << ' ' << s.origin.y << ' ' << s.origin.z
      << "\nCenterOfRotation = 0 0 0\nElementSpacing = " << s.spacing.x << ' ' << s.spacing.y << ' '
      << s.spacing.z << "\nDimSize = " << s.frame.dims[0] << ' ' << s.frame.dims[1] << ' ' << s.frame.dims[2];
  const std::string unit = unit_in_words(s.unit_m);
  if (unit == "um" || unit == "cm") out << "\nDistanceUnits = " << unit;
  if (s.vectors) out << "\nElementNumberOfChannels = 3";
  out << "\nElementType = " << (s.vectors ? "MET_FLOAT" : "MET_UCHAR")
      << "\nElementDataFile = " << (data_file.empty() ? "LOCAL" : data_file) << '\n';
  return out.str();
}

// ---- files

using Voxels = std::function<void(Packer&)>;

void write_nifti(const Saved& s, const Voxels& voxels) {
  TemporaryFile file(s.path);
  Packer packer(file, s.ends_with(".gz") || s.ends_with(".GZ") ? Packing::gzip : Packing::raw);
  const std::string header = nifti_header(s);
  packer.write(header.data(), header.size());
  voxels(packer);
  packer.finish();
  file.keep();
}

// Writes NRRD or MetaImage: the voxels follow the header, or lie in a file beside it (.nhdr, .mhd).
void write_with_text_header(const Saved& s, const Voxels& voxels) {
  const bool meta = format_of(s.path) == VolumeFormat::meta;
  const bool detached = s.ends_with("hdr") || s.ends_with("mhd");
  const fs::path beside =
      detached ? fs::path(s.path).replace_extension(meta ? ".zraw" : ".raw.gz") : fs::path();
  const std::string header = meta ? meta_header(s, beside.filename()) : nrrd_header(s, beside.filename());
  TemporaryFile file(s.path);
  file.write(header);
  const std::unique_ptr<TemporaryFile> data = detached ? std::make_unique<TemporaryFile>(beside) : nullptr;
  TemporaryFile& to = detached ? *data : file;
  const std::uint64_t begin = to.written();
  Packer packer(to, meta ? Packing::zlib : Packing::gzip);
  voxels(packer);
  packer.finish();
  if (meta) {
    std::ostringstream size;
    size.imbue(std::locale::classic());
    size << std::setw(kSizeDigits) << std::setfill('0') << to.written() - begin;
    file.rewrite(header.find(std::string(kSizeDigits, '0')), size.str());
  }
  if (detached) data->keep();
  file.keep();
}

void write_volume(const Saved& s, const Voxels& voxels) {
  if (format_of(s.path) == VolumeFormat::nifti) {
    write_nifti(s, voxels);
  } else {
    write_with_text_header(s, voxels);
  }
}

}  // namespace

std::string volume_ending(const fs::path& path) {
  format_of(path);
  const std::string last = path.extension().string();
  const std::string packed = fs::path(path.stem()).extension().string() + last;
  return packed.size() == std::string(".nii.gz").size() && last.size() == 3 ? packed : last;
}

VolumeFrame frame_of(const LabelVolume& volume) {
  return {volume.dims, volume.spacing_m, volume.origin_m, volume.rotation};
}

void write_labels(const fs::path& path, const VolumeFrame& frame, const LabelSlice& slice, double unit_m) {
  const Saved saved = check_path(path, frame, false, unit_m);
  write_volume(saved, [&](Packer& packer) {
    std::vector<std::uint8_t> labels(frame.slice_size());
    for (int k = 0; k < frame.dims[2]; ++k) {
      slice(k, labels);
      packer.write(labels.data(), labels.size());
    }
  });
}

void save_volume(const fs::path& path, const LabelVolume& volume, double unit_m) {
  const VolumeFrame frame = frame_of(volume);
  const double voxels = static_cast<double>(frame.dims[0]) * frame.dims[1] * frame.dims[2];
  if (voxels != static_cast<double>(volume.labels.size())) {
    refuse_volume(path, "a volume of ", voxels, " voxels with ", volume.labels.size(),
                  " labels cannot be saved");
  }
  write_labels(
      path, frame,
      [&](int k, std::span<std::uint8_t> slice) {
        std::copy_n(&volume.labels[volume.index(0, 0, k)], slice.size(), slice.begin());
      },
      unit_m);
}

void write_vectors(const fs::path& path, const VolumeFrame& frame, const VectorSlice& slice, double unit_m) {
  const Saved saved = check_path(path, frame, true, unit_m);
  const bool apart = format_of(path) == VolumeFormat::nifti;
  write_volume(saved, [&](Packer& packer) {
    std::vector<glm::vec3> vectors(frame.slice_size());
    std::vector<float> component(apart ? frame.slice_size() : 0);
    const auto unit = static_cast<float>(1.0 / unit_m);
    for (int pass = 0; pass < (apart ? 3 : 1); ++pass) {
      for (int k = 0; k < frame.dims[2]; ++k) {
        slice(k, vectors);
        if (apart) {
          for (std::size_t n = 0; n < vectors.size(); ++n) component[n] = vectors[n][pass] * unit;
          packer.write(component.data(), component.size() * sizeof(float));
        } else {
          for (glm::vec3& v : vectors) v *= unit;
          packer.write(vectors.data(), vectors.size() * sizeof(glm::vec3));
        }
      }
    }
  });
}

}  // namespace voxel
