// SPDX-License-Identifier: GPL-3.0-or-later
// Written volumes, read back by the project's own reader (labels) and by ITK (vectors).
#include "voxel/volume/write_volume.h"

#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <sys/resource.h>

#include <array>
#include <csignal>
#include <glm/geometric.hpp>
#include <random>

#include "tests/voxel/volume/volume_folder.h"

namespace {

namespace fs = std::filesystem;
using tests::refusal;
using voxel::VolumeFrame;

class VolumeWriter : public tests::VolumeFolder {};

constexpr std::array<const char*, 6> kNames{"v.nii", "v.nii.gz", "v.nrrd", "v.nhdr", "v.mha", "v.mhd"};

itk::ImageIOBase::Pointer reader_of(const std::string& name) {
  if (name.find(".nii") != std::string::npos) return itk::NiftiImageIO::New().GetPointer();
  if (name.find(".m") != std::string::npos) return itk::MetaImageIO::New().GetPointer();
  return itk::NrrdImageIO::New().GetPointer();
}

VolumeFrame turned_frame() {
  return {
      {4, 3, 5}, {1.5e-3, 0.5e-3, 2e-3}, {0.01, -0.02, 0.3}, glm::normalize(glm::dquat(0.9, 0.1, -0.3, 0.2))};
}

// A different vector in every voxel (m).
glm::vec3 vector_at(std::size_t n) {
  const auto x = static_cast<float>(n);
  return {1e-3F * x, -2e-3F * x, 0.5e-3F - 1e-3F * x};
}

TEST_F(VolumeWriter, ItkReadsADisplacementFieldWhereAndAsItIs) {
  const VolumeFrame frame = turned_frame();
  for (const char* name : kNames) {
    const fs::path path = in_folder(name);
    voxel::write_vectors(path, frame, [&](int k, std::span<glm::vec3> slice) {
      for (std::size_t n = 0; n < slice.size(); ++n)
        slice[n] = vector_at(n + static_cast<std::size_t>(k) * frame.slice_size());
    });
    const auto io = reader_of(name);
    io->SetFileName(path.string());
    io->ReadImageInformation();
    EXPECT_EQ(io->GetNumberOfComponents(), 3U) << name;
    EXPECT_EQ(io->GetComponentType(), itk::IOComponentEnum::FLOAT) << name;
    EXPECT_EQ(io->GetPixelType(), itk::IOPixelEnum::VECTOR) << name;
    ASSERT_GE(io->GetNumberOfDimensions(), 3U) << name;
    const glm::dmat3 direction = glm::mat3_cast(frame.rotation);
    itk::ImageIORegion region(io->GetNumberOfDimensions());
    for (unsigned a = 0; a < io->GetNumberOfDimensions(); ++a) region.SetSize(a, io->GetDimensions(a));
    for (unsigned a = 0; a < 3; ++a) {
      const int axis = static_cast<int>(a);
      EXPECT_EQ(io->GetDimensions(a), static_cast<unsigned>(frame.dims[a])) << name;
      EXPECT_NEAR(io->GetSpacing(a), frame.spacing_m[axis] * 1e3, 1e-6) << name;
      EXPECT_NEAR(io->GetOrigin(a), frame.origin_m[axis] * 1e3, 1e-4) << name;
      for (int row = 0; row < 3; ++row)
        EXPECT_NEAR(io->GetDirection(a)[static_cast<std::size_t>(row)], direction[axis][row], 1e-6) << name;
    }
    io->SetIORegion(region);
    std::vector<float> values(3 * frame.slice_size() * 5);
    ASSERT_EQ(static_cast<std::size_t>(io->GetImageSizeInBytes()), values.size() * sizeof(float)) << name;
    io->Read(values.data());
    for (std::size_t n = 0; n < values.size() / 3; ++n) {
      for (std::size_t c = 0; c < 3; ++c) {
        ASSERT_NEAR(values[3 * n + c], 1e3F * vector_at(n)[static_cast<int>(c)], 1e-4F)  // mm
            << name << " voxel " << n;
      }
    }
  }
}

TEST_F(VolumeWriter, ALargeVolumeNeedsASliceOfMemory) {
  // The writer asks for one slice at a time, in order, and keeps no other slice.
  const VolumeFrame frame{{64, 64, 200}, glm::dvec3(1e-3)};
  const fs::path path = in_folder("v.nrrd");
  int asked = 0;
  voxel::write_labels(path, frame, [&](int k, std::span<std::uint8_t> slice) {
    EXPECT_EQ(k, asked++);
    EXPECT_EQ(slice.size(), frame.slice_size());
    std::fill(slice.begin(), slice.end(), static_cast<std::uint8_t>(k));
  });
  EXPECT_EQ(asked, 200);
  const voxel::LabelVolume back = voxel::load_volume(path, {});
  EXPECT_EQ(back.labels[back.index(63, 63, 199)], 199);
  EXPECT_EQ(back.labels[back.index(0, 0, 7)], 7);
}

TEST_F(VolumeWriter, AWriterThatFailsLeavesWhatWasThere) {
  for (const char* name : kNames) {
    const fs::path path = write(name, "what was there");
    EXPECT_ANY_THROW(voxel::write_labels(path, turned_frame(), [](int k, std::span<std::uint8_t>) {
      if (k == 3) throw std::runtime_error("the session ended");
    }));
    EXPECT_EQ(tests::contents(path), "what was there") << name;
  }
  for (const auto& entry : fs::directory_iterator(in_folder("")))
    EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
}

TEST_F(VolumeWriter, AFullDiskIsSaidInWords) {
  // A limit on the size of files simulates a full disk.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto ignored = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{20'000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  std::mt19937 random(1);
  const std::string said = refusal([&] {
    voxel::write_labels(in_folder("v.nii.gz"), {{64, 64, 64}, glm::dvec3(1e-3)},
                        [&](int, std::span<std::uint8_t> slice) {
                          for (auto& label : slice) label = static_cast<std::uint8_t>(random());
                        });
  });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, ignored);
  EXPECT_SAYS(said, "free space");
  EXPECT_TRUE(fs::is_empty(in_folder("")));
}

TEST(VolumeEnding, IsWhatTheNameSays) {
  EXPECT_EQ(voxel::volume_ending("a/b.c.nii.gz"), ".nii.gz");
  EXPECT_EQ(voxel::volume_ending("a/b.c.nii"), ".nii");
  EXPECT_EQ(voxel::volume_ending("b.NRRD"), ".NRRD");
  EXPECT_EQ(voxel::volume_ending("b.x.mha"), ".mha");
  EXPECT_SAYS(refusal([] { voxel::volume_ending("b.gz"); }), ".nii.gz");
}

}  // namespace
