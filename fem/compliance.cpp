#include "fem/compliance.h"

namespace tendril::fem {

void solve_responses(const Constraints& constraints, const Eigen::VectorXd& x, Factor& K,
                     const Eigen::VectorXd& r, Responses& responses) {
  const int m = constraints.actuators();
  responses.loads.resize(r.size(), m + 1);
  constraints.actuator_directions(x, responses.loads.leftCols(m));
  responses.loads.col(m) = r;
  K.solve(responses.loads, responses.moves);
}

void compute_compliance(const Constraints& constraints, const Eigen::VectorXd& x, const Responses& responses,
                        Compliance& compliance) {
  const int m = constraints.actuators();
  const Eigen::MatrixXd delta_a = responses.loads.leftCols(m).transpose() * responses.moves;
  const Eigen::MatrixXd delta_e = constraints.effector_displacement(responses.moves);
  // Symmetric in exact arithmetic; the mean of the two halves is symmetric to the last bit.
  compliance.W_aa = 0.5 * (delta_a.leftCols(m) + delta_a.leftCols(m).transpose());
  compliance.W_ea = delta_e.leftCols(m);
  compliance.delta_a_free = constraints.shortening(x) + delta_a.col(m);
  compliance.p_e_free = constraints.effector_position(x) + delta_e.col(m);
}

}  // namespace tendril::fem
