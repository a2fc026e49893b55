// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <utility>

namespace resonid::fit::detail {

template <int Lanes>
struct PackOf;
template <>
struct PackOf<2> {
  using Type [[gnu::vector_size(16)]] = double;
};
template <>
struct PackOf<4> {
  using Type [[gnu::vector_size(32)]] = double;
};

/// A value's derivatives by the active coordinates, 0 at first. Eigen's arrays of more than eight leave a
/// call for every sum of two; in these the packs stay in registers.
template <int Columns, int Lanes = 2>
class Slopes {
 public:
  static constexpr int kColumns = Columns;

  [[gnu::always_inline]] inline void set(std::ptrdiff_t i, double value) {
    packs_[static_cast<std::size_t>(i / Lanes)][i % Lanes] = value;
  }
  [[gnu::always_inline]] inline double operator()(std::ptrdiff_t i) const {
    return packs_[static_cast<std::size_t>(i / Lanes)][i % Lanes];
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
  [[gnu::always_inline]] friend inline Slopes operator+(const Slopes& a, const Slopes& b) {
    return Slopes(a) += b;
  }
  [[gnu::always_inline]] friend inline Slopes operator-(const Slopes& a, const Slopes& b) {
    return Slopes(a) -= b;
  }
  [[gnu::always_inline]] friend inline Slopes operator-(const Slopes& a) { return Slopes(a) *= -1.0; }
  [[gnu::always_inline]] friend inline Slopes operator*(double scale, const Slopes& a) {
    return Slopes(a) *= scale;
  }
  [[gnu::always_inline]] friend inline Slopes operator*(const Slopes& a, double scale) {
    return Slopes(a) *= scale;
  }

 private:
  static constexpr std::size_t kPacks = (Columns + Lanes - 1) / Lanes;
  using Pack = typename PackOf<Lanes>::Type;

  template <class Operation>
  [[gnu::always_inline]] inline Slopes& each(Operation&& operation) {
    [&]<std::size_t... P>(std::index_sequence<P...>) __attribute__((always_inline)) { (operation(P), ...); }
    (std::make_index_sequence<kPacks>());
    return *this;
  }

  // The array alone is aligned as two doubles are.
  alignas(sizeof(Pack)) std::array<Pack, kPacks> packs_{};
};

}  // namespace resonid::fit::detail
