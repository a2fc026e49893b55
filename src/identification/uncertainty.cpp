// SPDX-License-Identifier: MIT
#include <cmath>
#include <identification/uncertainty.hpp>

namespace resonid::identification::detail {

std::vector<Resonance> resonances_of(const fit::DriveModel& drive) {
  std::vector<Resonance> found;
  for (const auto& mode : drive.modes())
    found.push_back({mode.anti, mode.frequency_hz.value, mode.frequency_hz.standard_deviation,
                     mode.damping_ratio.value, true, mode.damping_ratio.standard_deviation});
  return found;
}

namespace {

void put(const std::vector<fit::UncertainRoot>& roots, const char* kind, std::vector<Root>& to) {
  for (const auto& r : roots) to.push_back({r.value, r.covariance, kind});
}

/// ds = dz/(Ts z) turns and scales the error as it does the root.
void put_sampled(const std::vector<fit::UncertainRoot>& roots, const char* kind, double sample_time_s,
                 std::vector<Root>& to) {
  for (const auto& r : roots) {
    constexpr double kReal = 1e-9;
    const bool negative = r.value.real() <= 0.0 && std::abs(r.value.imag()) <= kReal * std::abs(r.value);
    if (negative || r.value == 0.0) continue;
    const std::complex<double> factor = 1.0 / (sample_time_s * r.value);
    Eigen::Matrix2d turn;
    turn << factor.real(), -factor.imag(), factor.imag(), factor.real();
    to.push_back({std::log(r.value) / sample_time_s, turn * r.covariance * turn.transpose(), kind});
  }
}

}  // namespace

std::vector<Root> roots_of(const fit::DriveModel& drive) {
  std::vector<Root> roots;
  put(drive.poles(), "pole", roots);
  put(drive.zeros(), "zero", roots);
  return roots;
}

std::vector<Root> roots_of(const fit::BlackBoxModel& model) {
  std::vector<Root> roots;
  put_sampled(model.poles(), "pole", model.transfer_function.sample_time_s, roots);
  put_sampled(model.zeros(), "zero", model.transfer_function.sample_time_s, roots);
  return roots;
}

}  // namespace resonid::identification::detail
