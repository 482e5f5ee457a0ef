// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/refine/hold.h"
#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::refine {

struct SampledView;

/// What a refinement hands on to the next one of the same views from the poses where it ended.
struct HandedOn {
  double reach_mm = 0.0;  ///< how far the view's correspondences were searched at last; 0: there was none before
};

/// One scan of a component: its segment (with trustworthy oriented normals) and its starting pose.
struct View {
  PointCloud segment_in_scan;
  Pose model_from_scan = Pose::Identity();
  double noise_sigma_mm = 0.0;                  ///< 0: unknown
  scan::Viewpoint viewpoint{};                  ///< in the scan frame, if known
  std::vector<std::uint8_t> beside_occluder{};  ///< of each point (scan::Occluders); empty: not known
  double spacing_mm = 0.0;  ///< of the scan's points; 0: unknown. Two scans agree no better than a tenth of it
  std::shared_ptr<const SampledView> sample{};  ///< of this very segment (sample_views); none: made when it is needed
  /// If all views have a reach, correspondences are searched no further from the start.
  HandedOn earlier{};
};

/// Where one scan's own points fit the CAD best, and how well they hold it there.
struct ModelFit {
  Pose model_from_scan = Pose::Identity();
  /// Inverse covariance of the twist (rotation rad, translation mm) applied on the left, for a part that deviates from
  /// its CAD as the scan shows; zero along what the surface in sight does not hold.
  Matrix6d information = Matrix6d::Zero();
  double share_off =
      0.0;  ///< of its points: further off the CAD than parts deviate from theirs, or facing away from it
};

/// Undirected link; both directions enter Eq. 5.
struct Link {
  int first = 0, second = 0;
};

struct RefineOptions {
  int points_per_scan = 25000;         ///< paper: 20-30 k, evenly spread
  int max_iterations = 60;             ///< LM steps
  double max_normal_angle_deg = 45.0;  ///< correspondences whose normals differ by more are dropped (ours)
  double start_distance_ratio = 0.04;  ///< farthest correspondence of the first step / diameter of the views (ours)
  double converged_motion = 0.02;      ///< stop when no view moves by more than this, in units of the residual noise
  // What goes beyond the paper; paper mode turns all of it off. What each is worth: bench/README.md, docs/refine.md.
  bool face_normals = true;    ///< normals fitted to the points of one face, not across edges
  bool rim_weights = true;     ///< points at a scan's rim hardly count: they may be mixed, and the surface ends
  bool rim_matches = true;     ///< where a face of one scan ends is held against the face across that edge in another
  bool reach_weights = true;   ///< a match counts less the further it reaches beyond the plane that was fitted
  bool edge_weights = true;    ///< edges count by their variance
  bool anneal = true;          ///< reach and robust scale shrink from the misalignment to the noise
  bool coarse_to_fine = true;  ///< a thinned sample until no view moves by more than half the noise
  bool keep_matches = true;    ///< correspondences are searched again only where views have moved
  bool drop_unheld = true;     ///< a link says nothing about directions that it does not hold
  bool loose_on_model = true;  ///< scans that hold one another only loosely are held against the CAD as well
  bool symmetric = false;      ///< symmetric point-to-plane residual (Rusinkiewicz 2019) in place of Eq. 4
  bool paper_mode = false;     ///< Eq. 5 as published: fixed robust scale, no annealing, all closest points

  [[nodiscard]] Result<void> validate() const;
  [[nodiscard]] RefineOptions as_published() const;  ///< paper mode, and everything beyond the paper off
};

template <class Visitor>
void for_each_field(RefineOptions& options, Visitor&& field) {
  field("points_per_scan", options.points_per_scan, "evenly spread points of each scan in the joint refinement");
  field("max_iterations", options.max_iterations, "steps of the joint refinement");
  field("max_normal_angle_deg", options.max_normal_angle_deg,
        "correspondences whose normals differ by more are dropped");
  field("start_distance_ratio", options.start_distance_ratio,
        "farthest correspondence at the start / diameter of all views together");
  field("converged_motion", options.converged_motion, "motion below which it stops, in units of the residual noise");
  field("face_normals", options.face_normals, "normals fitted to the points of one face, not across edges");
  field("rim_weights", options.rim_weights, "points at the rim of a scan hardly count");
  field("rim_matches", options.rim_matches, "ends of faces are held against the faces across their edges");
  field("reach_weights", options.reach_weights, "a match counts less beyond the plane that was fitted");
  field("edge_weights", options.edge_weights, "links count by the variance of their residuals");
  field("anneal", options.anneal, "reach and robust scale shrink from the misalignment to the noise");
  field("coarse_to_fine", options.coarse_to_fine, "the first steps take a thinned sample");
  field("keep_matches", options.keep_matches, "correspondences are searched again only where scans have moved");
  field("drop_unheld", options.drop_unheld, "a link says nothing about directions that it does not hold");
  field("loose_on_model", options.loose_on_model,
        "scans that hold one another only loosely are held against the CAD as well");
  field("symmetric", options.symmetric, "symmetric point-to-plane residuals");
}

/// What one directed edge of the graph says at the end.
struct EdgeResidual {
  int first = 0, second = 0;   ///< from `first`'s points to `second`'s planes (directed)
  std::size_t pairs = 0;       ///< accepted correspondences
  double rms_mm = 0.0;         ///< of their point-to-plane residuals, as the robust loss weights them
  std::size_t candidates = 0;  ///< points of `first` (a thinned sample) with a counterpart within the starting distance
  double spread_mm = 0.0;      ///< 1.4826 x median absolute residual of the candidates: what a wrong view cannot hide
};

/// A motion of one view (against the fixed one) that the data do not determine.
struct UnheldDirection {
  int view = 0;
  Vector6d twist =
      Vector6d::Zero();  ///< rotation (rad) then translation (mm), on the left; moves the view's points by 1 mm (rms)
  double eigenvalue = 0.0;  ///< information along it, relative to a direction that every pair holds fully
};

struct Refinement {
  int fixed_view = 0;                 ///< the view with most points on the model
  std::vector<Pose> model_from_scan;  ///< one a view; the fixed view keeps its start
  /// Of the twist (rotation rad, translation mm) applied on the left; zero for the fixed one. The larger, in every
  /// direction, of what the residual variance gives if matches were independent, and of what their sums over parts of a
  /// view show (a sandwich of clusters: Liang and Zeger, Biometrika 1986). Along an unheld direction the standard
  /// deviation is one diameter of the views: "unknown".
  std::vector<Matrix6d> covariance;
  int iterations = 0;
  bool converged = false;
  double rms_before_mm = 0.0, rms_after_mm = 0.0;  ///< weighted point-to-plane residual over all edges
  std::vector<EdgeResidual> edges;                 ///< two per link, in the order of the links
  std::vector<UnheldDirection> unheld;             ///< reported and not moved
  /// Faces that links hold well are enough to know every view to within the noise. If not, what noise and curvature
  /// feign has a share in the poses.
  bool firmly_held = true;
  bool on_model = false;             ///< the CAD had a say
  std::vector<LinkHold> link_holds;  ///< one a link, in the order of the links
  std::vector<ViewHold> view_holds;  ///< one a view; empty without links
  std::vector<HandedOn> handed_on;   ///< one a view; empty without links
};

/// Samples the views that have no sample yet, or one of other rules. Refinements of the same segments that follow need
/// not do it again, which is most of what a refinement from near by takes. Whoever changes a segment drops its sample.
/// Views that refine() would refuse are left alone.
void sample_views(std::span<View> views, const RefineOptions& options, const Context& context);

/// Minimises Eq. 5 over all poses of one component at once; without `on_model` the CAD does not enter.
///
/// Levenberg-Marquardt on point-to-plane residuals of closest points, both ways over every link, analytic Jacobians,
/// one kd-tree a view. Beyond the paper (docs/refine.md): reach and robust scale shrink edge by edge from the
/// misalignment to the noise, border points attract nothing, directions that an edge does not hold are taken out of it.
///
/// With `on_model`, one fit a view, the views start as their fits lie to one another and are held there as firmly as
/// these know; of links only what they hold well is believed then. The fixed view stays where it is.
///
/// Cost: about 1 us a point, link, direction and full iteration on a core; most iterations run on a thinned sample.
/// Errors: invalid_argument (options, as many fits as views, an empty segment, no normals, non-finite values, a bad
/// link), not_possible (the links do not connect the views, or no correspondences are found), cancelled.
[[nodiscard]] Result<Refinement> refine(std::span<const View> views, std::span<const Link> links,
                                        const RefineOptions& options, const Context& context,
                                        std::span<const ModelFit> on_model = {});

}  // namespace asbuilt::refine
