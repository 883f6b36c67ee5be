// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/video.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace hybrid {
namespace {

constexpr const char* kFfmpeg = "ffmpeg";

// The descriptor of ffmpeg on which it finds the file. The file has no name until it is whole, so that
// nothing is left however both programs end.
constexpr int kOutput = 3;
constexpr const char* kOutputName = "/dev/fd/3";

// Name of ffmpeg's container format.
std::string format_of(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  return ending == ".mkv" ? "matroska" : ending == ".webm" ? "webm" : "mp4";
}

// Most players want an even number of pixels along each side, and colours at half of the resolution.
std::vector<std::string> words_of(const std::filesystem::path& file, int width, int height,
                                  int frames_per_s) {
  return {kFfmpeg,    "-loglevel",
          "error",    "-y",
          "-f",       "rawvideo",
          "-pix_fmt", "rgb24",
          "-s",       fmt::format("{}x{}", width, height),
          "-r",       std::to_string(frames_per_s),
          "-i",       "-",
          "-vf",      "pad=ceil(iw/2)*2:ceil(ih/2)*2",
          "-pix_fmt", "yuv420p",
          "-f",       format_of(file),
          kOutputName};
}

// Starts ffmpeg with the reading end of the pipe as its standard input, and the file as kOutput. ffmpeg gets
// its own process group, because a terminal sends Ctrl-C to the whole group of the program. After a Ctrl-C
// ffmpeg still has to write the last frames. Returns an error number, or 0.
int start(const std::vector<std::string>& words, int input, int output, pid_t& process) {
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions{};
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output, kOutput);
  posix_spawnattr_t attributes{};
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int error = posix_spawnp(&process, kFfmpeg, &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error;
}

}  // namespace

void require_ffmpeg() {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((folder + "/" + kFfmpeg).c_str(), X_OK) == 0) return;
  }
  throw std::runtime_error(
      "--video needs the program ffmpeg, and it is not installed (on Debian the package ffmpeg); install it, "
      "or write the frames as pictures: hybrid view SCENE --frames N --out FOLDER");
}

VideoFile::VideoFile(const std::filesystem::path& file, int width, int height, int frames_per_s)
    : place_(file), way_(place_), width_(width), height_(height) {
  if (!way_.open())
    throw std::runtime_error(fmt::format("{}: cannot be written ({})", file.string(), std::strerror(errno)));
  std::array<int, 2> ends{-1, -1};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    throw std::runtime_error(fmt::format("{}: no pipe to ffmpeg: {}", file.string(), std::strerror(errno)));
  const int error = start(words_of(file, width, height, frames_per_s), ends[0], way_.descriptor(), ffmpeg_);
  close(ends[0]);
  pipe_ = ends[1];
  if (error != 0) {
    close(pipe_);
    throw std::runtime_error(
        fmt::format("{}: ffmpeg does not start: {}", file.string(), std::strerror(error)));
  }
  before_ = std::signal(SIGPIPE, SIG_IGN);
}

VideoFile::~VideoFile() {
  end();
  std::signal(SIGPIPE, before_);
}

bool VideoFile::end() noexcept {
  if (pipe_ < 0) return false;
  close(pipe_);
  pipe_ = -1;
  int status = -1;
  while (waitpid(ffmpeg_, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

void VideoFile::add(int width, int height, std::span<const unsigned char> rgb) {
  if (width != width_ || height != height_)
    throw std::runtime_error(fmt::format(
        "{}: a frame has {} x {} pixels and the first had {} x {}; leave the window's size as it is",
        place_.asked.string(), width, height, width_, height_));
  while (!rgb.empty()) {
    const ssize_t count = ::write(pipe_, rgb.data(), rgb.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0)
      throw std::runtime_error(place_.asked.string() + ": ffmpeg takes no more frames; its reason is above");
    rgb = rgb.subspan(static_cast<std::size_t>(count));
  }
}

void VideoFile::keep() {
  if (!end())
    throw std::runtime_error(place_.asked.string() +
                             ": ffmpeg has not written the video; its reason is above");
  if (!way_.keep())
    throw std::runtime_error(
        fmt::format("{}: cannot be written ({})", place_.asked.string(), std::strerror(errno)));
}

}  // namespace hybrid
