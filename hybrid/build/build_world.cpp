// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/build/build_world.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "hybrid/base/process_memory.h"
#include "hybrid/build/build_objects.h"
#include "hybrid/build/choose_model.h"
#include "hybrid/build/remove_overlap.h"
#include "hybrid/build/soft_notes.h"
#include "hybrid/build/thin_object.h"
#include "hybrid/geometry/surface_nets.h"
#include "hybrid/scene/read_feel.h"
#include "hybrid/tick/bodies/bodies_press_tissue.h"
#include "hybrid/tick/bodies/body_collisions.h"
#include "hybrid/tick/tissue/obstacles.h"
#include "hybrid/tick/tissue/press_tissue.h"

namespace hybrid {
namespace {

constexpr int kSurfaceSmoothing = 6;  // smoothing passes of a soft object's drawn surface
// Default limit on the number of cells along the scene's longest side. The cells lie in at most 64 bricks at
// any alignment.
constexpr double kMostCells = 504.0;
// Cells along the longest side if nothing is soft. Finer cells exclude no more objects.
constexpr double kRigidCells = 200.0;
constexpr std::size_t kMapReserve = 2048;  // spare bricks for motion

struct Box {
  glm::dvec3 low{1e300}, high{-1e300};
  void add(const glm::dvec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
};

[[noreturn]] void refuse(const Scene& scene, SourcePlace place, const std::string& text) {
  throw SceneError(scene.file, place, text);
}

// Runs a step; its exceptions are reported at `place` in the scene file.
template <class Step>
auto at_place(const Scene& scene, SourcePlace place, const std::string& name, Step&& step) {
  try {
    return step();
  } catch (const SceneError&) {
    throw;
  } catch (const std::bad_alloc&) {
    refuse(scene, place,
           fmt::format("\"{}\" does not fit in memory; give it a coarser spacing or a smaller part", name));
  } catch (const std::exception& e) {
    refuse(scene, place, fmt::format("\"{}\": {}", name, e.what()));
  }
}

double choose_cell(const Scene& scene, const Box& box, double soft_spacing) {
  const glm::dvec3 size = box.high - box.low;
  const double longest = std::max({size.x, size.y, size.z});
  if (scene.occupancy_cell_m) {
    // Estimate: surfaces occupy about one sheet of cells on each of the scene's six sides. In the worst case,
    // every 8 × 8 cells of a sheet need a brick of their own, which takes 2.6 kB.
    const double across = longest / *scene.occupancy_cell_m;
    const double bytes = 6.0 * across * across / 64.0 * 2600.0;
    if (bytes > 0.25 * static_cast<double>(usable_memory_bytes())) {
      refuse(scene, scene.occupancy_place,
             fmt::format("an occupancy cell of {:.3g} m over a scene of {:.3g} m needs about {:.1f} GB; "
                         "use a larger [occupancy] cell or leave it out",
                         *scene.occupancy_cell_m, longest, bytes / 1e9));
    }
    return *scene.occupancy_cell_m;
  }
  return soft_spacing > 0.0 ? std::max(soft_spacing, longest / kMostCells)
                            : rigid_cell_m(longest, scene.tool.radius_m);
}

class Builder {
 public:
  Builder(const Scene& scene, const Progress& progress) : scene_(scene), progress_(progress) {}

  BuiltScene build() {
    const auto start = std::chrono::steady_clock::now();
    if (scene_.tool.shape == Tool::Shape::punch && !scene_.rigid.empty()) {
      refuse(scene_, scene_.rigid.front().place,
             "a punch against rigid objects is not supported yet; use [tool] shape = \"ball\"");
    }
    for (const UnusedKey& key : scene_.unused_keys)
      built_.notes.push_back({key.object, polygon::Severity::warning, key.text});
    for (const ModelNote& note : scene_.model_notes)
      built_.notes.push_back({note.object, polygon::Severity::info, note.text});
    for (const RigidDescription& d : scene_.rigid) add_rigid(d);
    for (const SoftDescription& d : scene_.soft) read_soft(d);
    remove_overlaps();
    make_lattices();
    fill_map();
    finish_world();
    use_patches_and_obstacles();
    query_bodies(*world_, *built_.state);
    built_.world = std::move(world_);
    return_freed_memory();
    built_.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    built_.resident_bytes = resident_memory_bytes();
    built_.peak_bytes = peak_memory_bytes();
    return std::move(built_);
  }

 private:
  void report_progress(const std::string& text) const {
    if (progress_) progress_(text);
  }

  // A moving object pushes tissue out, so it must have an inside.
  void refuse_sheet_beside_soft(const RigidDescription& d, const RigidObject& object) const {
    if (scene_.soft.empty() || !object.motion.moves() || object.surface->solid()) return;
    refuse(scene_, d.motion_place,
           fmt::format("\"{}\" moves and is an open sheet, and such rigid objects beside soft ones are not "
                       "supported yet; close it, remove its motion, or the [[soft]] objects",
                       d.name));
  }

  // Boxes of all objects at rest, rigid ones first.
  std::vector<Box> boxes_at_rest() const {
    std::vector<Box> boxes;
    for (const RigidObject& object : world_->rigid) {
      boxes.emplace_back();
      for (const glm::dvec3& v : object.drawn->vertices) boxes.back().add(object.to_scene(v));
    }
    for (std::size_t o = 0; o < world_->soft.size(); ++o) {
      boxes.emplace_back();
      const voxel::Lattice& lattice = built_.state->soft[o]->lattice();
      const auto& dims = lattice.grid().dims;
      for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 at(corner & 1 ? dims[0] : -1, corner & 2 ? dims[1] : -1, corner & 4 ? dims[2] : -1);
        boxes.back().add(world_->soft[o].to_scene(at * lattice.spacing_m()));
      }
    }
    return boxes;
  }

  // Visits the objects whose boxes are nearer to the box of object `own` than kClearance times its size.
  template <class Visit>
  void for_near(const std::vector<Box>& boxes, std::size_t own, const Visit& visit) const {
    constexpr double kClearance = 0.25;  // share of the object's longest side
    const glm::dvec3 size = boxes[own].high - boxes[own].low;
    const double apart = kClearance * std::max({size.x, size.y, size.z});
    for (std::size_t o = 0; o < boxes.size(); ++o) {
      if (o != own && glm::all(glm::lessThan(boxes[o].low, boxes[own].high + apart)) &&
          glm::all(glm::lessThan(boxes[own].low - apart, boxes[o].high)))
        visit(o, apart);
    }
  }

  // Says in words why soft object `o` may meet something that moves or gives way. Empty if it cannot: no
  // rigid object moves, and no other soft object is near.
  std::string may_meet(const std::vector<Box>& boxes, std::size_t o) const {
    const auto moves = std::find_if(world_->rigid.begin(), world_->rigid.end(),
                                    [](const RigidObject& object) { return object.motion.moves(); });
    if (moves != world_->rigid.end()) return fmt::format("\"{}\" moves and may meet it", moves->name);
    std::string why;
    for_near(boxes, world_->rigid.size() + o, [&](std::size_t other, double apart) {
      if (other < world_->rigid.size() || !why.empty()) return;
      why = fmt::format("\"{}\" is nearer than {:.3g} mm, a quarter of its size, and may meet it",
                        world_->soft[other - world_->rigid.size()].name, 1e3 * apart);
    });
    return why;
  }

  // Objects that can meet only the tool and standing rigid objects get contacts on nested patches. Obstacles
  // are found for objects that have rigid objects near, and for all objects that are kept voxel by voxel.
  void use_patches_and_obstacles() {
    const std::vector<Box> boxes = boxes_at_rest();
    for (std::size_t o = 0; o < world_->soft.size(); ++o) {
      use_patches(boxes, o);
      bool near = !built_.state->soft[o]->uses_patches() && !world_->rigid.empty();
      for_near(boxes, world_->rigid.size() + o,
               [&](std::size_t other, double) { near = near || other < world_->rigid.size(); });
      const std::size_t voxels = near ? find_obstacles(*world_, *built_.state, o) : 0;
      if (voxels == 0) continue;
      built_.notes.push_back(
          {world_->soft[o].name, polygon::Severity::info,
           fmt::format("{} surface voxels lie near rigid objects, which will stop them", voxels)});
    }
  }

  void use_patches(const std::vector<Box>& boxes, std::size_t o) {
    voxel::SoftObject& object = *built_.state->soft[o];
    if (!scene_.soft[o].patches) return;
    const voxel::ToolInBody tool = tool_in_body(*world_, world_->soft[o], glm::dvec3(0.0));
    std::string obstacle;
    if (object.lattice().voxel_count() >= voxel::SoftObject::kLeastOnGrid) obstacle = may_meet(boxes, o);
    if (obstacle.empty()) obstacle = object.use_composite_grid(tool, scene_.soft[o].patch);
    note_patches(scene_.soft[o], object, obstacle, built_.notes);
  }

  void add_rigid(const RigidDescription& d) {
    report_progress(fmt::format("reading rigid \"{}\"", d.name));
    at_place(scene_, d.source_place, d.name, [&] { world_->rigid.push_back(build_rigid(d, built_.notes)); });
    RigidObject& object = world_->rigid.back();
    at_place(scene_, d.motion_place, d.name, [&] { object.motion = build_motion(d, object); });
    refuse_sheet_beside_soft(d, object);
    at_place(scene_, d.feel.texture ? d.feel.texture->place : d.place, d.name,
             [&] { object.feel = build_feel(d.feel); });
    for (const glm::dvec3& v : object.drawn->vertices) box_.add(object.to_scene(v));
  }

  void read_soft(const SoftDescription& d) {
    report_progress(fmt::format("reading soft \"{}\"", d.name));
    at_place(scene_, d.source_place, d.name, [&] {
      volumes_.push_back(build_volume(d, built_.notes));
      note_missing_labels(d, volumes_.back(), built_.notes);
      const std::uint64_t bytes = soft_load_bytes(volumes_.back().dims);
      if (bytes > usable_memory_bytes()) {
        throw std::runtime_error(
            fmt::format("a lattice of {} x {} x {} voxels needs about {:.1f} GB and this machine has "
                        "{:.1f} GB; give it a coarser spacing",
                        volumes_.back().dims[0], volumes_.back().dims[1], volumes_.back().dims[2],
                        static_cast<double>(bytes) / 1e9, static_cast<double>(usable_memory_bytes()) / 1e9));
      }
    });
  }

  void remove_overlaps() {
    anchored_.resize(volumes_.size());
    for (std::size_t o = 0; o < volumes_.size(); ++o) {
      const SoftDescription& d = scene_.soft[o];
      std::size_t removed = 0;
      if (!world_->rigid.empty()) {
        report_progress(fmt::format("looking where \"{}\" meets rigid objects", d.name));
        removed = remove_rigid_overlap(world_->rigid, volumes_[o], d.anchors.rigid_within_m, anchored_[o]);
        note_carved(d, removed, "rigid objects");
        note_missing_anchors(d, anchored_[o], built_.notes);
      }
      for (std::size_t later = o + 1; later < volumes_.size(); ++later) {
        const std::size_t by_soft = remove_soft_overlap(volumes_[o], volumes_[later]);
        note_carved(d, by_soft, "\"" + scene_.soft[later].name + "\"");
        removed += by_soft;
      }
      const auto& labels = volumes_[o].labels;
      const bool nothing = std::all_of(labels.begin(), labels.end(), [](auto label) { return label == 0; });
      if (removed > 0 && nothing) {
        refuse(
            scene_, d.place,
            fmt::format("nothing is left of \"{}\": other objects lie in all of its {} voxels, and carve it; "
                        "move one of them",
                        d.name, removed));
      }
    }
  }

  void note_carved(const SoftDescription& d, std::size_t removed, const std::string& by) {
    if (removed == 0) return;
    if (scene_.overlap == Overlap::refuse) {
      refuse(scene_, d.place,
             fmt::format("\"{}\" overlaps {} in {} voxels; move one of them, or say overlap = \"carve\"",
                         d.name, by, removed));
    }
    built_.notes.push_back(
        {d.name, polygon::Severity::info, fmt::format("{} voxels carved where {} lie", removed, by)});
  }

  void make_lattices() {
    for (std::size_t o = 0; o < volumes_.size(); ++o) {
      const SoftDescription& d = scene_.soft[o];
      report_progress(fmt::format("building the lattice of \"{}\"", d.name));
      at_place(scene_, d.source_place, d.name, [&] {
        voxel::LatticeOptions options = lattice_options(scene_, d);
        options.anchor_voxels = anchored_[o];
        SoftBody body{.name = d.name,
                      .pose = {volumes_[o].origin_m, volumes_[o].rotation},
                      .budget = d.budget,
                      .drawn = {}};
        body.drawn = surface_from_labels(volumes_[o], kSurfaceSmoothing);  // before the interior is thinned
        if (d.thinning) thin_object(scene_, d, volumes_[o], options, body, built_.notes);
        // The volume's memory is freed as soon as the lattice has its data.
        soft_.push_back(std::make_unique<voxel::SoftObject>(
            std::make_unique<voxel::Lattice>(std::move(volumes_[o]), options)));
        soft_.back()->set_own_work_share(d.work);
        volumes_[o] = {};
        note_memory(d, soft_.back()->lattice());
        note_felt_surface(scene_.tool, d.name, *soft_.back(), built_.notes);
        for (const glm::dvec3& v : body.drawn.vertices) box_.add(body.to_scene(v));
        world_->soft.push_back(std::move(body));
      });
    }
  }

  // Notes a warning, not an error: the scene fits as long as only a part of it is touched.
  void note_memory(const SoftDescription& d, const voxel::Lattice& lattice) {
    const std::uint64_t bytes = soft_touched_bytes(lattice), usable = usable_memory_bytes();
    if (bytes <= usable) return;
    built_.notes.push_back(
        {d.name, polygon::Severity::warning,
         fmt::format("touched everywhere it would take about {:.1f} GB, and this machine has {:.1f} GB; keep "
                     "the tool to a part of it, or give it a coarser spacing",
                     static_cast<double>(bytes) / 1e9, static_cast<double>(usable) / 1e9)});
  }

  void fill_map() {
    report_progress("filling the occupancy map");
    double spacing = 0.0;
    for (const auto& object : soft_) {
      const double h = object->lattice().min_spacing_m();
      spacing = spacing == 0.0 ? h : std::min(spacing, h);
    }
    const glm::dvec3 middle = 0.5 * (box_.low + box_.high);
    map_ = std::make_unique<OccupancyMap>(choose_cell(scene_, box_, spacing), middle);
    for (std::uint32_t o = 0; o < world_->rigid.size(); ++o) put_rigid_in_map(o);
    for (std::size_t o = 0; o < soft_.size(); ++o) {
      SoftBody& body = world_->soft[o];
      const auto surface = soft_[o]->lattice().surface();
      body.first_number = map_->add_soft(static_cast<std::uint32_t>(surface.size()));
      for (std::uint32_t s = 0; s < surface.size(); ++s) {
        map_->place(body.first_number + s, body.to_scene(soft_[o]->position(surface[s])));
      }
    }
    map_->reserve_bricks(soft_.empty() ? 0 : kMapReserve);
  }

  void put_rigid_in_map(std::uint32_t o) {
    const RigidObject& object = world_->rigid[o];
    const double margin = map_margin_m(scene_.rigid[o]);
    const auto corner = [&object](const polygon::TriangleIndices& t, std::size_t c) {
      return object.drawn->vertices[t[c]];
    };
    if (!object.motion.moves()) {
      for (const polygon::TriangleIndices& t : object.drawn->triangles) {
        map_->add_triangle(o, object.to_scene(corner(t, 0)), object.to_scene(corner(t, 1)),
                           object.to_scene(corner(t, 2)), margin);
      }
      return;
    }
    const auto cells = std::make_shared<SurfaceCells>(
        map_->cell_m(), 0.5 * (object.surface->lower() + object.surface->upper()));
    for (const polygon::TriangleIndices& t : object.drawn->triangles)
      cells->add_triangle(1, corner(t, 0), corner(t, 1), corner(t, 2), margin);
    cells->seal();
    map_->add_moving(o, cells, object.pose.position_m, object.pose.rotation);
  }

  void add_meetings() {
    const auto spacing = [this](std::uint32_t o) { return soft_[o]->lattice().min_spacing_m(); };
    for (std::uint32_t a = 0; a < soft_.size(); ++a) {
      for (std::uint32_t b = a + 1; b < soft_.size(); ++b) {
        if (spacing(a) < spacing(b)) {
          world_->soft_pairs.push_back({a, b});
        } else {
          world_->soft_pairs.push_back({b, a});
        }
      }
    }
  }
  void finish_world() {
    world_->tool = scene_.tool;
    world_->set_scale(box_.low, box_.high);
    world_->limits = scene_.safety;
    world_->limits.max_force_N = greatest_force_N(scene_);
    world_->encoder_m = scene_limits(scene_).resolution_m;
    world_->limits.deadline_s = scene_.deadline_periods / scene_.rate_hz;
    // An ideal device follows its path whatever the force is, so it absorbs no energy.
    const bool ideal = is_ideal(scene_);
    if (ideal && !scene_.max_energy_given)
      world_->limits.max_energy_J = std::numeric_limits<double>::infinity();
    if (scene_.passivity && !ideal) world_->passivity = passivity_options();
    add_meetings();
    for (RigidObject& object : world_->rigid) object.presses_tissue = object.motion.moves() && !soft_.empty();
    add_surface_points();
    built_.state = std::make_unique<WorldState>(*world_, std::move(*map_));
    built_.state->soft = std::move(soft_);
    built_.state->prepare(*world_);
    prepare_collisions(*world_, *built_.state);
    query_collisions(*world_, *built_.state);
    note_overlapping_bodies();
  }

  void note_overlapping_bodies() {
    for (const BodyPair& pair : built_.state->collisions.pairs) {
      const double deep_m = overlap_m(pair);
      if (deep_m <= pair.skin_m) continue;
      built_.notes.push_back(
          {world_->rigid[pair.free].name, polygon::Severity::warning,
           fmt::format("begins {:.3g} mm deep in \"{}\", and comes out of it by {:.2g} mm a tick; "
                       "move one of them if that is not meant",
                       1e3 * deep_m, world_->rigid[pair.other].name, 1e3 * pair.skin_m)});
    }
  }
  void add_surface_points() {
    const auto free = [](const RigidObject& object) {
      return object.motion.kind() == RigidMotion::Kind::free;
    };
    if (world_->rigid.size() < 2 || std::none_of(world_->rigid.begin(), world_->rigid.end(), free)) return;
    for (std::size_t o = 0; o < world_->rigid.size(); ++o)
      world_->rigid[o].points = surface_points(scene_.rigid[o].source, *world_->rigid[o].drawn);
  }

  [[nodiscard]] device::PassivityOptions passivity_options() const {
    return {.resolution_m = world_->encoder_m, .jnd_share = kJndShare, .jnd_floor_N = jnd_floor_N(scene_)};
  }

  const Scene& scene_;
  const Progress& progress_;
  BuiltScene built_;
  std::unique_ptr<World> world_ = std::make_unique<World>();
  std::vector<voxel::LabelVolume> volumes_;
  std::vector<std::vector<std::size_t>> anchored_;
  std::vector<std::unique_ptr<voxel::SoftObject>> soft_;
  std::unique_ptr<OccupancyMap> map_;
  Box box_;
};

}  // namespace

double rigid_cell_m(double longest_m, double tool_radius_m) {
  return std::max(0.5 * tool_radius_m, longest_m / kRigidCells);
}

BuiltScene build_scene(const Scene& scene, const Progress& progress) {
  return Builder(scene, progress).build();
}

ObjectBox object_box(const World& world, std::size_t object) {
  const std::size_t rigid = world.rigid.size();
  const polygon::TriangleMesh& mesh =
      object < rigid ? *world.rigid[object].drawn : world.soft[object - rigid].drawn;
  Box box;
  for (const glm::dvec3& v : mesh.vertices) {
    box.add(object < rigid ? world.rigid[object].to_scene(v) : world.soft[object - rigid].to_scene(v));
  }
  return {box.low, box.high};
}

std::string in_words(const ObjectBox& box) {
  return fmt::format("x {:.4g} to {:.4g}, y {:.4g} to {:.4g}, z {:.4g} to {:.4g} mm", 1e3 * box.low.x,
                     1e3 * box.high.x, 1e3 * box.low.y, 1e3 * box.high.y, 1e3 * box.low.z, 1e3 * box.high.z);
}

}  // namespace hybrid
