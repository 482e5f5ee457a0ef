// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "asbuilt/core/random.h"
#include "asbuilt/verify/lm_icp.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

TEST(FieldResidual, DerivativeIsThatOfCentralDifferences) {
  const model::PreparedModel model = test::prepared(test::stepped_block());
  const Eigen::Vector3d pivot = bounding_box(model.skin).center();
  const double lever = 0.5 * model.diameter;
  Random random(1, "derivative", 0);
  std::vector<double> errors;
  for (int trial = 0; trial < 3000; ++trial) {
    const std::size_t i = random.below(model.dense_samples.size());
    const Eigen::Vector3d point = (model.dense_samples.positions[i] +
                                   static_cast<float>(random.uniform(-2.0, 2.0)) * model.dense_samples.normals[i])
                                      .cast<double>();
    const model::DistanceField::Sample sample = model.field->at(point.cast<float>());
    ASSERT_TRUE(sample.known());
    const FieldResidual residual = field_residual(sample, point, pivot);
    for (int k = 0; k < 6; ++k) {
      const double step = 0.01 / (k < 3 ? lever : 1.0);
      const auto value = [&](double by) {
        const Vector6d twist = by * Vector6d::Unit(k);
        const Eigen::Vector3d moved = pose_from_twist(twist) * (point - pivot) + pivot;
        return field_residual(model.field->at(moved.cast<float>()), moved, pivot).value;
      };
      const double numeric = (value(step) - value(-step)) / (2.0 * step);
      errors.push_back(std::abs(numeric - residual.derivative[k]) / (k < 3 ? lever : 1.0));
    }
  }
  // Floats of 60 mm are 4e-6 mm apart: 4e-4 of a difference over 0.02 mm. Between two cells of the grid (0.4 mm wide,
  // so one step in twenty an axis) the derivative jumps.
  std::ranges::sort(errors);
  EXPECT_LT(errors[errors.size() / 2], 1e-3);
  EXPECT_LT(errors[errors.size() * 85 / 100], 5e-3);
}

TEST(FieldResidual, OffTheFieldThereIsNone) {
  const model::PreparedModel model = test::prepared(test::stepped_block(), 0.05);
  EXPECT_FALSE(model.field->at({1e4F, 0.0F, 0.0F}).known());
}

}  // namespace
}  // namespace asbuilt::verify
