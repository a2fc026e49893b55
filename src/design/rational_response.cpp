// SPDX-License-Identifier: MIT
#include "design/rational_response.hpp"

#include <algorithm>

namespace resonid::design {

/// The motion, and the lagging torque where there is one: x(k+1) = (a + 1) x(k) + b u(k).
struct RationalResponse::Core {
  using Row = std::array<double, kMost>;
  int order = 0;
  std::array<Row, kMost> a{};
  Row b{};

  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  explicit Core(const fit::SampledStates& s) {
    const auto motion = static_cast<int>(s.motion);
    const bool lags = !s.a.col(s.motion).isZero(0.0);
    order = motion + (lags ? 1 : 0);
    for (int i = 0; i < order; ++i) {
      for (int j = 0; j < order; ++j) a[at(i)][at(j)] = s.a(i, j) - (i == j ? 1.0 : 0.0);
      b[at(i)] = s.command(i);
    }
  }

  [[nodiscard]] Row times(const Row& x) const {
    Row y{};
    for (int i = 0; i < order; ++i)
      for (int j = 0; j < order; ++j) y[at(i)] += a[at(i)][at(j)] * x[at(j)];
    return y;
  }

  /// Coefficients of det((z - 1) I - a).
  [[nodiscard]] Polynomial denominator() const {
    Polynomial d{};
    d[at(order)] = 1.0;
    std::array<Row, kMost> m{};
    for (int i = 0; i < order; ++i) m[at(i)][at(i)] = 1.0;
    for (int k = 1; k <= order; ++k) {
      std::array<Row, kMost> next{};
      double trace = 0.0;
      for (int i = 0; i < order; ++i) {
        for (int l = 0; l < order; ++l)
          for (int j = 0; j < order; ++j) next[at(i)][at(j)] += a[at(i)][at(l)] * m[at(l)][at(j)];
        trace += next[at(i)][at(i)];
      }
      d[at(order - k)] = -trace / k;
      for (int i = 0; i < order; ++i) next[at(i)][at(i)] += d[at(order - k)];
      m = next;
    }
    return d;
  }
};

RationalResponse::RationalResponse(const fit::SampledStates& s) {
  const Core core(s);
  order_ = core.order;
  whole_delay_ = static_cast<int>(s.whole_delay);
  denominator_ = core.denominator();
  const Eigen::Index late = s.motion + 3;
  past_ = s.a(late, s.motion + 1);
  pole_ = s.a(late, late);
  // (M_k b), M_0 = I, M_k = a M_(k-1) + d_(n-k) I, is the numerator's column of (z - 1)^(n-1-k).
  Core::Row column = core.b;
  for (int k = order_ - 1; k >= 0; --k) {
    const std::size_t power = Core::at(k);
    for (int i = 0; i < order_; ++i) {
      measured_[power] += s.a(late, i) * column[Core::at(i)];
      load_[power] += s.load(i) * column[Core::at(i)];
    }
    if (k == 0) break;
    Core::Row next = core.times(column);
    for (int i = 0; i < order_; ++i) next[Core::at(i)] += denominator_[power] * core.b[Core::at(i)];
    column = next;
  }
  for (int k = 0; k <= order_; ++k) measured_[Core::at(k)] += s.command(late) * denominator_[Core::at(k)];
}

}  // namespace resonid::design
