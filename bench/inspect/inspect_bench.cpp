// SPDX-License-Identifier: Apache-2.0
// Inspection against simulated truth, and a cloud for the comparison of speed. bench/inspect/run calls it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "asbuilt/core/random.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/ply_writer.h"
#include "asbuilt/pipeline.h"
#include "asbuilt/simulate/parts.h"
#include "truth.h"

namespace asbuilt::bench {
namespace {

namespace fs = std::filesystem;

/// One line of points.csv.
struct MeasuredSpot {
  Eigen::Vector3d position, normal;
  bool scanned = false;
  double deviation = 0.0, error = 0.0;
  int scan = -1;  ///< that brought most of its points
};

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::stringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  return fields;
}

std::vector<MeasuredSpot> read_spots(const fs::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::vector<MeasuredSpot> spots;
  while (std::getline(file, line)) {
    const auto f = fields_of(line);
    MeasuredSpot spot;
    spot.position = {std::stod(f[0]), std::stod(f[1]), std::stod(f[2])};
    spot.normal = {std::stod(f[3]), std::stod(f[4]), std::stod(f[5])};
    spot.scanned = !f[6].empty();
    if (spot.scanned) spot.deviation = std::stod(f[6]);
    if (spot.scanned && !f[7].empty()) spot.error = std::stod(f[7]);
    if (spot.scanned && !f[10].empty()) spot.scan = std::stoi(f[10]);
    spots.push_back(spot);
  }
  return spots;
}

/// For each scan that report and truth have both placed, the motion from its true place to the reported one.
std::vector<std::optional<Pose>> pose_errors(const simulate::Simulation& simulation, const nlohmann::json& report) {
  std::vector<std::optional<Pose>> errors(simulation.scans.size());
  for (const auto& scan : report["scans"]) {
    const auto index = scan["index"].get<std::size_t>();
    const auto& truth = simulation.scans[index].model_from_scan;
    if (!scan["model_from_scan"].is_array() || !truth) continue;
    const auto numbers = scan["model_from_scan"].get<std::vector<double>>();
    Pose pose;
    pose.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
    errors[index] = pose * truth->inverse();
  }
  return errors;
}

/// What the errors of all scans have in common: by how much the report's alignment with the CAD is another than that
/// of truth, which goes by the whole part. About the part's centre, so that turns and shifts do not mix.
Pose common_motion(const std::vector<std::optional<Pose>>& errors, const Eigen::Vector3d& centre) {
  Eigen::Vector4d rotation = Eigen::Vector4d::Zero();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const auto& error : errors) {
    if (!error) continue;
    const Eigen::Quaterniond turn(error->linear());
    rotation += (turn.w() < 0.0 ? -1.0 : 1.0) * turn.coeffs();
    shift += *error * centre - centre;
    count += 1.0;
  }
  Pose common = Pose::Identity();
  if (count == 0.0) return common;
  common.linear() = Eigen::Quaterniond(rotation.normalized()).toRotationMatrix();
  common.translation() = centre + shift / count - common.linear() * centre;
  return common;
}

/// How far a spot is moved outwards by the error of the scan that brought most of its points: what no inspection of the
/// cloud can see.
double by_poses(const MeasuredSpot& spot, const std::vector<std::optional<Pose>>& errors) {
  if (spot.scan < 0 || !errors[static_cast<std::size_t>(spot.scan)]) return 0.0;
  return (*errors[static_cast<std::size_t>(spot.scan)] * spot.position - spot.position).dot(spot.normal);
}

double sigma_of(const std::vector<double>& values) {
  double sum = 0.0, squares = 0.0;
  for (const double v : values) sum += v, squares += v * v;
  const auto n = static_cast<double>(values.size());
  return std::sqrt(std::max(0.0, squares / n - sum / n * (sum / n)));
}

struct Options {
  int first = 0, scenes = 20, scans = 8, points = 60000;
  bool keep = false;  ///< the scenes and their reports
  std::uint64_t seed = 1;
  fs::path folder = "inspect_bench";
};

/// What is known of a scene, whatever its alignment.
struct Scene {
  const std::vector<MeasuredSpot>& spots;
  const nlohmann::json& report;
  const std::vector<simulate::Bump>& bumps;
  double sigma, limit;
};

/// Whether the report found a bump, and what it says of it; regions that it takes for it are marked as used.
nlohmann::ordered_json judged(const simulate::Bump& bump, const Scene& scene, const InspectionTruth& truth,
                              const std::vector<std::optional<Pose>>& pose_errors, std::vector<bool>& used) {
  std::vector<const MeasuredSpot*> about;
  std::size_t around = 0;
  double error_around = 0.0;
  for (const MeasuredSpot& spot : scene.spots) {
    const double distance = (spot.position - bump.centre_in_model).norm();
    if (distance > 1.3 * bump.radius_mm) continue;
    about.push_back(&spot);
    if (spot.normal.dot(bump.normal) < 0.5) continue;
    const auto deviation = truth.deviation(spot.position);
    if (!spot.scanned || !deviation || distance > 0.7 * bump.radius_mm) continue;
    ++around;
    error_around += spot.deviation - *deviation;
  }
  const auto is_scanned = [&](const Eigen::Vector3d& place) {
    const auto nearest = std::ranges::min_element(
        about, {}, [&](const MeasuredSpot* spot) { return (spot->position - place).squaredNorm(); });
    return nearest != about.end() && (*nearest)->scanned && (*nearest)->normal.dot(bump.normal) > 0.5;
  };
  const double peak = truth.peak(bump, is_scanned).value_or(0.0);
  nlohmann::ordered_json entry{{"height", bump.height_mm},
                               {"spots_scanned", around},
                               {"true_peak", peak},
                               {"radius", bump.radius_mm},
                               {"limit", scene.limit},
                               {"error_around", around > 0 ? error_around / static_cast<double>(around) : 0.0}};
  const auto& regions = scene.report["regions"];
  for (std::size_t r = 0; r < regions.size(); ++r) {
    const auto at = regions[r]["peak_at"].get<std::vector<double>>();
    const Eigen::Vector3d place(at[0], at[1], at[2]);
    const double found = regions[r]["peak"].get<double>();
    if ((place - bump.centre_in_model).norm() > 1.2 * bump.radius_mm || found * bump.height_mm < 0.0) continue;
    if (!used[r] && !entry.contains("peak")) {
      const double error = regions[r]["peak_standard_error"].get<double>();
      entry["peak"] = found;
      entry["standard_error"] = error;
      const auto nearest = std::ranges::min_element(
          scene.spots, {}, [&](const MeasuredSpot& spot) { return (spot.position - place).squaredNorm(); });
      entry["by_poses"] = by_poses(*nearest, pose_errors);
      entry["within"] = std::abs(found - peak) <= std::max(0.3 * scene.sigma, 3.0 * error);
    }
    used[r] = true;
  }
  return entry;
}

/// The figures of a report against what truth says, in one alignment of the true part with the CAD.
nlohmann::ordered_json judged(const Scene& scene, const InspectionTruth& truth,
                              const std::vector<std::optional<Pose>>& pose_errors) {
  std::vector<double> measured, expected, pulls;
  double mean_by_poses = 0.0, noise = 0.0;
  std::size_t visible = 0, scanned = 0, wrongly = 0, missed = 0;
  for (const MeasuredSpot& spot : scene.spots) {
    const bool seen = truth.is_visible(spot.position, spot.normal);
    visible += seen;
    scanned += spot.scanned;
    wrongly += spot.scanned && !seen;
    missed += !spot.scanned && seen;
    if (!spot.scanned) continue;
    const auto deviation = truth.deviation(spot.position);
    if (!deviation) continue;
    measured.push_back(spot.deviation);
    expected.push_back(*deviation);
    mean_by_poses += by_poses(spot, pose_errors);
    noise += spot.error * spot.error;
    if (spot.error > 0.0) pulls.push_back(std::abs(spot.deviation - *deviation) / spot.error);
  }
  const auto n = static_cast<double>(measured.size());
  double mean_error = 0.0;
  for (std::size_t i = 0; i < measured.size(); ++i) mean_error += (measured[i] - expected[i]) / n;
  const double spread = sigma_of(measured), true_spread = sigma_of(expected);
  const double without_noise = std::sqrt(std::max(0.0, spread * spread - noise / n));
  std::ranges::sort(pulls);

  nlohmann::ordered_json bumps = nlohmann::ordered_json::array();
  std::vector<bool> used(scene.report["regions"].size(), false);
  for (const simulate::Bump& bump : scene.bumps) bumps.push_back(judged(bump, scene, truth, pose_errors, used));
  int invented = 0;
  for (std::size_t r = 0; r < used.size(); ++r) {
    invented += !used[r] && scene.report["regions"][r]["significant"].get<bool>();
  }
  const auto all = static_cast<double>(scene.spots.size());
  return {{"coverage", static_cast<double>(scanned) / all},
          {"visible", static_cast<double>(visible) / all},
          {"scanned_unseen", static_cast<double>(wrongly) / all},
          {"seen_unscanned", static_cast<double>(missed) / all},
          {"mean_error_in_sigma", mean_error / scene.sigma},
          {"mean_by_poses_in_sigma", mean_by_poses / n / scene.sigma},
          {"spread", spread},
          {"spread_without_noise", without_noise},
          {"true_spread", true_spread},
          {"spread_error", without_noise / true_spread - 1.0},
          {"median_pull", pulls.empty() ? 0.0 : pulls[pulls.size() / 2]},
          {"bumps", bumps},
          {"invented", invented}};
}

/// One scene, the whole way from scans to report, and what truth says of it. Every other scene is undamaged.
nlohmann::ordered_json run_scene(const Options& options, int number, const Context& context) {
  simulate::SimulateOptions scene;
  scene.seed = options.seed + static_cast<std::uint64_t>(number);
  scene.scans = options.scans;
  scene.points = options.points;
  scene.pose = "any";
  scene.clutter_objects = 0;
  scene.clutter_low = scene.hidden_high = 0.0;
  scene.floor = false;
  const bool damaged = number % 2 == 0;
  scene.as_built.dents = damaged ? 2 : 0;
  scene.as_built.bosses = damaged ? 1 : 0;
  const TriangleMesh cad = simulate::valve_body();
  const auto simulation = simulate::simulate(cad, scene, context).value();
  const auto built = simulate::as_built(cad, scene.as_built, scene.seed).value();
  const double sigma = simulation.noise_sigma_mm;
  const fs::path folder = options.folder / fmt::format("scene_{:02}", number);
  fs::remove_all(folder);
  if (!simulate::write_simulation(folder, simulation)) return {{"error", "the scene was not written"}};

  std::vector<std::string> scans;
  for (const auto& scan : simulation.scans) scans.push_back((folder / (scan.name + ".ply")).string());
  pipeline::Options choice;
  // What the smooth warp does is within tolerance, with one sigma to spare; what was planted is not.
  const double limit = scene.as_built.warp_ratio * diameter(cad) + sigma;
  choice.inspect.tolerance = inspect::Tolerance{-limit, limit};
  const auto record = pipeline::reconstruct((folder / "model.ply").string(), scans, choice,
                                            {folder / "result", false, {}, {}}, context);
  if (!record) return {{"scene", number}, {"error", record.error().message}};

  std::ifstream file(folder / "result/report.json");
  const auto report = nlohmann::json::parse(file);
  const auto spots = read_spots(folder / "result/points.csv");
  const Scene seen{spots, report, built.bumps, sigma, limit};
  auto errors = pose_errors(simulation, report);
  nlohmann::ordered_json entry{{"scene", number}, {"sigma", sigma}};
  entry.update(judged(seen, InspectionTruth(simulation, Pose::Identity()), errors));
  const Pose common = common_motion(errors, bounding_box(cad).center());
  for (auto& error : errors) {
    if (error) error = *error * common.inverse();
  }
  entry["alike_aligned"] = judged(seen, InspectionTruth(simulation, common), errors);
  entry["alike_aligned"]["alignment_in_sigma"] =
      (common * bounding_box(cad).center() - bounding_box(cad).center()).norm() / sigma;
  if (!options.keep) fs::remove_all(folder);
  return entry;
}

/// How many of the scenes and bumps meet what is asked for.
struct Tally {
  int coverage = 0, mean = 0, spread = 0, bumps = 0, found = 0, within = 0, invented = 0;
  std::vector<double> pulls;

  std::string add(const nlohmann::ordered_json& scene) {
    int here = 0, here_found = 0, here_within = 0;
    for (const auto& bump : scene["bumps"]) {
      // Not seen well enough to be measured, or taken back by the warp so far that it is within tolerance.
      if (bump["spots_scanned"].get<int>() < 12) continue;
      if (std::abs(bump["true_peak"].get<double>()) <= bump["limit"].get<double>()) continue;
      ++here;
      here_found += bump.contains("peak");
      here_within += bump.value("within", false);
    }
    const auto number = [&](const char* name) { return scene[name].get<double>(); };
    bumps += here, found += here_found, within += here_within, invented += scene["invented"].get<int>();
    coverage += std::abs(number("coverage") - number("visible")) <= 0.01;
    mean += std::abs(number("mean_error_in_sigma")) <= 0.1;
    spread += std::abs(number("spread_error")) <= 0.05;
    pulls.push_back(number("median_pull"));
    return fmt::format("{:8.4f}  {:7.4f}  {:+10.3f}  {:+9.2f} %  {}/{} of {}  {:8}  {:4.2f}", number("coverage"),
                       number("visible"), number("mean_error_in_sigma"), 100.0 * number("spread_error"), here_found,
                       here_within, here, scene["invented"].get<int>(), number("median_pull"));
  }

  void print(std::string_view how, int scenes) {
    if (pulls.empty()) return;
    std::ranges::sort(pulls);
    fmt::print(
        "{}, {} scenes: coverage within 1 % in {}, mean within 0.1 sigma in {}, spread within 5 % in {}; of {} bumps {} "
        "found, {} within max(0.3 sigma, 3 standard errors); {} invented; errors of spots are {:.2f} standard errors in "
        "the median (honest: 0.67)\n",
        how, scenes, coverage, mean, spread, bumps, found, within, invented, pulls[pulls.size() / 2]);
  }
};

int run_scenes(const Options& options) {
  const Context context;
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  Tally as_placed, alike_aligned;
  int done = 0;
  fmt::print("scene             coverage  visible  mean/sigma  spread err  bumps found/within  invented  pull\n");
  for (int i = options.first; i < options.first + options.scenes; ++i) {
    const auto scene = run_scene(options, i, context);
    all.push_back(scene);
    if (scene.contains("error")) {
      fmt::print("{:5}  {}\n", i, scene["error"].get<std::string>());
      continue;
    }
    ++done;
    fmt::print("{:5}  as placed  {}\n", i, as_placed.add(scene));
    fmt::print("       aligned    {}\n", alike_aligned.add(scene["alike_aligned"]));
    std::fflush(stdout);
  }
  as_placed.print("truth as placed", done);
  alike_aligned.print("truth in the report's alignment", done);
  std::ofstream(options.folder / "scenes.json") << all.dump(1) << "\n";
  return 0;
}

/// The demonstration part with at least 100 000 triangles, and points on it with noise.
int write_speed_input(const Options& options, std::size_t points) {
  const TriangleMesh mesh = simulate::valve_body(3.0);
  fs::create_directories(options.folder);
  if (!io::write_mesh_ply(options.folder / "model.ply", mesh)) return 1;
  std::vector<double> up_to;
  double total = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) up_to.push_back(total += doubled_area_vector(mesh, i).norm());
  Random random(options.seed, "speed", 0);
  std::vector<float> x, y, z;
  for (std::size_t i = 0; i < points; ++i) {
    const auto t = static_cast<std::size_t>(std::ranges::upper_bound(up_to, random.uniform() * total) - up_to.begin());
    const Eigen::Vector3i& corners = mesh.triangles[std::min(t, mesh.triangles.size() - 1)];
    const double root = std::sqrt(random.uniform()), share = random.uniform();
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(corners[k])]; };
    const Eigen::Vector3d normal = (at(1) - at(0)).cross(at(2) - at(0)).normalized();
    const Eigen::Vector3d p = at(0) + root * (1.0 - share) * (at(1) - at(0)) + root * share * (at(2) - at(0)) +
                              0.1 * random.normal() * normal;
    x.push_back(static_cast<float>(p.x()));
    y.push_back(static_cast<float>(p.y()));
    z.push_back(static_cast<float>(p.z()));
  }
  const std::vector<io::PlyColumn> columns{
      {"x", std::span<const float>(x)}, {"y", std::span<const float>(y)}, {"z", std::span<const float>(z)}};
  fmt::print("{} triangles, {} points in {}\n", mesh.triangles.size(), points, options.folder.string());
  return io::write_ply(options.folder / "cloud.ply", columns) ? 0 : 1;
}

}  // namespace
}  // namespace asbuilt::bench

int main(int argc, char** argv) {
  asbuilt::bench::Options options;
  std::size_t speed_points = 0;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--first") options.first = std::stoi(value);
    if (name == "--keep") options.keep = value != "0";
    if (name == "--scenes") options.scenes = std::stoi(value);
    if (name == "--scans") options.scans = std::stoi(value);
    if (name == "--points") options.points = std::stoi(value);
    if (name == "--seed") options.seed = std::stoull(value);
    if (name == "--folder") options.folder = value;
    if (name == "--speed-input") speed_points = std::stoull(value);
  }
  return speed_points > 0 ? asbuilt::bench::write_speed_input(options, speed_points)
                          : asbuilt::bench::run_scenes(options);
}
