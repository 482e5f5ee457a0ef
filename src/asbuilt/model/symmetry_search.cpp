// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/symmetry_search.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::model {
namespace {

constexpr double kPi = std::numbers::pi;

// Lengths are shares of the diameter.
constexpr double kTolerance = 0.005;    // as verify's deviation_ratio: an as-built part may be off by as much
constexpr double kUnseen = 0.025;       // edge of the square that a scan need not show
constexpr double kSameMotion = 0.01;    // displacement up to which two motions are one
constexpr float kFacing = 0.5F;         // cosine: normals closer than 60 degrees agree; coarse facets differ by much
constexpr double kNearShare = 0.6;      // of the surface, from which a motion is a near-symmetry
constexpr double kRippleShare = 0.5;    // of all rotations about an axis, from which single ones need be better
constexpr double kNearAxisShare = 0.8;  // the same for all rotations about an axis
constexpr std::size_t kMostNear = 24;   // near-symmetries that are kept
constexpr std::size_t kMostElements = 256;     // of a discrete group
constexpr double kGolden = 2.399963229728653;  // radians: multiples never repeat

constexpr std::size_t kFirstSamples = 60, kCoarseSamples = 250, kProfileSamples = 400, kFineSamples = 1000;
constexpr int kGridAxes = 128;              // on the half sphere: 13 degrees apart
constexpr double kGridStep = kPi / 12.0;    // of the angle about each
constexpr double kCoarseReach = 0.08;       // what half a step of the grid displaces
constexpr double kLeastCoarseScore = 0.25;  // of 1: the beginning is not worth refining
constexpr std::size_t kMostScored = 400, kMostStarts = 48;

struct Axis {
  Eigen::Vector3d direction, point;
};

struct Found {
  Pose motion;
  SelfMatch match;
};

double angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) { return rotation_angle(a.transpose() * b); }

Eigen::Vector3d with_sign(const Eigen::Vector3d& direction) {
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  return direction[largest] < 0.0 ? Eigen::Vector3d(-direction) : direction;
}

// The line that a rotation leaves in its place, near `about`.
Axis axis_of(const Pose& motion, const Eigen::Vector3d& about) {
  const Eigen::AngleAxisd turn(motion.linear());
  const Eigen::Vector3d direction = turn.axis();
  const Eigen::Vector3d shift = motion * about - about;
  const Eigen::Vector3d across = shift - direction.dot(shift) * direction;
  // x = about + u with u across the axis and (I - R) u = shift: a half of the chord and its height.
  const double tangent = std::tan(0.5 * turn.angle());
  const Eigen::Vector3d offset = 0.5 * (across + direction.cross(across) / tangent);
  return {with_sign(direction), about + offset};
}

std::vector<Eigen::Vector3d> half_sphere(int count) {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < count; ++i) {
    const double z = (static_cast<double>(i) + 0.5) / count, radius = std::sqrt(1.0 - z * z);
    const double angle = kGolden * static_cast<double>(i);
    directions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  return directions;
}

}  // namespace

struct SelfMatching::Implementation {
  const PreparedModel& model;
  KdTree tree;
  float tolerance, lateral;
  double area_each;

  explicit Implementation(const PreparedModel& the_model)
      : model(the_model),
        tree(the_model.dense_samples.positions),
        tolerance(static_cast<float>(kTolerance * the_model.diameter)),
        area_each(the_model.dense_sample_area_mm2) {
    lateral = 1.5F * static_cast<float>(std::sqrt(area_each));
  }

  // The field answers for most; what it calls doubtful (its voxels round off edges and thin walls) is asked exactly.
  [[nodiscard]] bool agrees(const Eigen::Vector3f& image, const Eigen::Vector3f& normal) const {
    const DistanceField::Sample sample = model.field->at(image);
    if (!sample.known()) return false;
    const auto voxel = static_cast<float>(model.field->voxel_mm());
    const float distance = std::abs(sample.distance);
    if (distance > tolerance + voxel) return false;
    const auto faces_alike = [&](std::size_t triangle) { return model.face_normals[triangle].dot(normal) > kFacing; };
    if (distance < 0.5F * tolerance && faces_alike(static_cast<std::size_t>(sample.triangle))) return true;
    const SurfaceDistance::Nearest nearest = model.surface->nearest(image.cast<double>(), tolerance);
    if (!nearest.found()) return false;
    if (faces_alike(nearest.triangle)) return true;
    // Next to an edge, the nearest face may be the other one.
    const auto facing =
        tree.nearest_facing(image, std::hypot(lateral, tolerance), model.dense_samples.normals, normal, kFacing);
    if (!facing.found()) return false;
    const Eigen::Vector3f offset = image - model.dense_samples.positions[facing.index];
    return std::abs(offset.dot(model.dense_samples.normals[facing.index])) <= tolerance;
  }
};

SelfMatching::SelfMatching(const PreparedModel& model) : implementation_(std::make_unique<Implementation>(model)) {}
SelfMatching::~SelfMatching() = default;
SelfMatching::SelfMatching(SelfMatching&&) noexcept = default;
SelfMatching& SelfMatching::operator=(SelfMatching&&) noexcept = default;

SelfMatch SelfMatching::match(const Pose& motion) const {
  const PointCloud& samples = implementation_->model.dense_samples;
  const Eigen::Isometry3f moved = motion.cast<float>();
  SelfMatch result;
  std::size_t broken = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (implementation_->agrees(moved * samples.positions[i], moved.linear() * samples.normals[i])) continue;
    ++broken;
    result.breaks_at += samples.positions[i].cast<double>();
  }
  if (broken > 0) result.breaks_at /= static_cast<double>(broken);
  result.broken_area = static_cast<double>(broken) * implementation_->area_each;
  result.share = 1.0 - static_cast<double>(broken) / static_cast<double>(samples.size());
  return result;
}

bool SelfMatching::is_symmetry(const SelfMatch& match) const {
  const double edge = kUnseen * implementation_->model.diameter;
  return match.broken_area <= edge * edge;
}

namespace {

class Search {
 public:
  Search(const PreparedModel& model, const Context& context)
      : model_(model), context_(context), matching_(model), centre_(centroid()) {}

  [[nodiscard]] SymmetryGroup run() {
    std::vector<Found> found = matched(refined_from_afar(coarse_starts()));
    for (const Axis& axis : candidate_axes(found)) {
      std::vector<Found> about = matched(refined_from_afar(starts_about(axis)));
      found.insert(found.end(), about.begin(), about.end());
    }
    std::ranges::stable_sort(found, std::ranges::greater{}, [](const Found& f) { return f.match.share; });
    SymmetryGroup group;
    group.centre = centre_;
    find_revolutions(found, group);
    if (group.kind == SymmetryGroup::Kind::none) find_discrete(found, group);
    if (group.kind != SymmetryGroup::Kind::sphere) keep_near(found, group);
    std::erase_if(group.near_axes, [](const NearAxis& axis) { return axis.share < kNearAxisShare; });
    return group;
  }

 private:
  // --- scores and refinement -------------------------------------------------------------------------------------

  // Area, not samples: it is a fixed point of every true symmetry.
  [[nodiscard]] Eigen::Vector3d centroid() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double total = 0.0;
    for (std::size_t i = 0; i < model_.skin.triangles.size(); ++i) {
      const double area = doubled_area_vector(model_.skin, i).norm();
      for (int k = 0; k < 3; ++k) {
        sum += area / 3.0 * model_.skin.vertices[static_cast<std::size_t>(model_.skin.triangles[i][k])];
      }
      total += area;
    }
    return sum / total;
  }

  // Mean over the first samples of 1 - distance / reach, for those that face the same way as the skin there.
  [[nodiscard]] double score(const Pose& motion, std::size_t count, double reach_mm) const {
    const Eigen::Isometry3f moved = motion.cast<float>();
    const auto reach = static_cast<float>(reach_mm);
    const std::size_t used = std::min(count, model_.samples.size());
    float sum = 0.0F;
    for (std::size_t i = 0; i < used; ++i) {
      const DistanceField::Sample sample = model_.field->at(moved * model_.samples.positions[i]);
      if (!sample.known() || std::abs(sample.distance) > reach) continue;
      const Eigen::Vector3f& normal = model_.face_normals[static_cast<std::size_t>(sample.triangle)];
      if (normal.dot(moved.linear() * model_.samples.normals[i]) < kFacing) continue;
      sum += 1.0F - std::abs(sample.distance) / reach;
    }
    return static_cast<double>(sum) / static_cast<double>(used);
  }

  // Gauss-Newton on the robust distances of the samples to the model's own field, the robust scale narrowing.
  [[nodiscard]] Pose refined(Pose motion) const {
    for (const double scale : {0.02, 0.01}) {
      for (int step = 0; step < 5; ++step) motion = stepped(motion, kFineSamples, scale * model_.diameter);
    }
    return orthonormalised(motion);
  }

  // From further away; what does not fit at all by then is not worth the rest.
  [[nodiscard]] std::optional<Pose> refined_from_afar(Pose motion) const {
    for (const double scale : {kCoarseReach, 0.5 * kCoarseReach}) {
      for (int step = 0; step < 5; ++step) motion = stepped(motion, kCoarseSamples, scale * model_.diameter);
    }
    if (score(motion, kCoarseSamples, 0.5 * kCoarseReach * model_.diameter) < 0.6 * kNearShare) return std::nullopt;
    return refined(motion);
  }

  [[nodiscard]] Pose stepped(const Pose& motion, std::size_t count, double scale_mm) const {
    const Eigen::Isometry3f moved = motion.cast<float>();
    const Eigen::Vector3f pivot = (motion * centre_).cast<float>();
    const double lever = 0.5 * model_.diameter;
    const auto scale = static_cast<float>(scale_mm);
    Matrix6d matrix = Matrix6d::Zero();
    Vector6d right_side = Vector6d::Zero();
    const std::size_t used = std::min(count, model_.samples.size());
    for (std::size_t i = 0; i < used; ++i) {
      const Eigen::Vector3f point = moved * model_.samples.positions[i];
      const DistanceField::Sample sample = model_.field->at(point);
      if (!sample.known() || std::abs(sample.distance) >= scale) continue;
      const Eigen::Vector3f& normal = model_.face_normals[static_cast<std::size_t>(sample.triangle)];
      if (normal.dot(moved.linear() * model_.samples.normals[i]) < kFacing) continue;
      const float ratio = sample.distance / scale, root = 1.0F - ratio * ratio;
      const Eigen::Vector3d arm = (point - pivot).cast<double>() / lever, gradient = sample.gradient.cast<double>();
      Vector6d row;
      row << arm.cross(gradient), gradient;
      matrix += static_cast<double>(root * root) * row * row.transpose();
      right_side -= static_cast<double>(root * root * sample.distance) * row;
    }
    // What no sample holds (the turn of a cylinder) stays where it is.
    matrix.diagonal().array() += 1e-6 * matrix.trace() + 1e-12;
    Vector6d twist = solve_symmetric(matrix, right_side);
    twist.head<3>() /= lever;
    const Eigen::Vector3d about = motion * centre_;
    return Eigen::Translation3d(about) * pose_from_twist(twist) * Eigen::Translation3d(-about) * motion;
  }

  [[nodiscard]] std::vector<Pose> refined_from_afar(const std::vector<Pose>& starts) const {
    std::vector<std::optional<Pose>> result(starts.size());
    parallel_for(context_, starts.size(), 1, [&](std::size_t i) {
      if (!context_.cancelled()) result[i] = refined_from_afar(starts[i]);
    });
    std::vector<Pose> kept;
    for (const std::optional<Pose>& motion : result) {
      if (motion) kept.push_back(*motion);
    }
    return kept;
  }

  // The different ones that map enough of the surface onto itself.
  [[nodiscard]] std::vector<Found> matched(const std::vector<Pose>& motions) const {
    std::vector<Pose> different;
    for (const Pose& motion : motions) {
      if (displacement(motion) <= kSameMotion * model_.diameter) continue;  // the identity
      const bool known = std::ranges::any_of(different, [&](const Pose& other) {
        return displacement(other.inverse() * motion) <= kSameMotion * model_.diameter;
      });
      const bool promises = score(motion, kFineSamples, 0.02 * model_.diameter) > 0.8 * kNearShare;
      if (!known && promises) different.push_back(motion);
    }
    std::vector<SelfMatch> matches(different.size());
    parallel_for(context_, different.size(), 1, [&](std::size_t i) {
      if (!context_.cancelled()) matches[i] = matching_.match(different[i]);
    });
    std::vector<Found> found;
    for (std::size_t i = 0; i < different.size(); ++i) {
      if (matches[i].share >= kNearShare) found.push_back({different[i], matches[i]});
    }
    return found;
  }

  [[nodiscard]] double displacement(const Pose& motion) const { return largest_displacement_mm(motion, model_.box); }

  [[nodiscard]] bool is_symmetry(const Pose& motion) const { return matching_.is_symmetry(matching_.match(motion)); }

  // --- candidates ------------------------------------------------------------------------------------------------

  // The best places of a grid over all rotations. A turn and its inverse match alike, so half of them will do.
  [[nodiscard]] std::vector<Pose> coarse_starts() const {
    std::vector<Pose> grid;
    const Eigen::Vector3d box_centre = model_.box.center();
    const bool has_two_centres = (box_centre - centre_).norm() > kSameMotion * model_.diameter;
    for (const Eigen::Vector3d& axis : half_sphere(kGridAxes)) {
      for (int step = 2; step <= 12; ++step) {
        grid.push_back(rotation_about(axis, centre_, step * kGridStep));
        if (has_two_centres) grid.push_back(rotation_about(axis, box_centre, step * kGridStep));
      }
    }
    const double reach = kCoarseReach * model_.diameter;
    grid = best_apart(grid, scores_of(grid, kFirstSamples, reach), 0.0, 0.5 * kLeastCoarseScore, kMostScored);
    return best_apart(grid, scores_of(grid, kCoarseSamples, reach), kGridStep, kLeastCoarseScore, kMostStarts);
  }

  [[nodiscard]] std::vector<double> scores_of(const std::vector<Pose>& motions, std::size_t count,
                                              double reach_mm) const {
    std::vector<double> scores(motions.size());
    parallel_for(context_, motions.size(), 16, [&](std::size_t i) {
      if (!context_.cancelled()) scores[i] = score(motions[i], count, reach_mm);
    });
    return scores;
  }

  // The best, none within `apart` radians of a better one or of its inverse.
  [[nodiscard]] static std::vector<Pose> best_apart(const std::vector<Pose>& motions, const std::vector<double>& scores,
                                                    double apart, double least, std::size_t most) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < motions.size(); ++i) {
      if (scores[i] >= least) order.push_back(i);
    }
    std::ranges::sort(order, {}, [&](std::size_t i) { return std::pair(-scores[i], i); });
    std::vector<Pose> best;
    for (const std::size_t i : order) {
      if (best.size() == most) break;
      const bool is_new = apart == 0.0 || std::ranges::none_of(best, [&](const Pose& other) {
                            return angle_between(other.linear(), motions[i].linear()) < apart ||
                                   angle_between(other.linear().transpose(), motions[i].linear()) < apart;
                          });
      if (is_new) best.push_back(motions[i]);
    }
    return best;
  }

  // Those of the motions found, the best first, and the principal axes of the surface.
  [[nodiscard]] std::vector<Axis> candidate_axes(const std::vector<Found>& found) const {
    constexpr std::size_t kMostAxes = 6;
    std::vector<Axis> axes;
    const auto add = [&](const Axis& axis) {
      const bool known = std::ranges::any_of(axes, [&](const Axis& other) { return is_same(other, axis); });
      if (!known && axes.size() < kMostAxes) axes.push_back(axis);
    };
    const Eigen::Matrix3d principal = principal_axes();
    for (int i = 0; i < 3; ++i) add({with_sign(principal.col(i)), centre_});
    std::vector<Found> best = found;
    std::ranges::stable_sort(best, std::ranges::greater{}, [](const Found& f) { return f.match.share; });
    for (const Found& f : best) add(axis_of(f.motion, centre_));
    return axes;
  }

  [[nodiscard]] Eigen::Matrix3d principal_axes() const {
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3f& position : model_.dense_samples.positions) {
      const Eigen::Vector3d offset = position.cast<double>() - centre_;
      spread += offset * offset.transpose();
    }
    return SymmetricEigen<3>(spread).eigenvectors();
  }

  [[nodiscard]] bool is_same(const Axis& a, const Axis& b) const {
    return is_same(a, b, kSameMotion * model_.diameter);
  }
  [[nodiscard]] static bool is_same(const Axis& a, const Axis& b, double distance_mm) {
    constexpr double kSameDirection = 0.9986;  // 3 degrees
    if (std::abs(a.direction.dot(b.direction)) < kSameDirection) return false;
    return a.direction.cross(b.point - a.point).norm() < distance_mm;
  }

  // Angles about an axis where the model matches itself better than at their neighbours.
  [[nodiscard]] std::vector<Pose> starts_about(const Axis& axis) const {
    constexpr int kSteps = 120;
    constexpr std::size_t kMost = 16;
    std::vector<Pose> turns(kSteps + 2);
    for (std::size_t i = 0; i < turns.size(); ++i) {
      turns[i] = rotation_about(axis.direction, axis.point, static_cast<double>(i) * kPi / kSteps);
    }
    const std::vector<double> scores = scores_of(turns, kProfileSamples, 0.02 * model_.diameter);
    std::vector<std::size_t> peaks;
    for (std::size_t i = 2; i <= kSteps; ++i) {
      if (scores[i] >= 0.5 * kNearShare && scores[i] > scores[i - 1] && scores[i] >= scores[i + 1]) peaks.push_back(i);
    }
    // Among equals the smallest angle, of which the others are multiples.
    std::ranges::sort(peaks, {}, [&](std::size_t i) { return std::pair(-std::round(50.0 * scores[i]), i); });
    std::vector<Pose> starts;
    for (std::size_t i = 0; i < std::min(kMost, peaks.size()); ++i) starts.push_back(turns[peaks[i]]);
    return starts;
  }

  // --- groups ----------------------------------------------------------------------------------------------------

  // Share at the worst of some angles about an axis that have nothing in common.
  struct Turning {
    bool is_symmetry = true;
    double share = 1.0;
  };
  [[nodiscard]] Turning turning(const Axis& axis) const {
    constexpr std::size_t kAngles = 7;
    std::vector<SelfMatch> matches(kAngles);
    parallel_for(context_, kAngles, 1, [&](std::size_t i) {
      matches[i] = matching_.match(rotation_about(axis.direction, axis.point, kGolden * static_cast<double>(i + 1)));
    });
    Turning result;
    for (const SelfMatch& match : matches) {
      result.is_symmetry = result.is_symmetry && matching_.is_symmetry(match);
      result.share = std::min(result.share, match.share);
    }
    return result;
  }

  // The motions about one axis give its mean: large turns hold it best.
  [[nodiscard]] std::vector<Axis> averaged_axes(const std::vector<Found>& found) const {
    std::vector<Axis> seeds;
    for (const Found& f : found) {
      const Axis axis = axis_of(f.motion, centre_);
      if (std::ranges::none_of(seeds, [&](const Axis& other) { return is_same(other, axis); })) seeds.push_back(axis);
    }
    std::vector<Axis> result;
    for (const Axis& seed : seeds) {
      Axis mean{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
      double total = 0.0;
      for (const Found& f : found) {
        const Axis axis = axis_of(f.motion, centre_);
        if (!is_same(seed, axis)) continue;
        const double weight =
            std::pow(std::sin(0.5 * rotation_angle(f.motion.linear())), 2) * std::pow(f.match.share, 4);
        mean.direction += (axis.direction.dot(seed.direction) < 0.0 ? -weight : weight) * axis.direction;
        mean.point += weight * axis.point;
        total += weight;
      }
      result.push_back({with_sign(mean.direction.normalized()), mean.point / total});
    }
    return result;
  }

  void find_revolutions(const std::vector<Found>& found, SymmetryGroup& group) const {
    constexpr std::size_t kMost = 6;
    std::vector<Axis> axes = averaged_axes(found);
    const Eigen::Matrix3d principal = principal_axes();
    for (int i = 0; i < 3; ++i) {
      const Axis axis{with_sign(principal.col(i)), centre_};
      if (std::ranges::none_of(axes, [&](const Axis& other) { return is_same(other, axis); })) axes.push_back(axis);
    }
    if (axes.size() > kMost) axes.resize(kMost);
    std::vector<Axis> true_axes;
    for (const Axis& axis : axes) {
      const Turning turned = turning(axis);
      if (turned.is_symmetry) {
        true_axes.push_back(axis);
      } else if (turned.share >= kRippleShare) {
        add_near_axis({axis.direction, axis.point, turned.share}, group);
      }
      if (true_axes.size() == 2) break;
    }
    std::ranges::stable_sort(group.near_axes, std::ranges::greater{}, &NearAxis::share);
    if (true_axes.empty()) return;
    if (true_axes.size() == 2) {
      group = SymmetryGroup{};
      group.kind = SymmetryGroup::Kind::sphere;
      group.centre = centre_;
      return;
    }
    set_revolution(true_axes.front(), group);
  }

  void add_near_axis(const NearAxis& axis, SymmetryGroup& group) const {
    const bool known =
        std::ranges::any_of(group.near_axes, [&](const NearAxis& other) { return is_near_to(axis, other); });
    if (!known) group.near_axes.push_back(axis);
  }

  [[nodiscard]] bool is_near_to(const NearAxis& a, const NearAxis& b) const {
    return is_same({a.axis, a.point}, {b.axis, b.point}, 3.0 * kSameMotion * model_.diameter);
  }

  void set_revolution(const Axis& axis, SymmetryGroup& group) const {
    group.kind = SymmetryGroup::Kind::revolution;
    group.axis = axis.direction;
    group.order = 0;
    group.centre = axis.point + axis.direction.dot(centre_ - axis.point) * axis.direction;
    // A part that looks the same from both ends has its middle where its surface has.
    const Pose over = rotation_about(axis.direction.unitOrthogonal(), group.centre, kPi);
    if (is_symmetry(over)) group.elements.push_back(over);
  }

  // Products of the best generators, as long as each of them holds by itself.
  void find_discrete(const std::vector<Found>& found, SymmetryGroup& group) const {
    Generated generated;
    for (const Found& f : found) {
      if (!matching_.is_symmetry(f.match) || index_of(generated.elements, f.motion)) continue;
      extend(generated, f.motion);
    }
    while (generated.elements.size() > 1 && extend_by_finer_turns(generated)) {
    }
    if (generated.elements.size() == 1) return;
    group.kind = SymmetryGroup::Kind::discrete;
    group.elements = made_exact(generated.elements);
    set_main_axis(group);
  }

  struct Generated {
    std::vector<Pose> generators, elements{Pose::Identity()};
  };

  [[nodiscard]] std::optional<std::size_t> index_of(const std::vector<Pose>& elements, const Pose& motion) const {
    for (std::size_t i = 0; i < elements.size(); ++i) {
      if (displacement(elements[i].inverse() * motion) <= kSameMotion * model_.diameter) return i;
    }
    return std::nullopt;
  }

  // Takes one more generator in, with all its products; not if one of these is no symmetry.
  bool extend(Generated& group, const Pose& generator) const {
    Generated larger = group;
    larger.generators.push_back(generator);
    larger.elements.push_back(generator);
    for (std::size_t i = 1; i < larger.elements.size(); ++i) {
      for (const Pose& g : larger.generators) {
        const Pose product = larger.elements[i] * g;
        if (index_of(larger.elements, product)) continue;
        if (larger.elements.size() == kMostElements || context_.cancelled()) return false;
        const Pose exact = refined(product);                 // errors of a chain must not add up
        if (index_of(larger.elements, exact)) return false;  // it ran into another: not a motion of its own
        if (!is_symmetry(exact)) return false;
        larger.elements.push_back(exact);
      }
    }
    group = std::move(larger);
    return true;
  }

  // By a half, a third or a fifth of the smallest turn: peaks may have been missed where they are many.
  bool extend_by_finer_turns(Generated& group) const {
    const auto smallest =
        std::ranges::min_element(group.elements.begin() + 1, group.elements.end(), {},
                                 [](const Pose& element) { return rotation_angle(element.linear()); });
    const Axis axis = axis_of(*smallest, centre_);
    for (const double divisor : {2.0, 3.0, 5.0}) {
      const double angle = rotation_angle(smallest->linear()) / divisor;
      const Pose turn = refined(rotation_about(axis.direction, axis.point, angle));
      if (index_of(group.elements, turn) || !is_symmetry(turn)) continue;
      if (extend(group, turn)) return true;
    }
    return false;
  }

  // Averages each element over all its factorisations, which makes a near-group of rotations an exact one (each pass
  // squares the error), about the mean of the points that the elements leave in their place.
  [[nodiscard]] std::vector<Pose> made_exact(std::vector<Pose> elements) const {
    const std::size_t n = elements.size();
    std::vector<std::size_t> product(n * n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j)
        product[i * n + j] = closest(elements, elements[i].linear() * elements[j].linear());
    }
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const Pose& element : elements) centre += element * centre_ / static_cast<double>(n);
    for (int pass = 0; pass < 4; ++pass) {
      std::vector<Pose> averaged = elements;
      for (std::size_t i = 0; i < n; ++i) {
        Pose mean = Pose::Identity();
        mean.linear().setZero();
        for (std::size_t j = 0; j < n; ++j) {
          mean.linear() += elements[product[i * n + j]].linear() * elements[j].linear().transpose();
        }
        mean.linear() /= static_cast<double>(n);
        averaged[i].linear() = orthonormalised(mean).linear();
        averaged[i].translation() = centre - averaged[i].linear() * centre;
      }
      elements = std::move(averaged);
    }
    elements.front() = Pose::Identity();
    return elements;
  }

  [[nodiscard]] static std::size_t closest(const std::vector<Pose>& elements, const Eigen::Matrix3d& rotation) {
    std::size_t best = 0;
    double largest = -2.0;
    for (std::size_t i = 0; i < elements.size(); ++i) {
      const double trace = elements[i].linear().cwiseProduct(rotation).sum();
      if (trace > largest) largest = trace, best = i;
    }
    return best;
  }

  // That of the smallest turn, which is the one of highest order; elements by axis and angle.
  void set_main_axis(SymmetryGroup& group) const {
    const auto angle_of = [](const Pose& element) { return rotation_angle(element.linear()); };
    const auto smallest = std::ranges::min_element(group.elements.begin() + 1, group.elements.end(), {}, angle_of);
    group.order = static_cast<int>(std::lround(2.0 * kPi / angle_of(*smallest)));
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const Pose& element : group.elements) centre += element * centre_ / static_cast<double>(group.elements.size());
    group.centre = centre;
    group.axis = axis_of(*smallest, centre).direction;
  }

  // So close to an element that verification would not hold them apart, or still sliding towards it.
  [[nodiscard]] bool is_on_its_way(const Found& found, const SymmetryGroup& group) const {
    const double apart = displacement_modulo_mm(found.motion, group, model_.box);
    return apart < (found.match.share > 0.9 ? 0.04 : 0.1) * model_.diameter;
  }

  // No better than any other rotation about an axis of near-symmetry: a ripple.
  [[nodiscard]] bool only_rides_on_axis(const Found& found, const SymmetryGroup& group) const {
    const Axis axis = axis_of(found.motion, centre_);
    return std::ranges::any_of(group.near_axes, [&](const NearAxis& near) {
      return is_near_to({axis.direction, axis.point, 0.0}, near) && 1.0 - found.match.share > 0.5 * (1.0 - near.share);
    });
  }

  void keep_near(const std::vector<Found>& found, SymmetryGroup& group) const {
    for (const Found& f : found) {
      if (only_rides_on_axis(f, group) || is_on_its_way(f, group)) continue;
      for (const Pose& motion : {f.motion, Pose(f.motion.inverse())}) {
        // Poses g * P are the same pose as P, and so near ones of P are n * g.
        for (const Pose& element : group.elements) {
          if (group.near.size() == kMostNear) return;
          const Pose near = motion * element;
          const bool known = displacement_modulo_mm(near, group, model_.box) <= 2.0 * kSameMotion * model_.diameter ||
                             std::ranges::any_of(group.near, [&](const NearSymmetry& other) {
                               return displacement_modulo_mm(near * other.motion.inverse(), group, model_.box) <=
                                      2.0 * kSameMotion * model_.diameter;
                             });
          if (!known) group.near.push_back({near, f.match.share, f.match.breaks_at});
        }
      }
    }
  }

  const PreparedModel& model_;
  const Context& context_;
  SelfMatching matching_;
  Eigen::Vector3d centre_;
};

}  // namespace

SymmetryGroup find_symmetry(const PreparedModel& model, const Context& context) { return Search(model, context).run(); }

}  // namespace asbuilt::model
