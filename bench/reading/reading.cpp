// SPDX-License-Identifier: Apache-2.0
// How fast large scans are read, beside other programs' readers in the same run:
//   asbuilt_reading FOLDER [POINTS]
// FOLDER receives the files. Each is read three times by every reader in turn; the fastest of each counts. All files
// are in the cache of the system by then, so this is the reader's own speed and not the disk's.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <span>
#include <stdexcept>

#include "../program.h"
#include "../stopwatch.h"
#include "asbuilt/core/random.h"
#include "asbuilt/io/e57_writer.h"
#include "asbuilt/io/ply_writer.h"
#include "asbuilt/io/scan_file.h"
#include "peers.h"

namespace asbuilt::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kRounds = 3;

struct Seconds {
  double wall = 1e30, processor = 1e30;
};

/// A wavy floor of 6 m by 6 m with noise.
std::vector<Eigen::Vector3f> scanned_floor(std::size_t count) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(count);
  Random random(1, "reading", 0);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = random.uniform(-3000.0, 3000.0), y = random.uniform(-3000.0, 3000.0);
    points.push_back(Eigen::Vector3d(x, y, 2000.0 + 30.0 * std::sin(0.01 * x) + 0.1 * random.normal()).cast<float>());
  }
  return points;
}

template <class T>
io::PlyColumn column(std::string name, const std::vector<T>& values) {
  return {std::move(name), std::span<const T>(values)};
}

Result<void> write_plys(const fs::path& folder, const std::vector<Eigen::Vector3f>& points) {
  std::vector<float> x, y, z, nx(points.size(), 0.0F), nz(points.size(), 1.0F);
  const std::vector<std::uint8_t> grey(points.size(), 128);
  for (const Eigen::Vector3f& point : points) x.push_back(point.x()), y.push_back(point.y()), z.push_back(point.z());
  const std::vector<double> wide_x(x.begin(), x.end()), wide_y(y.begin(), y.end()), wide_z(z.begin(), z.end());
  const std::vector<io::PlyColumn> bare{column("x", x), column("y", y), column("z", z)};
  const std::vector<io::PlyColumn> wide{column("x", wide_x), column("y", wide_y), column("z", wide_z)};
  const std::vector<io::PlyColumn> full{column("x", x),      column("y", y),        column("z", z),
                                        column("nx", nx),    column("ny", nx),      column("nz", nz),
                                        column("red", grey), column("green", grey), column("blue", grey)};
  ASBUILT_CHECK(io::write_ply(folder / "float.ply", bare));
  ASBUILT_CHECK(io::write_ply(folder / "double.ply", wide));
  return io::write_ply(folder / "normals_colours.ply", full);
}

Result<void> write_e57s(const fs::path& folder, const std::vector<Eigen::Vector3f>& points) {
  io::E57Scan scan;
  scan.name = "floor";
  for (const Eigen::Vector3f& point : points) scan.positions_mm.push_back(point.cast<double>());
  ASBUILT_CHECK(io::write_e57(folder / "float.e57", std::vector{scan}));
  scan.colours.assign(points.size(), {128, 128, 128});
  scan.intensities.assign(points.size(), 0.5F);
  ASBUILT_CHECK(io::write_e57(folder / "colours.e57", std::vector{scan}));
  if (write_integers_with_libe57(folder / "integers.e57", points)) return {};
  return fail(ErrorCode::not_possible, "libE57Format is not there: no integers.e57");
}

/// The fastest of several runs of one reader, and what it read.
class Timed {
 public:
  Timed(std::string name, std::function<std::optional<PointsRead>(const std::function<void()>& stop)> read)
      : name_(std::move(name)), read_(std::move(read)) {}

  void run() {
    const Stopwatch watch;
    Seconds seconds;
    const auto stop = [&] { seconds = {watch.seconds(), watch.cpu_seconds()}; };
    points_ = read_(stop);
    best_ = {std::min(best_.wall, seconds.wall), std::min(best_.processor, seconds.processor)};
  }
  [[nodiscard]] const std::optional<PointsRead>& points() const { return points_; }
  [[nodiscard]] std::string row(const std::string& file) const {
    const double millions = 1e-6 * static_cast<double>(points_->count);
    return fmt::format("| {} | {} | {:.2f} | {:.2f} | {:.1f} | {:.1f} |", file, name_, best_.wall, best_.processor,
                       millions / best_.wall, millions / best_.processor);
  }

 private:
  std::string name_;
  std::function<std::optional<PointsRead>(const std::function<void()>&)> read_;
  std::optional<PointsRead> points_;
  Seconds best_;
};

std::optional<PointsRead> read_with_asbuilt(const fs::path& path, const std::function<void()>& stop) {
  const auto scans = io::read_scans(path, io::Unit::stated);
  stop();
  if (!scans) throw std::runtime_error(scans.error().message);
  PointsRead read{scans->front().cloud.size()};
  for (const Eigen::Vector3f& position : scans->front().cloud.positions) read.sum_mm += position.cast<double>();
  return read;
}

void compare(const fs::path& path) {
  const double mm_per_unit = path.extension() == ".e57" ? 1000.0 : 1.0;
  const auto peer = [&](std::optional<PeerPoints> (*read)(const std::string&)) {
    return [&path, read, mm_per_unit](const std::function<void()>& stop) -> std::optional<PointsRead> {
      const auto points = read(path);
      stop();
      return points ? std::optional(points->summed(mm_per_unit)) : std::nullopt;
    };
  };
  std::vector<Timed> readers;
  readers.emplace_back("asbuilt", [&](const auto& stop) { return read_with_asbuilt(path, stop); });
  readers.emplace_back("Open3D", peer(read_with_open3d));
  readers.emplace_back("libE57Format", peer(read_with_libe57));
  for (int round = 0; round < kRounds; ++round) {
    for (Timed& reader : readers) reader.run();
  }
  const PointsRead ours = readers.front().points().value();
  for (const Timed& reader : readers) {
    if (!reader.points()) continue;
    const auto& points = *reader.points();
    // Float rounds each coordinate of some metres by 1e-4 mm at most.
    const double most_mm = 1e-3 * static_cast<double>(ours.count);
    if (points.count != ours.count || !((points.sum_mm - ours.sum_mm).cwiseAbs().maxCoeff() < most_mm)) {
      throw std::runtime_error(path.string() + ": the readers do not agree on the points");
    }
    fmt::print("{}\n", reader.row(path.filename().string()));
  }
}

int run(int argc, char** argv) {
  if (argc < 2) throw std::runtime_error("usage: asbuilt_reading FOLDER [POINTS]");
  const fs::path folder = argv[1];
  const std::size_t count = argc > 2 ? static_cast<std::size_t>(std::atof(argv[2])) : 10'000'000;
  fs::create_directories(folder);
  {
    const std::vector<Eigen::Vector3f> points = scanned_floor(count);
    if (const auto written = write_plys(folder, points); !written) throw std::runtime_error(written.error().message);
    if (const auto written = write_e57s(folder, points); !written) fmt::print(stderr, "{}\n", written.error().message);
  }
  fmt::print(
      "| file | reader | s | processor s | million points a second | and a processor second "
      "|\n|---|---|---|---|---|---|\n");
  for (const char* name :
       {"float.ply", "double.ply", "normals_colours.ply", "float.e57", "colours.e57", "integers.e57"}) {
    if (fs::exists(folder / name)) compare(folder / name);
  }
  return 0;
}

}  // namespace
}  // namespace asbuilt::bench

int main(int argc, char** argv) {
  return asbuilt::bench::run_program("asbuilt_reading", asbuilt::bench::run, argc, argv);
}
