// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

namespace asbuilt {

/// A robust loss rho(r^2), as the paper's Eq. 3 and 5 apply it to squared residuals, with rho(s) -> s as s -> 0.
/// weight = d rho / d s: the factor of r^2 in iteratively re-weighted least squares.
struct HuberLoss {
  double scale = 1.0;  ///< residual from which the loss grows linearly, same unit as r

  [[nodiscard]] double value(double squared) const {
    const double limit = scale * scale;
    return squared <= limit ? squared : 2.0 * scale * std::sqrt(squared) - limit;
  }
  [[nodiscard]] double weight(double squared) const {
    return squared <= scale * scale ? 1.0 : scale / std::sqrt(squared);
  }
};

/// Redescending: residuals beyond `scale` have no pull at all.
struct TukeyLoss {
  double scale = 1.0;

  [[nodiscard]] double value(double squared) const {
    const double remaining = std::max(0.0, 1.0 - squared / (scale * scale));
    return scale * scale / 3.0 * (1.0 - remaining * remaining * remaining);
  }
  [[nodiscard]] double weight(double squared) const {
    const double remaining = std::max(0.0, 1.0 - squared / (scale * scale));
    return remaining * remaining;
  }
};

/// Smooth and never quite zero.
struct CauchyLoss {
  double scale = 1.0;

  [[nodiscard]] double value(double squared) const { return scale * scale * std::log1p(squared / (scale * scale)); }
  [[nodiscard]] double weight(double squared) const { return 1.0 / (1.0 + squared / (scale * scale)); }
};

}  // namespace asbuilt
