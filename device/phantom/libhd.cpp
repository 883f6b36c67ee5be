// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/phantom/libhd.h"

#include <dlfcn.h>

#include <array>
#include <cstdlib>
#include <string_view>
#include <vector>

namespace device {
namespace {

constexpr std::array kUsualNames{"libHD.so", "libHD.so.3.4", "libHD.so.3.0"};

constexpr std::string_view kInstall =
    "install the device's driver and OpenHaptics (from the maker, 3D Systems; free of charge), run ldconfig, "
    "or name the library: HYBRID_LIBHD=/path/to/libHD.so";

std::string loader_words() {
  const char* words = dlerror();
  return words == nullptr ? "the loader gives no reason" : words;
}

bool says(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

// True if the loader did not find the library `name` itself; false if it missed one of its dependencies.
bool is_absent(const std::string& words, const std::string& name) {
  return words.starts_with(name + ":") && says(words, "No such file");
}

std::string remedy(const std::string& words) {
  if (says(words, "libncurses") || says(words, "libtinfo")) {
    return "install the old terminal libraries that it needs: apt install libncurses5 libtinfo5";
  }
  if (says(words, "PhantomIO")) {
    return "install the device's driver too: libPhantomIOLib42.so comes with it, not with OpenHaptics; then "
           "run "
           "ldconfig";
  }
  if (says(words, "ELFCLASS") || says(words, "wrong ELF class")) {
    return "it is for another processor (32 bits?): install the 64-bit edition";
  }
  if (says(words, "invalid ELF header") || says(words, "file too short")) {
    return "it is no shared library, or a damaged one: install it again";
  }
  if (says(words, "No such file")) {
    return "install the library that is named as missing (ldd says which are), then run ldconfig";
  }
  return "see what `ldd` says of it, and install it again";
}

void* open(const std::string& name, std::string& words) {
  void* library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (library == nullptr) words = loader_words();
  return library;
}

void* open_named(const std::string& name, std::string_view by) {
  std::string words;
  if (void* library = open(name, words)) return library;
  throw DeviceError("libHD: " + name + " (" + std::string(by) + ") does not load: " + words + "; " +
                    (is_absent(words, name) ? "correct the path" : remedy(words)));
}

[[noreturn]] void refuse_broken(const std::string& file, const std::string& words) {
  throw DeviceError("libHD: " + file + " is there and does not load: " + words + "; " + remedy(words));
}

void* open_usual(std::string& file) {
  std::string tried;
  for (const char* name : kUsualNames) {
    std::string words;
    file = name;
    if (void* library = open(name, words)) return library;
    // A library that exists but does not load is taken for the intended one, so no other name is tried.
    if (!is_absent(words, name)) refuse_broken(file, words);
    tried.append(tried.empty() ? "" : ", ").append(file);
  }
  throw DeviceError("libHD: no PHANToM driver found (tried " + tried + "); " + std::string(kInstall));
}

class Symbols {
 public:
  explicit Symbols(void* library) : library_(library) {}

  template <typename Function>
  void find(Function*& function, const char* name) {
    function = reinterpret_cast<Function*>(dlsym(library_, name));
    if (function == nullptr) missing_ += (missing_.empty() ? "" : ", ") + std::string(name);
  }
  [[nodiscard]] const std::string& missing() const { return missing_; }

 private:
  void* library_;
  std::string missing_;
};

}  // namespace

HdLibrary load_libhd(const std::filesystem::path& file) {
  HdLibrary result;
  void* library = nullptr;
  const char* environment = std::getenv("HYBRID_LIBHD");
  if (!file.empty()) {
    result.file = file.string();
    library = open_named(result.file, "as asked for");
  } else if (environment != nullptr && *environment != '\0') {
    result.file = environment;
    library = open_named(result.file, "named by HYBRID_LIBHD");
  } else {
    library = open_usual(result.file);
  }

  Symbols symbols(library);
  HdFunctions& f = result.call;
  symbols.find(f.init_device, "hdInitDevice");
  symbols.find(f.disable_device, "hdDisableDevice");
  symbols.find(f.make_current, "hdMakeCurrentDevice");
  symbols.find(f.begin_frame, "hdBeginFrame");
  symbols.find(f.end_frame, "hdEndFrame");
  symbols.find(f.get_error, "hdGetError");
  symbols.find(f.error_string, "hdGetErrorString");
  symbols.find(f.enable, "hdEnable");
  symbols.find(f.get_booleans, "hdGetBooleanv");
  symbols.find(f.get_integers, "hdGetIntegerv");
  symbols.find(f.get_doubles, "hdGetDoublev");
  symbols.find(f.set_doubles, "hdSetDoublev");
  symbols.find(f.get_string, "hdGetString");
  symbols.find(f.check_calibration, "hdCheckCalibration");
  symbols.find(f.update_calibration, "hdUpdateCalibration");
  symbols.find(f.start_scheduler, "hdStartScheduler");
  symbols.find(f.stop_scheduler, "hdStopScheduler");
  symbols.find(f.set_rate, "hdSetSchedulerRate");
  symbols.find(f.schedule_synchronous, "hdScheduleSynchronous");
  symbols.find(f.schedule_asynchronous, "hdScheduleAsynchronous");
  symbols.find(f.unschedule, "hdUnschedule");
  if (!symbols.missing().empty()) {
    throw DeviceError(
        "libHD: " + result.file + " lacks " + symbols.missing() +
        "; it is not the HD library of OpenHaptics, or one older than 3.0: install OpenHaptics 3.4 "
        "(libHL.so and libQH.so are other libraries)");
  }
  return result;
}

}  // namespace device
