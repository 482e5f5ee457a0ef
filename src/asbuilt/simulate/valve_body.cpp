// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "asbuilt/simulate/implicit_mesh.h"
#include "asbuilt/simulate/parts.h"

// The valve body as a solid: rough casting with fillets first, machining (flat faces, bores, holes) after.
namespace asbuilt::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

// Union with a fillet of about `radius`.
double joined(double a, double b, double radius) {
  const double overlap = std::max(radius - std::abs(a - b), 0.0) / radius;
  return std::min(a, b) - 0.25 * overlap * overlap * radius;
}

double without(double body, double tool) { return std::max(body, -tool); }

// A straight axis with its own cross directions, along which pipes, flanges and bores are laid.
struct Axis {
  Vector3d origin, along, u, v;

  Axis(const Vector3d& from, const Vector3d& direction, const Vector3d& up = Vector3d::UnitZ())
      : origin(from), along(direction.normalized()) {
    u = (up - up.dot(along) * along).normalized();
    v = along.cross(u);
  }
  [[nodiscard]] Vector3d local(const Vector3d& p) const {
    const Vector3d d = p - origin;
    return {d.dot(u), d.dot(v), d.dot(along)};
  }
};

double tube(const Axis& axis, const Vector3d& p, double radius, double from, double to) {
  const Vector3d q = axis.local(p);
  const double side = std::hypot(q.x(), q.y()) - radius, end = std::max(from - q.z(), q.z() - to);
  return std::min(std::max(side, end), 0.0) + std::hypot(std::max(side, 0.0), std::max(end, 0.0));
}

double block(const Axis& axis, const Vector3d& p, const Vector3d& half, const Vector3d& centre, double round) {
  const Vector3d q = (axis.local(p) - centre).cwiseAbs() - half + Vector3d::Constant(round);
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - round;
}

double bolt_circle(const Axis& axis, const Vector3d& p, double circle_radius, double hole_radius, int holes,
                   double phase, double from) {
  const Vector3d q = axis.local(p);
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < holes; ++i) {
    const double angle = phase + 2.0 * kPi * i / holes;
    const double side = std::hypot(q.x() - circle_radius * std::cos(angle), q.y() - circle_radius * std::sin(angle));
    nearest = std::min(nearest, side - hole_radius);
  }
  return std::max(nearest, from - q.z());
}

const Axis kInlet(Vector3d(0, 0, 0), Vector3d(-1, 0.05, 0));
const Axis kOutlet(Vector3d(5, 0, -4), Vector3d(0.88, 0.46, -0.1));
const Axis kBonnet(Vector3d(0, 0, 0), Vector3d(0.12, -0.22, 1), Vector3d::UnitX());
const Axis kDrain(Vector3d(10, 0, -12), Vector3d(0.25, -1, -0.25));
const Axis kGauge(Vector3d(-58, 0, 0), Vector3d(0.1, 0.75, 0.65));
const Axis kLug(60 * kBonnet.v + 78 * kBonnet.along - 10 * kBonnet.u, kBonnet.u);
const Axis kWorld(Vector3d::Zero(), Vector3d::UnitZ(), Vector3d::UnitX());

double casting(const Vector3d& p) {
  const Vector3d bulb = (p - Vector3d(0, 0, -4)).cwiseQuotient(Vector3d(82, 70, 66));
  double body = (bulb.norm() - 1.0) * 66.0;
  body = joined(body, tube(kInlet, p, 43, 0, 145), 22);
  body = joined(body, tube(kOutlet, p, 37, 0, 128), 20);
  body = joined(body, tube(kBonnet, p, 48, 0, 112), 18);
  body = joined(body, tube(kInlet, p, 82, 140, 164), 8);
  body = joined(body, tube(kOutlet, p, 66, 122, 142), 7);
  body = joined(body, block(kBonnet, p, {66, 54, 10}, {6, 0, 112}, 9), 7);
  // Foot: a web under the bulb, then the plate.
  body = joined(body, block(kWorld, p, {16, 40, 38}, {-8, 4, -82}, 6), 12);
  body = joined(body, block(kWorld, p, {40, 12, 38}, {-8, 4, -82}, 6), 12);
  body = joined(body, block(kWorld, p, {78, 52, 9}, {-14, 8, -122}, 6), 8);
  // Ribs from the flanges to the body, none opposite another.
  body = joined(body, block(kInlet, p, {30, 6, 34}, {44, 0, 112}, 3), 6);
  body = joined(body, block(kInlet, p, {6, 28, 38}, {0, 42, 108}, 3), 6);
  body = joined(body, block(kOutlet, p, {26, 5.5, 32}, {-36, 0, 96}, 3), 6);
  body = joined(body, block(kBonnet, p, {32, 6, 26}, {38, 0, 82}, 3), 6);
  // Bosses: drain, gauge, and a square pad for the name plate.
  body = joined(body, tube(kDrain, p, 24, 40, 92), 9);
  body = joined(body, tube(kGauge, p, 17, 20, 68), 7);
  body = joined(body, block(kWorld, p, {30, 12, 20}, {12, 62, 12}, 4), 5);
  // Lifting lug on the bonnet's neck.
  return joined(body, block(kBonnet, p, {7, 24, 22}, {-10, 56, 74}, 4), 6);
}

double machined(const Vector3d& p) {
  double body = casting(p);
  // Raised sealing faces stand on two of the flanges.
  body = std::min(body, tube(kInlet, p, 54, 160, 168));
  body = std::min(body, tube(kBonnet, p, 45, 118, 127));
  // The cavity and the ways into it.
  body = without(body, (p - Vector3d(0, 0, -2)).cwiseQuotient(Vector3d(60, 50, 46)).norm() * 46.0 - 46.0);
  body = without(body, tube(kInlet, p, 31, 0, 200));
  body = without(body, tube(kOutlet, p, 25, 0, 200));
  body = without(body, tube(kOutlet, p, 33, 134, 200));
  body = without(body, tube(kBonnet, p, 34, 0, 200));
  body = without(body, tube(kDrain, p, 11, 30, 120));
  body = without(body, tube(kGauge, p, 7.5, 40, 90));
  body = without(body, tube(kLug, p, 9.5, -40, 40));
  // Bolt holes: eight, five and four.
  body = without(body, bolt_circle(kInlet, p, 68, 8, 8, kPi / 8, 130));
  body = without(body, bolt_circle(kOutlet, p, 52, 7, 5, 0.0, 110));
  const Vector3d on_bonnet = kBonnet.local(p);
  for (const auto& [x, y] : {std::pair{60.0, 40.0}, {-48.0, 40.0}, {60.0, -40.0}, {-48.0, -40.0}}) {
    body = without(body, std::max(std::hypot(on_bonnet.x() - x, on_bonnet.y() - y) - 7.5, 90 - on_bonnet.z()));
  }
  // Foot: two round holes on one side, a slot on the other, one corner off.
  for (const double y : {-28.0, 42.0}) body = without(body, tube(kWorld, p - Vector3d(46, y, 0), 8.5, -140, -100));
  body = without(body, block(kWorld, p, {9, 26, 30}, {-76, 8, -122}, 8.5));
  const Vector3d corner = (Vector3d(1, -1, 0)).normalized();
  body = std::max(body, p.z() < -100 ? corner.dot(p - Vector3d(64, -30, 0)) : -1e9);
  return body;
}

}  // namespace

TriangleMesh valve_body(double cell_mm) {
  return surface_of(machined, {Vector3d(-190, -130, -140), Vector3d(180, 150, 150)}, cell_mm);
}

}  // namespace asbuilt::simulate
