// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/mesh_edit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "asbuilt/core/result.h"

namespace asbuilt::simulate {
namespace {

const Eigen::Vector3d& corner(const TriangleMesh& mesh, const Eigen::Vector3i& triangle, int k) {
  return mesh.vertices[static_cast<std::size_t>(triangle[k])];
}

bool is_collapsed(const Eigen::Vector3i& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

// The middles of the edges that are too long, by edge; indices of new vertices.
class EdgeMiddles {
 public:
  EdgeMiddles(TriangleMesh& mesh, const std::function<double(const Eigen::Vector3d&)>& max_edge_mm)
      : mesh_(mesh), max_edge_mm_(max_edge_mm) {}

  // -1 where the edge is short enough.
  int of(int a, int b) {
    const auto [place, is_new] = known_.try_emplace(std::minmax(a, b), -1);
    if (!is_new) return place->second;
    const Eigen::Vector3d from = mesh_.vertices[static_cast<std::size_t>(a)];
    const Eigen::Vector3d to = mesh_.vertices[static_cast<std::size_t>(b)];
    const Eigen::Vector3d middle = 0.5 * (from + to);
    if ((to - from).norm() <= max_edge_mm_(middle)) return -1;
    place->second = static_cast<int>(mesh_.vertices.size());
    mesh_.vertices.push_back(middle);
    return place->second;
  }

 private:
  TriangleMesh& mesh_;
  const std::function<double(const Eigen::Vector3d&)>& max_edge_mm_;
  std::map<std::pair<int, int>, int> known_;
};

// One triangle into one to four, by which of its edges got a middle.
void split(const Eigen::Vector3i& t, const Eigen::Vector3i& middle, std::vector<Eigen::Vector3i>& out) {
  const auto cut = (middle.array() >= 0).count();
  if (cut == 0) {
    out.push_back(t);
  } else if (cut == 3) {
    out.insert(out.end(), {{t[0], middle[0], middle[2]},
                           {t[1], middle[1], middle[0]},
                           {t[2], middle[2], middle[1]},
                           {middle[0], middle[1], middle[2]}});
  } else {
    // Turned so that edge 0 is cut and, of two cut edges, 0 and 1 are.
    int first = 0;
    while (middle[first] < 0 || (cut == 2 && middle[(first + 1) % 3] < 0)) ++first;
    const int a = t[first], b = t[(first + 1) % 3], c = t[(first + 2) % 3];
    const int ab = middle[first], bc = middle[(first + 1) % 3];
    if (cut == 1) {
      out.insert(out.end(), {{a, ab, c}, {ab, b, c}});
    } else {
      out.insert(out.end(), {{ab, b, bc}, {a, ab, bc}, {a, bc, c}});
    }
  }
}

}  // namespace

TriangleMesh transformed(const TriangleMesh& mesh, const Pose& to_from_mesh) {
  TriangleMesh result = mesh;
  for (Eigen::Vector3d& vertex : result.vertices) vertex = to_from_mesh * vertex;
  return result;
}

TriangleMesh scaled(const TriangleMesh& mesh, const Eigen::Vector3d& factors) {
  TriangleMesh result = mesh;
  for (Eigen::Vector3d& vertex : result.vertices) vertex = vertex.cwiseProduct(factors);
  if (factors.prod() < 0.0) {
    for (Eigen::Vector3i& triangle : result.triangles) std::swap(triangle[1], triangle[2]);
  }
  return result;
}

TriangleMesh merged(std::span<const TriangleMesh> meshes) {
  TriangleMesh result;
  for (const TriangleMesh& mesh : meshes) {
    const int offset = static_cast<int>(result.vertices.size());
    result.vertices.insert(result.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const Eigen::Vector3i& t : mesh.triangles) result.triangles.emplace_back(t.array() + offset);
  }
  return result;
}

TriangleMesh welded(const TriangleMesh& mesh) {
  std::map<std::tuple<double, double, double>, int> known;
  std::vector<int> lowest(mesh.vertices.size()), new_index(mesh.vertices.size(), -1);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& p = mesh.vertices[i];
    lowest[i] = known.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(i)).first->second;
  }
  TriangleMesh result;
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    Eigen::Vector3i kept;
    for (int k = 0; k < 3; ++k) kept[k] = lowest[static_cast<std::size_t>(triangle[k])];
    if (is_collapsed(kept)) continue;
    for (int k = 0; k < 3; ++k) new_index[static_cast<std::size_t>(kept[k])] = 0;  // used
    result.triangles.push_back(kept);
  }
  for (std::size_t i = 0; i < new_index.size(); ++i) {
    if (new_index[i] < 0) continue;
    new_index[i] = static_cast<int>(result.vertices.size());
    result.vertices.push_back(mesh.vertices[i]);
  }
  for (Eigen::Vector3i& triangle : result.triangles) {
    for (int k = 0; k < 3; ++k) triangle[k] = new_index[static_cast<std::size_t>(triangle[k])];
  }
  return result;
}

TriangleMesh subdivided(const TriangleMesh& mesh, const std::function<double(const Eigen::Vector3d&)>& max_edge_mm) {
  TriangleMesh result = mesh;
  for (bool changed = true; changed;) {
    EdgeMiddles middles(result, max_edge_mm);
    std::vector<Eigen::Vector3i> finer;
    finer.reserve(result.triangles.size());
    const std::size_t vertices_before = result.vertices.size();
    for (const Eigen::Vector3i& t : result.triangles) {
      const int ab = middles.of(t[0], t[1]), bc = middles.of(t[1], t[2]), ca = middles.of(t[2], t[0]);
      split(t, {ab, bc, ca}, finer);
    }
    result.triangles = std::move(finer);
    changed = result.vertices.size() > vertices_before;
  }
  return result;
}

std::vector<Eigen::Vector3d> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Eigen::Vector3d weighted = doubled_area_vector(mesh, i);
    for (int k = 0; k < 3; ++k) normals[static_cast<std::size_t>(mesh.triangles[i][k])] += weighted;
  }
  for (Eigen::Vector3d& normal : normals) normal.normalize();  // Eigen leaves a zero vector as it is
  return normals;
}

std::vector<double> vertex_areas(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size(), 0.0);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const double share = doubled_area_vector(mesh, i).norm() / 6.0;
    for (int k = 0; k < 3; ++k) areas[static_cast<std::size_t>(mesh.triangles[i][k])] += share;
  }
  return areas;
}

std::vector<SurfacePoint> area_samples(const TriangleMesh& mesh, std::size_t count, Random random) {
  ASBUILT_EXPECT(surface_area(mesh) > 0.0, "a mesh with area to draw samples from");
  std::vector<double> area_up_to(mesh.triangles.size());
  double total = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    area_up_to[i] = total += 0.5 * doubled_area_vector(mesh, i).norm();
  }
  std::vector<SurfacePoint> samples;
  samples.reserve(count);
  std::size_t triangle = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double place = (static_cast<double>(i) + random.uniform()) / static_cast<double>(count) * total;
    while (triangle + 1 < area_up_to.size() && area_up_to[triangle] <= place) ++triangle;
    const Eigen::Vector3i& t = mesh.triangles[triangle];
    const double root = std::sqrt(random.uniform()), along = random.uniform();
    samples.push_back({(1.0 - root) * corner(mesh, t, 0) + root * (1.0 - along) * corner(mesh, t, 1) +
                           root * along * corner(mesh, t, 2),
                       doubled_area_vector(mesh, triangle).normalized()});
  }
  return samples;
}

}  // namespace asbuilt::simulate
