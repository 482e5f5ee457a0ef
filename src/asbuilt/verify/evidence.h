// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/depth_image.h"
#include "asbuilt/scan/field_of_view.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::verify {

/// What a scan can be asked about a pose. Built once per scan, then const.
struct ScanEvidence {
  /// `background` marks points that cannot be the part's (planes larger than it); they hide and reveal, but never
  /// confirm.
  ScanEvidence(const scan::Scan& scan, const std::vector<std::uint8_t>& background,
               const Context& context = Context(1));

  const scan::Scan& scan;
  std::vector<std::uint8_t> background;  ///< one a point of the scan
  scan::Scan foreground;                 ///< the scan without them: points, normals, surface variation
  KdTree foreground_tree;
  std::optional<scan::DepthImage> depth;   ///< of all points, if the viewpoint is known
  std::optional<scan::FieldOfView> field;  ///< likewise
};

/// Surfaces seen flatter than this cosine of the incidence (78 degrees) return too little to be asked for.
inline constexpr double kGrazing = 0.2;

/// Distance between neighbouring measurements, mm, where a pose puts the middle of the model.
[[nodiscard]] double spacing_at(const Pose& model_from_scan, const model::PreparedModel& model, const scan::Scan& scan);

/// Cosine of the incidence at which the sensor looks on a sample of the model; nothing if it is averted or grazing, or
/// if the part itself is in the way. Open skins are seen from either side. `towards_sensor` is a unit vector in the
/// scan.
[[nodiscard]] std::optional<double> cosine_if_seen(const Pose& scan_from_model, const Eigen::Vector3f& point_in_model,
                                                   const Eigen::Vector3f& normal_in_model,
                                                   const Eigen::Vector3d& towards_sensor,
                                                   const model::PreparedModel& model);

/// What became of the model samples that ought to be visible at a pose. Each counts with the cosine of its incidence,
/// the area that it shows to the sensor: what is seen edge-on returns little and proves little.
struct PoseEvidence {
  std::size_t samples = 0;             ///< all model samples asked
  std::size_t explained_anywhere = 0;  ///< of all samples, visible or not: Eq. 11 to the letter
  std::size_t explained_samples = 0;   ///< of those that ought to be visible
  std::size_t facing_samples = 0;      ///< those that ought to be visible, or would be but for other things
  double facing = 0.0;                 ///< turned to the sensor and not behind the part itself
  double explained = 0.0;              ///< the scan has a surface there (Eq. 11's condition, across the surface)
  double hidden = 0.0;                 ///< something stands in front, or nobody looked there: neutral
  double contradicted = 0.0;           ///< the scan has a surface nearby, but not there
  double seen_through = 0.0;           ///< the sensor measured something behind
  double missing = 0.0;                ///< no return: weak evidence against
  /// Of the explained samples' normals on a twist about the part's centre; rotations are measured by the motion that
  /// they cause at half a diameter.
  Matrix6d information = Matrix6d::Zero();
  /// Likewise of a twist and of growth about the part's centre (which moves the surface at half a diameter by as much as
  /// a shift by one), and of growth alone.
  Vector6d twist_growth = Vector6d::Zero();
  double growth = 0.0;

  /// Smallest eigenvalue of the information per explained sample: 0 if the part can slide or turn without leaving the
  /// surface that was found (a plane, a cylinder).
  [[nodiscard]] double weakest_direction() const;
  /// For minus against: what candidates compete by, per sample asked.
  [[nodiscard]] double support(double contradiction_weight) const;

  /// Xi over what should be visible and is not hidden; a missing return counts a quarter.
  [[nodiscard]] double score() const;
  [[nodiscard]] double free_space_share() const;  ///< seen_through / (facing - hidden)
  [[nodiscard]] double visible_share() const;     ///< Eq. 11 over all samples
};

struct EvidenceOptions {
  double distance_mm = 1.0;  ///< tau_theta: across the surface
  double lateral_mm = 1.0;   ///< how far along the surface the next measurement may be
  std::size_t most_samples = std::numeric_limits<std::size_t>::max();
  double most_lateral_mm = std::numeric_limits<double>::infinity();  ///< where surfaces are looked at flatly
};

/// `lateral_mm` where the sensor looks on a surface at this cosine of the incidence, 0 where it is not known: beyond 53
/// degrees, rays meet the surface ever farther apart; up to `most_lateral_mm`.
[[nodiscard]] double lateral_at(const EvidenceOptions& options, double cosine);

/// Asks the scan about every one of `samples` (oriented, in the model frame), or the first `most_samples` of them.
[[nodiscard]] PoseEvidence evidence_for(const Pose& model_from_scan, const PointCloud& samples,
                                        const model::PreparedModel& model, const ScanEvidence& scan,
                                        const EvidenceOptions& options);

/// Of the scan points on the model and within it, the share that lies deeper under its surface than the doubled
/// distance: no sensor measures inside a solid. What takes the place of the rays where the viewpoint is unknown.
[[nodiscard]] double share_within(const Pose& model_from_scan, std::span<const Eigen::Vector3f> points_in_scan,
                                  const model::PreparedModel& model, double distance_mm);

/// By how much more of the scan points on the model hide behind the rest of the scan when they are looked at from the
/// side to which the pose turns them than from the other. A mirror image, seen from within, shows the part's own
/// surface; what else is in the scan tells where the sensor stood. How far away it was is not known: the least over
/// several distances counts. 0 if nothing else is in the scan, never negative.
[[nodiscard]] double share_seen_from_behind(const Pose& model_from_scan,
                                            std::span<const Eigen::Vector3f> points_in_scan,
                                            const model::PreparedModel& model, const ScanEvidence& scan,
                                            const EvidenceOptions& options);

struct NormalOptions {
  double distance_mm = 1.0;  ///< tau_theta: points this close are on the model
  double max_angle = 0.5;    ///< radians up to which two normals agree
};

/// Share of the scan points on the model whose normal agrees with the model's; 0 when there are none. Signs count only
/// where the scan knows them. The published judge (Sec. 3.1): every point with the normal it came with.
[[nodiscard]] double normal_agreement(const Pose& model_from_scan, const scan::Scan& scan,
                                      const model::PreparedModel& model, const NormalOptions& options);

/// The same over at most 600 of `points_in_scan` where the model is flat as far as a normal's fit reaches, with normals
/// fitted that far: the smallest radius at which noise tilts a normal by some 6 degrees. On narrower strips and next to
/// edges normals mean nothing. If there are fewer than 30 such points, they have no say: nothing is returned.
[[nodiscard]] std::optional<double> flat_normal_agreement(const Pose& model_from_scan,
                                                          std::span<const Eigen::Vector3f> points_in_scan,
                                                          const ScanEvidence& scan, const model::PreparedModel& model,
                                                          const NormalOptions& options);

}  // namespace asbuilt::verify
