// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <concepts>
#include <string_view>
#include <variant>

#include "fem/element/corotational.h"
#include "fem/element/element_kernels.h"
#include "fem/element/neo_hookean.h"
#include "fem/element/tetrahedron.h"
#include "fem/simd/simd.h"

namespace tendril::fem {

/// The table of material laws: one row a law, the class of its element. All else that depends on the set of
/// laws follows from it. A value is one tetrahedron at one deformation; std::visit calls its functions.
using Element = std::variant<CorotationalElement,  //
                             NeoHookeanElement>;

/// What the class of a row has; CorotationalElement describes the functions. Two more are optional:
/// kernels(), for many elements at once, and update_lane(), for a law that keeps more in a batch than the
/// dilatation.
template <typename E>
concept MaterialElement = std::constructible_from<E, const RestTetrahedron&, const Moduli&, const Corners&> &&
    requires(const E& e, Tangent tangent, double pressure) {
  { E::kName } -> std::convertible_to<std::string_view>;
  { e.inverted() } -> std::same_as<bool>;
  { e.energy() } -> std::same_as<double>;
  { e.dilatation() } -> std::same_as<double>;
  { e.dilatation_gradient() } -> std::same_as<Corners>;
  { e.forces(pressure) } -> std::same_as<Corners>;
  { e.stiffness(tangent, pressure) } -> std::same_as<Blocks>;
};

/// How stress depends on strain: one of the rows of Element, never another. All laws agree with E and ν at
/// small strains.
class Law {
 public:
  /// The law of an element's class. It compiles only for a row of the table.
  template <MaterialElement E>
  static constexpr Law of() {
    return Law(kRow<E>);
  }

  /// The word for it in the robot file. Real-time: yes.
  friend constexpr std::string_view name(Law law) { return law.row_->name; }
  friend constexpr bool operator==(Law, Law) = default;

  /// Its passes over a batch; null ones for InstructionSet::kScalar.
  ElementKernels kernels(InstructionSet set) const { return row_->kernels(set); }

  /// What ElementKernels::update() does, for one lane, without kernels.
  /// @param corners  3 × 4 present positions, m
  /// @return         false if the element is inverted
  bool update_lane(ElementBatch& batch, int lane, const Corners& corners) const {
    return row_->update_lane(batch, lane, corners);
  }

  /// One element. It keeps a reference to `rest`.
  /// @param corners  3 × 4 present positions, m
  Element element(const RestTetrahedron& rest, const Moduli& moduli, const Corners& corners) const {
    return row_->element(rest, moduli, corners);
  }

 private:
  struct Row {
    std::string_view name;
    ElementKernels (*kernels)(InstructionSet);
    bool (*update_lane)(ElementBatch&, int, const Corners&);
    Element (*element)(const RestTetrahedron&, const Moduli&, const Corners&);
  };
  template <typename E>
  static ElementKernels kernels_of(InstructionSet set) {
    if constexpr (requires { E::kernels(set); })
      return E::kernels(set);
    else
      return {};
  }

  template <typename E>
  static bool update_lane_of(ElementBatch& batch, int lane, const Corners& corners) {
    if constexpr (requires { E::update_lane(batch, lane, corners); }) {
      return E::update_lane(batch, lane, corners);
    } else {
      const RestTetrahedron rest = rest_tetrahedron(batch, lane);
      const E element(rest, {batch.mu[lane], batch.lambda[lane]}, corners);
      batch.theta[lane] = element.dilatation();
      return !element.inverted();
    }
  }

  template <typename E>
  static Element element_of(const RestTetrahedron& rest, const Moduli& moduli, const Corners& corners) {
    return Element(std::in_place_type<E>, rest, moduli, corners);
  }

  template <typename E>
  static constexpr Row kRow{E::kName, &kernels_of<E>, &update_lane_of<E>, &element_of<E>};

  explicit constexpr Law(const Row& row) : row_(&row) {}

  const Row* row_;
};

/// All laws, in the order of the table.
inline constexpr auto kLaws = []<typename... E>(const std::variant<E...>*) {
  return std::array{Law::of<E>()...};
}(static_cast<const Element*>(nullptr));

}  // namespace tendril::fem
