// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::model {

/// Rays against triangle meshes (Embree, hidden). Built once, then const and safe from any thread.
class RayScene {
 public:
  struct Hit {
    double distance = std::numeric_limits<double>::infinity();  ///< along the direction, in its lengths
    std::uint32_t mesh = 0;                                     ///< index into the meshes given
    std::uint32_t triangle = 0;                                 ///< index within that mesh

    [[nodiscard]] bool found() const { return distance < std::numeric_limits<double>::infinity(); }
  };

  explicit RayScene(const TriangleMesh& mesh);
  explicit RayScene(std::span<const TriangleMesh> meshes);
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  /// First hit along origin + t * direction, t in [near, far].
  [[nodiscard]] Hit first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double near = 0.0,
                              double far = std::numeric_limits<double>::infinity()) const;

  /// Whether anything is hit for t in [near, far]; cheaper than first_hit.
  [[nodiscard]] bool is_blocked(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double near,
                                double far) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace asbuilt::model
