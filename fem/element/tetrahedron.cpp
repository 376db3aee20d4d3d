// SPDX-License-Identifier: Apache-2.0
#include "fem/element/tetrahedron.h"

#include <Eigen/Dense>
#include <cmath>

#include "fem/element/element_kernels.h"

namespace tendril::fem {

Eigen::Matrix3d cofactors(const Eigen::Matrix3d& A) {
  Eigen::Matrix3d C;
  C.col(0) = A.col(1).cross(A.col(2));
  C.col(1) = A.col(2).cross(A.col(0));
  C.col(2) = A.col(0).cross(A.col(1));
  return C;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d M;
  M << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return M;
}

RestTetrahedron rest_tetrahedron(const Corners& corners) {
  const Eigen::Matrix3d D = corners.rightCols<3>().colwise() - corners.col(0);
  const double det = D.determinant();
  RestTetrahedron rest;
  rest.volume = std::abs(det) / 6;
  rest.g.rightCols<3>() = cofactors(D) / det;  // D⁻ᵀ
  rest.g.col(0) = -rest.g.rightCols<3>().rowwise().sum();
  return rest;
}

RestTetrahedron rest_tetrahedron(const ElementBatch& batch, int lane) {
  RestTetrahedron rest{batch.volume[lane], {}};
  for (int b = 0; b < 3; ++b)
    for (int c = 0; c < 3; ++c) rest.g(c, b + 1) = batch.g[b][c][lane];
  rest.g.col(0) = -rest.g.rightCols<3>().rowwise().sum();
  return rest;
}

}  // namespace tendril::fem
