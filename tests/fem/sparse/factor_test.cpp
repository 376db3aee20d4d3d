// SPDX-License-Identifier: Apache-2.0
#include "fem/sparse/factor.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "fem/body/assembler.h"
#include "fem/simd/simd.h"
#include "fem/sparse/front_kernels.h"
#include "rt/heap_guard.h"
#include "tests/fem/body/bodies.h"
#include "tests/fem/sparse/cholmod_factor.h"

namespace tendril::fem::factor_test {

using testing::random_vector;

constexpr double kReference = 1e-9;  // what the fast path may differ from CHOLMOD by, relative
constexpr double kSingle = 1e-3;     // the same in single precision: 2⁻²⁴ times a beam's condition

/// A beam's stiffness and a border of rows that touch few nodes, one node, all nodes and none.
struct Bordered {
  explicit Bordered(int nx, int ny, int nz, unsigned seed)
      : random(seed),
        model(testing::beam_model(testing::beam(nx, ny, nz, 0.01))),
        K(model.make_stiffness({})),
        border(4),
        B_T(Eigen::MatrixXd::Zero(model.unknowns(), 4)) {
    Eigen::VectorXd f;
    const Eigen::VectorXd x = model.rest() + random_vector(random, model.unknowns(), 1e-6);
    Assembler(model, K).assemble(x, Tangent::kExact, f, K);
    const int n = model.free_nodes();
    border[0] = {0, n / 3, n / 3 + 1, 0};
    border[1] = {n - 1};
    for (int i = 0; i < n; ++i) border[2].push_back(i);
    for (int row = 0; row < 4; ++row)
      for (int node : border[row]) B_T.col(row).segment<3>(3 * node) = random_vector(random, 3, 1.0);
  }

  std::mt19937 random;
  Model model;
  StiffnessMatrix K;
  std::vector<std::vector<int>> border;
  Eigen::MatrixXd B_T;
};

/// The kernels of every instruction set that this machine has.
std::vector<const FrontKernels*> all_kernels() {
  std::vector<const FrontKernels*> sets = {&front_kernels(InstructionSet::kV3)};
  if (best_instruction_set() == InstructionSet::kV4) sets.push_back(&front_kernels(InstructionSet::kV4));
  return sets;
}

TEST_CASE("The factor sees the compliance at its border as CHOLMOD does", "[law]") {
  const unsigned seed = GENERATE(1u, 2u);
  const FrontKernels* kernels = GENERATE(from_range(all_kernels()));
  CAPTURE(seed, kernels == &front_kernels(InstructionSet::kV3));
  for (const auto& [nx, ny, nz] :
       {std::array{1, 1, 1}, std::array{9, 1, 1}, std::array{7, 4, 3}, std::array{20, 8, 8}}) {
    Bordered b(nx, ny, nz, seed);
    CAPTURE(nx, ny, nz);
    Factor factor(b.K, b.border, StoragePrecision::kDouble, *kernels);
    REQUIRE(factor.factorize(b.K, b.B_T));
    CholmodFactor reference(b.K);
    REQUIRE(reference.factorize(b.K));
    Eigen::MatrixXd moves;
    reference.solve(b.B_T, moves);
    const Eigen::MatrixXd W = b.B_T.transpose() * moves;
    CHECK((factor.border_compliance() - W).norm() <= kReference * W.norm());
    CHECK(factor.border_compliance() == factor.border_compliance().transpose());

    const Eigen::VectorXd c = random_vector(b.random, 4, 1.0);
    Eigen::VectorXd x(b.model.unknowns());
    factor.solve(c, x);
    CHECK((x - moves * c).norm() <= kReference * (moves * c).norm());
    CHECK((b.K.multiply(x) - b.B_T * c).norm() <= kReference * (b.B_T * c).norm());
  }
}

TEST_CASE("Eight vectors at once are multiplied as each of them is", "[law]") {
  Bordered b(7, 4, 3, 9);
  const EightVectors X = random_vector(b.random, 8 * b.K.size(), 1.0).reshaped(8, b.K.size());
  EightVectors Y;
  b.K.multiply(X, Y);
  for (int i = 0; i < 8; ++i) {
    const Eigen::VectorXd y = b.K.multiply(Eigen::VectorXd(X.row(i).transpose()));
    CHECK((Y.row(i).transpose() - y).norm() <= 1e-13 * y.norm());
  }
}

TEST_CASE("A factor kept in single precision solves as the stiffness to single precision", "[law]") {
  const unsigned seed = GENERATE(6u, 7u);
  const FrontKernels* kernels = GENERATE(from_range(all_kernels()));
  CAPTURE(seed, kernels == &front_kernels(InstructionSet::kV3));
  for (const auto& [nx, ny, nz] : {std::array{1, 1, 1}, std::array{7, 4, 3}, std::array{20, 8, 8}}) {
    Bordered b(nx, ny, nz, seed);
    CAPTURE(nx, ny, nz);
    Factor factor(b.K, b.border, StoragePrecision::kSingle, *kernels);
    REQUIRE(factor.factorize(b.K, b.B_T));
    CholmodFactor reference(b.K);
    REQUIRE(reference.factorize(b.K));
    Eigen::MatrixXd expected;
    EightVectors V = random_vector(b.random, 8 * b.K.size(), 1.0).reshaped(8, b.K.size());
    reference.solve(V.transpose(), expected);
    factor.precondition(V);
    CHECK((V.transpose() - expected).norm() <= kSingle * expected.norm());

    reference.solve(b.B_T, expected);
    EightVectors X(8, b.K.size());
    factor.border_solutions(1, X);  // of rows 1, 2 and 3
    CHECK((X.topRows(3).transpose() - expected.rightCols(3)).norm() <= kSingle * expected.norm());
    CHECK(X.bottomRows(5).isZero(0));
    const Eigen::MatrixXd W = b.B_T.transpose() * expected;
    CHECK((factor.border_compliance() - W).norm() <= kReference * W.norm());  // in double all the same
  }
}

TEST_CASE("The factor reports an indefinite matrix and one that is not finite, and recovers", "[law]") {
  Bordered b(4, 2, 2, 3);
  const StiffnessMatrix good = b.K;
  Factor factor(b.K, b.border);
  REQUIRE(factor.factorize(b.K, b.B_T));
  const Eigen::MatrixXd W = factor.border_compliance();
  Factor alone(b.K);  // with no border at all
  CHECK(alone.factorize(b.K, Eigen::MatrixXd(b.model.unknowns(), 0)));
  // One entry of the last node at a time, so that the fault shows up late too.
  for (const double bad : {static_cast<double>(NAN), static_cast<double>(INFINITY), -1e9}) {
    for (int node : {0, b.model.free_nodes() - 1}) {
      CAPTURE(bad, node);
      b.K = good;
      b.K.block(b.K.column_starts()[node])[4] = bad;
      CHECK_FALSE(factor.factorize(b.K, b.B_T));
    }
  }
  REQUIRE(factor.factorize(good, b.B_T));
  CHECK(factor.border_compliance() == W);  // to the last bit
}

TEST_CASE("A body in two parts is factored as two", "[law]") {
  const Mesh one = testing::beam(2, 1, 1, 0.01);
  Mesh two = one;
  const int n = one.node_count();
  two.nodes.conservativeResize(Eigen::NoChange, 2 * n);
  two.nodes.rightCols(n) = one.nodes.colwise() + Eigen::Vector3d(0, 0.05, 0);
  for (auto tet : one.tets) {
    for (int& node : tet) node += n;
    two.tets.push_back(tet);
  }
  for (int node : one.regions.at("base")) two.regions["base"].push_back(node + n);
  const Model model = testing::beam_model(two);
  StiffnessMatrix K = model.make_stiffness({});
  Eigen::VectorXd f;
  Assembler(model, K).assemble(model.rest(), Tangent::kExact, f, K);
  std::vector<std::vector<int>> border(2);
  for (int i = 0; i < model.free_nodes(); ++i) border[i % 2].push_back(i);
  Eigen::MatrixXd B_T = Eigen::MatrixXd::Zero(model.unknowns(), 2);
  for (int i = 0; i < model.free_nodes(); ++i) B_T(3 * i + 1, i % 2) = 1;
  Factor factor(K, border);
  REQUIRE(factor.factorize(K, B_T));
  const Eigen::MatrixXd W = B_T.transpose() * K.dense().ldlt().solve(B_T);
  CHECK((factor.border_compliance() - W).norm() <= kReference * W.norm());
}

TEST_CASE("Factoring again allocates nothing", "[rt]") {
  if (!rt::HeapGuard::available()) {
    WARN("skipped: heap calls are not counted in this build");
    return;
  }
  Bordered b(7, 3, 3, 4);
  Factor factor(b.K, b.border), single(b.K, b.border, StoragePrecision::kSingle);
  const Eigen::VectorXd c = random_vector(b.random, 4, 1.0);
  Eigen::VectorXd x(b.model.unknowns());
  EightVectors X = EightVectors::Ones(8, b.model.unknowns()), Y = X;
  const rt::HeapGuard guard;
  const bool good = factor.factorize(b.K, b.B_T) && single.factorize(b.K, b.B_T);
  factor.solve(c, x);
  single.precondition(X);
  single.border_solutions(0, X);
  b.K.multiply(X, Y);
  CHECK(guard.calls() == 0);
  CHECK(good);
}

/// A front of random numbers that is positive definite, laid out as FrontKernels wants it.
struct RandomFront {
  RandomFront(int k, int n, std::mt19937& random) {
    const Eigen::MatrixXd M = random_vector(random, (k + n) * (k + n), 1.0).reshaped(k + n, k + n);
    A = M * M.transpose() + Eigen::MatrixXd::Identity(k + n, k + n);
    const int kp = round_up_to_panel(k), np = round_up_to_panel(n);
    for (auto* memory : {&F, &L, &U})
      *memory = Aligned((kp + np + 2 * kSimdRows) * (kp + np + 2 * kSimdRows));
    front = {k, n, F.at(), kp + np + kSimdRows, L.at(), U.at(), np + kSimdRows, true};
    for (int c = 0; c < k; ++c) {
      for (int r = c; r < k; ++r) F.at()[c * front.ld + r] = A(r, c);
      for (int r = 0; r < n; ++r) F.at()[c * front.ld + kp + r] = A(k + r, c);
    }
    for (int c = 0; c < n; ++c)
      for (int r = c; r < n; ++r) U.at()[c * front.ldu + r] = A(k + r, k + c);
  }
  /// Entry of L; update rows are counted from the padded pivots on.
  double l(int i, int p) const {
    return front.L[i / kSimdRows * kSimdRows * front.k + kSimdRows * p + i % kSimdRows];
  }

  struct Aligned {
    explicit Aligned(int count = 0) : numbers(count + kSimdRows, 0.0) {}
    double* at() {
      auto address = reinterpret_cast<std::uintptr_t>(numbers.data());
      return reinterpret_cast<double*>((address + 63) / 64 * 64);
    }
    std::vector<double> numbers;
  };
  Eigen::MatrixXd A;
  Aligned F, L, U;
  Front front;
};

TEST_CASE("Kernels of every instruction set eliminate a front as a dense Cholesky does", "[law]") {
  const unsigned seed = 5;
  std::mt19937 random(seed);
  CAPTURE(seed);
  for (const FrontKernels* kernels : all_kernels())
    for (const auto& [k, n] :
         {std::pair{1, 1}, {3, 10}, {7, 1}, {8, 8}, {24, 49}, {33, 7}, {100, 37}, {230, 210}}) {
      RandomFront f(k, n, random);
      CAPTURE(kernels == &front_kernels(InstructionSet::kV3), k, n);
      REQUIRE(kernels->eliminate(f.front));
      const Eigen::MatrixXd L1 = f.A.topLeftCorner(k, k).llt().matrixL();
      const Eigen::MatrixXd L2 =
          L1.triangularView<Eigen::Lower>().solve(f.A.bottomLeftCorner(n, k).transpose()).transpose();
      const Eigen::MatrixXd rest = f.A.bottomRightCorner(n, n) - L2 * L2.transpose();
      double error = 0;
      for (int c = 0; c < k; ++c) {
        for (int r = c; r < k; ++r) error = std::max(error, std::abs(f.l(r, c) - L1(r, c)));
        for (int r = 0; r < n; ++r)
          error = std::max(error, std::abs(f.l(round_up_to_panel(k) + r, c) - L2(r, c)));
      }
      for (int c = 0; c < n; ++c)
        for (int r = c; r < n; ++r)
          error = std::max(error, std::abs(f.front.U[c * f.front.ldu + r] - rest(r, c)));
      CHECK(error < 1e-12 * f.A.norm());

      RandomFront::Aligned z(round_up_to_panel(n)), x(round_up_to_panel(k));
      const Eigen::VectorXd update = random_vector(random, n, 1.0);
      std::copy(update.begin(), update.end(), z.at());
      kernels->back_substitute(f.front, z.at(), x.at());
      const Eigen::VectorXd expected =
          L1.transpose().triangularView<Eigen::Upper>().solve(-(L2.transpose() * update));
      CHECK((Eigen::Map<Eigen::VectorXd>(x.at(), k) - expected).norm() <= 1e-9 * (1 + expected.norm()));
    }
}

TEST_CASE("Kernels of every instruction set substitute eight right sides as a dense triangle does", "[law]") {
  const unsigned seed = 8;
  std::mt19937 random(seed);
  CAPTURE(seed);
  for (const FrontKernels* kernels : all_kernels())
    for (const auto& [k, n] : {std::pair{1, 1}, {3, 10}, {8, 8}, {24, 49}, {33, 7}, {64, 0}}) {
      CAPTURE(kernels == &front_kernels(InstructionSet::kV3), k, n);
      const int kp = round_up_to_panel(k), np = round_up_to_panel(n);
      // L with ones on the diagonal and little below it, so that no error grows.
      Eigen::MatrixXf L = Eigen::MatrixXf::Zero(kp + np, k);
      for (int c = 0; c < k; ++c) {
        for (int r = c; r < k; ++r) L(r, c) = random_vector(random, 1, 0.1).cast<float>()[0] + float(r == c);
        for (int r = kp; r < kp + n; ++r) L(r, c) = random_vector(random, 1, 0.1).cast<float>()[0];
      }
      std::vector<double> memory(4 * (kp + np) * (k + kSimdRows) + 2 * kSimdRows);
      const auto address = reinterpret_cast<std::uintptr_t>(memory.data());
      auto* panels = reinterpret_cast<float*>((address + 63) / 64 * 64);
      float* z = panels + static_cast<size_t>(kp + np) * kp;
      for (int r = 0; r < kp + np; ++r)
        for (int c = 0; c < k; ++c)
          panels[(r / kSimdRows) * kSimdRows * k + kSimdRows * c + r % kSimdRows] = L(r, c);
      Eigen::Map<Eigen::Matrix<float, 8, Eigen::Dynamic>> rows(z, 8, kp + np);
      rows.setZero();
      const Eigen::MatrixXf b = random_vector(random, 8 * k, 1.0).cast<float>().reshaped(k, 8);
      const auto L1 = L.topRows(k).triangularView<Eigen::Lower>();
      const auto L2 = L.middleRows(kp, n);

      rows.leftCols(k) = b.transpose();
      kernels->forward_substitute_eight(panels, k, n, z);
      const Eigen::MatrixXf y = L1.solve(b);
      CHECK((rows.leftCols(k).transpose() - y).norm() <= 1e-4f * y.norm());
      CHECK((rows.middleCols(kp, n).transpose() + L2 * y).norm() <= 1e-4f * y.norm());

      const Eigen::MatrixXf update = random_vector(random, 8 * n, 1.0).cast<float>().reshaped(n, 8);
      rows.leftCols(k) = b.transpose();
      rows.middleCols(kp, n) = update.transpose();
      kernels->backward_substitute_eight(panels, k, n, z);
      const Eigen::MatrixXf x = L1.transpose().solve(b - L2.transpose() * update);
      CHECK((rows.leftCols(k).transpose() - x).norm() <= 1e-4f * x.norm());
    }
}

}  // namespace tendril::fem::factor_test
