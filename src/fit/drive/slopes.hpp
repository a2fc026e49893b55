// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <utility>

namespace resonid::fit::detail {

/// A value's derivatives by the active coordinates. Eigen's arrays of more than eight leave a call for every
/// sum of two; in these the packs stay in registers.
template <int Columns>
class Slopes {
 public:
  [[gnu::always_inline]] inline void set(std::ptrdiff_t i, double value) {
    packs_[static_cast<std::size_t>(i / kLanes)][i % kLanes] = value;
  }
  [[gnu::always_inline]] inline double operator()(std::ptrdiff_t i) const {
    return packs_[static_cast<std::size_t>(i / kLanes)][i % kLanes];
  }

  [[gnu::always_inline]] inline Slopes& operator+=(const Slopes& other) {
    return each([&](std::size_t p) { packs_[p] += other.packs_[p]; });
  }
  [[gnu::always_inline]] inline Slopes& operator-=(const Slopes& other) {
    return each([&](std::size_t p) { packs_[p] -= other.packs_[p]; });
  }
  [[gnu::always_inline]] inline Slopes& operator*=(double scale) {
    return each([&](std::size_t p) { packs_[p] *= scale; });
  }
  friend inline Slopes operator+(Slopes a, const Slopes& b) { return a += b; }
  friend inline Slopes operator-(Slopes a, const Slopes& b) { return a -= b; }
  friend inline Slopes operator-(Slopes a) { return a *= -1.0; }
  friend inline Slopes operator*(double scale, Slopes a) { return a *= scale; }
  friend inline Slopes operator*(Slopes a, double scale) { return a *= scale; }

 private:
  static constexpr int kLanes = 2;
  static constexpr std::size_t kPacks = (Columns + kLanes - 1) / kLanes;
  using Pack [[gnu::vector_size(kLanes * sizeof(double))]] = double;

  template <class Operation>
  [[gnu::always_inline]] inline Slopes& each(Operation&& operation) {
    [&]<std::size_t... P>(std::index_sequence<P...>) __attribute__((always_inline)) { (operation(P), ...); }
    (std::make_index_sequence<kPacks>());
    return *this;
  }

  std::array<Pack, kPacks> packs_{};
};

template <int Columns>
Slopes<Columns> zero() {
  return {};
}

}  // namespace resonid::fit::detail
