// SPDX-License-Identifier: Apache-2.0
#include "scene.h"

#include <stdexcept>

#include "asbuilt/core/random.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/simulate/parts.h"

namespace asbuilt::bench {
namespace {

// A benchmark without its scene has nothing to say.
template <class T>
T value_of(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

Pose looking_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d(0.1, 0.9, 0.3)).normalized();
  Pose world_from_sensor = Pose::Identity();
  world_from_sensor.linear() << right, forward.cross(right), forward;
  world_from_sensor.translation() = eye;
  return world_from_sensor;
}

Scene make_scene() {
  const Context context;
  Scene scene;
  scene.model = value_of(model::prepare(simulate::valve_body(), {}, context));
  scene.codebook = value_of(detect::build_codebook(scene.model, {}, context));
  const Eigen::Vector3d eye = bounding_box(scene.model.skin).center() + scene.model.diameter * Eigen::Vector3d(1, 2, 1);
  const PointCloud points = rays_onto(scene.model, eye, 300, 0.1, scene.model_from_scan);
  scene.scan = value_of(scan::prepare_scan(points, Eigen::Vector3d(Eigen::Vector3d::Zero()), {}, {}, context));
  return scene;
}

}  // namespace

PointCloud rays_onto(const model::PreparedModel& model, const Eigen::Vector3d& eye_in_model, int side, double noise_mm,
                     Pose& model_from_scan) {
  const Eigen::Vector3d middle = bounding_box(model.skin).center();
  model_from_scan = looking_at(eye_in_model, middle);
  const double half_width = 0.5 * model.diameter / (eye_in_model - middle).norm();
  Random random(1, "rays", 0);
  PointCloud points;
  for (int row = 0; row < side; ++row) {
    for (int column = 0; column < side; ++column) {
      const Eigen::Vector3d ray(half_width * (2.0 * column / side - 1.0), half_width * (2.0 * row / side - 1.0), 1.0);
      const Eigen::Vector3d direction = ray.normalized();
      const auto hit = model.rays->first_hit(eye_in_model, model_from_scan.linear() * direction);
      if (!hit.found()) continue;
      points.positions.push_back(((hit.distance + noise_mm * random.normal()) * direction).cast<float>());
    }
  }
  return points;
}

const Scene& scene() {
  static const Scene the_scene = make_scene();
  return the_scene;
}

}  // namespace asbuilt::bench
