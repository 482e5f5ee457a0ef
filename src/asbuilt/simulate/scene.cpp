// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/model/ray_scene.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "asbuilt/simulate/parts.h"
#include "asbuilt/simulate/resting.h"
#include "asbuilt/simulate/visibility.h"

namespace asbuilt::simulate {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kPlacings = 8;                   // whole arrangements tried for the ranges of clutter and hidden share
constexpr std::size_t kTruthSamples = 12000;   // of the part, for occlusion and hidden share
constexpr std::size_t kContactSamples = 4000;  // of the part, for what may stand where
constexpr std::size_t kBodySamples = 1200;     // of another thing, likewise
constexpr double kGapRatio = 0.025;            // least distance between sampled points of two things / diameter

using Points = std::vector<Eigen::Vector3f>;

Points positions(const std::vector<SurfacePoint>& samples) {
  Points points;
  for (const SurfacePoint& sample : samples) points.push_back(sample.position.cast<float>());
  return points;
}

Pose yawed(double angle) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

// Stands a rotated mesh on the floor so that the middle of its box is above (x, y).
Pose standing(const TriangleMesh& mesh, const Eigen::Matrix3d& rotation, double x, double y) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  const Eigen::Vector3d middle = bounding_box(transformed(mesh, pose)).center();
  pose.translation() = Eigen::Vector3d(x - middle.x(), y - middle.y(), height_on_floor(mesh, rotation));
  return pose;
}

Eigen::Matrix3d part_rotation(const TriangleMesh& part, const SimulateOptions& options, std::uint64_t index,
                              Random& random) {
  if (options.pose == "any") return random_rotation(random);
  if (options.pose == "resting") return resting_rotation(part, random);
  // Upright parts are turned on evenly, so that the scans together go around them.
  const double turn = 2.0 * kPi * static_cast<double>(index) / options.scans;
  return yawed(turn + random.uniform(-0.25, 0.25)).linear();
}

// z of the result looks along `forward`, y as far down as it can.
Eigen::Matrix3d looking_along(const Eigen::Vector3d& forward) {
  Eigen::Matrix3d axes;
  axes.col(2) = forward.normalized();
  axes.col(0) = axes.col(2).cross(Eigen::Vector3d::UnitZ()).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

Sensor placed_sensor(const SimulateOptions& options, const Eigen::Vector3d& target, double size, Random& random) {
  const SensorKind kind = options.sensor_kind();
  Sensor sensor;
  sensor.kind = kind;
  const double azimuth = random.uniform(0.0, 2.0 * kPi);
  const Eigen::Vector3d sideways(std::cos(azimuth), std::sin(azimuth), 0.0);
  if (kind == SensorKind::laser_scanner) {
    const double distance = random.uniform(0.9, 1.6) * size, tilt = random.uniform(-0.03, 0.03);
    sensor.world_from_scan = yawed(random.uniform(0.0, 2.0 * kPi)) * Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX());
    sensor.world_from_scan.translation() = distance * sideways;
    sensor.world_from_scan.translation().z() = random.uniform(0.6, 1.3) * size;
    sensor.near_mm = 0.1 * size;
    return sensor;
  }
  const double distance = random.uniform(1.5, 2.0) * size, elevation = random.uniform(15.0, 55.0) / 180.0 * kPi;
  const Eigen::Vector3d offset =
      distance * (std::cos(elevation) * sideways + std::sin(elevation) * Eigen::Vector3d::UnitZ());
  Eigen::Vector3d aim = target;
  for (int k = 0; k < 3; ++k) aim[k] += random.uniform(-0.06, 0.06) * size;
  sensor.world_from_scan.linear() = looking_along(-offset);
  sensor.world_from_scan.translation() = aim + offset;
  // Further placements need room in the field beside the first.
  const double field = 1.0 + 0.6 * std::sqrt(static_cast<double>(options.instances - 1));
  sensor.half_width = field * random.uniform(0.5, 0.8) * size / distance;
  sensor.near_mm = 0.4 * distance;
  sensor.far_mm = 1.9 * distance;
  return sensor;
}

TriangleMesh surroundings(const SimulateOptions& options, double size) {
  const bool hall = options.sensor_kind() == SensorKind::laser_scanner || options.walls;
  const double reach = (hall ? 5.0 : 20.0) * size, height = 3.0 * size, thin = 0.01 * size;
  std::vector<TriangleMesh> slabs;
  const auto add = [&](const Eigen::Vector3d& extent, const Eigen::Vector3d& centre) {
    Pose pose = Pose::Identity();
    pose.translation() = centre;
    slabs.push_back(transformed(box(extent), pose));
  };
  if (options.floor) add({2.0 * reach, 2.0 * reach, thin}, {0.0, 0.0, -0.5 * thin});
  if (hall) {
    for (const double side : {-1.0, 1.0}) {
      add({thin, 2.0 * reach, height}, {side * reach, 0.0, 0.5 * height});
      add({2.0 * reach, thin, height}, {0.0, 0.8 * side * reach, 0.5 * height});
    }
  }
  return merged(slabs);
}

// A placement of the part as the sensor sees it: samples of its surface, and which of them are still seen.
class SeenPlacement {
 public:
  SeenPlacement(const TriangleMesh& mesh_in_world, const Sensor& sensor, Random random)
      : samples_(area_samples(mesh_in_world, kTruthSamples, random)),
        unobstructed_(visible_samples(samples_, model::RayScene(mesh_in_world), sensor)),
        seen_(unobstructed_) {}

  [[nodiscard]] const std::vector<SurfacePoint>& samples() const { return samples_; }
  [[nodiscard]] const std::vector<std::size_t>& seen() const { return seen_; }
  [[nodiscard]] double hidden() const { return hidden_if(seen_); }
  [[nodiscard]] double hidden_if(const std::vector<std::size_t>& seen) const {
    if (unobstructed_.empty()) return 1.0;
    return 1.0 - static_cast<double>(seen.size()) / static_cast<double>(unobstructed_.size());
  }
  [[nodiscard]] double seen_share() const {
    return static_cast<double>(seen_.size()) / static_cast<double>(samples_.size());
  }
  [[nodiscard]] bool is_in_view(const Sensor& sensor) const {
    return std::ranges::all_of(samples_, [&](const SurfacePoint& s) { return sensor.has_in_view(s.position); });
  }

  // What would still be seen with another thing in the scene.
  [[nodiscard]] std::vector<std::size_t> seen_past(const model::RayScene& thing, const Sensor& sensor) const {
    const std::vector<std::size_t> covered = covered_samples(samples_, seen_, thing, sensor);
    std::vector<std::size_t> left;
    std::ranges::set_difference(seen_, covered, std::back_inserter(left));
    return left;
  }
  void set_seen(std::vector<std::size_t> seen) { seen_ = std::move(seen); }

 private:
  std::vector<SurfacePoint> samples_;
  std::vector<std::size_t> unobstructed_, seen_;
};

// What may still be placed where: all bodies so far as points, and what is still seen of each placement of the part.
class Arrangement {
 public:
  Arrangement(const TriangleMesh& part, const SimulateOptions& options, std::uint64_t index, bool has_part,
              Random& random)
      : options_(options), size_(diameter(part)) {
    const Pose world_from_part = standing(part, part_rotation(part, options, index, random), 0.0, 0.0);
    const TriangleMesh part_in_world = transformed(part, world_from_part);
    const Eigen::Vector3d target = bounding_box(part_in_world).center();
    scene_.sensor = placed_sensor(options, target, size_, random);
    scene_.meshes_in_world = {surroundings(options, size_), has_part ? part_in_world : TriangleMesh{}};
    if (!has_part) return;
    scene_.world_from_model = world_from_part;
    placements_.emplace_back(part_in_world, scene_.sensor, Random(options.seed, "truth", index));
    occupy(positions(area_samples(part_in_world, kContactSamples, Random(options.seed, "contact", index))));
  }

  [[nodiscard]] double size() const { return size_; }
  [[nodiscard]] const Sensor& sensor() const { return scene_.sensor; }
  // Of the part itself, not of its further placements; there must be one.
  [[nodiscard]] const SeenPlacement& part() const { return placements_.front(); }

  // Whether the points keep the gap from all bodies, the sensor, and the floor's underside.
  [[nodiscard]] bool is_free(const Points& points) const {
    const auto gap = static_cast<float>(kGapRatio * size_);
    const Eigen::Vector3f eye = scene_.sensor.position_in_world().cast<float>();
    for (const Eigen::Vector3f& point : points) {
      if ((point - eye).norm() < 0.3F * static_cast<float>(size_)) return false;
      for (const auto& body : bodies_) {
        if (body.nearest(point, gap).found()) return false;
      }
    }
    return true;
  }

  // Puts a thing there unless it would touch another or hide more of a placement than is allowed.
  bool add(const TriangleMesh& mesh_in_world, double most_hidden, Random& random) {
    const Points points = positions(area_samples(mesh_in_world, kBodySamples, Random(random.bits(), "body", 0)));
    if (!is_free(points)) return false;
    const model::RayScene rays(mesh_in_world);
    std::vector<std::vector<std::size_t>> left;
    for (const SeenPlacement& placement : placements_) {
      left.push_back(placement.seen_past(rays, scene_.sensor));
      if (placement.hidden_if(left.back()) > most_hidden) return false;
    }
    for (std::size_t i = 0; i < placements_.size(); ++i) placements_[i].set_seen(std::move(left[i]));
    scene_.meshes_in_world.push_back(mesh_in_world);
    occupy(points);
    return true;
  }

  // Puts the part there once more, wholly in view, before any clutter is there.
  bool add_copy(const TriangleMesh& part, const Pose& world_from_part, double most_hidden, Random& random) {
    const TriangleMesh mesh_in_world = transformed(part, world_from_part);
    SeenPlacement copy(mesh_in_world, scene_.sensor, Random(options_.seed, "truth of copy", random.bits()));
    if (!copy.is_in_view(scene_.sensor)) return false;
    for (std::size_t i = Scene::kPart; i < scene_.meshes_in_world.size(); ++i) {
      copy.set_seen(copy.seen_past(model::RayScene(scene_.meshes_in_world[i]), scene_.sensor));
    }
    if (copy.hidden() > most_hidden || !add(mesh_in_world, most_hidden, random)) return false;
    placements_.push_back(std::move(copy));
    scene_.copies.push_back({world_from_part, 1.0, 1.0});
    return true;
  }

  // The scene with its figures, told from exact rays.
  [[nodiscard]] Scene finished(const TriangleMesh& part, const NoiseModel& noise, const Context& context) const {
    Scene scene = scene_;
    if (!scene.world_from_model) return scene;
    const model::RayScene rays(scene.meshes_in_world);
    const RayGrid grid = grid_for(8000, scene.meshes_in_world, rays, scene.sensor, noise, context);
    const auto returns = exact_returns(scene.meshes_in_world, rays, scene.sensor, grid, context);
    const double visible_mm2 = placements_.front().seen_share() * surface_area(part);
    scene.occlusion = 1.0 - placements_.front().seen_share();
    scene.hidden = placements_.front().hidden();
    scene.clutter = 1.0 - visible_mm2 / (visible_mm2 + seen_area(returns, grid, noise, Scene::kPart));
    for (std::size_t k = 0; k < scene.copies.size(); ++k) {
      scene.copies[k].occlusion = 1.0 - placements_[k + 1].seen_share();
      scene.copies[k].hidden = placements_[k + 1].hidden();
    }
    return scene;
  }

 private:
  void occupy(const Points& points) { bodies_.emplace_back(points); }

  const SimulateOptions& options_;
  double size_;
  Scene scene_;
  std::vector<SeenPlacement> placements_;  // the part, then its copies
  std::vector<KdTree> bodies_;
};

Eigen::Matrix3d leaning(const Eigen::Matrix3d& upright, Random& random) {
  const double tilt = random.uniform(10.0, 35.0) / 180.0 * kPi, side = random.uniform(0.0, 2.0 * kPi);
  const Eigen::Vector3d axis(std::cos(side), std::sin(side), 0.0);
  return Eigen::AngleAxisd(tilt, axis).toRotationMatrix() * upright;
}

// A thing on the floor: half of them lie anywhere, half are pushed towards the part until they almost touch it.
bool add_thing(Arrangement& arrangement, const TriangleMesh& shape, double most_hidden, double reach, Random& random) {
  const double size = arrangement.size();
  Eigen::Matrix3d rotation = resting_rotation(shape, random);
  if (random.uniform() < 0.3) rotation = leaning(rotation, random);
  const bool pushed = random.uniform() < 0.5;
  for (int tries = 0; tries < 12; ++tries) {
    const double azimuth = random.uniform(0.0, 2.0 * kPi), away = std::sqrt(random.uniform(0.04, 1.0)) * reach;
    const auto at = [&](double distance) {
      return transformed(shape, standing(shape, rotation, distance * std::cos(azimuth), distance * std::sin(azimuth)));
    };
    double distance = away;
    if (pushed) {
      const Points points = positions(area_samples(at(away), kBodySamples, Random(random.bits(), "push", 0)));
      const double step = 0.02 * size;
      for (double nearer = away - step; nearer > 0.0; nearer -= step) {
        Points moved = points;
        const Eigen::Vector3f shift(static_cast<float>((nearer - away) * std::cos(azimuth)),
                                    static_cast<float>((nearer - away) * std::sin(azimuth)), 0.0F);
        for (Eigen::Vector3f& point : moved) point += shift;
        if (!arrangement.is_free(moved)) break;
        distance = nearer;
      }
    }
    if (arrangement.add(at(distance), most_hidden, random)) return true;
  }
  return false;
}

// A post, plate or beam that stands on the floor somewhere between the sensor and a part of the part still seen.
bool add_occluder(Arrangement& arrangement, double most_hidden, Random& random) {
  const std::vector<std::size_t>& seen = arrangement.part().seen();
  if (seen.empty()) return false;
  const Eigen::Vector3d target = arrangement.part().samples()[seen[random.below(seen.size())]].position;
  const Eigen::Vector3d eye = arrangement.sensor().position_in_world();
  const double size = arrangement.size();
  const Eigen::Vector3d place = eye + random.uniform(0.5, 0.85) * (target - eye);
  const double height = place.z() + random.uniform(0.02, 0.25) * size;
  if (height < 0.05 * size) return false;
  const double width = random.uniform(0.05, 0.3) * size;
  TriangleMesh post =
      random.uniform() < 0.5 ? cylinder(0.5 * width, height) : box({width, random.uniform(0.02, 0.15) * size, height});
  const double tilt = random.uniform(-0.15, 0.15);
  const Eigen::Matrix3d rotation = yawed(random.uniform(0.0, 2.0 * kPi)).linear() *
                                   Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()).toRotationMatrix();
  return arrangement.add(transformed(post, standing(post, rotation, place.x(), place.y())), most_hidden, random);
}

// The part once more, beside the first; in the attitudes that are asked for.
bool add_copy(Arrangement& arrangement, const TriangleMesh& part, const SimulateOptions& options, Random& random) {
  for (int tries = 0; tries < 60; ++tries) {
    const Eigen::Matrix3d rotation = options.pose == "upright" ? yawed(random.uniform(0.0, 2.0 * kPi)).linear()
                                                               : part_rotation(part, options, 0, random);
    const double azimuth = random.uniform(0.0, 2.0 * kPi), away = random.uniform(0.4, 1.6) * arrangement.size();
    const Pose pose = standing(part, rotation, away * std::cos(azimuth), away * std::sin(azimuth));
    if (arrangement.add_copy(part, pose, options.hidden_high, random)) return true;
  }
  return false;
}

TriangleMesh decoy_of(const TriangleMesh& part, const SimulateOptions& options) {
  Eigen::Vector3d factors = Eigen::Vector3d::Constant(options.decoy_scale);
  if (options.decoy_mirrored) factors.x() = -factors.x();
  return scaled(part, factors);
}

Scene arranged_once(const TriangleMesh& part, const SimulateOptions& options, const NoiseModel& noise,
                    std::uint64_t index, bool has_part, Random random, const Context& context,
                    std::span<const TriangleMesh> companions) {
  Arrangement arrangement(part, options, index, has_part, random);
  const double size = arrangement.size();
  const double reach = (options.sensor_kind() == SensorKind::laser_scanner ? 3.0 : 1.2) * size;
  const double wanted_hidden = random.uniform(options.hidden_low, options.hidden_high);
  for (int i = 1; i < options.instances && has_part; ++i) add_copy(arrangement, part, options, random);
  if (!has_part && !companions.empty()) {
    const TriangleMesh& stand_in = companions.front();
    const Eigen::Matrix3d rotation = part_rotation(stand_in, options, index, random);
    arrangement.add(transformed(stand_in, standing(stand_in, rotation, 0.0, 0.0)), options.hidden_high, random);
    companions = companions.subspan(1);
  }
  for (const TriangleMesh& companion : companions) {
    add_thing(arrangement, companion, options.hidden_high, reach, random);
  }
  const TriangleMesh decoy = options.decoys > 0 ? decoy_of(part, options) : TriangleMesh{};
  for (int i = 0; i < options.decoys; ++i) add_thing(arrangement, decoy, options.hidden_high, reach, random);
  const auto things = static_cast<int>(std::lround(options.clutter_objects * random.uniform(0.6, 1.4)));
  for (int i = 0; i < things; ++i) {
    const TriangleMesh shape = random_shape(random, random.uniform(0.2, 0.8) * size);
    add_thing(arrangement, shape, std::max(wanted_hidden, options.hidden_low), reach, random);
  }
  for (int tries = 0; tries < 60 && has_part && arrangement.part().hidden() < 0.9 * wanted_hidden; ++tries) {
    add_occluder(arrangement, options.hidden_high, random);
  }
  return arrangement.finished(part, noise, context);
}

double outside(double value, double low, double high) { return std::max({low - value, value - high, 0.0}); }

// How far the scene misses the wanted ranges.
double miss(const Scene& scene, const SimulateOptions& options) {
  const double missing_copies = options.instances - 1 - static_cast<int>(scene.copies.size());
  const double hidden = missing_copies + outside(scene.hidden, options.hidden_low, options.hidden_high);
  if (options.sensor_kind() == SensorKind::laser_scanner) return hidden;
  return hidden + outside(scene.clutter, options.clutter_low, options.clutter_high);
}

}  // namespace

double middle_distance_mm(SensorKind kind, double diameter_mm) {
  return (kind == SensorKind::laser_scanner ? 1.35 : 1.75) * diameter_mm;
}

Scene arrange(const TriangleMesh& part_in_model, const SimulateOptions& options, const NoiseModel& noise,
              std::uint64_t index, bool has_part, const Context& context, std::span<const TriangleMesh> companions) {
  std::optional<Scene> best;
  for (std::uint64_t placing = 0; placing < kPlacings && !context.cancelled(); ++placing) {
    Scene scene = arranged_once(part_in_model, options, noise, index, has_part,
                                Random(options.seed, "scene", index * kPlacings + placing), context, companions);
    if (!best || miss(scene, options) < miss(*best, options)) best = std::move(scene);
    if (!has_part || miss(*best, options) == 0.0) break;
  }
  return best.value_or(Scene{});
}

}  // namespace asbuilt::simulate
