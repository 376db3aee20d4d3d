// SPDX-License-Identifier: Apache-2.0
#include "tests/qp/sequence.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace tendril::qp {
namespace {

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : file_(file), in_(file, std::ios::binary) {}

  template <typename T>
  T value() {
    T result{};
    if (!in_.read(reinterpret_cast<char*>(&result), sizeof result))
      throw std::runtime_error(file_.string() + ": ends too early");
    return result;
  }

  Vector vector(int n) {
    Vector result(n);
    for (double& entry : result) entry = value<double>();
    return result;
  }

  Matrix matrix(int n) {
    Matrix result(n, n);
    for (int i = 0; i < n; ++i) result.row(i) = vector(n).transpose();
    return result;
  }

 private:
  std::filesystem::path file_;
  std::ifstream in_;
};

}  // namespace

std::vector<std::filesystem::path> sequence_files() {
  const std::filesystem::path folder = std::filesystem::path(TENDRIL_SHARED_DATA) / "qp";
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".qps") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

Sequence read_sequence(const std::filesystem::path& qps) {
  Reader in(qps), reference(std::filesystem::path(qps).replace_extension(".ref"));
  const auto magic = in.value<std::array<char, 8>>();
  if (std::memcmp(magic.data(), "QPSEQ01", 8) != 0)
    throw std::runtime_error(qps.string() + ": not a QPSEQ01 file");
  const int m = in.value<int>(), e = in.value<int>(), snapshots = in.value<int>(), ticks = in.value<int>();
  in.value<std::array<int, 2>>();     // rate and seed
  in.value<std::array<double, 3>>();  // epsilon, scales of forces and strokes
  const double inf = in.value<double>();
  const auto bound = [&] {
    Vector result = in.vector(m);
    for (double& entry : result)
      if (std::abs(entry) >= inf) entry = std::copysign(std::numeric_limits<double>::infinity(), entry);
    return result;
  };
  const Vector a_min = bound(), a_max = bound(), l_min = bound(), l_max = bound();

  Sequence result{qps.stem().string(), e, TieBreak::kAny, {}, {}};
  for (int i = 0; i < snapshots; ++i) {
    for (int j = 0; j < e; ++j) in.vector(m);  // W_ea
    const Matrix A = in.matrix(m), H = in.matrix(m);
    result.snapshots.push_back({H, A});
  }
  for (int i = 0; i < ticks; ++i) {
    Sequence::Tick tick;
    tick.snapshot = in.value<int>();
    in.value<int>();  // what the generator meant; the reference's own status decides
    const Vector d = in.vector(e), d_a = in.vector(m);
    tick.g = in.vector(m);
    tick.bounds = {a_min, a_max, l_min - d_a, l_max - d_a};
    tick.scale = 0.5 * d.squaredNorm();
    tick.infeasible = reference.value<int>() == 2;
    tick.objective = reference.value<double>();
    reference.vector(m);
    for (int j = 0; j < 2; ++j) reference.vector(m);  // multipliers
    result.ticks.push_back(tick);
  }
  return result;
}

}  // namespace tendril::qp
