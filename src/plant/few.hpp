// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

namespace resonid::plant {

// States and steps of machines of few masses as plain arrays. Eigen's expressions of fixed sizes, of which
// each is a type of its own for each machine, take minutes to compile.

template <int Rows>
using Few = std::array<double, static_cast<std::size_t>(Rows)>;

/// Matrix by columns.
template <int Rows, int Columns>
struct FewColumns {
  std::array<double, static_cast<std::size_t>(Rows* Columns)> entry{};
  [[nodiscard]] const double* column(std::size_t j) const noexcept { return entry.data() + j * Rows; }
  [[nodiscard]] double operator()(std::size_t i, std::size_t j) const noexcept { return entry[j * Rows + i]; }
};

template <std::size_t Rows>
inline void add(std::array<double, Rows>& sum, const double* column, double times) noexcept {
  for (std::size_t i = 0; i < Rows; ++i) sum[i] += times * column[i];
}

/// The first columns of the matrix, as many as there are rows, times a state.
template <std::size_t Rows>
[[nodiscard]] inline std::array<double, Rows> times(const double* columns,
                                                    const std::array<double, Rows>& state) noexcept {
  std::array<double, Rows> result;
  for (std::size_t i = 0; i < Rows; ++i) result[i] = columns[i] * state[0];
  for (std::size_t j = 1; j < Rows; ++j) add(result, columns + j * Rows, state[j]);
  return result;
}
template <std::size_t Rows, int Columns>
[[nodiscard]] inline std::array<double, Rows> times(const FewColumns<static_cast<int>(Rows), Columns>& matrix,
                                                    const std::array<double, Rows>& state) noexcept {
  return times(matrix.entry.data(), state);
}

}  // namespace resonid::plant
