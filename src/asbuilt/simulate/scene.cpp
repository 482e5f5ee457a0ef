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

Sensor placed_sensor(SensorKind kind, const Eigen::Vector3d& target, double size, Random& random) {
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
  sensor.half_width = random.uniform(0.5, 0.8) * size / distance;
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

// What may still be placed where: all bodies so far as points, and which samples of the part are still seen.
class Arrangement {
 public:
  Arrangement(const TriangleMesh& part, const SimulateOptions& options, std::uint64_t index, bool has_part,
              Random& random)
      : options_(options), size_(diameter(part)) {
    const Pose world_from_part = standing(part, part_rotation(part, options, index, random), 0.0, 0.0);
    const TriangleMesh part_in_world = transformed(part, world_from_part);
    const Eigen::Vector3d target = bounding_box(part_in_world).center();
    scene_.sensor = placed_sensor(options.sensor_kind(), target, size_, random);
    scene_.meshes_in_world = {surroundings(options, size_), has_part ? part_in_world : TriangleMesh{}};
    if (!has_part) return;
    scene_.world_from_model = world_from_part;
    samples_ = area_samples(part_in_world, kTruthSamples, Random(options.seed, "truth", index));
    unobstructed_ = visible_samples(samples_, model::RayScene(part_in_world), scene_.sensor);
    seen_ = unobstructed_;
    occupy(positions(area_samples(part_in_world, kContactSamples, Random(options.seed, "contact", index))));
  }

  [[nodiscard]] double size() const { return size_; }
  [[nodiscard]] const Sensor& sensor() const { return scene_.sensor; }
  [[nodiscard]] double hidden() const { return share_lost(seen_.size()); }
  [[nodiscard]] const std::vector<SurfacePoint>& samples() const { return samples_; }
  [[nodiscard]] const std::vector<std::size_t>& seen() const { return seen_; }

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

  // Puts a thing there unless it would touch another or hide more than is allowed.
  bool add(const TriangleMesh& mesh_in_world, double most_hidden, Random& random) {
    const Points points = positions(area_samples(mesh_in_world, kBodySamples, Random(random.bits(), "body", 0)));
    if (!is_free(points)) return false;
    if (!samples_.empty()) {
      const std::vector<std::size_t> covered =
          covered_samples(samples_, seen_, model::RayScene(mesh_in_world), scene_.sensor);
      if (share_lost(seen_.size() - covered.size()) > most_hidden) return false;
      std::vector<std::size_t> left;
      std::ranges::set_difference(seen_, covered, std::back_inserter(left));
      seen_ = std::move(left);
    }
    scene_.meshes_in_world.push_back(mesh_in_world);
    occupy(points);
    return true;
  }

  // The scene with its figures, told from exact rays.
  [[nodiscard]] Scene finished(const TriangleMesh& part, const NoiseModel& noise, const Context& context) const {
    Scene scene = scene_;
    if (!scene.world_from_model) return scene;
    const model::RayScene rays(scene.meshes_in_world);
    const RayGrid grid = grid_for(8000, scene.meshes_in_world, rays, scene.sensor, noise, context);
    const auto returns = exact_returns(scene.meshes_in_world, rays, scene.sensor, grid, context);
    const double share = static_cast<double>(seen_.size()) / static_cast<double>(samples_.size());
    const double visible_mm2 = share * surface_area(part);
    scene.occlusion = 1.0 - share;
    scene.hidden = hidden();
    scene.clutter = 1.0 - visible_mm2 / (visible_mm2 + seen_area(returns, grid, noise, Scene::kPart));
    return scene;
  }

 private:
  void occupy(const Points& points) { bodies_.emplace_back(points); }
  [[nodiscard]] double share_lost(std::size_t still_seen) const {
    if (unobstructed_.empty()) return 1.0;
    return 1.0 - static_cast<double>(still_seen) / static_cast<double>(unobstructed_.size());
  }

  const SimulateOptions& options_;
  double size_;
  Scene scene_;
  std::vector<SurfacePoint> samples_;
  std::vector<std::size_t> unobstructed_, seen_;
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
  if (arrangement.seen().empty()) return false;
  const std::size_t sample = arrangement.seen()[random.below(arrangement.seen().size())];
  const Eigen::Vector3d target = arrangement.samples()[sample].position;
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
  for (int tries = 0; tries < 60 && has_part && arrangement.hidden() < 0.9 * wanted_hidden; ++tries) {
    add_occluder(arrangement, options.hidden_high, random);
  }
  return arrangement.finished(part, noise, context);
}

double outside(double value, double low, double high) { return std::max({low - value, value - high, 0.0}); }

// How far the scene misses the wanted ranges.
double miss(const Scene& scene, const SimulateOptions& options) {
  const double hidden = outside(scene.hidden, options.hidden_low, options.hidden_high);
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
