// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/detect/options.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::pipeline {

/// Whether a row of a scan holds a measurement: it is finite and not the origin, which stands for no return.
[[nodiscard]] bool is_measured(const Eigen::Vector3f& point);

/// Indices, ascending, of the points in which the part is sought, of a scan that is far denser than that takes; nothing
/// if it is not, or if the options want all.
///
/// Of each cube of four search spacings (`search_spacing_ratio` of the model's sampling distance) an even share stays,
/// that which leaves sixteen in the fullest cube around it: about one to a square of the search spacing, whatever the
/// density, and as noisy as all of them. (Sixteen of every cube would be no fair draw: next to a surface there are
/// cubes that only its noise and strays reach.) Points that are none (not finite, no return) never stay. Where more
/// than half of the points would stay, or hardly enough to find anything, all are taken. The same for any number of
/// threads. Cost: linear, some 30 ns a point.
[[nodiscard]] std::optional<std::vector<std::uint32_t>> search_points(std::span<const Eigen::Vector3f> points,
                                                                      const model::PreparedModel& model,
                                                                      const detect::DetectOptions& options,
                                                                      const Context& context);

/// Prepares the points in which the part is sought. These are as dense everywhere, which hides where the sensor stood:
/// where the file does not say it, a fair draw of `all` is asked. Errors and the other arguments:
/// scan::prepare_scan.
[[nodiscard]] Result<scan::Scan> prepare_search(const PointCloud& sought, const PointCloud& all,
                                                const std::optional<Eigen::Vector3d>& file_viewpoint,
                                                const scan::ViewpointRequest& request, const scan::ScanOptions& options,
                                                const Context& context);

}  // namespace asbuilt::pipeline
