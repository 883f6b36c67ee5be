// SPDX-License-Identifier: GPL-3.0-or-later
// Writes frames as a video, through the program ffmpeg where it is installed. The file is written whole or
// not at all.
#pragma once

#include <sys/types.h>

#include <csignal>
#include <filesystem>
#include <span>

#include "hybrid/base/whole_file.h"

namespace hybrid {

// Throws std::runtime_error with the remedy if ffmpeg is not installed.
void require_ffmpeg();

class VideoFile {
 public:
  // The ending of `file` is .mp4, .mkv or .webm. Starts ffmpeg. Throws std::runtime_error.
  VideoFile(const std::filesystem::path& file, int width, int height, int frames_per_s);
  ~VideoFile();  // ends ffmpeg, and removes a video that was not kept
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;
  VideoFile(VideoFile&&) = delete;
  VideoFile& operator=(VideoFile&&) = delete;

  // Adds a frame: rows from the top, three bytes (RGB) a pixel. Throws std::runtime_error if its size is not
  // that of the video, or if ffmpeg has ended.
  void add(int width, int height, std::span<const unsigned char> rgb);
  // Call after the last frame. The video then replaces the target. Throws std::runtime_error.
  void keep();

 private:
  // Waits until ffmpeg has ended. Returns whether it wrote the video.
  bool end() noexcept;

  FilePlace place_;
  FileOnItsWay way_;
  int width_, height_;
  int pipe_ = -1;
  pid_t ffmpeg_ = -1;
  sighandler_t before_ = SIG_DFL;  // of SIGPIPE, which would end this program if ffmpeg fails
};

}  // namespace hybrid
