#include "fem/corotational.h"

#include <Eigen/Dense>

namespace tendril::fem {
namespace {

constexpr int kPolarIterations = 20;
// The iteration converges quadratically: a step below 1e-8 leaves an error of about 1e-16.
constexpr double kPolarStep2 = 1e-16;

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

}  // namespace

RestTetrahedron rest_tetrahedron(const Eigen::Matrix<double, 3, 4>& corners) {
  const Eigen::Matrix3d D = corners.rightCols<3>().colwise() - corners.col(0);
  const double det = D.determinant();
  RestTetrahedron rest;
  rest.volume = det / 6;
  rest.g.rightCols<3>() = cofactors(D) / det;  // D⁻ᵀ
  rest.g.col(0) = -rest.g.rightCols<3>().rowwise().sum();
  return rest;
}

Eigen::Matrix3d polar_rotation(const Eigen::Matrix3d& F) {
  if (!F.allFinite()) return F;
  Eigen::Matrix3d R = F;
  for (int k = 0; k < kPolarIterations && F.determinant() > 0; ++k) {
    const Eigen::Matrix3d C = cofactors(R);
    const Eigen::Matrix3d next = 0.5 * (R + C / R.col(0).dot(C.col(0)));
    const double step2 = (next - R).squaredNorm();
    R = next;
    if (step2 < kPolarStep2) return R;
  }
  // Inside out, or so flat that the iteration takes too long.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

CorotationalElement::CorotationalElement(const RestTetrahedron& rest, const Material& material,
                                         const Eigen::Matrix<double, 3, 4>& corners)
    : rest_(rest), mu_(material.lame_mu()), lambda_(material.lame_lambda()) {
  const Eigen::Matrix3d F = corners * rest.g.transpose();
  det_F_ = F.determinant();
  R_ = polar_rotation(F);
  S_.noalias() = R_.transpose() * F;
}

double CorotationalElement::energy() const {
  const double trace = S_.trace() - 3;
  return rest_.volume *
         (mu_ * (S_ - Eigen::Matrix3d::Identity()).squaredNorm() + 0.5 * lambda_ * trace * trace);
}

Eigen::Matrix<double, 3, 4> CorotationalElement::forces() const {
  Eigen::Matrix3d stress = 2 * mu_ * S_;
  stress.diagonal().array() += lambda_ * (S_.trace() - 3) - 2 * mu_;
  return (-rest_.volume * (R_ * stress)) * rest_.g;
}

std::array<Eigen::Matrix3d, 10> CorotationalElement::stiffness(Tangent tangent) const {
  const double V = rest_.volume;
  const Eigen::Matrix<double, 3, 4> h = R_ * rest_.g;
  const Eigen::Matrix4d gg = rest_.g.transpose() * rest_.g;
  std::array<Eigen::Matrix3d, 10> K;
  int k = 0;

  if (tangent == Tangent::kFrozenRotation) {
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b <= a; ++b, ++k) {
        K[k].noalias() = (V * mu_) * (h.col(b) * h.col(a).transpose());
        K[k].noalias() += (V * lambda_) * (h.col(a) * h.col(b).transpose());
        K[k].diagonal().array() += V * mu_ * gg(a, b);
      }
    return K;
  }

  const double c = lambda_ * (S_.trace() - 3) - 2 * mu_;
  Eigen::Matrix3d turning = -S_;
  turning.diagonal().array() += S_.trace();
  const Eigen::Matrix3d B = (V * c) * (R_ * turning.inverse() * R_.transpose());
  std::array<Eigen::Matrix3d, 4> cross, B_cross;
  for (int a = 0; a < 4; ++a) {
    cross[a] = cross_matrix(h.col(a));
    B_cross[a].noalias() = B * cross[a];
  }
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      K[k].noalias() = cross[a].transpose() * B_cross[b];
      K[k].noalias() += (V * lambda_) * (h.col(a) * h.col(b).transpose());
      K[k].diagonal().array() += 2 * V * mu_ * gg(a, b);
    }
  return K;
}

}  // namespace tendril::fem
