# SPDX-License-Identifier: Apache-2.0
"""Surfaces of a reconstruction against the true one; a Markdown table. SCENE: simulate's folder, RESULT: reconstruct's."""
import json, math, subprocess, sys, time

import numpy as np
import open3d as o3d

SAMPLES = 200_000
NEAR_IN_SPACINGS = 3.0  # of a cloud point: there something was measured
SHARP_DEGREES = 30.0

scene, result = sys.argv[1:3]
truth = o3d.io.read_triangle_mesh(f"{scene}/as_built.ply")
cloud = o3d.io.read_point_cloud(f"{result}/reconstruction.ply")
sigma = json.load(open(f"{scene}/truth.json"))["noise_sigma"]
tree = o3d.geometry.KDTreeFlann(cloud)
points = np.asarray(cloud.points)
spacing = float(np.median([math.sqrt(tree.search_knn_vector_3d(p, 2)[2][1]) for p in points[:: max(1, len(points) // 2000)]]))


def caster(mesh):
    """For distances: without triangles that are none in single precision, at which Open3D gives up."""
    corners = np.asarray(mesh.vertices).astype(np.float32)[np.asarray(mesh.triangles)]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    whole = np.asarray(mesh.triangles)[area > 1e-7 * spacing * spacing]
    rays = o3d.t.geometry.RaycastingScene()
    rays.add_triangles(o3d.core.Tensor(np.asarray(mesh.vertices).astype(np.float32)),
                       o3d.core.Tensor(whole.astype(np.uint32)))
    return rays


def closest(rays, at):
    answer = rays.compute_closest_points(o3d.core.Tensor(np.asarray(at, dtype=np.float32)))
    return answer["points"].numpy().astype(float), answer["primitive_normals"].numpy().astype(float)


def distance(rays, at):
    return np.linalg.norm(closest(rays, at)[0] - at, axis=1)


def fitted_to(rays, at):
    """The small motion that lays points onto a surface, point to plane, robust: truth has another alignment than the report."""
    motion = np.eye(4)
    for _ in range(20):
        moved = at @ motion[:3, :3].T + motion[:3, 3]
        on, normal = closest(rays, moved)
        residual = np.einsum("ij,ij->i", normal, moved - on)
        weight = np.clip(1.0 - (residual / (4.685 * 1.4826 * np.median(np.abs(residual)))) ** 2, 0.0, None) ** 2
        jacobian = np.hstack([np.cross(moved, normal), normal])
        step = np.linalg.solve(jacobian.T @ (weight[:, None] * jacobian), -jacobian.T @ (weight * residual))
        turn = o3d.geometry.get_rotation_matrix_from_axis_angle(step[:3])
        update = np.eye(4)
        update[:3, :3], update[:3, 3] = turn, step[3:]
        motion = update @ motion
    return motion


def sharp_edge_points(mesh):
    """Points along the edges of the true part whose faces meet at more than SHARP_DEGREES, half a spacing apart."""
    corners, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    mesh.compute_triangle_normals()
    normals = np.asarray(mesh.triangle_normals)
    faces_of = {}
    for t, triangle in enumerate(triangles):
        for i in range(3):
            faces_of.setdefault(tuple(sorted((triangle[i], triangle[(i + 1) % 3]))), []).append(t)
    found = []
    for (a, b), faces in faces_of.items():
        if len(faces) != 2 or normals[faces[0]] @ normals[faces[1]] > math.cos(math.radians(SHARP_DEGREES)):
            continue
        steps = max(1, int(2.0 * np.linalg.norm(corners[b] - corners[a]) / spacing))
        found.append(corners[a] + (np.arange(steps)[:, None] + 0.5) / steps * (corners[b] - corners[a]))
    return np.concatenate(found)


def open_edges(mesh):
    return len(mesh.get_non_manifold_edges(allow_boundary_edges=False)) - len(
        mesh.get_non_manifold_edges(allow_boundary_edges=True))


def near_cloud(at):
    target = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(at))
    return np.asarray(target.compute_point_cloud_distance(aligned)) < NEAR_IN_SPACINGS * spacing


def by_pcl(program, *options):
    """A surface by one of PCL's programs, in the frame of the cloud."""
    base = f"{result}/../peer"
    bare = o3d.geometry.PointCloud(cloud.points)
    bare.normals = cloud.normals
    o3d.io.write_point_cloud(f"{base}.pcd", bare)
    for command in ([program, f"{base}.pcd", f"{base}.vtk", *options], ["pcl_vtk2ply", f"{base}.vtk", f"{base}.ply"]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return o3d.io.read_triangle_mesh(f"{base}.ply")


def poisson():
    """Cells of about a spacing."""
    extent = 1.25 * float(np.max(cloud.get_max_bound() - cloud.get_min_bound()))
    return by_pcl("pcl_poisson_reconstruction", "-depth", str(math.ceil(math.log2(extent / spacing))))


true_rays = caster(truth)
motion = fitted_to(true_rays, points)
aligned = o3d.geometry.PointCloud(cloud)
aligned.transform(motion)
# What was scanned of the true part, and of its edges.
true_samples = np.asarray(truth.sample_points_uniformly(SAMPLES).points)
true_samples = true_samples[near_cloud(true_samples)]
edges = sharp_edge_points(truth)
edges = edges[near_cloud(edges)]

print(f"{len(points)} points, spacing {spacing:.3g} mm, sigma {sigma:.3g} mm, {len(edges)} places on sharp edges that were scanned")
print("| surface | triangles | where measured: mean distance, mm | 99 % below, mm | true surface within 3 sigma, % | "
      "sharp edges: mean distance, mm | area where nothing was measured, % | its mean distance, mm | open edges | seconds |")
print("|" + "---|" * 10)
surfaces = [
    ("`mesh.ply`", lambda: o3d.io.read_triangle_mesh(f"{result}/mesh.ply")),
    ("`mesh_watertight.ply`", lambda: o3d.io.read_triangle_mesh(f"{result}/mesh_watertight.ply")),
    ("PCL, Poisson", poisson),
    ("PCL, greedy projection", lambda: by_pcl("pcl_gp3_surface", "-radius", str(4.0 * spacing), "-mu", "2.5")),
]
for name, make in surfaces:
    begin = time.monotonic()
    mesh = make()
    seconds = time.monotonic() - begin
    mesh.transform(motion)
    samples = np.asarray(mesh.sample_points_uniformly(SAMPLES).points)
    measured = near_cloud(samples)
    off = distance(true_rays, samples)
    rays = caster(mesh)
    made_up = off[~measured]
    print(f"| {name} | {len(mesh.triangles)} | {off[measured].mean():.3f} | {np.quantile(off[measured], 0.99):.3f} | "
          f"{100 * np.mean(distance(rays, true_samples) < 3 * sigma):.2f} | {distance(rays, edges).mean():.3f} | "
          f"{100 * np.mean(~measured):.1f} | {made_up.mean() if len(made_up) else float('nan'):.2f} | {open_edges(mesh)} | "
          f"{f'{seconds:.1f}' if name.startswith('PCL') else 'in the run'} |")
