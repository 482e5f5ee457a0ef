// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/report/colours.h"
#include "asbuilt/report/image.h"
#include "asbuilt/report/scene.h"

namespace asbuilt::report {

/// From where a part is looked at.
struct View {
  std::string name;   ///< of the file: "corner", "from_plus_x" ...
  std::string title;  ///< in the picture: "corner", "from +x" ...
  Eigen::Vector3d towards_viewer = Eigen::Vector3d::UnitZ(), up = Eigen::Vector3d::UnitY();
};

/// A corner, and along the axes from either side.
[[nodiscard]] const std::vector<View>& standard_views();

struct ViewOptions {
  int width = 960, height = 720;
  bool steps = false;  ///< discrete colours
};

/// The part coloured by deviation, without perspective, filling the picture beside a legend; grey where nothing was
/// scanned, edges drawn. No window system and no graphics card are needed.
[[nodiscard]] Image rendered(const Scene& scene, const ColourMap& colours, const View& view,
                             const ViewOptions& options);

/// PNG files of all standard views, in their order.
[[nodiscard]] std::vector<std::string> rendered_views(const Scene& scene, const ColourMap& colours,
                                                      const ViewOptions& options, const Context& context);

}  // namespace asbuilt::report
