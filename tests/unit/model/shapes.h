// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "asbuilt/core/random.h"
#include "asbuilt/core/triangle_mesh.h"

/// Meshes with known answers for the tests of the model stage.
namespace asbuilt::test {

/// A closed box of 12 triangles, or 12 n^2 with each side cut n times, wound outwards.
inline TriangleMesh box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int cuts = 1) {
  TriangleMesh mesh;
  const Eigen::Vector3d size = high - low;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const int base = static_cast<int>(mesh.vertices.size());
      for (int i = 0; i <= cuts; ++i) {
        for (int j = 0; j <= cuts; ++j) {
          Eigen::Vector3d p = low;
          p[axis] += side * size[axis];
          p[u] += size[u] * i / cuts;
          p[v] += size[v] * j / cuts;
          mesh.vertices.push_back(p);
        }
      }
      for (int i = 0; i < cuts; ++i) {
        for (int j = 0; j < cuts; ++j) {
          const int a = base + i * (cuts + 1) + j, b = a + cuts + 1, c = b + 1, d = a + 1;
          Eigen::Vector3i first(a, b, c), second(a, c, d);
          if (side == 0) {
            std::swap(first[1], first[2]);
            std::swap(second[1], second[2]);
          }
          mesh.triangles.push_back(first);
          mesh.triangles.push_back(second);
        }
      }
    }
  }
  return mesh;
}

/// The same vertices made one where they coincide exactly.
inline TriangleMesh joined(const TriangleMesh& mesh) {
  TriangleMesh result;
  std::map<std::array<double, 3>, int> known;
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& p = mesh.vertices[static_cast<std::size_t>(triangle[k])];
      const auto [place, is_new] = known.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(result.vertices.size()));
      if (is_new) result.vertices.push_back(p);
      corners[k] = place->second;
    }
    result.triangles.push_back(corners);
  }
  return result;
}

/// A sphere from an octahedron, each triangle cut in four `levels` times; vertices lie exactly on the sphere.
inline TriangleMesh sphere(const Eigen::Vector3d& centre, double radius, int levels) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    mesh.vertices.push_back(Eigen::Vector3d::Unit(axis));
    mesh.vertices.push_back(-Eigen::Vector3d::Unit(axis));
  }
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [place, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.vertices.size()));
      const auto at = [&](int i) { return mesh.vertices[static_cast<std::size_t>(i)]; };
      if (is_new) mesh.vertices.push_back((at(a) + at(b)).normalized());
      return place->second;
    };
    std::vector<Eigen::Vector3i> finer;
    for (const Eigen::Vector3i& t : mesh.triangles) {
      const int ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = centre + radius * vertex;
  return mesh;
}

/// Both meshes in one, side by side.
inline TriangleMesh together(const TriangleMesh& first, const TriangleMesh& second) {
  TriangleMesh mesh = first;
  const int offset = static_cast<int>(first.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), second.vertices.begin(), second.vertices.end());
  for (const Eigen::Vector3i& t : second.triangles) mesh.triangles.emplace_back(t.array() + offset);
  return mesh;
}

inline void flip(Eigen::Vector3i& triangle) { std::swap(triangle[1], triangle[2]); }

inline Eigen::Vector3d random_point(Random& random, double low, double high) {
  const double x = random.uniform(low, high), y = random.uniform(low, high), z = random.uniform(low, high);
  return {x, y, z};
}

/// Six times the signed volume: positive for a closed mesh that is wound outwards.
inline double sixfold_volume(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    sum += at(0).dot(at(1).cross(at(2)));
  }
  return sum;
}

}  // namespace asbuilt::test
