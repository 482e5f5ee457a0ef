// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/ray_scene.h"

#include <embree3/rtcore.h>

#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "asbuilt/core/result.h"

namespace asbuilt::model {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// What a ray carries through Embree. `best` is kept by the filter below, so that of several hits at the same
// distance (a ray through an edge) the lowest (mesh, triangle) wins, however the hierarchy was laid out.
struct OrderedRay {
  RTCIntersectContext context;
  std::tuple<float, unsigned, unsigned> best{kInfinity, RTC_INVALID_GEOMETRY_ID, RTC_INVALID_GEOMETRY_ID};
};

void keep_lowest(const RTCFilterFunctionNArguments* arguments) {
  auto& ray = *reinterpret_cast<OrderedRay*>(arguments->context);
  const float distance = RTCRayN_tfar(arguments->ray, arguments->N, 0);
  const unsigned mesh = RTCHitN_geomID(arguments->hit, arguments->N, 0);
  const unsigned triangle = RTCHitN_primID(arguments->hit, arguments->N, 0);
  const std::tuple candidate(distance, mesh, triangle);
  if (candidate < ray.best) {
    ray.best = candidate;
  } else {
    arguments->valid[0] = 0;
  }
}

RTCRay make_ray(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, double near, double far) {
  RTCRay ray{};
  ray.org_x = origin.x();
  ray.org_y = origin.y();
  ray.org_z = origin.z();
  ray.dir_x = direction.x();
  ray.dir_y = direction.y();
  ray.dir_z = direction.z();
  ray.tnear = static_cast<float>(near);
  ray.tfar = static_cast<float>(far);
  ray.mask = 0xffffffffU;  // distribution builds have ray masks switched on: an empty mask would hit nothing
  return ray;
}

bool is_usable(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  return origin.allFinite() && direction.allFinite();
}

}  // namespace

struct RayScene::Implementation {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // taken off before rounding to float

  explicit Implementation(std::span<const TriangleMesh> meshes) {
    device = rtcNewDevice(nullptr);
    if (device == nullptr) throw std::runtime_error("asbuilt: Embree could not be started on this machine");
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    Eigen::AlignedBox3d box;
    for (const TriangleMesh& mesh : meshes) box.extend(bounding_box(mesh));
    if (!box.isEmpty()) centre = box.center();
    for (std::size_t i = 0; i < meshes.size(); ++i) attach(meshes[i], static_cast<unsigned>(i));
    rtcCommitScene(scene);
    if (rtcGetDeviceError(device) != RTC_ERROR_NONE) {
      release();
      throw std::runtime_error("asbuilt: Embree could not build the ray scene (out of memory?)");
    }
  }
  ~Implementation() { release(); }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  void release() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
    scene = nullptr;
    device = nullptr;
  }

  void attach(const TriangleMesh& mesh, unsigned id) {
    if (mesh.empty()) return;
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.vertices.size()));
    auto* triangles = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
    if (vertices != nullptr && triangles != nullptr) {
      for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        Eigen::Map<Eigen::Vector3f>(vertices + 3 * i) = (mesh.vertices[i] - centre).cast<float>();
      }
      for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        Eigen::Map<Eigen::Matrix<unsigned, 3, 1>>(triangles + 3 * i) = mesh.triangles[i].cast<unsigned>();
      }
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, id);
    rtcReleaseGeometry(geometry);
  }
};

RayScene::RayScene(const TriangleMesh& mesh) : RayScene(std::span(&mesh, 1)) {}
RayScene::RayScene(std::span<const TriangleMesh> meshes) : implementation_(std::make_unique<Implementation>(meshes)) {}
RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

RayScene::Hit RayScene::first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double near,
                                  double far) const {
  if (!is_usable(origin, direction)) return {};
  RTCRayHit query{};
  query.ray = make_ray((origin - implementation_->centre).cast<float>(), direction.cast<float>(), near, far);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  OrderedRay ordered;
  rtcInitIntersectContext(&ordered.context);
  ordered.context.filter = keep_lowest;
  rtcIntersect1(implementation_->scene, &ordered.context, &query);
  const auto [distance, mesh, triangle] = ordered.best;
  if (mesh == RTC_INVALID_GEOMETRY_ID) return {};
  return {static_cast<double>(distance), mesh, triangle};
}

bool RayScene::is_blocked(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double near,
                          double far) const {
  if (!is_usable(origin, direction)) return false;
  RTCRay ray = make_ray((origin - implementation_->centre).cast<float>(), direction.cast<float>(), near, far);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(implementation_->scene, &context, &ray);
  return ray.tfar < 0.0F;  // Embree's sign for a hit
}

}  // namespace asbuilt::model
