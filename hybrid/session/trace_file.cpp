// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/trace_file.h"

#include <fmt/format.h>

#include "hybrid/base/whole_file.h"

namespace hybrid {

void save_trace(const std::filesystem::path& file, std::span<const TraceRow> rows) {
  WholeFile out(file);
  out.write(
      "t_s,device_x_m,device_y_m,device_z_m,proxy_x_m,proxy_y_m,proxy_z_m,"
      "force_x_N,force_y_N,force_z_N,rigid_N,soft_N,contacts,tick_us\n");
  for (const TraceRow& r : rows) {
    out.write(fmt::format(
        "{:.6f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.7g},{:.7g},{:.7g},{:.7g},{:.7g},{},{:.3f}\n",
        r.t_s, r.device_m.x, r.device_m.y, r.device_m.z, r.proxy_m.x, r.proxy_m.y, r.proxy_m.z, r.force_N.x,
        r.force_N.y, r.force_N.z, r.rigid_N, r.soft_N, r.contacts, r.tick_us));
  }
  out.keep();
}

}  // namespace hybrid
