// SPDX-License-Identifier: Apache-2.0
#include "fem/element/neo_hookean.h"

#include <Eigen/Dense>
#include <cmath>

namespace tendril::fem {

namespace v3 {
extern const ElementKernels kNeoHookeanKernels;
}
namespace v4 {
extern const ElementKernels kNeoHookeanKernels;
}

ElementKernels NeoHookeanElement::kernels(InstructionSet set) {
  if (set == InstructionSet::kScalar) return {};
  if constexpr (kHasV4)
    if (set == InstructionSet::kV4) return v4::kNeoHookeanKernels;
  return v3::kNeoHookeanKernels;
}

NeoHookeanElement::NeoHookeanElement(const RestTetrahedron& rest, const Moduli& moduli,
                                     const Corners& corners)
    : rest_(rest),
      moduli_(moduli),
      F_(corners * rest.g.transpose()),
      C_(cofactors(F_)),
      J_(F_.col(0).dot(C_.col(0))) {}

double NeoHookeanElement::energy() const {
  const double theta = dilatation();
  return rest_.volume * (0.5 * moduli_.mu * (F_.squaredNorm() - 3) - moduli_.mu * theta +
                         0.5 * (moduli_.mu + moduli_.lambda) * theta * theta);
}

Corners NeoHookeanElement::dilatation_gradient() const { return C_ * rest_.g; }

double NeoHookeanElement::q(double patch_pressure) const {
  return (moduli_.mu + moduli_.lambda) * dilatation() - moduli_.mu + patch_pressure;
}

Corners NeoHookeanElement::forces(double patch_pressure) const {
  return -rest_.volume * (moduli_.mu * F_ + q(patch_pressure) * C_) * rest_.g;
}

// Entry (3j + i, 3l + k) is the derivative by F_ij and F_kl.
NeoHookeanElement::Hessian NeoHookeanElement::hessian(double q) const {
  Hessian H = (moduli_.mu + moduli_.lambda) * C_.reshaped() * C_.reshaped().transpose();
  H.diagonal().array() += moduli_.mu;
  for (int j = 0; j < 3; ++j) {
    // cof F has the columns F_1 × F_2, F_2 × F_0, F_0 × F_1.
    const int next = (j + 1) % 3, last = (j + 2) % 3;
    H.block<3, 3>(3 * j, 3 * next) -= q * cross_matrix(F_.col(last));
    H.block<3, 3>(3 * j, 3 * last) += q * cross_matrix(F_.col(next));
  }
  return H;
}

NeoHookeanElement::Hessian NeoHookeanElement::projected_hessian(double q) const {
  const double mu = moduli_.mu;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F_, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d U = svd.matrixU();
  Eigen::Matrix3d V = svd.matrixV();
  Eigen::Vector3d sigma = svd.singularValues();
  // J is the product of the σ where U and V are both proper or both improper.
  const double sign = U.determinant() * V.determinant();
  V.col(2) *= sign, sigma[2] *= sign;
  const Eigen::Vector3d c(sigma[1] * sigma[2], sigma[2] * sigma[0], sigma[0] * sigma[1]);

  Eigen::Matrix3d stretch = (mu + moduli_.lambda) * c * c.transpose();
  Hessian H = Hessian::Zero();
  const auto add = [&](double eigenvalue, const Eigen::Matrix3d& direction) {
    const Eigen::Matrix3d turned = U * direction * V.transpose();
    if (eigenvalue > 0) H += eigenvalue * turned.reshaped() * turned.reshaped().transpose();
  };
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    Eigen::Matrix3d twist = Eigen::Matrix3d::Zero(), flip = twist;
    twist(i, j) = flip(i, j) = flip(j, i) = std::sqrt(0.5);
    twist(j, i) = -twist(i, j);
    add(mu + q * sigma[k], twist);
    add(mu - q * sigma[k], flip);
    stretch(k, k) += mu;
    stretch(i, j) += q * sigma[k];
    stretch(j, i) += q * sigma[k];
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> stretches(stretch);
  for (int k = 0; k < 3; ++k)
    add(stretches.eigenvalues()[k], stretches.eigenvectors().col(k).asDiagonal().toDenseMatrix());
  return H;
}

Blocks NeoHookeanElement::stiffness(Tangent tangent, double patch_pressure) const {
  const double q = this->q(patch_pressure);
  const Hessian H = tangent == Tangent::kExact ? hessian(q) : projected_hessian(q);
  Blocks K;
  int k = 0;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      K[k].setZero();
      for (int j = 0; j < 3; ++j)
        for (int l = 0; l < 3; ++l)
          K[k] += rest_.volume * rest_.g(j, a) * rest_.g(l, b) * H.block<3, 3>(3 * j, 3 * l);
    }
  return K;
}

}  // namespace tendril::fem
