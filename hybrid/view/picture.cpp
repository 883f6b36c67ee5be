// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/picture.h"

#include <dlfcn.h>
#include <epoxy/egl.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <string_view>

#include "hybrid/base/png_file.h"
#include "hybrid/view/frame_painter.h"

namespace hybrid {
namespace {

constexpr const char* remedy =
    "; a picture needs EGL and OpenGL 3.3 (on Debian the packages libegl1, libgl1, libegl-mesa0 and "
    "libgl1-mesa-dri, which draw without a graphics card too)";

bool library_exists(const char* name) {
  void* const library = dlopen(name, RTLD_LAZY | RTLD_LOCAL);
  if (library == nullptr) return false;
  dlclose(library);
  return true;
}

EGLDisplay initialised(EGLDisplay display) {
  EGLint major = 0;
  EGLint minor = 0;
  return display != EGL_NO_DISPLAY && eglInitialize(display, &major, &minor) == EGL_TRUE ? display
                                                                                         : EGL_NO_DISPLAY;
}

EGLDisplay open_display() {
  // libepoxy ends the program if these libraries are missing, so check first.
  if (!library_exists("libEGL.so.1"))
    throw std::runtime_error(std::string("libEGL.so.1 is not here") + remedy);
  if (!library_exists("libOpenGL.so.0") && !library_exists("libGL.so.1")) {
    throw std::runtime_error(std::string("libGL.so.1 is not here") + remedy);
  }
  const char* const known = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const std::string_view extensions = known != nullptr ? known : "";
  const auto has = [&](std::string_view name) { return extensions.find(name) != std::string_view::npos; };
  EGLDisplay display = EGL_NO_DISPLAY;
  if (has("EGL_EXT_platform_base") && has("EGL_MESA_platform_surfaceless")) {
    display =
        initialised(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  }
  if (display == EGL_NO_DISPLAY && has("EGL_EXT_platform_base") && has("EGL_EXT_platform_device") &&
      has("EGL_EXT_device_enumeration")) {
    // A vendor's driver without Mesa: take the first device.
    EGLDeviceEXT device = nullptr;
    EGLint count = 0;
    if (eglQueryDevicesEXT(1, &device, &count) == EGL_TRUE && count > 0) {
      display = initialised(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr));
    }
  }
  if (display == EGL_NO_DISPLAY) display = initialised(eglGetDisplay(EGL_DEFAULT_DISPLAY));
  if (display == EGL_NO_DISPLAY)
    throw std::runtime_error(std::string("EGL finds nothing to draw with") + remedy);
  return display;
}

// An EGL context without a surface, current on this thread during its life.
class OffscreenContext {
 public:
  OffscreenContext() {
    // The display is opened once and never closed. So the driver stays loaded, and the next picture starts
    // without delay. If opening fails, the next picture tries again.
    static const EGLDisplay opened = open_display();
    display_ = opened;
    if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) {
      throw std::runtime_error(std::string("this EGL does not offer OpenGL") + remedy);
    }
    const std::array<EGLint, 5> wanted{EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (eglChooseConfig(display_, wanted.data(), &config, 1, &count) != EGL_TRUE || count < 1) {
      throw std::runtime_error(std::string("EGL offers no OpenGL configuration") + remedy);
    }
    const std::array<EGLint, 7> version{EGL_CONTEXT_MAJOR_VERSION,
                                        3,
                                        EGL_CONTEXT_MINOR_VERSION,
                                        3,
                                        EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                        EGL_NONE};
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, version.data());
    if (context_ == EGL_NO_CONTEXT) {
      throw std::runtime_error(std::string("EGL makes no OpenGL 3.3 context") + remedy);
    }
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE) {
      eglDestroyContext(display_, context_);
      throw std::runtime_error(std::string("EGL cannot use a context without a surface") + remedy);
    }
  }
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;
  OffscreenContext(OffscreenContext&&) = delete;
  OffscreenContext& operator=(OffscreenContext&&) = delete;
  ~OffscreenContext() {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
  }

 private:
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

struct PictureMaker::State {
  OffscreenContext context;
  const DrawnScene& scene;
  FramePainter painter;

  State(const DrawnScene& drawn, int height) : scene(drawn), painter(drawn, Samples::fine, height) {}
};

PictureMaker::PictureMaker(const DrawnScene& scene, int height)
    : state_(std::make_unique<State>(scene, height)) {}

PictureMaker::~PictureMaker() = default;

std::vector<std::uint8_t> PictureMaker::draw(const Snapshot& snapshot, const PictureOptions& options) {
  const double aspect = frame_layout(options.width, options.height, false).aspect();
  FrameOptions frame;
  frame.width = options.width;
  frame.height = options.height;
  frame.inset = options.inset;
  frame.view = options.view;
  state_->painter.paint(
      snapshot, options.camera ? *options.camera : frame_scene(state_->scene, snapshot, aspect), frame);
  return state_->painter.read_rgb();
}

void PictureMaker::save(const std::filesystem::path& png, const Snapshot& snapshot,
                        const PictureOptions& options) {
  save_png(png, options.width, options.height, draw(snapshot, options));
}

void save_picture(const std::filesystem::path& png, const DrawnScene& scene, const Snapshot& snapshot,
                  const PictureOptions& options) {
  PictureMaker maker(scene, options.height);
  maker.save(png, snapshot, options);
}

}  // namespace hybrid
