// SPDX-License-Identifier: GPL-3.0-or-later
#include <bit>
#include <cmath>

#include "voxel/volume/check_header.h"
#include "voxel/volume/length_unit.h"
#include "voxel/volume/text_header.h"

namespace voxel {

namespace fs = std::filesystem;

void inspect_meta(const fs::path& path, VoxelPlace& place) {
  const TextHeader header = read_text_header(path, '=', "elementdatafile");
  if (!header.has("elementdatafile")) refuse_volume(path, "the header has no ElementDataFile; ", kDamaged);
  check_axes(path, header.number("ndims", std::nan("")));
  for (const char* field : {"DimSize", "ElementType"}) {
    if (header.has(lower_case(field))) continue;
    refuse_volume(path, "the header has no ", field, " before ElementDataFile; ", kDamaged);
  }
  place.offset = header.bytes;
  find_data_file(path, header.text("elementdatafile"), place);
  const std::string compressed = lower_case(header.text("compresseddata"));
  if (starts_with(compressed, "t") || starts_with(compressed, "1"))
    place.packing = VoxelPlace::Packing::deflate;
  const std::string binary = lower_case(header.text("binarydata"));
  if (starts_with(binary, "f") || starts_with(binary, "0")) place.packing = VoxelPlace::Packing::text;
  place.offset += bytes_to_skip(path, header, "headersize");
  if (header.number("headersize", 0.0) < 0.0)
    place.as_they_are = false;  // the voxels are at the end of the file
  // If the header gives no step between voxels, MetaIO takes the size of a voxel for it.
  if (!header.has("elementspacing") && !header.has("elementsize")) place.notes.emplace_back(kNoSpacing);
  if (header.has("distanceunits") && header.text("distanceunits") != "?") {
    place.stated_unit = header.text("distanceunits");
    place.unit_m = length_unit_m(place.stated_unit);
  }
  for (const char* key : {"binarydatabyteordermsb", "elementbyteordermsb"}) {
    const std::string order = lower_case(header.text(key));
    if (starts_with(order, "t") || starts_with(order, "1"))
      place.swapped = std::endian::native == std::endian::little;
  }
  const double packed = header.number("compresseddatasize", 0.0);
  if (!(packed >= 0.0 && packed <= static_cast<double>(place.file_bytes))) {
    refuse_volume(path, "the header says ", header.text("compresseddatasize"),
                  " bytes of compressed voxels, but '", place.file.string(), "' has ", place.file_bytes, "; ",
                  kDamaged);
  }
}

}  // namespace voxel
