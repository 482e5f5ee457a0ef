// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/shared_cells.h"

#include <gmock/gmock.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <random>
#include <vector>

#include "asbuilt/core/pose.h"

namespace asbuilt::graph {
namespace {

constexpr int kUpX = 0, kDownX = 1, kUpY = 2, kDownY = 3, kUpZ = 4, kDownZ = 5;

std::vector<Cell> wall(int side, int a_cells, int b_cells, int at) {
  std::vector<Cell> cells;
  const int axis = side / 2;
  for (int a = 0; a < a_cells; ++a) {
    for (int b = 0; b < b_cells; ++b) {
      Cell cell;
      cell.side = side;
      cell.voxel[axis] = at;
      cell.voxel[(axis + 1) % 3] = a;
      cell.voxel[(axis + 2) % 3] = b;
      cells.push_back(cell);
    }
  }
  return cells;
}

SharedCells sum_of(const std::vector<std::vector<Cell>>& walls) {
  SharedCells cells;
  for (const std::vector<Cell>& each : walls) {
    for (const Cell& cell : each) cells.add(cell);
  }
  return cells;
}

// The definition, cell by cell.
double firmness_by_definition(const std::vector<Cell>& cells) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Cell& cell : cells) centre += cell.voxel.cast<double>() / static_cast<double>(cells.size());
  double squares = 0.0;
  for (const Cell& cell : cells) squares += (cell.voxel.cast<double>() - centre).squaredNorm();
  const double radius = std::sqrt(squares / static_cast<double>(cells.size()));
  Matrix6d information = Matrix6d::Zero();
  for (const Cell& cell : cells) {
    const Eigen::Vector3d normal = (cell.side % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(cell.side / 2);
    Vector6d j;
    j << (cell.voxel.cast<double>() - centre).cross(normal) / radius, normal;
    information += j * j.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(information).eigenvalues()[0];
}

TEST(SharedCells, APlaneATubeAndASingleCellLeaveAMotionFree) {
  EXPECT_EQ(SharedCells{}.firmness(), 0.0);
  EXPECT_EQ(sum_of({wall(kUpZ, 1, 1, 3)}).firmness(), 0.0);
  EXPECT_EQ(sum_of({wall(kUpZ, 20, 30, 5)}).firmness(), 0.0);
  // A square tube along z slides.
  EXPECT_EQ(
      sum_of({wall(kUpX, 8, 30, 9), wall(kDownX, 8, 30, 0), wall(kUpY, 30, 8, 9), wall(kDownY, 30, 8, 0)}).firmness(),
      0.0);
}

TEST(SharedCells, ACornerHoldsAllAndFewCellsHoldLittle) {
  const double corner = sum_of({wall(kUpX, 9, 9, 9), wall(kUpY, 9, 9, 9), wall(kUpZ, 9, 9, 9)}).firmness();
  EXPECT_GT(corner, 1.0);
  EXPECT_LE(corner, 81.0 + 1e-9);  // a third of all
  const double sliver = sum_of({wall(kUpX, 9, 9, 9), wall(kUpY, 9, 9, 9), wall(kUpZ, 1, 9, 9)}).firmness();
  EXPECT_LT(sliver, corner);
  EXPECT_LE(sliver, 9.0 + 1e-9);  // no more cells than nine face along z
}

TEST(SharedCells, IsWhatTheDefinitionSaysInAnyOrderAndAnywhere) {
  std::mt19937 random(7);
  for (int round = 0; round < 50; ++round) {
    std::vector<Cell> cells;
    const auto draw = [&](unsigned below) { return static_cast<int>(random() % below); };
    const Eigen::Vector3i offset(draw(2000) - 1000, draw(2000) - 1000, draw(2000) - 1000);
    for (int i = 0; i < 40; ++i) cells.push_back({offset + Eigen::Vector3i(draw(12), draw(20), draw(5)), draw(6)});
    const double expected = firmness_by_definition(cells);
    const double firmness = sum_of({cells}).firmness();
    EXPECT_NEAR(firmness, expected, 1e-6 * 40.0);
    std::ranges::shuffle(cells, random);
    EXPECT_EQ(sum_of({cells}).firmness(), firmness);
  }
}

TEST(SharedCells, KeysSayWhatTheyWereMadeOf) {
  for (const Cell& cell : {Cell{{0, 0, 0}, 0}, Cell{{-7, 12, -400000}, 5}, Cell{{524287, -524288, 1}, 3}}) {
    const Cell back = cell_of(key_of(cell));
    EXPECT_EQ(back.voxel, cell.voxel);
    EXPECT_EQ(back.side, cell.side);
  }
}

}  // namespace
}  // namespace asbuilt::graph
