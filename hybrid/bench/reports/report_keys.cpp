// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/reports/report_keys.h"

#include <array>

namespace hybrid::bench {
namespace {

using enum KeyKind;

constexpr std::array kRigidKeys{
    ReportKey{"path", identity},
    ReportKey{"mesh", identity},
    ReportKey{"triangles", detail},
    ReportKey{"radius_m", identity},
    ReportKey{"speed_m_s", identity},
    ReportKey{"engine", identity},
    ReportKey{"scale", identity},
    ReportKey{"offset_m", identity},
    ReportKey{"path_ticks", detail},
    ReportKey{"ticks", context},  // a slow engine is stopped after some seconds
    ReportKey{"timer_overhead_us", context},
    ReportKey{"pop_throughs", exact, "ticks"},
    ReportKey{"inside_ticks", exact, "ticks"},
    ReportKey{"error_lost_ticks", exact, "error_ticks"},
    ReportKey{"faults", exact, "ticks"},
    ReportKey{"truncated_ticks", exact, "ticks"},
    ReportKey{"error_mesh_max_m", exact, "error_ticks"},
    ReportKey{"error_mesh_p99_m", exact, "error_ticks"},
    ReportKey{"clearance_min_m", exact, "error_ticks"},
    ReportKey{"error_sphere_max_m", exact, "ticks"},
    ReportKey{"error_sphere_rms_m", exact, "ticks"},
    ReportKey{"optimum_sphere_max_m", exact, "ticks"},
    ReportKey{"optimum_sphere_rms_m", exact, "ticks"},
    ReportKey{"error_sphere_at_optimum_ticks_max_m", exact, "ticks"},
    ReportKey{"error_closed_max_m", exact, "ticks"},
    ReportKey{"error_closed_rms_m", exact, "ticks"},
    ReportKey{"force_step_p99_N", exact, "ticks"},
    ReportKey{"contact_ticks", exact, "ticks"},
    ReportKey{"error_ticks", context},  // as many as the time allows, unless all are asked for
    ReportKey{"error_worst_tick", context},
    ReportKey{"steps_max", exact, "ticks"},
    ReportKey{"steps_mean", exact, "ticks"},
    ReportKey{"surveys_per_tick", exact, "ticks"},
    ReportKey{"bytes", measured},  // differs, because several threads build the hierarchy
    ReportKey{"p50_us", measured},
    ReportKey{"p99_us", measured},
    ReportKey{"p999_us", measured},
    ReportKey{"max_us", measured},
    ReportKey{"least_us.p50", measured},
    ReportKey{"least_us.p99", measured},
    ReportKey{"least_us.p999", measured},
    ReportKey{"least_us.max", measured},
    ReportKey{"pose_us.p50", measured},
    ReportKey{"pose_us.p99", measured},
    ReportKey{"pose_us.p999", measured},
    ReportKey{"pose_us.max", measured},
    ReportKey{"build_ms", measured},
    ReportKey{"surface_build_ms", measured},
    ReportKey{"map_build_ms", measured},
};

constexpr std::array kSoftKeys{
    ReportKey{"case", identity},
    ReportKey{"engine", identity},
    ReportKey{"voxels", identity},
    ReportKey{"material", identity},
    ReportKey{"depth_spacings", identity},
    ReportKey{"slack", identity},
    ReportKey{"axes", identity},
    ReportKey{"threads", detail},
    ReportKey{"repeats", context},
    ReportKey{"note", context},
    ReportKey{"reference", context},
    ReportKey{"violated"},
    ReportKey{"exact"},
    ReportKey{"source_off_spacings"},
    ReportKey{"force_error_jnd", exact, "repeats", "relax"},
    ReportKey{"force_error_N", exact, "repeats", "relax"},
    ReportKey{"truncated_share", exact, "repeats"},
    ReportKey{"moved"},
    ReportKey{"bytes_per_voxel"},
    ReportKey{"p50_us", measured},
    ReportKey{"p99_us", measured},
    ReportKey{"p999_us", measured},
    ReportKey{"max_us", measured},
    ReportKey{"ns_per_voxel_update", measured},
    ReportKey{"ns_per_candidate", measured},
    ReportKey{"speedup", measured},
};

constexpr std::array kOccupancyKeys{
    ReportKey{"op", identity},
    ReportKey{"engine", identity},
    ReportKey{"what", identity},
    ReportKey{"pattern", identity},
    ReportKey{"elements", identity},
    ReportKey{"object_voxels", detail},
    ReportKey{"box_cells", identity},
    ReportKey{"batch", detail},
    ReportKey{"batches", context},
    ReportKey{"note", context},
    ReportKey{"reference", context},
    ReportKey{"checked", context},
    ReportKey{"missed", exact, "checked"},
    ReportKey{"extra", exact, "checked"},
    ReportKey{"found_mean"},
    ReportKey{"cells"},
    ReportKey{"bytes_per_cell"},
    ReportKey{"p50_ns", measured},
    ReportKey{"p99_ns", measured},
};

constexpr std::array kThreadsKeys{
    ReportKey{"scene", identity},
    ReportKey{"load", identity},
    ReportKey{"ticks", context},
    ReportKey{"results", context},
    ReportKey{"same_ticks"},
    ReportKey{"late_ticks", measured},
    ReportKey{"tick_us.p50", measured},
    ReportKey{"tick_us.p99", measured},
    ReportKey{"tick_us.p999", measured},
    ReportKey{"tick_us.max", measured},
    ReportKey{"p99_ratio", measured},
    ReportKey{"p999_ratio", measured},
    ReportKey{"relaxation_share", measured},
};

constexpr std::array kScenesKeys{
    ReportKey{"scene", identity},
    ReportKey{"model", identity},
    ReportKey{"values", detail},
    ReportKey{"repeats", context},
    ReportKey{"reference", context},
    ReportKey{"noisy", context},
    ReportKey{"p99_ratio_sure", context},
    ReportKey{"left_out", context},
    ReportKey{"faults", exact, "ticks"},
    ReportKey{"force_error_jnd", exact, "ticks"},
    ReportKey{"force_error_p99_jnd", exact, "ticks"},
    ReportKey{"force_error_N", exact, "ticks"},
    ReportKey{"from_given.moving.jnd_p50", exact, "ticks"},
    ReportKey{"from_given.moving.jnd_p99", exact, "ticks"},
    ReportKey{"from_given.moving.jnd_max", exact, "ticks"},
    ReportKey{"from_given.moving.ticks", exact, "ticks"},
    ReportKey{"from_given.still.jnd_p50", exact, "ticks"},
    ReportKey{"from_given.still.jnd_p99", exact, "ticks"},
    ReportKey{"from_given.still.jnd_max", exact, "ticks"},
    ReportKey{"from_given.still.ticks", exact, "ticks"},
    ReportKey{"ticks"},
    ReportKey{"contact_ticks", exact, "ticks"},
    ReportKey{"soft_voxels"},
    ReportKey{"memory_bytes", measured},  // differs, because several threads build hierarchies
    ReportKey{"p50_us.median", measured},
    ReportKey{"p50_us.least", measured},
    ReportKey{"p50_us.most", measured},
    ReportKey{"p99_us.median", measured},
    ReportKey{"p99_us.least", measured},
    ReportKey{"p99_us.most", measured},
    ReportKey{"p999_us.median", measured},
    ReportKey{"p999_us.least", measured},
    ReportKey{"p999_us.most", measured},
    ReportKey{"max_us.median", measured},
    ReportKey{"max_us.least", measured},
    ReportKey{"max_us.most", measured},
    ReportKey{"p99_ratio", measured},
    ReportKey{"load_s", measured},
};

constexpr std::array kThesisKeys{
    ReportKey{"case", identity},
    ReportKey{"engine", identity},
    ReportKey{"model", identity},
    ReportKey{"thread", identity},
    ReportKey{"hand", detail},
    ReportKey{"depth_mm", identity},
    ReportKey{"speed_mm_per_s", identity},
    ReportKey{"elements", detail},
    ReportKey{"thesis_percent", detail},
    ReportKey{"ticks", context},             // the session of a late cube ends early
    ReportKey{"force_error_jnd", measured},  // the largest cube depends on the machine
    ReportKey{"voxels", measured},
    ReportKey{"edge", measured},
    ReportKey{"late_edge", measured},
    ReportKey{"late_share", measured},
    ReportKey{"contact_share", measured},
    ReportKey{"p50_us", measured},
    ReportKey{"p99_us", measured},
    ReportKey{"p999_us", measured},
    ReportKey{"max_us", measured},
    ReportKey{"memory_bytes", measured},
    ReportKey{"load_s", measured},
    ReportKey{"ms_per_s", measured},
    ReportKey{"ms_per_s_voxel_by_voxel", measured},
};

}  // namespace

std::span<const ReportKey> keys_of(std::string_view suite) {
  if (suite == "rigid") return kRigidKeys;
  if (suite == "soft") return kSoftKeys;
  if (suite == "occupancy") return kOccupancyKeys;
  if (suite == "threads") return kThreadsKeys;
  if (suite == "scenes") return kScenesKeys;
  if (suite == "thesis") return kThesisKeys;
  return {};
}

}  // namespace hybrid::bench
