// SPDX-License-Identifier: Apache-2.0
#include "parts.h"

#include <array>
#include <numbers>
#include <utility>

#include "asbuilt/io/mesh_file.h"
#include "asbuilt/simulate/parts.h"

namespace asbuilt::bench {
namespace {

constexpr double kPi = std::numbers::pi;

constexpr int kContinuous = 720;

/// A file of the CAD folder. What is said of its symmetry was measured (`asbuilt_detection parts`). The unit makes the
/// part some decimetres large where the file only says "size 1", or is a model of a model.
struct CadFile {
  const char* file;
  Group group;
  const char* family;
  bool is_own_mirror;
  io::Unit unit;
  int fold = 1;  ///< turns about an axis through the middle of the box that map the part onto itself
  int axis = 2;
};
constexpr std::array kCadFiles{
    CadFile{"housing_TR12J.stl", Group::distinct, "casting", false, io::Unit::millimetre},
    CadFile{"flange_bearing.stl", Group::distinct, "flange", false, io::Unit::millimetre},
    CadFile{"motor_assembly.stl", Group::distinct, "casting", false, io::Unit::millimetre},
    CadFile{"anchor_bracket.off", Group::distinct, "bracket", true, io::Unit::metre},
    CadFile{"linkrod.stl", Group::distinct, "rod", true, io::Unit::inch},
    CadFile{"frame.stl", Group::distinct, "rod", true, io::Unit::millimetre},
    CadFile{"hinge.stl", Group::distinct, "bracket", true, io::Unit::millimetre},
    CadFile{"pipe_clamp_half.stl", Group::distinct, "bracket", true, io::Unit::millimetre},
    CadFile{"screw_sym.stl", Group::symmetric, "rod", true, io::Unit::millimetre, 2},
    CadFile{"turbine_rotor_sym.off", Group::symmetric, "flange", true, io::Unit::metre, kContinuous, 0},
};

Pose turned(const Eigen::Vector3d& axis, double angle, const Eigen::Vector3d& centre) {
  return Eigen::Translation3d(centre) * Eigen::AngleAxisd(angle, axis.normalized()) * Eigen::Translation3d(-centre);
}

// Turns about an axis through the centre; `fold` of them make a whole one.
std::vector<Pose> turns(const Eigen::Vector3d& axis, int fold, const Eigen::Vector3d& centre) {
  std::vector<Pose> poses;
  for (int i = 1; i < fold; ++i) poses.push_back(turned(axis, 2.0 * kPi * i / fold, centre));
  return poses;
}

// The turns about z, and each of them after half a turn about x.
std::vector<Pose> with_flip(std::vector<Pose> about_z) {
  const Pose flip = turned(Eigen::Vector3d::UnitX(), kPi, Eigen::Vector3d::Zero());
  std::vector<Pose> all = about_z;
  all.push_back(flip);
  for (const Pose& turn : about_z) all.push_back(turn * flip);
  return all;
}

}  // namespace

const char* name_of(Group group) { return group == Group::distinct ? "distinct" : "symmetric"; }

std::vector<SuitePart> own_parts() {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ(), origin = Eigen::Vector3d::Zero();
  std::vector<SuitePart> parts;
  const auto add = [&](const char* name, const char* family, bool is_own_mirror, TriangleMesh mesh) {
    parts.push_back({name, Group::distinct, family, is_own_mirror, std::move(mesh), {}});
  };
  const auto add_symmetric = [&](const char* name, const char* family, TriangleMesh mesh, std::vector<Pose> group) {
    parts.push_back({name, Group::symmetric, family, true, std::move(mesh), std::move(group)});
  };
  add("valve_body", "casting", false, simulate::valve_body());
  add("stepped_block", "bracket", false, simulate::stepped_block());
  add("l_profile", "rod", true, simulate::l_profile(120.0, 80.0, 12.0, 300.0));

  // Turned by half about the line that halves the bend's 90 degrees.
  add_symmetric("pipe_elbow", "flange", simulate::pipe_elbow(150.0, 50.0, 5.0),
                turns(Eigen::Vector3d(1.0, 1.0, 0.0), 2, origin));
  add_symmetric("flange", "flange", simulate::flange(120.0, 24.0, 6, 3.0), turns(z, 6, origin));
  add_symmetric("box", "box", simulate::box({300.0, 200.0, 120.0}), with_flip(turns(z, 2, origin)));
  add_symmetric("plate", "box", simulate::box({300.0, 200.0, 10.0}), with_flip(turns(z, 2, origin)));
  add_symmetric("cylinder", "rod", simulate::cylinder(60.0, 200.0, 96), with_flip(turns(z, kContinuous, origin)));
  return parts;
}

Result<std::vector<SuitePart>> parts_of(const std::filesystem::path& cad_folder) {
  std::vector<SuitePart> parts;
  for (const CadFile& cad : kCadFiles) {
    const std::filesystem::path path = cad_folder / cad.file;
    if (!std::filesystem::exists(path)) continue;
    ASBUILT_TRY(mesh, io::read_mesh(path, cad.unit));
    parts.push_back({path.stem().string(), cad.group, cad.family, cad.is_own_mirror, std::move(mesh), {}});
    parts.back().symmetries =
        turns(Eigen::Vector3d::Unit(cad.axis), cad.fold, bounding_box(parts.back().mesh).center());
  }
  return parts;
}

}  // namespace asbuilt::bench
