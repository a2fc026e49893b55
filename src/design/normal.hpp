// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>

namespace resonid::design {

/// Standard normal numbers by Marsaglia's polar method: the same on every platform.
class StandardNormal {
 public:
  explicit StandardNormal(std::uint64_t seed) : random_(seed) {}

  double next() {
    for (;;) {
      const double a = 2.0 * uniform() - 1.0, b = 2.0 * uniform() - 1.0, s = a * a + b * b;
      if (s > 0.0 && s < 1.0) return a * std::sqrt(-2.0 * std::log(s) / s);
    }
  }
  Eigen::VectorXd next(Eigen::Index count) {
    Eigen::VectorXd u(count);
    for (auto& x : u) x = next();
    return u;
  }

 private:
  double uniform() { return static_cast<double>(random_() >> 11) / 9007199254740992.0; }  // 2^53
  std::mt19937_64 random_;
};

}  // namespace resonid::design
