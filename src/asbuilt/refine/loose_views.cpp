// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/loose_views.h"

#include <vector>

#include "asbuilt/refine/gauge.h"

namespace asbuilt::refine {

Result<Refinement> refine_on_model(std::span<const View> views, std::span<const Link> links,
                                   const model::SurfaceDistance& surface, double diameter_mm,
                                   const RefineOptions& options, const Context& context) {
  RefineOptions by_faces = options;
  by_faces.rim_matches = options.rim_matches && !options.loose_on_model;
  auto by_scans = refine(views, links, by_faces, context);
  if (!by_scans || by_scans->firmly_held || options.paper_mode || !options.loose_on_model) return by_scans;
  std::vector<View> held(views.begin(), views.end());
  for (View& view : held) {
    auto fit = fit_to_model(view, surface, diameter_mm, context);
    if (!fit && fit.error().code == ErrorCode::cancelled) return tl::unexpected(fit.error());
    if (!fit) return by_scans;  // nothing of it is near the CAD
    view.on_model = *fit;
  }
  // As the fits lie to one another; the fixed view stays where it was.
  const auto fixed = static_cast<std::size_t>(by_scans->fixed_view);
  const Pose to_fixed = views[fixed].model_from_scan * held[fixed].on_model->model_from_scan.inverse(Eigen::Isometry);
  for (std::size_t v = 0; v < held.size(); ++v) {
    if (v != fixed) held[v].model_from_scan = orthonormalised(to_fixed * held[v].on_model->model_from_scan);
  }
  ASBUILT_TRY(with_model, refine(held, links, options, context));
  with_model.rms_before_mm = by_scans->rms_before_mm;
  with_model.iterations += by_scans->iterations;
  return std::move(with_model);
}

}  // namespace asbuilt::refine
