// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/matrix_factors.h"

#include <gtest/gtest.h>

#include "asbuilt/core/random.h"

namespace asbuilt {
namespace {

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  Random random(seed, "matrix", 0);
  Eigen::MatrixXd matrix(rows, columns);
  for (Eigen::Index i = 0; i < matrix.size(); ++i) matrix.data()[i] = random.uniform(-1.0, 1.0);
  return matrix;
}

Eigen::MatrixXd random_symmetric(Eigen::Index size, std::uint64_t seed) {
  const Eigen::MatrixXd root = random_matrix(size, size, seed);
  return root * root.transpose();
}

double off_identity(const Eigen::MatrixXd& matrix) {
  return (matrix.transpose() * matrix - Eigen::MatrixXd::Identity(matrix.cols(), matrix.cols())).cwiseAbs().maxCoeff();
}

template <int Size>
void expect_eigen(const Eigen::Matrix<double, Size, Size>& matrix) {
  const SymmetricEigen<Size> eigen(matrix);
  EXPECT_LT((matrix * eigen.eigenvectors() - eigen.eigenvectors() * eigen.eigenvalues().asDiagonal()).norm(), 1e-12);
  EXPECT_LT(off_identity(eigen.eigenvectors()), 1e-12);
  for (Eigen::Index i = 1; i < matrix.rows(); ++i) EXPECT_LE(eigen.eigenvalues()[i - 1], eigen.eigenvalues()[i]);
}

TEST(MatrixFactors, EigenvectorsAreOrthogonalAndTheirValuesAscend) {
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    expect_eigen<3>(random_symmetric(3, seed));
    expect_eigen<6>(random_symmetric(6, seed));
    expect_eigen<Eigen::Dynamic>(random_symmetric(4, seed));
  }
}

TEST(MatrixFactors, SolutionsSatisfyTheirEquations) {
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    const Eigen::Matrix3d three = random_symmetric(3, seed) + 0.1 * Eigen::Matrix3d::Identity();
    const Matrix6d six = random_symmetric(6, seed) + 0.1 * Matrix6d::Identity();
    const Eigen::Vector3d b3 = random_matrix(3, 1, seed + 100);
    const Vector6d b6 = random_matrix(6, 1, seed + 200);
    EXPECT_LT((three * solve_symmetric(three, b3) - b3).norm(), 1e-12);
    EXPECT_LT((six * solve_symmetric(six, b6) - b6).norm(), 1e-12);
  }
}

TEST(MatrixFactors, ABasisBeginsWithTheSpaceOfItsColumns) {
  const Eigen::MatrixXd columns = random_matrix(6, 2, 3);
  const Eigen::MatrixXd basis = orthogonal_basis(columns);
  ASSERT_EQ(basis.rows(), 6);
  ASSERT_EQ(basis.cols(), 6);
  EXPECT_LT(off_identity(basis), 1e-12);
  EXPECT_LT((basis.rightCols(4).transpose() * columns).norm(), 1e-12);
}

TEST(MatrixFactors, SingularValuesAreTheLengthsOfWhatTheirVectorsAreTakenTo) {
  const Eigen::MatrixXd matrix = random_matrix(3, 5, 4);  // wide: two vectors are taken to zero
  const RightSingularVectors singular = right_singular_vectors(matrix);
  ASSERT_EQ(singular.values.size(), 3);
  ASSERT_EQ(singular.vectors.cols(), 5);
  EXPECT_LT(off_identity(singular.vectors), 1e-12);
  for (Eigen::Index i = 0; i < 5; ++i) {
    EXPECT_NEAR((matrix * singular.vectors.col(i)).norm(), i < 3 ? singular.values[i] : 0.0, 1e-12);
  }
  for (Eigen::Index i = 1; i < 3; ++i) EXPECT_GE(singular.values[i - 1], singular.values[i]);
}

TEST(MatrixFactors, TheRotationBetweenTwoDirectionsIsTheShortest) {
  Random random(5, "directions", 0);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d from(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
    const Eigen::Vector3d to(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
    const Eigen::Matrix3d rotation = rotation_between(from, to).toRotationMatrix();
    EXPECT_LT((rotation * from.normalized() - to.normalized()).norm(), 1e-12);
    EXPECT_NEAR(rotation_angle(rotation), std::acos(from.normalized().dot(to.normalized())), 1e-7);
    const Eigen::Matrix3d half_turn = rotation_between(from, -from).toRotationMatrix();
    EXPECT_LT((half_turn * from + from).norm(), 1e-7);
    EXPECT_LT(off_identity(half_turn), 1e-12);
  }
}

}  // namespace
}  // namespace asbuilt
