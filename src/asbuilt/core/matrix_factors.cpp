// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/matrix_factors.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace asbuilt {

template <int Size>
SymmetricEigen<Size>::SymmetricEigen(const Matrix& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(symmetric);
  values_ = solver.eigenvalues();
  vectors_ = solver.eigenvectors();
}

template class SymmetricEigen<3>;
template class SymmetricEigen<6>;
template class SymmetricEigen<Eigen::Dynamic>;

Eigen::Vector3d solve_symmetric(const Eigen::Matrix3d& a, const Eigen::Vector3d& b) { return a.ldlt().solve(b); }

Vector6d solve_symmetric(const Matrix6d& a, const Vector6d& b) { return a.ldlt().solve(b); }

Eigen::MatrixXd orthogonal_basis(const Eigen::MatrixXd& columns) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(columns).householderQ();
}

RightSingularVectors right_singular_vectors(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeFullV);
  return {svd.singularValues(), svd.matrixV()};
}

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

}  // namespace asbuilt
