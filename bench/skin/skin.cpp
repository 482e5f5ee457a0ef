// SPDX-License-Identifier: Apache-2.0
// asbuilt_skin_bench: how much of a model nobody can see, before and after `prepare`, and whether `prepare` lost
// anything that can be seen. By brute force, with nothing of the code that makes the skin.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "../program.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/model/prepared_model.h"
#include "brute_visibility.h"

namespace asbuilt::bench {
namespace {

constexpr double kLiftOff = 1e-5;  // of the diameter
constexpr int kPlainly = 10;       // viewpoints that see a spot which cannot be overlooked

struct Arguments {
  std::vector<std::string> models;
  std::string json, skins;
  std::size_t spots = 40000, viewpoints = 2000;
  int threads = 0;
};

struct Figures {
  std::string name;
  std::size_t triangles = 0, skin_triangles = 0, open_edges = 0;
  double area = 0.0, skin_area = 0.0;              ///< mm^2
  double hidden_before = 0.0, hidden_after = 0.0;  ///< share of the area that no viewpoint sees
  double whole_faces_hidden_after = 0.0;           ///< the part of hidden_after on faces of which no spot is seen
  double visible_lost = 0.0, plainly_visible_lost = 0.0;  ///< share of the visible area that the skin has not
  double extent_lost_mm = 0.0;                            ///< of the box's diagonal
};

double share(std::size_t count, std::size_t of) {
  return of > 0 ? static_cast<double>(count) / static_cast<double>(of) : 0.0;
}

std::string line_of(const Spot& spot, int views) {
  const Eigen::Vector3d &p = spot.position, &n = spot.normal;
  return fmt::format("{},{},{},{},{},{},{}\n", p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), views);
}

Result<Figures> figures_of(const std::string& path, const Arguments& args, const Context& context) {
  ASBUILT_TRY(file, io::read_model(path, {}));
  const TriangleMesh& mesh = file.mesh;
  ASBUILT_TRY(prepared, model::prepare(mesh, {}, context));
  const TriangleMesh& skin = prepared.skin;
  const double whole = diameter(mesh), lift_off = kLiftOff * whole;
  const model::RayScene scene(mesh), skin_scene(skin);
  const std::vector<Eigen::Vector3d> viewpoints = viewpoints_around(mesh, args.viewpoints);

  Figures figures;
  figures.name = std::filesystem::path(path).filename().string();
  figures.triangles = mesh.triangles.size();
  figures.skin_triangles = skin.triangles.size();
  figures.open_edges = prepared.report.open_edges;
  figures.area = surface_area(mesh);
  figures.skin_area = surface_area(skin);
  figures.extent_lost_mm = whole - diameter(skin);

  const std::vector<Spot> spots = spots_on(mesh, args.spots);
  std::ofstream lost_spots;
  if (!args.skins.empty()) lost_spots.open(std::filesystem::path(args.skins) / (figures.name + ".lost.csv"));
  const std::vector<int> views = views_of(spots, viewpoints, scene, lift_off, kPlainly, context);
  std::size_t visible = 0, plainly = 0, lost = 0, plainly_lost = 0;
  for (std::size_t i = 0; i < spots.size(); ++i) {
    if (views[i] == 0) continue;
    const Eigen::Vector3d above = spots[i].position + lift_off * spots[i].normal;
    const bool is_there = skin_scene.is_blocked(above, -spots[i].normal, 0.0, 2.0 * lift_off);
    if (!is_there && lost_spots.is_open()) lost_spots << line_of(spots[i], views[i]);
    ++visible;
    plainly += views[i] == kPlainly ? 1 : 0;
    lost += is_there ? 0 : 1;
    plainly_lost += views[i] == kPlainly && !is_there ? 1 : 0;
  }
  figures.hidden_before = 1.0 - share(visible, spots.size());
  figures.visible_lost = share(lost, visible);
  figures.plainly_visible_lost = share(plainly_lost, plainly);

  // Seen against the whole model: what the skin left out hides nothing any more, but it is still there in reality.
  const std::vector<Spot> skin_spots = spots_on(skin, args.spots);
  const std::vector<int> skin_views = views_of(skin_spots, viewpoints, scene, lift_off, 1, context);
  std::vector<std::uint8_t> is_seen(skin.triangles.size(), 0);
  for (std::size_t i = 0; i < skin_spots.size(); ++i) {
    if (skin_views[i] > 0) is_seen[skin_spots[i].triangle] = 1;
  }
  std::size_t hidden = 0, on_hidden_faces = 0;
  for (std::size_t i = 0; i < skin_spots.size(); ++i) {
    if (skin_views[i] > 0) continue;
    ++hidden;
    on_hidden_faces += is_seen[skin_spots[i].triangle] != 0 ? 0 : 1;
  }
  figures.hidden_after = share(hidden, skin_spots.size());
  figures.whole_faces_hidden_after = share(on_hidden_faces, skin_spots.size());

  if (!args.skins.empty()) {
    const auto ply = std::filesystem::path(args.skins) / (figures.name + ".skin.ply");
    ASBUILT_CHECK(io::write_mesh_ply(ply, skin));
    std::ofstream seen(std::filesystem::path(args.skins) / (figures.name + ".spots.csv"));
    for (std::size_t i = 0; i < skin_spots.size(); ++i) seen << line_of(skin_spots[i], skin_views[i]);
  }
  return figures;
}

nlohmann::ordered_json to_json(const Figures& f) {
  return {{"model", f.name},
          {"triangles", f.triangles},
          {"skin_triangles", f.skin_triangles},
          {"open_edges", f.open_edges},
          {"area_mm2", f.area},
          {"skin_area_mm2", f.skin_area},
          {"hidden_before", f.hidden_before},
          {"hidden_after", f.hidden_after},
          {"whole_faces_hidden_after", f.whole_faces_hidden_after},
          {"visible_lost", f.visible_lost},
          {"plainly_visible_lost", f.plainly_visible_lost},
          {"extent_lost_mm", f.extent_lost_mm}};
}

int run(int argc, char** argv) {
  Arguments args;
  CLI::App app("What of a model can be seen, before and after prepare (bench/README.md)");
  app.add_option("models", args.models, "model files")->required();
  app.add_option("--json", args.json, "file for the figures");
  app.add_option("--skins", args.skins, "folder for the skins as PLY and their spots as CSV (x y z nx ny nz seen)");
  app.add_option("--spots", args.spots, "spots on the surface")->capture_default_str();
  app.add_option("--viewpoints", args.viewpoints, "where a scanner may stand")->capture_default_str();
  app.add_option("--threads", args.threads, "0: all cores");
  CLI11_PARSE(app, argc, argv);

  const Context context(args.threads);
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  fmt::print(
      "| model | triangles | of the skin | open edges | hidden before % | hidden after % | on whole faces % | "
      "visible lost % | plainly visible lost % |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const std::string& path : args.models) {
    const auto figures = figures_of(path, args, context);
    if (!figures) {
      fmt::print(stderr, "asbuilt_skin_bench: {}\n", figures.error().message);
      return 1;
    }
    const Figures& f = *figures;
    fmt::print("| {} | {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.3f} | {:.3f} |\n", f.name, f.triangles,
               f.skin_triangles, f.open_edges, 100.0 * f.hidden_before, 100.0 * f.hidden_after,
               100.0 * f.whole_faces_hidden_after, 100.0 * f.visible_lost, 100.0 * f.plainly_visible_lost);
    std::fflush(stdout);
    all.push_back(to_json(f));
  }
  if (args.json.empty()) return 0;
  std::ofstream file(args.json);
  file << all.dump(1) << "\n";
  file.close();
  if (file) return 0;
  fmt::print(stderr, "asbuilt_skin_bench: {}: cannot be written\n", args.json);
  return 1;
}

}  // namespace
}  // namespace asbuilt::bench

int main(int argc, char** argv) {
  return asbuilt::bench::run_program("asbuilt_skin_bench", asbuilt::bench::run, argc, argv);
}
