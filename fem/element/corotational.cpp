// SPDX-License-Identifier: Apache-2.0
#include "fem/element/corotational.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>

namespace tendril::fem {

namespace v3 {
extern const ElementKernels kCorotationalKernels;
}
namespace v4 {
extern const ElementKernels kCorotationalKernels;
}

namespace {

constexpr int kPolarIterations = 20;
// The iteration converges quadratically: a step below 1e-8 leaves an error of about 1e-16.
constexpr double kPolarStep2 = 1e-16;

}  // namespace

Eigen::Matrix3d polar_rotation(const Eigen::Matrix3d& F) {
  if (!F.allFinite()) return F;
  Eigen::Matrix3d R = F;
  const bool upright = F.determinant() > 0;
  for (int k = 0; k < kPolarIterations && upright; ++k) {
    const Eigen::Matrix3d C = cofactors(R);
    const Eigen::Matrix3d next = 0.5 * (R + C / R.col(0).dot(C.col(0)));
    const double step2 = (next - R).squaredNorm();
    R = next;
    if (step2 < kPolarStep2) return R;
  }
  // Inverted, or so flat that the iteration takes too long.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
}

ElementKernels CorotationalElement::kernels(InstructionSet set) {
  if (set == InstructionSet::kScalar) return {};
  if constexpr (kHasV4)
    if (set == InstructionSet::kV4) return v4::kCorotationalKernels;
  return v3::kCorotationalKernels;
}

bool CorotationalElement::update_lane(ElementBatch& batch, int lane, const Corners& corners) {
  Eigen::Matrix3d F = Eigen::Matrix3d::Zero();
  for (int b = 0; b < 3; ++b)
    F += (corners.col(b + 1) - corners.col(0)) *
         Eigen::RowVector3d(batch.g[b][0][lane], batch.g[b][1][lane], batch.g[b][2][lane]);
  const Eigen::Matrix3d R = polar_rotation(F);
  const Eigen::Quaterniond q(R);
  batch.q[0][lane] = q.w();
  for (int c = 0; c < 3; ++c) batch.q[c + 1][lane] = q.vec()[c];
  batch.theta[lane] = (R.transpose() * F).trace() - 3;
  return F.determinant() > 0;
}

CorotationalElement::CorotationalElement(const RestTetrahedron& rest, const Moduli& moduli,
                                         const Corners& corners)
    : rest_(rest), moduli_(moduli) {
  const Eigen::Matrix3d F = corners * rest.g.transpose();
  det_F_ = F.determinant();
  R_ = polar_rotation(F);
  S_.noalias() = R_.transpose() * F;
}

double CorotationalElement::energy() const {
  const double theta = dilatation();
  return rest_.volume * (moduli_.mu * (S_ - Eigen::Matrix3d::Identity()).squaredNorm() +
                         0.5 * moduli_.lambda * theta * theta);
}

double CorotationalElement::dilatation() const { return S_.trace() - 3; }

Corners CorotationalElement::dilatation_gradient() const { return R_ * rest_.g; }

Corners CorotationalElement::forces(double patch_pressure) const {
  Eigen::Matrix3d stress = 2 * moduli_.mu * S_;
  stress.diagonal().array() += moduli_.lambda * dilatation() + patch_pressure - 2 * moduli_.mu;
  return (-rest_.volume * (R_ * stress)) * rest_.g;
}

Blocks CorotationalElement::stiffness(Tangent tangent, double patch_pressure) const {
  const double V = rest_.volume;
  const auto [mu, lambda] = moduli_;
  const Corners h = R_ * rest_.g;
  const Eigen::Matrix4d gg = rest_.g.transpose() * rest_.g;
  Blocks K;
  int k = 0;

  if (tangent == Tangent::kSemidefinite) {
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b <= a; ++b, ++k) {
        K[k].noalias() = (V * mu) * (h.col(b) * h.col(a).transpose());
        K[k].noalias() += (V * lambda) * (h.col(a) * h.col(b).transpose());
        K[k].diagonal().array() += V * mu * gg(a, b);
      }
    return K;
  }

  const double c = lambda * dilatation() + patch_pressure - 2 * mu;
  Eigen::Matrix3d rotation_hessian = -S_;
  rotation_hessian.diagonal().array() += S_.trace();
  const Eigen::Matrix3d B = (V * c) * (R_ * rotation_hessian.inverse() * R_.transpose());
  std::array<Eigen::Matrix3d, 4> cross, B_cross;
  for (int a = 0; a < 4; ++a) {
    cross[a] = cross_matrix(h.col(a));
    B_cross[a].noalias() = B * cross[a];
  }
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      K[k].noalias() = cross[a].transpose() * B_cross[b];
      K[k].noalias() += (V * lambda) * (h.col(a) * h.col(b).transpose());
      K[k].diagonal().array() += 2 * V * mu * gg(a, b);
    }
  return K;
}

}  // namespace tendril::fem
