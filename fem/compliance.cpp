#include "fem/compliance.h"

namespace tendril::fem {

void solve_responses(const Constraints& constraints, const Eigen::VectorXd& x, Factor& K,
                     const Eigen::VectorXd& r, Responses& responses) {
  const int m = constraints.actuators();
  responses.loads.resize(r.size(), m + 1);
  constraints.actuator_directions(x, responses.loads.leftCols(m));
  responses.loads.col(m) = r;
  responses.effectors.resize(r.size(), constraints.effector_coordinates());
  constraints.effector_directions(x, responses.effectors);
  K.solve(responses.loads, responses.moves);
}

void compute_compliance(const Constraints& constraints, const Eigen::VectorXd& x, const Responses& responses,
                        Compliance& compliance) {
  const int m = constraints.actuators();
  const Eigen::MatrixXd delta_a = responses.loads.leftCols(m).transpose() * responses.moves;
  const Eigen::MatrixXd delta_e = responses.effectors.transpose() * responses.moves;
  // Symmetric in exact arithmetic; the mean of the two halves is symmetric to the last bit.
  compliance.W_aa = 0.5 * (delta_a.leftCols(m) + delta_a.leftCols(m).transpose());
  compliance.W_ea = delta_e.leftCols(m);
  constraints.displacement(x, compliance.delta_a_free);
  compliance.delta_a_free += delta_a.col(m);
  constraints.effector_position(x, compliance.p_e_free);
  compliance.p_e_free += delta_e.col(m);
}

}  // namespace tendril::fem
