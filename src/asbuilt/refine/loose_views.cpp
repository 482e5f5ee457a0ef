// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/loose_views.h"

#include <vector>

#include "asbuilt/refine/gauge.h"
#include "asbuilt/refine/suspicious_view.h"

namespace asbuilt::refine {
namespace {

constexpr double kMostOff = 0.1;  // share of a view's points off the CAD: dents and bosses rather than a wrong pose

}  // namespace

Result<Refinement> refine_on_model(std::span<const View> views, std::span<const Link> links,
                                   const model::SurfaceDistance& surface, double diameter_mm,
                                   const RefineOptions& options, const Context& context) {
  RefineOptions by_faces = options;
  by_faces.rim_matches = options.rim_matches && !options.loose_on_model;
  auto by_scans = refine(views, links, by_faces, context);
  if (!by_scans || by_scans->firmly_held || options.paper_mode || !options.loose_on_model) return by_scans;
  std::vector<ModelFit> on_model;
  for (const View& view : views) {
    const auto fit = fit_to_model(view, surface, diameter_mm, context);
    if (!fit && fit.error().code == ErrorCode::cancelled) return tl::unexpected(fit.error());
    if (!fit) return by_scans;  // nothing of it is near the CAD
    on_model.push_back(*fit);
  }
  // A view that the scans contradict either lies off the CAD, even fitted to it, and stands wrong, or has strayed along
  // what nothing holds. The first is to be dropped: held on the CAD it would stand as firmly as the right ones.
  ASBUILT_TRY(contradicted, view_against_others(views, links, *by_scans, context));
  if (contradicted && on_model[static_cast<std::size_t>(contradicted->view)].share_off > kMostOff) return by_scans;
  auto with_model = refine(views, links, options, context, on_model);
  if (!with_model) {
    // Fitted each by itself, as round parts are, views may have nothing left in common: what links told stands.
    if (with_model.error().code == ErrorCode::not_possible) return by_scans;
    return with_model;
  }
  with_model->rms_before_mm = by_scans->rms_before_mm;
  with_model->iterations += by_scans->iterations;
  return with_model;
}

}  // namespace asbuilt::refine
