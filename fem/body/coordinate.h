// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <variant>
#include <vector>

#include "fem/body/attachment.h"
#include "fem/body/model.h"
#include "fem/mesh/surface.h"
#include "fem/sparse/stiffness_matrix.h"

namespace tendril::fem {

/// A point that a cable passes or a rod ends at: a material point of the body (in the model's numbering), or
/// one fixed in space (m).
using CablePoint = std::variant<Attachment, Eigen::Vector3d>;

/// A vector that is linear in the pose, Σ w_i x_i + c, m: the mean of points, or the difference of two. Fixed
/// nodes and points fixed in space contribute to c.
class LinearVector {
 public:
  struct Term {
    int node;  ///< a free one; each occurs once
    double weight;
  };

  void add(const Model& model, const CablePoint& point, double weight);
  const std::vector<Term>& terms() const { return terms_; }  ///< by node, descending
  std::vector<int> nodes() const;                            ///< of the terms
  Eigen::Vector3d at(const Eigen::VectorXd& x) const;        ///< m

  /// Adds the gradient of u · Σ w_i x_i to g (3N).
  void add_gradient(const Eigen::Vector3d& u, Eigen::Ref<Eigen::VectorXd> g) const;

 private:
  std::vector<Term> terms_;
  Eigen::Vector3d constant_ = Eigen::Vector3d::Zero();
};

// A generalised coordinate q(x) of the body is a scalar that an actuator drives, or that is controlled. The
// effort λ that is conjugate to it puts the forces λ ∂q/∂x on the nodes. There are three kinds. Each has
//   value(x)             q
//   add_gradient(x, g)   g += ∂q/∂x, 3N
//   add_hessian(x, scale, tangent, K)
//                        K += scale ∂²q/∂x²; with the semidefinite tangent only if that is positive
//                        semidefinite
//   cliques()            sets of nodes that the Hessian couples beyond those of elements
//   bind(K)              looks up where in matrices of K's pattern the Hessian goes
//   nodes()              the free nodes that it depends on, at any pose
// Real-time: no. The first three allocate nothing; their time depends only on the number of nodes involved.

/// u · v(x): the position of a point, or of the mean of several, along a direction u fixed in space, m.
class Projection {
 public:
  Projection(LinearVector point, const Eigen::Vector3d& direction);

  double value(const Eigen::VectorXd& x) const { return direction_.dot(point_.at(x)); }
  void add_gradient(const Eigen::VectorXd&, Eigen::Ref<Eigen::VectorXd> g) const {
    point_.add_gradient(direction_, g);
  }
  void add_hessian(const Eigen::VectorXd&, double, Tangent, StiffnessMatrix&) const {}  // linear
  std::vector<std::vector<int>> cliques() const { return {}; }
  void bind(const StiffnessMatrix&) {}
  std::vector<int> nodes() const { return point_.nodes(); }

 private:
  LinearVector point_;
  Eigen::Vector3d direction_;
};

/// ± the length of a polyline through points, m.
class Length {
 public:
  /// @param sign  +1 for a rod, −1 for a cable: its coordinate grows as it shortens
  Length(const Model& model, const std::vector<CablePoint>& points, double sign);

  double value(const Eigen::VectorXd& x) const;
  void add_gradient(const Eigen::VectorXd& x, Eigen::Ref<Eigen::VectorXd> g) const;
  /// A segment of length L and direction u adds (±scale / L)(I − u uᵀ) to the relative motion of its ends.
  void add_hessian(const Eigen::VectorXd& x, double scale, Tangent tangent, StiffnessMatrix& K) const;
  std::vector<std::vector<int>> cliques() const;
  void bind(const StiffnessMatrix& K);
  std::vector<int> nodes() const;

  /// Index of the first segment whose ends coincide, or −1.
  int first_degenerate_segment(const Eigen::VectorXd& x) const;

 private:
  struct Segment {
    LinearVector span;
    std::vector<int> slots;  // of the pairs of shares (i, j ≤ i) in order
  };
  std::vector<Segment> segments_;
  double sign_;
};

/// The volume of a cavity, m³: that of the closed surface of the body's faces around it. It is positive if
/// the faces are counter-clockwise seen from inside the cavity.
class Volume {
 public:
  /// @param surface  closed, in the model's numbering
  Volume(const Model& model, std::vector<Face> surface);

  double value(const Eigen::VectorXd& x) const;
  void add_gradient(const Eigen::VectorXd& x, Eigen::Ref<Eigen::VectorXd> g) const;
  /// The Hessian is indefinite, so nothing is added unless the tangent is exact.
  void add_hessian(const Eigen::VectorXd& x, double scale, Tangent tangent, StiffnessMatrix& K) const;
  std::vector<std::vector<int>> cliques() const { return {}; }  // its edges are edges of elements
  void bind(const StiffnessMatrix& K);
  std::vector<int> nodes() const;

 private:
  const Model* model_;
  std::vector<Face> surface_;
  std::vector<std::array<int, 3>> slots_;  // of a face's pairs (1, 2), (2, 0), (0, 1)
};

using Coordinate = std::variant<Projection, Length, Volume>;

}  // namespace tendril::fem
