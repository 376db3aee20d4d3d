// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>

#include "fem/body/dynamics.h"
#include "tests/validation/beam.h"
#include "tests/validation/cases.h"
#include "tests/validation/convergence.h"

// The simulated robot's body in motion: a cantilever that swings in its first bending mode. On its mesh the
// mode has a frequency ω of its own, from K and the masses, which is held against beam theory. Backward Euler
// turns the mode into the factor 1/(1 − iωh) a step, so that it swings with atan(ωh)/h and decays at the rate
// ln(1 + ω²h²)/2h, about ω²h/2: what the motion must show.

namespace tendril::validation {
namespace {

constexpr ConvergenceLimits kVibrationShort{1.7, 2.2, 100, 20},
    kVibrationFull{1.8, 2.2, 12, 1};                             // of ω², a stiffness
constexpr double kSwingError = 0.01;                             // %, of frequency and of decay
constexpr double kDecayOrderLow = 0.95, kDecayOrderHigh = 1.05;  // in the step
constexpr double kEnergyGain = 1e-9;                             // of the energy at the start, in any step
constexpr double kStaticError = 1e-6;                            // of the deflection

constexpr double kVibrationLength = 0.1, kVibrationHeight = 0.01,
                 kWidth = 0.02;  // m; wider than high, so that one mode is the lowest
constexpr double kVibrationYoung = 1e6, kDensity = 1000;  // Pa, kg/m³
constexpr double kAmplitude = 1e-4;                       // m
constexpr double kPi = std::numbers::pi;

Beam vibration_beam_of(int cells_high) {
  return {kVibrationLength, kVibrationHeight, kWidth, 10 * cells_high, cells_high, 2 * cells_high};
}

fem::Model model_of(const Beam& beam, double gravity = 0) {
  const double mass = kDensity * beam.area() * kVibrationLength;
  return {beam.mesh(), {kVibrationYoung, 0}, fem::Mass{mass}, beam.clamped(), {0, 0, -gravity}};
}

/// First bending frequency, rad/s: Euler and Bernoulli's, ω_b = 1.8751² √(EI/ρA)/L², lowered by shear as
/// Dunkerley's rule has it, 1/ω² = 1/ω_b² + 1/ω_s² with ω_s = (π/2) √(κG/ρ)/L and κ = 5/6, and by the
/// sections' rotary inertia as Rayleigh's quotient has it: ∫ρA φ² grows by ∫ρI φ'², 4.65 I/(A L²) times
/// itself for this mode φ.
double theory(const Beam& beam) {
  const double bending = std::pow(1.8751040687, 2) / (kVibrationLength * kVibrationLength) *
                         std::sqrt(kVibrationYoung * beam.second_moment() / (kDensity * beam.area()));
  const double shear = kPi / 2 / kVibrationLength * std::sqrt(5.0 / 6 * kVibrationYoung / 2 / kDensity);
  const double rotary = 1 + 4.65 * beam.second_moment() / (beam.area() * kVibrationLength * kVibrationLength);
  return 1 / std::sqrt(rotary / (bending * bending) + 1 / (shear * shear));
}

struct Mode {
  double omega;           ///< rad/s
  Eigen::VectorXd shape;  ///< 3N, largest entry 1
};

/// The lowest mode at rest, K φ = ω² M φ, by inverse iteration.
Mode lowest_mode(const fem::Model& model) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> K(stiffness_at_rest(model));
  const Eigen::VectorXd& M = model.masses();
  Mode mode{0, Eigen::VectorXd::Zero(model.unknowns())};
  for (int i = 0; i < model.free_nodes(); ++i)
    mode.shape[3 * i + 2] = std::pow(model.rest()[3 * i] / kVibrationLength, 2);
  for (int k = 0; k < 40; ++k) {  // other modes shrink at least fourfold each time
    const Eigen::VectorXd next = K.solve(M.cwiseProduct(mode.shape));
    mode.omega = std::sqrt(mode.shape.dot(M.cwiseProduct(next)) / next.dot(M.cwiseProduct(next)));
    mode.shape = next / next.cwiseAbs().maxCoeff();
  }
  return mode;
}

void frequency(Report& report, Extent extent) {
  const bool full = extent == Extent::kFull;
  Convergence found;
  for (int n : full ? std::vector{1, 2, 4, 6} : std::vector{1, 2}) {
    const double expected = theory(vibration_beam_of(n)),
                 omega = lowest_mode(model_of(vibration_beam_of(n))).omega;
    found.add(1e3 * kVibrationHeight / n, 100 * (std::pow(omega / expected, 2) - 1));
    report.note(fmt::format("first frequency, cells of {:.3g} mm", found.sizes.back()), omega / (2 * kPi),
                "Hz");
  }
  report.note("first frequency of beam theory", theory(vibration_beam_of(1)) / (2 * kPi), "Hz");
  report.picture({"Squared first frequency: error", "edge of a cell, mm", "error, %", true});
  report_convergence(report, "error of the squared frequency", found,
                     full ? kVibrationFull : kVibrationShort);
  draw_second_order(report, found);
}

/// What is written down of the swinging beam.
struct Swing {
  std::vector<double> time, deflection, energy;  ///< s, m, J
};

Swing swing_of(const Beam& beam, const fem::Model& model, const Mode& mode, double h, double duration) {
  const fem::Constraints none(model, {}, {});
  fem::Dynamics body(model, none, {0, 0});
  body.reset(model.rest() + kAmplitude * mode.shape);
  Swing swing;
  for (int i = 0; i * h < duration; ++i) {
    swing.time.push_back(i * h);
    swing.deflection.push_back(beam.end_displacement(model, body.x()).z());
    swing.energy.push_back(body.kinetic_energy() + model.energy(body.x()));
    if (!body.step(Eigen::VectorXd(), h)) throw std::runtime_error("the swinging beam cannot be advanced");
  }
  return swing;
}

/// The factor of one mode a step, from the recurrence z_{k+1} = 2 Re(q) z_k − |q|² z_{k−1} that its samples
/// obey.
std::complex<double> factor_of(const std::vector<double>& z) {
  Eigen::MatrixX2d known(z.size() - 2, 2);
  Eigen::VectorXd next(z.size() - 2);
  for (Eigen::Index k = 0; k < next.size(); ++k) {
    known.row(k) << z[k + 1], z[k];
    next[k] = z[k + 2];
  }
  const Eigen::Vector2d c = (known.transpose() * known).inverse() * (known.transpose() * next);
  return {c[0] / 2, std::sqrt(-c[1] - c[0] * c[0] / 4)};
}

double largest_gain(const std::vector<double>& energy) {
  double gain = 0;
  for (size_t i = 1; i < energy.size(); ++i) gain = std::max(gain, energy[i] - energy[i - 1]);
  return gain / energy.front();
}

/// Nothing damps here but the integrator: it must never add energy, and what it takes must halve with the
/// step.
void dissipation(Report& report) {
  const Beam beam = vibration_beam_of(1);
  const fem::Model model = model_of(beam);
  const Mode mode = lowest_mode(model);
  const double period = 2 * kPi / mode.omega;
  const std::vector<int> steps_a_period = {25, 50, 100};
  std::vector<double> decays;
  std::vector<Swing> swings;
  double gain = 0;
  for (int steps : steps_a_period) {
    const double h = period / steps;
    swings.push_back(swing_of(beam, model, mode, h, 4 * period));
    const auto factor = factor_of(swings.back().deflection);
    const auto expected = 1.0 / std::complex<double>(1, -mode.omega * h);
    report.at_most(fmt::format("{} steps a period: frequency against atan(ωh)/h", steps),
                   100 * std::abs(std::arg(factor) / std::arg(expected) - 1), "%", kSwingError);
    report.at_most(fmt::format("{} steps a period: rate of decay against ln(1 + ω²h²)/2h", steps),
                   100 * std::abs(std::log(std::abs(factor)) / std::log(std::abs(expected)) - 1), "%",
                   kSwingError);
    gain = std::max(gain, largest_gain(swings.back().energy));
    decays.push_back(-std::log(std::abs(factor)) / h);
  }
  report.within("order of the decay in the step", order(2, decays[1], 1, decays[2]), "", kDecayOrderLow,
                kDecayOrderHigh);
  report.at_most("largest gain of total energy in a step, of that at the start", gain, "", kEnergyGain);

  report.picture({"The end of the beam, let go in its first mode", "time, s", "deflection, mm"});
  for (size_t k = 0; k < swings.size(); ++k) {
    for (double& z : swings[k].deflection) z *= 1e3;
    report.series(fmt::format("{} steps a period", steps_a_period[k]), Style::kLine, swings[k].time,
                  swings[k].deflection);
  }
  report.picture({"Its total energy", "time, s", "share of that at the start"});
  for (size_t k = 0; k < swings.size(); ++k) {
    const double start = swings[k].energy.front();
    for (double& energy : swings[k].energy) energy /= start;
    report.series(fmt::format("{} steps a period", steps_a_period[k]), Style::kLine, swings[k].time,
                  swings[k].energy);
  }
}

/// Under gravity and damping the motion ends where the equilibrium is.
void limit(Report& report) {
  fem::Model model = model_of(vibration_beam_of(1), 9.81);
  const fem::Constraints none(model, {}, {});
  fem::Dynamics body(model, none, {5, 0.02});
  for (int i = 0; i < 400; ++i)
    if (!body.step(Eigen::VectorXd(), 0.05)) throw std::runtime_error("the falling beam cannot be advanced");
  const Eigen::VectorXd rest = settle(model, model.rest(), {});
  report.at_most("where the motion ends against the equilibrium, of the deflection",
                 (body.x() - rest).cwiseAbs().maxCoeff() / (rest - model.rest()).cwiseAbs().maxCoeff(), "",
                 kStaticError);
}

}  // namespace

void vibration(Report& report, Extent extent) {
  frequency(report, extent);
  dissipation(report);
  limit(report);
}

}  // namespace tendril::validation
