// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/pose.h"

// Factorisations of small matrices. Eigen does the work; that it is compiled here and not by everyone who asks saves
// minutes of every build.
namespace asbuilt {

/// The eigenvalues of a symmetric matrix, ascending, and its eigenvectors, the columns in the same order. Reads the
/// lower triangle. For Size 3, 6 and Eigen::Dynamic.
template <int Size>
class SymmetricEigen {
 public:
  using Matrix = Eigen::Matrix<double, Size, Size>;
  using Vector = Eigen::Matrix<double, Size, 1>;

  explicit SymmetricEigen(const Matrix& symmetric);

  [[nodiscard]] const Vector& eigenvalues() const { return values_; }
  [[nodiscard]] const Matrix& eigenvectors() const { return vectors_; }

 private:
  Vector values_;
  Matrix vectors_;
};

extern template class SymmetricEigen<3>;
extern template class SymmetricEigen<6>;
extern template class SymmetricEigen<Eigen::Dynamic>;

/// x of A x = b, A symmetric and positive semidefinite (LDLT with pivoting).
[[nodiscard]] Eigen::Vector3d solve_symmetric(const Eigen::Matrix3d& a, const Eigen::Vector3d& b);
[[nodiscard]] Vector6d solve_symmetric(const Matrix6d& a, const Vector6d& b);

/// A square orthogonal matrix whose first columns span those of `columns` (QR by Householder's reflections).
[[nodiscard]] Eigen::MatrixXd orthogonal_basis(const Eigen::MatrixXd& columns);

/// Singular values, descending, and all right singular vectors, a column each.
struct RightSingularVectors {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
[[nodiscard]] RightSingularVectors right_singular_vectors(const Eigen::MatrixXd& matrix);

/// The shortest rotation that takes the direction `from` to the direction `to`; of opposite ones, any half turn.
[[nodiscard]] Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace asbuilt
